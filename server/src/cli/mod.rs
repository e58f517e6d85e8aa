//! The command line: one file for each command.
//!
//! Results go to the standard output, progress and errors to the standard error. Exit codes: 0 success, 2 invalid command
//! line, 3 bad input, explained in one sentence.

mod serve;
mod scenarios;
mod simulate;
mod import;
mod info;
mod track;
pub mod drive;
pub mod drive_options;
mod presets;
mod study;
mod study_commanded;
mod study_drive_grid;
mod study_odometry;
mod export;
mod fault;
pub mod open;
pub mod terminal;
mod sheet;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use sightline_geometry::error::{Error, Result};

use crate::version::VERSION;

/// The exit code for bad input.
const BAD_INPUT: u8 = 3;

/// An interactive visual debugger for the visual target tracking of planetary rovers.
#[derive(Debug, Parser)]
#[command(name = "sightline", version = VERSION, arg_required_else_help = true)]
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
    /// Convert a foreign recording (KITTI odometry, PDS3) to a traverse.
    Import(import::Import),
    /// Print the contents of a traverse.
    Info(info::Info),
    /// List the named configurations of the tracker, or print one.
    Presets(presets::Presets),
    /// Track targets without a browser; one JSON object a step.
    Track(track::Track),
    /// Drive the simulated rover towards a target on its own estimates; one JSON object a stop.
    Drive(drive::Drive),
    /// Run a validation experiment: many targets in many worlds against the truth.
    Study(study::Study),
    /// Write a session as a file: a recording, tables, images, a report.
    Export(export::Export),
}

/// Runs the command that the arguments name.
pub fn run() -> ExitCode {
    let matches = with_negative_numbers(Cli::command()).get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    start_log();
    let outcome = match cli.command {
        Command::Serve(command) => command.run(),
        Command::Scenarios(command) => command.run(),
        Command::Simulate(command) => command.run(),
        Command::Import(command) => command.run(),
        Command::Info(command) => command.run(),
        Command::Presets(command) => command.run(),
        Command::Track(command) => command.run(),
        Command::Drive(command) => command.run(),
        Command::Study(command) => command.run(),
        Command::Export(command) => command.run(),
    };
    exit_code(outcome)
}

/// Makes a negative number the value of the option before it, so that the limits of the option are reported for it.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    command
        .mut_args(|arg| {
            let takes_number = arg.get_action().takes_values() && !arg.is_allow_hyphen_values_set();
            arg.allow_negative_numbers(takes_number)
        })
        .mut_subcommands(with_negative_numbers)
}

/// The exit code of a command; writes the error to the standard error.
pub fn exit_code(outcome: Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // The reader closed the pipe, as `head` does.
        Err(Error::Write { path, source })
            if path.as_os_str() == terminal::STDOUT && source.kind() == std::io::ErrorKind::BrokenPipe =>
        {
            ExitCode::SUCCESS
        }
        Err(error) => {
            terminal::error(&format!("sightline: {error}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// Logs our warnings and the errors of other crates to the standard error, unless `RUST_LOG` is set.
pub fn start_log() {
    use tracing_subscriber::EnvFilter;
    let filter =
        EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("error,sightline_server=warn"));
    // A log that a library has already started stays in use.
    let colours = std::io::stderr().is_terminal();
    let log =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_ansi(colours);
    let _ = log.try_init();
}

/// The runtime of jobs and requests.
fn runtime() -> Result<tokio::runtime::Runtime> {
    let built = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    built.map_err(|error| Error::Request(format!("cannot start: {error}")))
}
