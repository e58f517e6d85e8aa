//! Driving on commands: the form of the command, the drive as the server has it, and the panel that shows both.

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
pub(crate) mod tried;
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
    /// The command as it stands in the form.
    pub command: DriveCommand,
    /// The targets to which the rover drives afterwards, as they stand in the form, by their numbers.
    pub then: Vec<usize>,
    /// The faults to be injected into the next drive or branch.
    pub faults: Vec<NewFault>,
    /// The pause as it stands in the form.
    pub pause: pause::PauseForm,
    /// The drive with the name of its session; `None` before it was read.
    pub view: Option<(String, DriveView)>,
    /// The whole drives that are tried in the background, of all sessions.
    pub tried: Vec<tried::TriedDrive>,
    /// The cursor's stop, and the one to which it goes with the rover once the page knows it.
    following: Option<[usize; 2]>,
    is_asked: bool,
    is_stale: bool,
    is_beginning: bool,
}

/// What a person asks for about driving.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Changes the command in the form.
    Form(DriveCommand),
    /// Changes the targets that are visited afterwards.
    Then(Vec<usize>),
    /// Changes the faults to be injected into the next drive or branch.
    Faults(Vec<NewFault>),
    /// Begins a drive with the run that is looked at: from the first stop, or as a branch at the cursor's stop.
    Begin,
    /// Changes the pause in the form.
    PauseForm(pause::PauseForm),
    /// Lets the drive wait at the chosen stage of its present stop.
    Pause,
    /// Goes on to the chosen pause with the run that is looked at.
    Continue,
    /// Computes one stage more with the run that is looked at.
    NextStage,
    /// Drives one stop further.
    OneStop,
    /// Drives on with the run that is looked at, under the command in the form.
    GoOn,
    /// Tries the whole drive again under another command, in the background.
    Try {
        /// The command.
        command: DriveCommand,
        /// Its change in words, by which the drive is known.
        change: String,
    },
    /// Ends the drive that is tried with a change and removes its session.
    CancelTried(String),
}
