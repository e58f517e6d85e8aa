//! `sightline drive`: drives the simulated rover towards a target on its own estimates, or follows a recording and compares
//! its commands with the recorded motions.
//!
//! Writes one line of JSON per stop to the standard output as soon as it is computed: the step's row and, under `cycle`, the
//! decisions at that stop. The last line is `{"summary": …}`.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_recordings::replayed::Answer;
use sightline_recordings::{DrivenTraverse, Traverse};
use sightline_rover::driving::{
    Cycle, DriveCommand, GoalRule, Motion, OdometryPair, PathChoice, SlipCheck, TrackedStops,
};
use sightline_session::driving::DriveSummary;
use sightline_session::faults::{self, NewFault};
use sightline_session::replayed_drive::{ReplaySummary, ReplayedDrive};
use sightline_session::step::RunStep;
use sightline_session::stop_cause::StopExplanation;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_session::visits::Visit;
use sightline_track::locate::shape_tracker::placement::Placement;
use sightline_track::presets::preset;
use sightline_track::settings::{Changes, Settings, parse_assignment};
use sightline_track::target::Designation;
use sightline_world::choose_targets;

use super::drive_options::{NavigatorName, Odometry, OnArrival, Pairs, SlipOf, Tracked};
use super::study_odometry::Configuration;
use super::terminal::{self, Progress};
use super::track::{pixel, without_images};
use super::{open, simulate};
use crate::exports::rows::ExportRow;

/// Drive the simulated rover towards a target on its own estimates.
#[derive(Debug, Args)]
pub(super) struct Drive {
    /// The scenario: a file, or a name from `sightline scenarios`. With the folder of a recording, the rover follows the
    /// recorded path, and every line compares the command with the recorded step.
    scenario: PathBuf,
    /// The position of the target in the first left image, px; with several, the rover drives to one after the other.
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true,
        required_unless_present = "list_targets")]
    target: Vec<Pixel>,
    /// The pair in which the target is designated and tracked, by its name in camera.further; by default the main pair, for
    /// which the mast is pointed in any case.
    #[arg(long, value_name = "NAME")]
    camera: Option<CameraName>,
    /// Print the targets that the scenario's rule chooses, one JSON object a line, and end.
    #[arg(long)]
    list_targets: bool,
    /// Horizontal distance of the goal from the target, m.
    #[arg(long, value_name = "M", default_value_t = DriveCommand::default().standoff_m)]
    standoff: f64,
    /// Added to the goal, x and y of the site frame, m.
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true)]
    offset: Option<Pixel>,
    /// Keep the goal of the designation, regardless of tracking: the baseline.
    #[arg(long)]
    fixed_goal: bool,
    /// Distance from the goal at which the rover has arrived, m.
    #[arg(long, value_name = "M", default_value_t = DriveCommand::default().tolerance_m)]
    tolerance: f64,
    /// Longest step, as a fraction of the distance to the target.
    #[arg(long, value_name = "PART", default_value_t = DriveCommand::default().step_fraction)]
    step_fraction: f64,
    /// The stops at which the target is tracked.
    #[arg(long, value_name = "STOPS", default_value = "every")]
    tracked_stops: Tracked,
    /// Maximum number of stops, including the first.
    #[arg(long, value_name = "N", default_value_t = DriveCommand::default().stops_max)]
    stops: u32,
    /// The use of visual odometry.
    #[arg(long, value_name = "USE", default_value = "full")]
    odometry: Odometry,
    /// The pairs used by visual odometry.
    #[arg(long, value_name = "PAIRS", default_value = "shared")]
    odometry_pair: Pairs,
    /// The settings of visual odometry.
    #[arg(long, value_name = "NAME", default_value = "sightline")]
    odometry_preset: Configuration,
    /// The navigator that chooses the motions.
    #[arg(long, value_name = "NAME", default_value = "arcs")]
    navigator: NavigatorName,
    /// A pair of every stop for the hazard map, by its name in camera.further; can be given more than once. By default the
    /// first hazcams that look ahead.
    #[arg(long, value_name = "NAME")]
    hazard_camera: Vec<CameraName>,
    /// Ground nearer to the target counts as good on the hazard map, m.
    #[arg(long, value_name = "M", default_value_t = DriveCommand::default().exemption_radius_m)]
    exemption: f64,
    /// Slip ratio of a step above which the drive stops.
    #[arg(long, value_name = "PART", default_value_t = DriveCommand::default().slip_max)]
    slip_max: f64,
    /// The motion that the slip ratio refers to.
    #[arg(long, value_name = "MOTION", default_value = "wheels")]
    slip_check: SlipOf,
    /// Number of consecutive motions refused by visual odometry above which the drive stops; by default it never does.
    #[arg(long, value_name = "N")]
    refusals_max: Option<u32>,
    /// Time on Mars after which the drive stops, also during a motion, min.
    #[arg(long, value_name = "MIN", default_value_t = DriveCommand::default().flight_minutes_max)]
    minutes: f64,
    /// Motions to drive in sequence instead of those to the goal: metres (0.5), `turn` and degrees (turn 20), or both (0.5
    /// turn 20), separated by commas.
    #[arg(long, value_name = "MOTION,…", value_delimiter = ',', allow_hyphen_values = true)]
    motions: Vec<Motion>,
    /// Whether the mast also observes the targets that are visited later.
    #[arg(long, value_name = "true|false", default_value_t = true, action = clap::ArgAction::Set)]
    look_at_waiting: bool,
    /// An action after arrival; can be given more than once.
    #[arg(long, value_name = "ACTION")]
    on_arrival: Vec<OnArrival>,
    /// Horizontal distance of the goal from the target in an approach after arrival, m.
    #[arg(long, value_name = "M", default_value_t = DriveCommand::default().final_standoff_m)]
    final_standoff: f64,
    /// A fault to inject: occluder, shadow, feature_starvation, pose_jump or camera_drop_out, its first and last stop, and, for the
    /// first two, the target it concerns, from 0: for example occluder:5-7 or shadow:8-9@1; can be given more than once.
    #[arg(long, value_name = "KIND:FROM-TO[@TARGET]", value_parser = super::fault::parse)]
    fault: Vec<NewFault>,
    /// Another seed than the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// A named configuration of the tracker from `sightline presets`; --set changes it further.
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// A setting of the tracker, for example ncc_min=0.6; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// A setting of the scenario, for example terrain.slope_deg=5; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    world: Vec<String>,
    /// The folder to create for the drive, which can be opened and replayed; without it, the images are removed at the end.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Output format of the stops.
    #[arg(long, default_value = "jsonl")]
    format: Format,
}

