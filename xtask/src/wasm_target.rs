//! The standard library for WASM: installed with the toolchain, or by `rustup`.
//!
//! `rust-toolchain.toml` names the target, so `rustup` installs it with the toolchain. A toolchain that is older than the
//! file lacks it, and `rustup` does not add it if `RUSTUP_AUTO_INSTALL=0`.

use std::path::Path;

use anyhow::Result;

use crate::cmd;

/// The compilation target of the viewer in the browser.
pub(crate) const TARGET: &str = "wasm32-unknown-unknown";

/// Installs the standard library for [`TARGET`] if the compiler lacks it.
pub(crate) fn ensure() -> Result<()> {
    let sysroot = cmd::output(cmd::rustc().args(["--print", "sysroot"]), "install Rust with rustup")?;
    if is_installed(Path::new(sysroot.trim())) {
        return Ok(());
    }
    cmd::print_line(format!("Installing the Rust target {TARGET}."));
    cmd::run(
        cmd::program("rustup").args(["target", "add", TARGET]),
        "install the Rust standard library for wasm32-unknown-unknown with your package manager",
    )
}

/// True if the sysroot contains the compiled library.
fn is_installed(sysroot: &Path) -> bool {
    let directory = sysroot.join("lib/rustlib").join(TARGET).join("lib");
    std::fs::read_dir(directory).is_ok_and(|entries| {
        entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("libstd-"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_installed_once_its_libstd_exists() {
        let sysroot = tempfile::tempdir().expect("a temporary folder");
        let library = sysroot.path().join("lib/rustlib").join(TARGET).join("lib");
        std::fs::create_dir_all(&library).expect("a folder");
        assert!(!is_installed(sysroot.path()));
        std::fs::write(library.join("libstd-0123.rlib"), "").expect("a file");
        assert!(is_installed(sysroot.path()));
    }
}
