//! The command `sightline`.

use std::process::ExitCode;

fn main() -> ExitCode {
    sightline_server::cli::run()
}
