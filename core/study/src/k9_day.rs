//! K9's three targets in one commanded drive: visited in turn with hazard avoidance, each handed off to the hazcams.
//!
//! ```text
//! designation  │ x_0 − x_true │           at the first stop, by stereo
//! tracker      │ x_arrived − x_true │     by features, at the stop of arrival
//! first view   │ x_look − x_true │        after the registration of the next pair to the view of the designation
//! hand-off     │ x_handed − x_look │      added by the transfer to the hazcams: the rover does not move
//! ```
//! All in the rover frame, m. *Tracker accuracy* and *hand-off accuracy* are the paper's terms (R213), measured against
//! the truth.
//!
//! Source: D§4, R205–R215.

use std::path::Path;

use serde::Serialize;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{ArrivalAction, DriveCommand, NavigatorKind};
use sightline_session::step::RunStep;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::presets::preset;
use sightline_track::target::Designation;
use sightline_world::{Scenario, choose_targets, library};

use super::checkouts::Images;

/// The scenarios: a day with the sun to the side, and one with the rover's own shadow (R214).
pub const DAYS: [&str; 2] = ["k9-day", "k9-day-shadow"];

/// The part of the drive to one target.
#[derive(Clone, Debug, Serialize)]
pub struct K9Visit {
    /// Name of the scenario.
    pub day: &'static str,
    /// Seed of the world.
    pub seed: u64,
    /// Index of the target, 0 to 2.
    pub target: usize,
    /// Reason of its end.
    pub reason: String,
    /// Number of stops of this part.
    pub stops: usize,
    /// Number of stops of this part at which the update was rejected.
    pub bad_stops: usize,
    /// Error of the designation, which an incremental tracker retains, m (R215).
    pub designation_m: Option<f64>,
    /// Error at the stop of arrival, or else at the last stop, m.
    pub tracker_m: Option<f64>,
    /// Error of the registration to the first view, m; null if the rover did not arrive.
    pub first_view_m: Option<f64>,
    /// Error added by the hand-off, m; null without one.
    pub hand_off_m: Option<f64>,
    /// Error after the hand-off, m.
    pub handed_m: Option<f64>,
    /// Reason why the hand-off was rejected; null if it was used.
    pub failure: Option<String>,
    /// Distance between the contact point of the arm and the target, m.
    pub touch_m: Option<f64>,
    /// Time on Mars at its end, min.
    pub minutes: f64,
}

/// Drives a day and returns its visits; targets that were not reached are omitted.
///
/// # Errors
/// A world that does not show all three targets or cannot be driven in, or [`Error::Cancelled`].
pub fn drive(day: &'static str, images: Images, folder: &Path, cancel: Cancel<'_>) -> Result<Vec<K9Visit>> {
    let mut scenario = Scenario { seed: images.seed, ..library::scenario(day)? };
    scenario.camera.image_size = images.size;
    scenario.camera.samples_per_axis = images.samples_per_axis;
    scenario.validate()?;
    let settings = preset("combined")?.settings()?;
    let world = DrivenTraverse::begin(&scenario, folder, cancel)?;
    let traverse = world.traverse();
    let targets = traverse.world().map(|world| choose_targets(world, &scenario, traverse.index()));
    let targets: Vec<Designation> =
        targets.unwrap_or_default().into_iter().map(|pixel| Designation::new(0, pixel)).collect();
    if targets.len() < 3 {
        return Err(Error::Target(format!("the first image shows {} of the three rocks", targets.len())));
    }
    let command = DriveCommand {
        navigator: NavigatorKind::Morphin,
        on_arrival: vec![ArrivalAction::Look, ArrivalAction::HandOff],
        // The time limit of a Mars rover does not apply to K9.
        flight_minutes_max: 10_000.0,
        ..DriveCommand::default()
    };
    let mut drive = TargetedDrive::begin_to(world, &targets, command, &settings, cancel)?;
    let mut visits = Vec::new();
    loop {
        while drive.advance(&settings, cancel)? {}
        visits.push(visit(day, images.seed, &drive));
        if !drive.visit_next() {
            return Ok(visits);
        }
    }
}

fn visit(day: &'static str, seed: u64, drive: &TargetedDrive) -> K9Visit {
    let since = drive.command.since.unwrap_or(0);
    let own: Vec<&RunStep> =
        drive.steps.iter().filter(|step| step.step >= since).map(AsRef::as_ref).collect();
    let actions = drive.cycles.last().map_or(0, |cycle| cycle.arrival_actions as usize);
    let at = |back: usize| own.len().checked_sub(1 + back).and_then(|index| own.get(index));
    let [handed, look] = [0, 1].map(|back| at(back).filter(|_| actions == 2));
    let error_m = |step: &&RunStep| step.truth.as_ref().map(|truth| truth.err_m);
    let position = |step: &&RunStep| step.update.target.position_in_rover;
    let failure = handed.and_then(|step| step.shape()?.registration.as_ref()?.reason.clone());
    let is_used = failure.is_none();
    let is_bad = |step: &&&RunStep| step.verdict().is_some_and(|verdict| !verdict.accepted);
    K9Visit {
        day,
        seed,
        target: drive.target,
        reason: drive.ending().map_or_else(String::new, |ending| ending.reason.word().to_owned()),
        stops: own.len(),
        bad_stops: own.iter().filter(is_bad).count(),
        designation_m: drive.steps.first().and_then(|first| Some(first.truth.as_ref()?.err_m)),
        tracker_m: at(actions).and_then(error_m),
        first_view_m: look.and_then(error_m),
        hand_off_m: handed.zip(look).filter(|_| is_used).map(|(a, b)| (position(a) - position(b)).norm()),
        handed_m: handed.filter(|_| is_used).and_then(error_m),
        failure,
        touch_m: handed.and_then(|step| step.shape()?.placement?.offset_m),
        minutes: drive.cycles.last().map_or(0.0, |cycle| cycle.flight_minutes),
    }
}
