//! `sightline-experiments`: measures figures and tables of the documents again.

use std::process::ExitCode;

fn main() -> ExitCode {
    sightline_experiments::cli::run()
}