/// Output format of the stops.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// One JSON object per stop, then one with the summary.
    Jsonl,
}

/// The output line of a stop.
#[derive(Serialize)]
struct StopLine<'a> {
    /// The number of the target that the rover drives to, from 0; absent with one target.
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<usize>,
    #[serde(flatten)]
    row: ExportRow,
    /// Number of vetoed paths; absent without a hazard map.
    #[serde(skip_serializing_if = "Option::is_none")]
    vetoed_paths: Option<usize>,
    cycle: &'a Cycle,
}

/// The output line of a stop of a recording.
#[derive(Serialize)]
struct ReplayLine<'a> {
    #[serde(flatten)]
    row: ExportRow,
    /// Number of vetoed paths; absent without a hazard map.
    #[serde(skip_serializing_if = "Option::is_none")]
    vetoed_paths: Option<usize>,
    cycle: &'a Cycle,
    answer: Option<&'a Answer>,
}

/// The output line after the last stop of a recording.
#[derive(Serialize)]
struct ReplaySummaryLine {
    summary: ReplaySummary,
}

/// The output line of a target.
#[derive(Serialize)]
struct TargetLine {
    target: [f64; 2],
}

/// The output line after the last stop.
#[derive(Serialize)]
struct SummaryLine {
    /// The visits, in a drive to several targets.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    visits: Vec<Visit>,
    /// The outcome for the last target.
    summary: DriveSummary,
    /// Instrument-placement target after a hand-off; absent without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    placement: Option<Placement>,
    /// Why the drive stopped; absent if it has arrived.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<StopExplanation>,
}

impl Drive {
    /// Drives until the goal is reached or something ends the drive.
    ///
    /// # Errors
    /// An invalid scenario, target, command or setting, or a folder that cannot be written.
    pub(super) fn run(self) -> Result<()> {
        if self.scenario.is_dir() {
            return self.replay();
        }
        let mut scenario = open::scenario(&self.scenario)?;
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        let scenario = simulate::with(&scenario, "--world", &self.world)?;
        let settings = self.settings()?;
        self.command().validate()?;
        let temporary =
            tempfile::tempdir().map_err(|source| Error::Write { path: std::env::temp_dir(), source })?;
        let plain = || temporary.path().join("drive");
        let folder = self.out.clone().filter(|_| self.fault.is_empty()).unwrap_or_else(plain);
        let world = DrivenTraverse::begin(&scenario, &folder, Cancel::default())?;
        if self.list_targets {
            let traverse = world.traverse();
            let Some(simulated) = traverse.world() else { return Ok(()) };
            let targets = choose_targets(simulated, &scenario, traverse.index());
            if targets.is_empty() {
                let problem = "no pixel of the first image fits the scenario's rule for targets; choose another seed, or a smaller \
                               targets.window_px with --world";
                return Err(Error::Target(problem.to_owned()));
            }
            return targets.iter().try_for_each(|pixel| line(&TargetLine { target: [pixel.x, pixel.y] }));
        }
        let designated = |pixel: &Pixel| Designation { step: 0, pixel: *pixel, camera: self.camera };
        let targets: Vec<Designation> = self.target.iter().map(designated).collect();
        let world = if self.fault.is_empty() {
            world
        } else {
            let faulty = temporary.path().join("faulty");
            let folder = self.out.as_ref().map_or(faulty, Clone::clone);
            let designation = |number: usize| targets.get(number).copied();
            let faults = faults::placed(world.traverse(), &self.fault, designation, 0)?;
            world.branch(1, &faults, &folder, Cancel::default())?
        };
        let drive = TargetedDrive::begin_to(world, &targets, self.command(), &settings, Cancel::default())?;
        follow(drive, &settings)
    }

