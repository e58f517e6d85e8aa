//! The project's commands: `cargo xtask serve | test | golden | fuzz | drill | check | strings | web | bench | dist | screenshot`.
//!
//! Each command installs or builds its prerequisites, or explains in one sentence why this is impossible. `serve` builds
//! only the server, the other commands the whole workspace; `sightline-features` gives both the same features, so that the
//! large dependencies compile once.

mod cmd;
mod web;
mod build;
mod costs;
mod features;
mod wasm_target;
mod apt;
mod chromium;
mod serve;
mod test;
mod golden;
mod fuzz;
mod drill;
mod check;
mod house_rules;
mod imports;
mod public_functions;
mod strings;
mod packages;
mod deny;
mod bench;
mod peers;
mod remap;
mod components;
mod sbom;
mod licences;
mod dist;

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// The project's commands.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    command: Task,
}

/// The commands.
#[derive(Subcommand)]
enum Task {
    /// Build the page and the server and start it; it prints its address.
    Serve {
        /// Arguments for `sightline serve`, after `--`.
        #[arg(last = true)]
        arguments: Vec<String>,
    },
    /// Build everything and run every test, in the browser too.
    Test {
        /// Run only the tests whose names contain this.
        filter: Option<String>,
    },
    /// Compare every number computed by tracking with the golden lists.
    Golden {
        /// Record the lists again instead.
        #[arg(long)]
        update: bool,
    },
    /// Search for inputs that make a parser of external data fail.
    Fuzz {
        /// Search in this parser only; by default in all parsers.
        target: Option<String>,
        /// Duration of the search in each parser, minutes.
        #[arg(long, default_value_t = 1.0)]
        minutes: f64,
    },
    /// Test the program under load and with faults, for about 20 minutes, and print the results as a table.
    Drill,
    /// Check format, lints (native and WASM), documentation, dependencies, and the project's own rules.
    Check,
    /// List every text that users can see, one `file:line<TAB>text` per line.
    Strings {
        /// List only the texts of files whose path contains this.
        filter: Option<String>,
    },
    /// Build the page with the viewer's WASM into `target/web`.
    Web,
    /// Run the benchmarks.
    Bench {
        /// Run only the benchmarks whose names contain this.
        filter: Option<String>,
        /// Compare correlation, features, matching and dense stereo with OpenCV instead, on the same pixels and in turn.
        #[arg(long, conflicts_with = "filter")]
        peers: bool,
        /// Print the comparison as one JSON object per line.
        #[arg(long, requires = "peers")]
        json: bool,
    },
    /// Build the program for distribution, with the viewer inside, its bill of materials and its licences, in `target/dist`.
    Dist,
    /// Update the screenshot in the README.
    Screenshot,
}

fn main() -> ExitCode {
    if let Some(code) = fuzz::as_compiler() {
        return code;
    }
    let done = match Arguments::parse().command {
        Task::Serve { arguments } => serve::serve(&arguments),
        Task::Test { filter } => test::test(filter.as_deref()),
        Task::Golden { update } => golden::golden(update),
        Task::Fuzz { target, minutes } => fuzz::fuzz(target.as_deref(), minutes),
        Task::Drill => drill::drill(),
        Task::Check => check::check(),
        Task::Strings { filter } => strings::strings(filter.as_deref()),
        Task::Web => web::web(),
        Task::Bench { peers: true, json, .. } => peers::peers(json),
        Task::Bench { filter, .. } => bench::bench(filter.as_deref()),
        Task::Dist => dist::dist(),
        Task::Screenshot => test::screenshot(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Standard error may be closed; the exit code still reports the failure.
            writeln!(std::io::stderr(), "xtask: {error:#}").unwrap_or_default();
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn arguments_after_two_dashes_go_to_the_server() {
        let parsed = Arguments::parse_from(["cargo xtask", "serve", "--", "--port", "0"]);
        assert!(matches!(parsed.command, Task::Serve { arguments } if arguments == ["--port", "0"]));
    }
}
