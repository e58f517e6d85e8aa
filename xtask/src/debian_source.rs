//! The standard library's source from Debian's package `rust-src`, of exactly this compiler's version.
//!
//! The machine's own Debian release rarely carries the version we need, so `apt` is asked for the suites that do,
//! on the mirror that the machine already uses, with lists of our own under `target/`: the machine's sources stay as
//! they are, while `apt`'s proxy settings and its check of signatures apply.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::{cmd, wasm_std};

/// Debian's suites that carry recent compilers, in the order in which they are asked.
const SUITES: [&str; 3] = ["trixie-backports", "forky", "sid"];

/// A Debian mirror as the machine's own sources name it.
#[derive(Clone, Debug, PartialEq)]
struct Mirror {
    uri: String,
    /// The key ring that the machine trusts for this mirror, if its sources name one.
    signed_by: Option<String>,
}

/// Puts the source where Cargo looks for it.
pub(crate) fn install(sysroot: &Path) -> Result<()> {
    let version = compiler_version()?;
    let mirrors = machine_mirrors();
    if mirrors.is_empty() {
        bail!("this machine's apt sources name no Debian mirror");
    }
    let work = cmd::root().join("target").join("rust-src");
    let mut reason = format!("no suite of this machine's Debian mirror has rust-src {version}");
    for mirror in &mirrors {
        for suite in SUITES {
            let apt = match Apt::update(&work, mirror, suite) {
                Ok(apt) => apt,
                Err(error) => {
                    reason = format!("{error:#}");
                    continue;
                }
            };
            let Some(package) = apt.package_of(&version)? else { continue };
            cmd::say(format!("Debian's {suite} has rust-src {package}: downloading it."));
            let unpacked = apt.download_and_unpack(&package)?;
            copy_library(&find_library(&unpacked, &version)?, &wasm_std::source_dir(sysroot))?;
            // Only the copied folder is needed; what remains here is large and can be fetched again.
            std::fs::remove_dir_all(&work).unwrap_or_default();
            return Ok(());
        }
    }
    bail!(reason)
}

/// The compiler's version, such as `1.95.0`.
fn compiler_version() -> Result<String> {
    let said = cmd::output(cmd::rustc().arg("-vV"), "install Rust")?;
    let release = said.lines().find_map(|line| line.strip_prefix("release: "));
    Ok(release.context("`rustc -vV` names no release; install Rust again")?.trim().to_owned())
}

/// `apt` with lists of its own for one suite.
struct Apt {
    directory: PathBuf,
}

impl Apt {
    /// Writes the one source and downloads its list of packages.
    fn update(work: &Path, mirror: &Mirror, suite: &str) -> Result<Self> {
        let apt = Self { directory: work.to_path_buf() };
        for part in ["lists/partial", "cache/archives/partial"] {
            std::fs::create_dir_all(work.join(part)).context("the folder target/rust-src cannot be made")?;
        }
        let options = mirror.signed_by.as_ref().map_or_else(String::new, |key| format!("[signed-by={key}] "));
        let line = format!("deb {options}{} {suite} main\n", mirror.uri);
        std::fs::write(work.join("sources.list"), line).context("target/rust-src cannot be written")?;
        cmd::output(
            apt.command("apt-get").args(["update", "--error-on=any"]),
            "look at the machine's network",
        )?;
        Ok(apt)
    }

    /// One of `apt`'s programs, told to use our lists only.
    fn command(&self, program: &str) -> Command {
        let at = |part: &str| self.directory.join(part).display().to_string();
        let mut command = cmd::program(program);
        command.current_dir(&self.directory).env("LC_ALL", "C");
        for option in [
            format!("Dir::Etc::sourcelist={}", at("sources.list")),
            "Dir::Etc::sourceparts=/dev/null".to_owned(),
            format!("Dir::State::lists={}", at("lists")),
            format!("Dir::Cache={}", at("cache")),
            "Acquire::Languages=none".to_owned(),
            "Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false".to_owned(),
            // The sandbox's user may not enter the workspace.
            "APT::Sandbox::User=root".to_owned(),
        ] {
            command.arg("-o").arg(option);
        }
        command
    }

    /// The full version of the package for this compiler, if the suite has it.
    fn package_of(&self, version: &str) -> Result<Option<String>> {
        let table = cmd::output(self.command("apt-cache").args(["madison", "rust-src"]), "install apt")?;
        Ok(package_in(&table, version))
    }

    /// Downloads the package and unpacks it; `apt` has compared it with the signed list.
    fn download_and_unpack(&self, package: &str) -> Result<PathBuf> {
        let mend = "look at the machine's network and at the space on its disk";
        cmd::output(self.command("apt-get").arg("download").arg(format!("rust-src={package}")), mend)?;
        let archive = std::fs::read_dir(&self.directory)?
            .flatten()
            .map(|entry| entry.path())
            .find(|path| path.extension().is_some_and(|extension| extension == "deb"))
            .context("apt-get left no package in target/rust-src")?;
        let unpacked = self.directory.join("unpacked");
        cmd::output(cmd::program("dpkg-deb").arg("-x").arg(archive).arg(&unpacked), mend)?;
        Ok(unpacked)
    }
}

/// The version of the row of `apt-cache madison` that belongs to this compiler.
fn package_in(table: &str, version: &str) -> Option<String> {
    table.lines().find_map(|row| {
        let package = row.split('|').nth(1)?.trim();
        let upstream = package.split(['+', '-', '~']).next()?;
        (upstream == version).then(|| package.to_owned())
    })
}

