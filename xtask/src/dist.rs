//! `cargo xtask dist`: one program for distribution, with the viewer inside, and its accompanying files.
//!
//! ```text
//! target/dist/sightline            the program
//! target/dist/sightline.cdx.json   its bill of materials
//! target/dist/LICENSES.txt         the licences of all its parts
//! target/dist/SHA256SUMS           the digests of these files, for `sha256sum --check`
//! ```
//!
//! The same commit gives the same files, independent of the folders of the checkout, of Cargo and of the build
//! (`docs/release.md`).

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use jiff::Timestamp;

use crate::sbom::{self, Program, sha256};
use crate::{cmd, components, licences, packages, remap, web};

/// Builds the page, then the optimised program that embeds it, and writes the program with its accompanying files to
/// `target/dist`.
pub(crate) fn dist() -> Result<()> {
    web::web()?;
    let target_dir = cmd::target_dir();
    let mut cargo = cmd::cargo(&[
        "build",
        "--locked",
        "--package",
        "sightline-server",
        "--bin",
        "sightline",
        "--release",
    ]);
    cargo.env("CARGO_INCREMENTAL", "0");
    remap::apply(&mut cargo, &target_dir)?;
    cmd::run(&mut cargo, "mend what the compiler reports above")?;
    let name = format!("sightline{}", std::env::consts::EXE_SUFFIX);
    let program = read(&target_dir.join("release").join(&name))?;
    let folder = cmd::root().join("target").join("dist");
    std::fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    let built = folder.join(&name);
    std::fs::copy(target_dir.join("release").join(&name), &built)
        .with_context(|| format!("{} cannot be written", built.display()))?;
    let mut sums = format!("{}  {name}\n", sha256(&program));
    for (name, content) in papers(&built, &program)? {
        write(&folder.join(name), &content)?;
        sums.push_str(&format!("{}  {name}\n", sha256(content.as_bytes())));
    }
    write(&folder.join("SHA256SUMS"), &sums)?;
    cmd::print_line(sums.trim_end());
    cmd::print_line(format!(
        "The program is {}; bill of materials and licences are beside it.",
        built.display()
    ));
    Ok(())
}

/// The bill of materials and the licences of the program.
fn papers(built: &Path, program: &[u8]) -> Result<[(&'static str, String); 2]> {
    let version =
        cmd::output(cmd::program(built).arg("--version"), "the program that was built does not start")?;
    let version = version.trim();
    let host = packages::host()?;
    let packages = components::packages(&host)?;
    let components = components::components(&packages, &host)?;
    let library = components::standard_library()?;
    let time = time()?;
    let described = Program {
        version: version.strip_prefix("sightline ").unwrap_or(version),
        library: &library,
        target: &host,
        sha256: &sha256(program),
        time: time.as_deref(),
    };
    let mut sbom = serde_json::to_string_pretty(&sbom::sbom(&components, &described)?)?;
    sbom.push('\n');
    Ok([("sightline.cdx.json", sbom), ("LICENSES.txt", licences::listing(&components, version, &library)?)])
}

/// The reproducible time stamp of the bill: `SOURCE_DATE_EPOCH`, or else the time of the commit.
fn time() -> Result<Option<String>> {
    let seconds = match std::env::var("SOURCE_DATE_EPOCH") {
        Ok(seconds) => seconds,
        // A source archive has no commit.
        Err(_) => {
            cmd::output(cmd::program("git").args(["log", "-1", "--format=%ct"]), "").unwrap_or_default()
        }
    };
    if seconds.trim().is_empty() {
        return Ok(None);
    }
    let seconds = seconds.trim().parse().context("SOURCE_DATE_EPOCH is no number of seconds since 1970")?;
    Ok(Some(Timestamp::from_second(seconds).context("SOURCE_DATE_EPOCH is out of range")?.to_string()))
}

fn read(file: &Path) -> Result<Vec<u8>> {
    std::fs::read(file).with_context(|| format!("{} cannot be read", file.display()))
}

fn write(file: &PathBuf, content: &str) -> Result<()> {
    std::fs::write(file, content).with_context(|| format!("{} cannot be written", file.display()))
}
