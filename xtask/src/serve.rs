//! `cargo xtask serve`: build what changed, then become the server.

use std::process::Command;

use anyhow::Result;

use crate::{cmd, web};

/// Builds the page and the programs, then runs `sightline serve` in this process's place.
pub(crate) fn serve(arguments: &[String]) -> Result<()> {
    web::web()?;
    build_programs()?;
    let mut server = cmd::program(cmd::sightline_binary());
    server.arg("serve").args(arguments);
    become_program(server)
}

/// Builds the workspace's programs.
pub(crate) fn build_programs() -> Result<()> {
    cmd::run(
        &mut cmd::cargo(&["build", "--workspace", "--exclude", "xtask", "--bins"]),
        "mend what the compiler reports above",
    )
}

/// Replaces this process, so that a signal sent to it reaches the server.
#[cfg(unix)]
fn become_program(mut command: Command) -> Result<()> {
    use std::os::unix::process::CommandExt;
    let error = command.exec();
    Err(anyhow::Error::new(error).context("target/debug/sightline cannot be started; build it again"))
}

/// Runs the program and waits, where a process cannot be replaced.
#[cfg(not(unix))]
fn become_program(mut command: Command) -> Result<()> {
    cmd::run(&mut command, "read what the server says above")
}
