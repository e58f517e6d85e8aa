//! Commanded drives: the command form, the drive as reported by the server, and the panel that shows both.

pub(crate) mod data_flow;
pub(crate) mod faults;
pub(crate) mod ground;
pub(crate) mod hazards;
pub(crate) mod map;
mod map_pairs;
mod motions;
pub(crate) mod panel;
pub(crate) mod paths;
pub(crate) mod pause;
pub(crate) mod stages;
pub(crate) mod trial_drives;
pub(crate) mod update;
pub(crate) mod visits;
pub(crate) mod why;
pub(crate) mod words;

use sightline_rover::driving::DriveCommand;
use sightline_session::driving::DriveView;
use sightline_session::faults::NewFault;

/// The drive of the open session.
#[derive(Clone, Debug, Default)]
pub struct Driving {
    /// The command in the form.
    pub command: DriveCommand,
    /// Numbers of the targets to visit afterwards, in the form.
    pub then: Vec<usize>,
    /// The faults to be injected into the next drive or branch.
    pub faults: Vec<NewFault>,
    /// The pause in the form.
    pub pause: pause::PauseForm,
    /// The drive, with the name of its session; `None` until read.
    pub view: Option<(String, DriveView)>,
    /// The trial drives in the background, of all sessions.
    pub trials: Vec<trial_drives::TrialDrive>,
    /// The cursor's stop, and the stop to which it follows the rover once that is loaded.
    following: Option<[usize; 2]>,
    is_pending: bool,
    is_stale: bool,
    is_beginning: bool,
}

/// A command about driving.
#[derive(Clone, Debug, PartialEq)]
pub enum DrivingCommand {
    /// Changes the command in the form.
    Form(DriveCommand),
    /// Changes the targets that are visited afterwards.
    Then(Vec<usize>),
    /// Changes the faults to be injected into the next drive or branch.
    Faults(Vec<NewFault>),
    /// Starts a drive with the selected run: from the first stop, or as a branch at the cursor's stop.
    Begin,
    /// Changes the pause in the form.
    PauseForm(pause::PauseForm),
    /// Pauses the drive at the chosen stage of its current stop.
    Pause,
    /// Continues to the chosen pause with the selected run.
    Continue,
    /// Computes one more stage with the selected run.
    NextStage,
    /// Drives one stop further.
    OneStop,
    /// Continues the drive with the selected run, under the command in the form.
    GoOn,
    /// Drives the whole drive again under another command, in the background.
    Try {
        /// The command.
        command: DriveCommand,
        /// Description of the change, which identifies the trial drive.
        change: String,
    },
    /// Ends the trial drive with a change and removes its session.
    CancelTrial(String),
}