    /// Follows a recording.
    fn replay(&self) -> Result<()> {
        let without_effect = [
            ("--seed", self.seed.is_some()),
            ("--world", !self.world.is_empty()),
            ("--out", self.out.is_some()),
            ("--list-targets", self.list_targets),
            ("--fault", !self.fault.is_empty()),
        ];
        if let Some((option, _)) = without_effect.iter().find(|(_, is_given)| *is_given) {
            let problem = format!("{option} has no effect on a recording; leave it out or give a scenario");
            return Err(Error::Request(problem));
        }
        let settings = self.settings()?;
        let traverse = Traverse::open(&self.scenario)?;
        let [pixel] = self.target[..] else {
            let problem = "--target: a recording is followed with one target; give it once";
            return Err(Error::Request(problem.to_owned()));
        };
        let designation = Designation { step: 0, pixel, camera: self.camera };
        let cancel = Cancel::default();
        let mut drive = ReplayedDrive::begin(&traverse, designation, self.command(), &settings, cancel)?;
        let mut progress = Progress::new("followed to stop");
        loop {
            let goes_on = drive.advance(&settings, cancel)?;
            let number = drive.cycles.len() - 1;
            let (step, cycle): (&RunStep, &Cycle) = (&drive.steps[number], &drive.cycles[number]);
            line(&ReplayLine {
                row: step.into(),
                vetoed_paths: vetoed_paths(cycle),
                cycle,
                answer: drive.answer_to(cycle),
            })?;
            progress.tell(number + 1, traverse.stop_count());
            if !goes_on {
                return line(&ReplaySummaryLine { summary: drive.summary() });
            }
            drive.steps[number] = Arc::new(without_images(&drive.steps[number]));
        }
    }

    fn command(&self) -> DriveCommand {
        DriveCommand {
            standoff_m: self.standoff,
            offset_m: self.offset.map_or([0.0; 2], |offset| [offset.x, offset.y]),
            goal: if self.fixed_goal { GoalRule::Fixed } else { GoalRule::FollowsTarget },
            tolerance_m: self.tolerance,
            step_fraction: self.step_fraction,
            stops_max: self.stops,
            odometry: self.odometry.mode(),
            tracked_stops: match self.tracked_stops {
                Tracked::Every => TrackedStops::Every,
                Tracked::ByDistance => TrackedStops::ByDistance,
            },
            odometry_pair: match self.odometry_pair {
                Pairs::Shared => OdometryPair::Shared,
                Pairs::Own => OdometryPair::Own,
            },
            odometry_preset: self.odometry_preset.preset().1,
            navigator: self.navigator.kind(),
            hazard_cameras: self.hazard_camera.clone(),
            exemption_radius_m: self.exemption,
            slip_max: self.slip_max,
            slip_check: match self.slip_check {
                SlipOf::Wheels => SlipCheck::Wheels,
                SlipOf::Command => SlipCheck::Command,
            },
            refusals_max: self.refusals_max,
            flight_minutes_max: self.minutes,
            motions: self.motions.clone(),
            look_at_waiting: self.look_at_waiting,
            on_arrival: self.on_arrival.iter().map(|action| action.action()).collect(),
            final_standoff_m: self.final_standoff,
            ..DriveCommand::default()
        }
    }

    fn settings(&self) -> Result<Settings> {
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        let own =
            self.preset.as_ref().map_or_else(|| Ok(Settings::default()), |name| preset(name)?.settings())?;
        let settings = own.with(&changes)?;
        terminal::settings_without_effect(&settings, &changes);
        Ok(settings)
    }
}

/// Drives to the end and writes one line per stop.
fn follow(mut drive: TargetedDrive, settings: &Settings) -> Result<()> {
    let mut progress = Progress::new("drove to stop");
    let has_several = drive.has_several_targets();
    loop {
        let goes_on = drive.advance(settings, Cancel::default())?;
        let number = drive.cycles.len() - 1;
        let (step, cycle): (&RunStep, &Cycle) = (&drive.steps[number], &drive.cycles[number]);
        let target = has_several.then_some(drive.target);
        line(&StopLine { target, row: step.into(), vetoed_paths: vetoed_paths(cycle), cycle })?;
        progress.tell(number + 1, drive.command.stops_max as usize);
        if !goes_on {
            let (summary, why) = (drive.summary(), drive.why());
            if drive.visit_next() {
                continue;
            }
            let placement = drive.steps.last().and_then(|last| last.shape()?.placement);
            return line(&SummaryLine { visits: drive.visits, summary, placement, why });
        }
        // The images of earlier stops are not needed any more.
        drive.steps[number] = Arc::new(without_images(&drive.steps[number]));
    }
}

fn vetoed_paths(cycle: &Cycle) -> Option<usize> {
    cycle.choice.as_ref().map(PathChoice::vetoed_count)
}

fn line(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value).map_err(|error| Error::Request(error.to_string()))?;
    terminal::line(&text)
}
