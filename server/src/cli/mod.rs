//! The command line: one file for each command.
//!
//! Results go to the standard output, progress and complaints to the standard error. Exit codes: 0 done,
//! 2 the command was not written correctly, 3 bad input, said in one sentence.

pub mod serve;
pub mod scenarios;
pub mod simulate;
pub mod import;
pub mod info;
pub mod track;
pub mod presets;
pub mod study;
pub mod export;
mod real_motion;
mod registration;
mod realism;
mod scenery;
mod scenery_figure;
mod scenery_pictures;
mod open;
mod say;
mod sheet;
mod trackability;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use sightline_core::error::Error;

/// The exit code for bad input.
const BAD_INPUT: u8 = 3;

/// An interactive visual debugger for the visual target tracking of planetary rovers.
#[derive(Debug, Parser)]
#[command(name = "sightline", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Open traverses in the browser; without any, a simulated drive whose target is lost.
    Serve(serve::Serve),
    /// List the scenarios that come with the program, or print one.
    Scenarios(scenarios::Scenarios),
    /// Render a simulated traverse into a folder.
    Simulate(simulate::Simulate),
    /// Turn a foreign recording (KITTI odometry, PDS3) into a traverse.
    Import(import::Import),
    /// Say what a traverse holds.
    Info(info::Info),
    /// List the named configurations of the tracker, or print one.
    Presets(presets::Presets),
    /// Track targets without a browser; one JSON object a step.
    Track(track::Track),
    /// Run a validation experiment: many targets in many worlds against the truth.
    Study(study::Study),
    /// Write a session as a file: a recording, tables, pictures, a report.
    Export(export::Export),
}

/// Runs the command that the arguments name.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    start_log();
    let outcome = match cli.command {
        Command::Serve(command) => command.run(),
        Command::Scenarios(command) => command.run(),
        Command::Simulate(command) => command.run(),
        Command::Import(command) => command.run(),
        Command::Info(command) => command.run(),
        Command::Presets(command) => command.run(),
        Command::Track(command) => command.run(),
        Command::Study(command) => command.run(),
        Command::Export(command) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads our output has had enough, as `head` does.
        Err(Error::Write { path, source })
            if path.as_os_str() == say::STDOUT && source.kind() == std::io::ErrorKind::BrokenPipe =>
        {
            ExitCode::SUCCESS
        }
        Err(error) => {
            say::error(&format!("sightline: {error}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// Logs warnings of our own and errors of others to the standard error; `RUST_LOG` says otherwise.
fn start_log() {
    use tracing_subscriber::EnvFilter;
    let filter =
        EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("error,sightline_server=warn"));
    // Another log may have been started by a library; then that one stays.
    let colours = std::io::stderr().is_terminal();
    let log =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_ansi(colours);
    let _ = log.try_init();
}
