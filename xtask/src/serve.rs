//! `cargo xtask serve`: builds what changed, then runs the server.

use std::process::Command;

use anyhow::Result;

use crate::build::{self, Build};
use crate::{cmd, web};

/// Builds the page and the server concurrently, then replaces this process by `sightline serve`.
pub(crate) fn serve(arguments: &[String]) -> Result<()> {
    build_all()?;
    let mut server = cmd::program(cmd::sightline_binary());
    server.arg("serve").args(arguments);
    become_program(server)
}

/// Builds only the page and the program `sightline`.
pub(crate) fn build_all() -> Result<()> {
    // The server's build script reads this folder, which a fresh clone does not have.
    std::fs::create_dir_all(web::output_dir())?;
    build::run(vec![web::build()?, program()])
}

/// The build of the program `sightline`.
///
/// `sightline-features` gives it the dependency features of the whole workspace, so that `cargo test` does not recompile the
/// dependencies.
fn program() -> Build {
    Build {
        name: "server",
        command: cmd::cargo(&["build", "--package", "sightline-server", "--bin", "sightline"]),
        tree: vec!["--package", "sightline-server", "--edges", "normal,build"],
        then: || Ok(()),
    }
}

/// Replaces this process, so that a signal sent to it reaches the server.
#[cfg(unix)]
fn become_program(mut command: Command) -> Result<()> {
    use std::os::unix::process::CommandExt;
    let error = command.exec();
    Err(anyhow::Error::new(error).context("target/debug/sightline cannot be started; build it again"))
}

/// Runs the program and waits, on systems that cannot replace a process.
#[cfg(not(unix))]
fn become_program(mut command: Command) -> Result<()> {
    cmd::run(&mut command, "read what the server says above")
}
