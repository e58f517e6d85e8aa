//! `cargo xtask web`: the viewer as WASM, its bindings and the page, in `target/web`.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::UNIX_EPOCH;

use anyhow::{Context, Result};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use wasm_bindgen_cli_support::Bindgen;

use crate::build::{self, Build};
use crate::{cmd, remap, wasm_target};

/// The folder from which the server serves or embeds the page.
pub(crate) fn output_dir() -> PathBuf {
    cmd::root().join("target").join("web")
}

/// Builds what changed.
pub(crate) fn web() -> Result<()> {
    build::run(vec![build()?])
}

/// The build of the viewer's WASM, followed by that of the page.
pub(crate) fn build() -> Result<Build> {
    wasm_target::ensure()?;
    let mut command = viewer_cargo("build")?;
    command.args(["--package", "sightline-viewer", "--lib"]);
    let tree =
        vec!["--package", "sightline-viewer", "--target", wasm_target::TARGET, "--edges", "normal,build"];
    Ok(Build { name: "page", command, tree, then: pack })
}

/// Writes the page for the viewer's WASM.
fn pack() -> Result<()> {
    let wasm =
        cmd::root().join("target/viewer").join(wasm_target::TARGET).join("viewer/sightline_viewer.wasm");
    let output = output_dir();
    std::fs::create_dir_all(&output).with_context(|| format!("{} cannot be made", output.display()))?;
    bind(&wasm, &output)?;
    copy_page(&cmd::root().join("web"), &output)?;
    compress(&output)?;
    let bytes = std::fs::metadata(output.join("sightline_viewer_bg.wasm"))?.len();
    let sent = std::fs::metadata(output.join("sightline_viewer_bg.wasm.gz"))?.len();
    let (bytes, sent) = (bytes as f64 / 1e6, sent as f64 / 1e6);
    cmd::print_line(format!(
        "The page is in target/web; its WASM has {bytes:.1} MB, {sent:.1} MB compressed."
    ));
    Ok(())
}

/// Writes a compressed version of every file for browsers that accept it, if it is missing or outdated.
///
/// Compares the contents, because two builds may have the same file time.
fn compress(output: &Path) -> Result<()> {
    for entry in std::fs::read_dir(output).with_context(|| format!("{} cannot be read", output.display()))? {
        let file = entry?.path();
        let Some(name) = file.file_name().and_then(|name| name.to_str()) else { continue };
        if name.ends_with(".gz") || !file.is_file() {
            continue;
        }
        let packed = file.with_file_name(format!("{name}.gz"));
        let content = std::fs::read(&file).with_context(|| format!("{} cannot be read", file.display()))?;
        if unpack(&packed).is_ok_and(|present| present == content) {
            continue;
        }
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(&content)?;
        std::fs::write(&packed, encoder.finish()?)
            .with_context(|| format!("{} cannot be written", packed.display()))?;
    }
    Ok(())
}

/// Decompresses a file.
fn unpack(packed: &Path) -> std::io::Result<Vec<u8>> {
    let mut content = Vec::new();
    GzDecoder::new(std::fs::File::open(packed)?).read_to_end(&mut content)?;
    Ok(content)
}

/// A Cargo command for the viewer in the browser, with its own target directory and profile.
///
/// The native crates use other features and flags; separate directories prevent either from recompiling the other. The
/// folders of this machine are remapped in every build, so that the distributed page is compiled only once.
pub(crate) fn viewer_cargo(task: &str) -> Result<Command> {
    let target_dir = cmd::root().join("target/viewer");
    let mut cargo = cmd::cargo(&[task, "--target", wasm_target::TARGET, "--target-dir", "target/viewer"]);
    cargo.args(["--profile", "viewer"]);
    remap::apply(&mut cargo, &target_dir)?;
    Ok(cargo)
}

/// Writes the JavaScript bindings and the matching WASM, unless they are up to date.
fn bind(wasm: &Path, output: &Path) -> Result<()> {
    let described = describe(wasm)?;
    let note = cmd::root().join("target/viewer/bound");
    let written = ["sightline_viewer.js", "sightline_viewer_bg.wasm"];
    let is_there = written.iter().all(|name| output.join(name).is_file());
    if is_there && std::fs::read_to_string(&note).is_ok_and(|remembered| remembered == described) {
        return Ok(());
    }
    let mut bindgen = Bindgen::new();
    bindgen
        .remove_name_section(true)
        .remove_producers_section(true)
        .web(true)
        .and_then(|bindgen| bindgen.input_path(wasm).out_name("sightline_viewer").typescript(false).generate(output))
        .context("wasm-bindgen fails on the viewer; give wasm-bindgen and wasm-bindgen-cli-support the same version")?;
    std::fs::write(&note, described).with_context(|| format!("{} cannot be written", note.display()))
}

/// A fingerprint of a build of the viewer, without reading it.
fn describe(wasm: &Path) -> Result<String> {
    let metadata = std::fs::metadata(wasm)
        .with_context(|| format!("Cargo left no {}; mend the viewer", wasm.display()))?;
    let modified = metadata.modified()?.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    Ok(format!("{} bytes, {modified} ns", metadata.len()))
}

/// Copies the files of the page that differ.
fn copy_page(page: &Path, output: &Path) -> Result<()> {
    for entry in std::fs::read_dir(page).with_context(|| format!("{} cannot be read", page.display()))? {
        let file = entry?.path();
        let Some(name) = file.file_name().filter(|_| file.is_file()) else { continue };
        let copy = output.join(name);
        let content = std::fs::read(&file).with_context(|| format!("{} cannot be read", file.display()))?;
        if std::fs::read(&copy).is_ok_and(|present| present == content) {
            continue;
        }
        std::fs::write(&copy, content).with_context(|| format!("{} cannot be written", copy.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compressed_files_follow_their_sources() {
        let output = tempfile::tempdir().expect("a temporary folder");
        // Both are often written within one tick of the clock.
        for text in ["one ".repeat(1000), "two".to_owned()] {
            std::fs::write(output.path().join("a.js"), &text).expect("a file");
            compress(output.path()).expect("compressed");
            assert_eq!(unpack(&output.path().join("a.js.gz")).expect("whole"), text.as_bytes());
        }
        std::fs::write(output.path().join("a.js.gz"), "cut short").expect("a file");
        compress(output.path()).expect("compressed");
        assert_eq!(unpack(&output.path().join("a.js.gz")).expect("whole"), b"two");
        assert!(!output.path().join("a.js.gz.gz").exists());
    }

    #[test]
    fn the_page_is_copied_again_only_where_it_differs() {
        let page = tempfile::tempdir().expect("a temporary folder");
        let output = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(page.path().join("index.html"), "one").expect("a file");
        copy_page(page.path(), output.path()).expect("the page is copied");
        let copy = output.path().join("index.html");
        let modified = std::fs::metadata(&copy).expect("a copy").modified().expect("a time");
        copy_page(page.path(), output.path()).expect("nothing differs");
        assert_eq!(std::fs::metadata(&copy).expect("a copy").modified().expect("a time"), modified);
        std::fs::write(page.path().join("index.html"), "two").expect("a file");
        copy_page(page.path(), output.path()).expect("the page is copied");
        assert_eq!(std::fs::read_to_string(&copy).expect("a copy"), "two");
    }
}
