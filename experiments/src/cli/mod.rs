//! The command line of the experiments: one file for each.

mod cancel;
mod claims;
mod driving;
mod navigation;
mod realism;
mod scenery;
mod scenery_figure;
mod scenery_pictures;
mod scenery_report;
mod real_motion;
mod real_odometry;
mod registration;
mod spirit137;
mod trackability;
mod worlds;

use std::process::ExitCode;

use clap::Parser;
use sightline_server::cli::{exit_code, start_log};

/// One-off experiments behind figures and tables of the documents.
#[derive(Debug, Parser)]
#[command(name = "sightline-experiments", arg_required_else_help = true)]
enum Experiment {
    /// How soon each long computation ends once it is cancelled.
    Cancel(cancel::Cancelled),
    /// Tracked targets and their NEES in worlds with pointing error.
    Claims(claims::Claimed),
    /// Closed-loop drives on slopes with slip: arrival, errors of target and goal, collisions.
    Driving(driving::Driving),
    /// The navigator among rocks on exact range data, without images, beside a planner that knows the ground.
    Navigation(navigation::Navigation),
    /// How hard the simulated worlds are: plain correlation, without scale and roll, at steps of 5 % and 23 %.
    Realism(realism::Worlds),
    /// The simulated scenery in numbers: rocks, ground, noise and texture against their laws and real frames.
    Scenery(scenery::Scenery),
    /// Recorded frames: the motion that features or visual odometry find against the motion that is known of them.
    RealMotion(real_motion::RealMotion),
    /// Rocks registered by their shape: basin of convergence, accuracy, and the result for another rock.
    Registration(registration::Registrations),
    /// Visual odometry along the path that Spirit drove at site 137, in a rendered world.
    #[command(name = "spirit-137")]
    Spirit137(spirit137::Spirit137),
    /// Targets drawn where the trackability map says good, risky or bad: which of them are tracked to the end?
    Trackability(trackability::Worlds),
}

/// Runs the experiment that the arguments name.
pub fn run() -> ExitCode {
    let experiment = Experiment::parse();
    start_log();
    exit_code(match experiment {
        Experiment::Cancel(arguments) => arguments.run(),
        Experiment::Claims(arguments) => arguments.run(),
        Experiment::Driving(arguments) => arguments.run(),
        Experiment::Navigation(arguments) => arguments.run(),
        Experiment::Realism(arguments) => arguments.run(),
        Experiment::Scenery(arguments) => arguments.run(),
        Experiment::RealMotion(arguments) => arguments.run(),
        Experiment::Registration(arguments) => arguments.run(),
        Experiment::Spirit137(arguments) => arguments.run(),
        Experiment::Trackability(arguments) => arguments.run(),
    })
}