/// The folder `library` in the unpacked package.
fn find_library(unpacked: &Path, version: &str) -> Result<PathBuf> {
    [format!("usr/src/rustc-{version}/library"), "usr/lib/rustlib/src/rust/library".to_owned()]
        .into_iter()
        .map(|place| unpacked.join(place))
        .find(|place| place.join("std/Cargo.toml").is_file() && place.join("Cargo.lock").is_file())
        .context("the package rust-src holds no folder `library` with a lock file")
}

/// Copies the source beside the compiler; the last step is a rename, so that a half copy is never taken for a whole.
fn copy_library(library: &Path, destination: &Path) -> Result<()> {
    let mend = "make the compiler's folder writable";
    let partial = destination.with_file_name("library.partial");
    let parent = destination.parent().context("the sysroot has no parent folder")?;
    std::fs::create_dir_all(parent)
        .with_context(|| format!("{} cannot be made; {mend}", parent.display()))?;
    for stale in [&partial, &destination.to_path_buf()] {
        if stale.exists() {
            std::fs::remove_dir_all(stale)
                .with_context(|| format!("{} cannot be removed; {mend}", stale.display()))?;
        }
    }
    cmd::output(cmd::program("cp").arg("-RL").arg(library).arg(&partial), mend)?;
    std::fs::rename(&partial, destination)
        .with_context(|| format!("{} cannot be made; {mend}", destination.display()))
}

/// The Debian mirrors in this machine's apt sources.
fn machine_mirrors() -> Vec<Mirror> {
    let release = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
    let Some(codename) = release.lines().find_map(|line| line.strip_prefix("VERSION_CODENAME=")) else {
        return Vec::new();
    };
    let mut files = vec![PathBuf::from("/etc/apt/sources.list")];
    if let Ok(entries) = std::fs::read_dir("/etc/apt/sources.list.d") {
        files.extend(entries.flatten().map(|entry| entry.path()));
    }
    files.sort();
    let mut mirrors = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        let found = match file.extension().and_then(|extension| extension.to_str()) {
            Some("sources") => mirrors_in_stanzas(&text, codename),
            Some("list") => mirrors_in_lines(&text, codename),
            _ => Vec::new(),
        };
        mirrors.extend(found);
    }
    mirrors.dedup();
    mirrors
}

/// Mirrors in apt's one-line format: `deb [options] uri suite components…`.
fn mirrors_in_lines(text: &str, codename: &str) -> Vec<Mirror> {
    let mirror = |line: &str| {
        let rest = line.trim().strip_prefix("deb ")?.trim_start();
        let (options, rest) = match rest.strip_prefix('[') {
            Some(bracketed) => bracketed.split_once(']')?,
            None => ("", rest),
        };
        let mut words = rest.split_whitespace();
        let uri = words.next()?.to_owned();
        let is_debian = words.next() == Some(codename) && words.any(|word| word == "main");
        let signed_by = options.split_whitespace().find_map(|option| option.strip_prefix("signed-by="));
        is_debian.then(|| Mirror { uri, signed_by: signed_by.map(str::to_owned) })
    };
    text.lines().filter_map(mirror).collect()
}

/// Mirrors in apt's stanza format: `URIs:`, `Suites:`, `Components:` and so on.
fn mirrors_in_stanzas(text: &str, codename: &str) -> Vec<Mirror> {
    let stanza_mirrors = |stanza: &str| {
        let words = |name: &str| -> Vec<String> {
            let value = stanza.lines().find_map(|line| {
                let (key, value) = line.split_once(':')?;
                key.eq_ignore_ascii_case(name).then_some(value)
            });
            value.unwrap_or_default().split_whitespace().map(str::to_owned).collect()
        };
        let has = |name: &str, word: &str| words(name).iter().any(|found| found == word);
        if !has("Types", "deb") || !has("Suites", codename) || !has("Components", "main") {
            return Vec::new();
        }
        let signed_by = words("Signed-By").into_iter().next();
        words("URIs").into_iter().map(|uri| Mirror { uri, signed_by: signed_by.clone() }).collect()
    };
    text.split("\n\n").flat_map(stanza_mirrors).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_formats_of_sources_name_the_same_mirror() {
        let expected = vec![Mirror {
            uri: "https://mirror.example/debian".to_owned(),
            signed_by: Some("/usr/share/keyrings/debian.gpg".to_owned()),
        }];
        let lines = "# a comment\ndeb https://other.example/apt cloud-bookworm main\n\
                     deb [arch=amd64 signed-by=/usr/share/keyrings/debian.gpg] https://mirror.example/debian bookworm main\n";
        let stanzas = "Types: deb\n# a comment\nURIs: https://mirror.example/debian\nSuites: bookworm bookworm-updates\n\
                       Components: main\nSigned-By: /usr/share/keyrings/debian.gpg\n\nTypes: deb\n\
                       URIs: https://mirror.example/security\nSuites: bookworm-security\nComponents: main\n";
        assert_eq!(mirrors_in_lines(lines, "bookworm"), expected);
        assert_eq!(mirrors_in_stanzas(stanzas, "bookworm"), expected);
    }

    #[test]
    fn only_the_package_of_exactly_this_compiler_is_taken() {
        let table =
            "  rust-src | 1.96.1+dfsg1-2~bpo13+1 | suite\n  rust-src | 1.95.0+dfsg1-2~bpo13+1 | suite\n";
        assert_eq!(package_in(table, "1.95.0").as_deref(), Some("1.95.0+dfsg1-2~bpo13+1"));
        assert_eq!(package_in(table, "1.95"), None);
    }
}
