//! The standard library for WASM: the first way that works on this machine, and which one it was.
//!
//! The ways, in order: it is installed; `rustup` installs it; Cargo builds it from the source that lies beside the
//! compiler; Cargo builds it from the source that Debian ships for exactly this compiler.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, bail};

use crate::{cmd, debian_source};

/// The target of the viewer in the browser.
pub(crate) const TARGET: &str = "wasm32-unknown-unknown";

/// How the standard library for WASM comes to the viewer's build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum WasmStd {
    /// It lies compiled beside the compiler.
    Installed,
    /// Cargo builds it from its source.
    FromSource,
}

impl WasmStd {
    /// Adds to a Cargo command what this way needs.
    pub(crate) fn prepare(self, cargo: &mut Command) {
        if self == Self::FromSource {
            // Only nightly compilers build the standard library without this variable.
            cargo.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=std,panic_abort");
        }
    }
}

/// Finds the first way that works, prints it, and makes it ready.
pub(crate) fn ensure() -> Result<WasmStd> {
    let mend = "install Rust";
    let sysroot = PathBuf::from(cmd::output(cmd::rustc().args(["--print", "sysroot"]), mend)?.trim());
    if is_installed(&sysroot) {
        cmd::say("WASM standard library: installed with the compiler.");
        return Ok(WasmStd::Installed);
    }
    let note = cmd::root().join("target/viewer/rustup-refused");
    if add_with_rustup(&sysroot, &note) {
        cmd::say("WASM standard library: installed by `rustup target add`.");
        return Ok(WasmStd::Installed);
    }
    if has_source(&sysroot) {
        cmd::say("WASM standard library: built from the source that lies beside the compiler.");
    } else if let Err(error) = debian_source::install(&sysroot) {
        bail!(
            "the standard library for {TARGET} is missing, `rustup` cannot install it and Debian's source of it did \
             not come ({error:#}): run `rustup target add {TARGET}` or `rustup component add rust-src` where it can \
             download, or copy the folder `library` of this compiler's source to {}",
            source_dir(&sysroot).display()
        );
    } else {
        cmd::say("WASM standard library: built from Debian's source for this compiler.");
    }
    // Without this note the next start only asks `rustup` again.
    note.parent().map_or(Ok(()), std::fs::create_dir_all).unwrap_or_default();
    std::fs::write(&note, sysroot.to_string_lossy().as_bytes()).unwrap_or_default();
    Ok(WasmStd::FromSource)
}

/// Where Cargo looks for the standard library's source.
pub(crate) fn source_dir(sysroot: &Path) -> PathBuf {
    sysroot.join("lib/rustlib/src/rust/library")
}

/// True when the compiled library lies in the sysroot.
fn is_installed(sysroot: &Path) -> bool {
    let directory = sysroot.join("lib/rustlib").join(TARGET).join("lib");
    std::fs::read_dir(directory).is_ok_and(|entries| {
        entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("libstd-"))
    })
}

/// True when Cargo can build the library from source.
fn has_source(sysroot: &Path) -> bool {
    source_dir(sysroot).join("Cargo.lock").is_file() && source_dir(sysroot).join("std/Cargo.toml").is_file()
}

/// Asks `rustup` for the target, unless `note` says that it refused this compiler before.
///
/// A machine whose `rustup` cannot download must not wait for it at every start, and at the first not for long.
fn add_with_rustup(sysroot: &Path, note: &Path) -> bool {
    if std::fs::read_to_string(note).is_ok_and(|refused| refused == sysroot.to_string_lossy()) {
        return false;
    }
    let mut rustup = cmd::program("rustup");
    rustup.args(["target", "add", TARGET]).env("RUSTUP_MAX_RETRIES", "0");
    cmd::succeeds(&mut rustup, Duration::from_secs(60)) && is_installed(sysroot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_sysroot_has_neither_library_nor_source() {
        let sysroot = tempfile::tempdir().expect("a temporary folder");
        assert!(!is_installed(sysroot.path()) && !has_source(sysroot.path()));
    }

    #[test]
    fn a_source_without_its_lock_file_is_not_taken() {
        let sysroot = tempfile::tempdir().expect("a temporary folder");
        let library = source_dir(sysroot.path());
        std::fs::create_dir_all(library.join("std")).expect("a folder");
        std::fs::write(library.join("std/Cargo.toml"), "").expect("a file");
        assert!(!has_source(sysroot.path()));
        std::fs::write(library.join("Cargo.lock"), "").expect("a file");
        assert!(has_source(sysroot.path()));
    }
}
