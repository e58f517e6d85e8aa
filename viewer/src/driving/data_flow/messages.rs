//! The components of targeted driving, and the last message on every edge between them at a stop, in words.
//!
//! The messages are formed from the record of the step and the decisions of the drive; lengths are in m or cm, angles in
//! deg.
//!
//! Source: Kim et al. (2009), §3, Fig. 1; R2, R3.

use sightline_rover::driving::GoalRule;

use crate::command::Stage;
use crate::driving::words;
use crate::panels::numbers::{counted, fixed};
use crate::state::State;

/// A component of targeted driving.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    Operator,
    Tracker,
    MastCameras,
    MastPointing,
    Goal,
    HazardMap,
    Hazcams,
    PoseEstimate,
    Navigator,
    Locomotor,
}

/// A message from one component to another.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Message {
    pub(super) from: Component,
    pub(super) to: Component,
    /// The message; `None` if there is none at this stop.
    pub(super) text: Option<String>,
}

impl Component {
    /// All components, in drawing order.
    pub(super) const ALL: [Self; 10] = [
        Self::Operator,
        Self::Goal,
        Self::Navigator,
        Self::Tracker,
        Self::HazardMap,
        Self::MastCameras,
        Self::Hazcams,
        Self::MastPointing,
        Self::PoseEstimate,
        Self::Locomotor,
    ];

    /// The name in the panel.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Operator => "operator",
            Self::Tracker => "tracker",
            Self::MastCameras => "mast cameras",
            Self::MastPointing => "mast pointing",
            Self::Goal => "goal",
            Self::HazardMap => "hazard map",
            Self::Hazcams => "hazcams",
            Self::PoseEstimate => "pose estimate",
            Self::Navigator => "navigator",
            Self::Locomotor => "locomotor",
        }
    }

    /// The stage whose record the component writes.
    pub(super) const fn stage(self) -> Option<Stage> {
        match self {
            Self::Operator | Self::Hazcams => None,
            Self::Tracker => Some(Stage::LOCATE),
            Self::MastCameras => Some(Stage::CAPTURE),
            Self::MastPointing => Some(Stage::POINT_MAST),
            Self::Goal => Some(Stage::SET_GOAL),
            Self::HazardMap | Self::Navigator => Some(Stage::SELECT_PATH),
            Self::PoseEstimate => Some(Stage::PREDICT),
            Self::Locomotor => Some(Stage::DRIVE),
        }
    }
}

/// The last message on every edge at the cursor's stop.
pub(super) fn messages(state: &State) -> Vec<Message> {
    use Component::{
        Goal, HazardMap, Hazcams, Locomotor, MastCameras, MastPointing, Navigator, Operator, PoseEstimate,
        Tracker,
    };
    let edges: [(Component, Component, Option<String>); 12] = [
        (Operator, Tracker, designation(state)),
        (Operator, Goal, command(state)),
        (Tracker, Goal, located(state)),
        (MastCameras, Tracker, pair(state)),
        (MastCameras, PoseEstimate, by_vision(state)),
        (MastPointing, MastCameras, angles(state)),
        (PoseEstimate, MastPointing, predicted(state)),
        (Goal, Navigator, goal(state)),
        (Hazcams, HazardMap, range_data(state)),
        (HazardMap, Navigator, paths(state)),
        (Navigator, Locomotor, motion(state)),
        (Locomotor, PoseEstimate, by_wheels(state)),
    ];
    edges.into_iter().map(|(from, to, text)| Message { from, to, text }).collect()
}

fn metres(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|value| fixed(*value, 2)).collect();
    format!("({}) m", values.join(", "))
}

fn designation(state: &State) -> Option<String> {
    let designation = state.target()?.designation;
    let (x, y) = (designation.pixel.x, designation.pixel.y);
    Some(format!("pixel ({}, {}) of stop {}", fixed(x, 1), fixed(y, 1), designation.step))
}

fn command(state: &State) -> Option<String> {
    let command = &state.drive()?.steering.as_ref()?.command;
    let rule = if command.goal == GoalRule::Fixed { ", fixed" } else { "" };
    let tolerance = fixed(100.0 * command.tolerance_m, 1);
    Some(format!("standoff {} m{rule}, tolerance {tolerance} cm", fixed(command.standoff_m, 2)))
}

fn located(state: &State) -> Option<String> {
    let target = &state.trace()?.trace.updated()?.target;
    let word = &state.row_at(state.cursor.step)?.state;
    Some(format!("{word}, at {} from the rover", metres(target.position_in_rover.coords.as_slice())))
}

fn pair(state: &State) -> Option<String> {
    let capture = state.trace()?.trace.capture()?;
    let [width, height] = capture.left_size;
    let grey =
        capture.subframe_mean.map(|mean| format!(", mean grey {} %", fixed(100.0 * f64::from(mean), 0)));
    Some(format!("pair {width} × {height} px{}", grey.unwrap_or_default()))
}

fn by_vision(state: &State) -> Option<String> {
    let measured = state.measured_motion(state.cursor.step)?;
    Some(match measured.update.refusal() {
        Some(_) => "visual odometry refused the update".to_owned(),
        None => format!("motion by vision, slip {}", words::slip(measured)),
    })
}

fn angles(state: &State) -> Option<String> {
    let used = state.trace()?.trace.pointing()?.used?;
    let [azimuth, elevation] =
        [used.azimuth_rad, used.elevation_rad].map(|angle| fixed(angle.to_degrees(), 1));
    Some(format!("azimuth {azimuth}°, elevation {elevation}°"))
}

fn predicted(state: &State) -> Option<String> {
    let prediction = state.trace()?.trace.prediction()?;
    let sigma_m = (prediction.covariance_in_rover.trace() / 3.0).max(0.0).sqrt();
    let at = metres(prediction.position_in_rover.coords.as_slice());
    Some(format!("target at {at} from the rover, 1σ {} cm", fixed(100.0 * sigma_m, 1)))
}

fn goal(state: &State) -> Option<String> {
    let goal = state.cycle_at(state.cursor.step)?.goal;
    let arrived = if goal.arrived { ", arrived" } else { "" };
    Some(format!("{}, {} m away{arrived}", metres(&goal.in_site_m), fixed(goal.distance_m, 2)))
}

fn range_data(state: &State) -> Option<String> {
    let points = state.cycle_at(state.cursor.step)?.range_points?;
    Some(counted(points, "point"))
}

fn paths(state: &State) -> Option<String> {
    let choice = state.cycle_at(state.cursor.step)?.choice.as_ref()?;
    let open = choice.candidates.iter().filter(|candidate| candidate.veto.is_none()).count();
    Some(format!("{open} of {} open", counted(choice.candidates.len(), "path")))
}

fn motion(state: &State) -> Option<String> {
    let cycle = state.cycle_at(state.cursor.step).filter(|_| state.is_decided(Stage::SELECT_PATH))?;
    match (&cycle.motion, &cycle.ending) {
        (Some(motion), _) => Some(words::motion(motion)),
        (None, Some(ending)) => Some(format!("stay: {}", ending.reason.word())),
        (None, None) => Some("stay for another pair".to_owned()),
    }
}

fn by_wheels(state: &State) -> Option<String> {
    let step = state.cursor.step.checked_sub(1)?;
    let report = state.cycle_at(step)?.report?;
    let stalled = if report.stall.is_some() { ", a wheel stalled" } else { "" };
    Some(format!(
        "{} m by the wheels from stop {step}, tilt {}°{stalled}",
        fixed(report.wheels_m, 2),
        fixed(report.tilt_deg, 1)
    ))
}
