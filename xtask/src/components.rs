//! The parts of the distributed program: crates, the standard library, and files inside crates with their own licences.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::packages::{self, Name, Package, Packages};
use crate::{cmd, wasm_target};

/// A file of a package that becomes part of the program and has its own licence.
pub(crate) struct Embedded {
    /// The package.
    package: &'static str,
    /// The file, relative to the package's folder.
    pub(crate) file: &'static str,
    /// SPDX expression.
    pub(crate) licence: &'static str,
    /// The file with the text of the licence; `None` if it is that of the package.
    pub(crate) text: Option<&'static str>,
    /// Whether its own components are unknown.
    pub(crate) has_unknown_components: bool,
}

const fn font(file: &'static str, licence: &'static str, text: &'static str) -> Embedded {
    Embedded {
        package: "epaint_default_fonts",
        file,
        licence,
        text: Some(text),
        has_unknown_components: false,
    }
}

/// The files with their own licences.
const EMBEDDED: [Embedded; 6] = [
    font("fonts/Hack-Regular.ttf", "MIT AND Bitstream-Vera", "fonts/Hack-Regular.txt"),
    font("fonts/NotoEmoji-Regular.ttf", "OFL-1.1", "fonts/OFL.txt"),
    font("fonts/Ubuntu-Light.ttf", "Ubuntu-font-1.0", "fonts/UFL.txt"),
    font("fonts/egui-icons.ttf", "MIT", "fonts/emoji-icon-font-mit-license.txt"),
    font("fonts/emoji-icon-font.ttf", "MIT", "fonts/emoji-icon-font-mit-license.txt"),
    Embedded {
        package: "re_web_viewer_server",
        file: "web_viewer/re_viewer_bg.wasm",
        licence: "MIT OR Apache-2.0",
        text: None,
        has_unknown_components: true,
    },
];

/// Extensions of files that can be embedded and have their own licences.
const EMBEDDED_ENDINGS: [&str; 4] = ["ttf", "otf", "woff2", "wasm"];

/// Folders of packages that are not compiled.
const NOT_COMPILED: [&str; 7] = ["tests", "test", "benches", "examples", "programs", "contrib", "testdata"];

/// One crate in the program or its page.
pub(crate) struct Component<'a> {
    pub(crate) package: &'a Package,
    /// SHA-256 of the package's archive; `None` for the workspace's own packages.
    pub(crate) checksum: Option<&'a str>,
    pub(crate) is_in_program: bool,
    pub(crate) is_in_page: bool,
    /// Its runtime dependencies.
    pub(crate) needs: Vec<&'a Package>,
    /// Its files with their own licences.
    pub(crate) embedded: Vec<&'static Embedded>,
}

impl Component<'_> {
    /// The location of the part, in words.
    pub(crate) fn location(&self) -> &'static str {
        match (self.is_in_program, self.is_in_page) {
            (true, true) => "program and page",
            (true, false) => "program",
            _ => "page",
        }
    }

    /// The folder of the package's sources.
    pub(crate) fn folder(&self) -> &Path {
        self.package.manifest_path.parent().unwrap_or(&self.package.manifest_path)
    }
}

/// The packages for this machine and for the page.
pub(crate) fn packages(host: &str) -> Result<Packages> {
    Packages::for_targets(&[host.to_owned(), wasm_target::TARGET.to_owned()], &[])
}

/// Every package whose code is in the program for `host` or in its page, by name.
pub(crate) fn components<'a>(packages: &'a Packages, host: &str) -> Result<Vec<Component<'a>>> {
    let program = packages::inside_program(host)?;
    let page = packages::inside_page()?;
    let all: BTreeSet<&Name> = program.union(&page).collect();
    let component = |name: &Name| -> Result<Component<'a>> {
        let package = packages.get(name)?;
        let needed = packages.needs(name).filter(|needed| all.contains(needed));
        let component = Component {
            package,
            checksum: packages.checksum(name),
            is_in_program: program.contains(name),
            is_in_page: page.contains(name),
            needs: needed.map(|needed| packages.get(needed)).collect::<Result<_>>()?,
            embedded: EMBEDDED.iter().filter(|embedded| embedded.package == package.name).collect(),
        };
        refuse_unknown_files(&component)?;
        Ok(component)
    };
    all.iter().map(|name| component(name)).collect()
}

/// Fails if a dependency contains a file that may be embedded but has no entry in [`EMBEDDED`].
fn refuse_unknown_files(component: &Component<'_>) -> Result<()> {
    if component.package.source.is_none() {
        return Ok(());
    }
    for file in compiled_files(component.folder())? {
        let is_embedded =
            file.extension().is_some_and(|end| EMBEDDED_ENDINGS.iter().any(|known| end == *known));
        if is_embedded && !component.embedded.iter().any(|known| component.folder().join(known.file) == file)
        {
            bail!("{} may be embedded: give it a licence in xtask/src/components.rs", file.display());
        }
    }
    Ok(())
}

/// The files of a package, except its tests and examples, in a fixed order.
pub(crate) fn compiled_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    for entry in entries {
        let entry = entry?;
        if !entry.file_type()?.is_dir() {
            found.push(entry.path());
        } else if !NOT_COMPILED.iter().any(|name| entry.file_name() == *name) {
            found.extend(compiled_files(&entry.path())?);
        }
    }
    found.sort();
    Ok(found)
}

/// The version of the compiler, which is also that of the standard library.
pub(crate) fn standard_library() -> Result<String> {
    let version_text = cmd::output(cmd::rustc().arg("-vV"), "install Rust with rustup")?;
    let release = version_text.lines().find_map(|line| line.strip_prefix("release: ")).map(str::to_owned);
    release.context("`rustc -vV` names no release")
}
