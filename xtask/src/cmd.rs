//! Runs other programs: working directory, environment, and error messages.

use std::ffi::OsStr;
use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// The workspace's root directory.
pub(crate) fn root() -> PathBuf {
    let here = std::env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    here.parent().map_or_else(|| here.clone(), Path::to_path_buf)
}

/// The directory in which Cargo builds the native crates.
pub(crate) fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |dir| root().join(dir))
}

/// The path of the program `sightline` after `cargo build`.
pub(crate) fn sightline_binary() -> PathBuf {
    target_dir().join("debug").join(format!("sightline{}", std::env::consts::EXE_SUFFIX))
}

/// Prints one line to standard output; a closed pipe is not an error.
pub(crate) fn print_line(line: impl Display) {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).unwrap_or_default();
}

/// A command that runs in the workspace's root.
///
/// `cargo run` describes `xtask` in environment variables that an inner Cargo or a build script would take for a description
/// of another crate, so these are removed.
pub(crate) fn program(name: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(name);
    command.current_dir(root());
    for (key, _) in std::env::vars_os() {
        let key = key.to_string_lossy();
        if key.starts_with("CARGO_PKG_")
            || key.starts_with("CARGO_MANIFEST_")
            || key.starts_with("CARGO_BIN_")
        {
            command.env_remove(key.as_ref());
        }
    }
    command
}

/// The Cargo that runs this program.
pub(crate) fn cargo(arguments: &[&str]) -> Command {
    let mut command = program(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments);
    command
}

/// The Rust compiler that Cargo uses.
pub(crate) fn rustc() -> Command {
    program(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()))
}

/// Runs a program to completion in the same terminal; `mend` is the advice after a failure.
pub(crate) fn run(command: &mut Command, mend: &str) -> Result<()> {
    let status =
        command.status().with_context(|| format!("{} cannot be started; {mend}", command_line(command)))?;
    if !status.success() {
        bail!("{} failed ({status}); {mend}", command_line(command));
    }
    Ok(())
}

/// Runs a program to completion and returns its standard output.
pub(crate) fn output(command: &mut Command, mend: &str) -> Result<String> {
    let output = command
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("{} cannot be started; {mend}", command_line(command)))?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let last = stderr.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("it said nothing");
        bail!("{} failed ({}): {last}; {mend}", command_line(command), output.status);
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Runs a program silently, at most for `limit`; returns whether it succeeded.
pub(crate) fn succeeds(command: &mut Command, limit: Duration) -> bool {
    let quiet = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let Ok(mut child) = quiet.spawn() else { return false };
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return status.success(),
            Ok(None) if start.elapsed() < limit => std::thread::sleep(Duration::from_millis(50)),
            Ok(None) | Err(_) => {
                // The child may end between the check and the kill; it must be reaped in either case.
                child.kill().unwrap_or_default();
                return child.wait().is_ok_and(|status| status.success());
            }
        }
    }
}

/// The first of `names` found in the directories of `PATH`.
pub(crate) fn find_in_path(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    names.iter().find_map(|name| {
        std::env::split_paths(&path)
            .map(|directory| directory.join(format!("{name}{}", std::env::consts::EXE_SUFFIX)))
            .find(|file| file.is_file())
    })
}

/// A command line as typed in a shell.
fn command_line(command: &Command) -> String {
    let mut words = vec![
        Path::new(command.get_program())
            .file_name()
            .unwrap_or(command.get_program())
            .to_string_lossy()
            .into_owned(),
    ];
    words.extend(command.get_args().map(|word| word.to_string_lossy().into_owned()));
    format!("`{}`", words.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_hangs_is_stopped_at_its_limit() {
        let start = Instant::now();
        assert!(!succeeds(Command::new("sleep").arg("30"), Duration::from_millis(200)));
        assert!(start.elapsed() < Duration::from_secs(5));
    }

    #[test]
    fn a_failure_names_the_program_and_the_way_to_mend_it() {
        let error = run(&mut Command::new("false"), "try another one").expect_err("`false` fails");
        assert!(
            error.to_string().contains("`false` failed") && error.to_string().ends_with("try another one")
        );
    }
}
