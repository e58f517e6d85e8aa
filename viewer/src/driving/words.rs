//! Words for motions, endings and outcomes.

use sightline_rover::driving::{Cycle, Ending, NavigatorKind, OdometryPair, StopReason, TrackedStops, Veto};
use sightline_rover::hazards::HazardTerm;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryMode, OdometryPreset};
use sightline_session::driving::DriveSummary;
pub(super) use sightline_session::stop_cause::words::motion;

use crate::panels::digits;
use crate::panels::numbers::{counted, fixed};

/// The navigator.
pub(super) fn navigator(navigator: NavigatorKind) -> &'static str {
    match navigator {
        NavigatorKind::Arcs => "no hazard avoidance",
        NavigatorKind::Gestalt => "hazard avoidance, gestalt",
        NavigatorKind::Morphin => "hazard avoidance, morphin",
    }
}

/// A hazard term with its value.
pub(super) fn term(term: HazardTerm, value: f64) -> String {
    match term {
        HazardTerm::Tilt => format!("tilt {}°", fixed(value, 1)),
        HazardTerm::Roughness => format!("roughness {} cm", fixed(100.0 * value, 1)),
        HazardTerm::Step => format!("step {} cm", fixed(100.0 * value, 1)),
        HazardTerm::Unknown => format!("certainty {}", fixed(value, 2)),
    }
}

/// The reason for the veto of a path.
pub(super) fn veto(veto: &Veto) -> String {
    let (name, scale, unit) = match veto.term {
        HazardTerm::Tilt => ("tilt", 1.0, "°"),
        HazardTerm::Roughness => ("roughness", 100.0, " cm"),
        HazardTerm::Step => ("step", 100.0, " cm"),
        HazardTerm::Unknown => {
            let [value, limit] = [veto.value, veto.limit].map(|share| fixed(100.0 * share, 0));
            return format!("{value} % of the path is unknown, limit {limit} %");
        }
    };
    let [value, limit] = [veto.value, veto.limit].map(|value| fixed(scale * value, 1));
    format!("{name} {value}{unit} at {} m, limit {limit}{unit}", fixed(veto.along_m, 2))
}

/// The use of visual odometry.
pub(super) fn odometry(mode: OdometryMode) -> &'static str {
    match mode {
        OdometryMode::Off => "no visual odometry",
        OdometryMode::SlipCheck => "vision checks the slip",
        OdometryMode::Full => "vision corrects the pose",
    }
}

/// The stops at which the target is tracked.
pub(super) fn tracked_stops(stops: TrackedStops) -> &'static str {
    match stops {
        TrackedStops::Every => "track at every stop",
        TrackedStops::ByDistance => "track after each full step",
    }
}

/// The stereo pairs of visual odometry.
pub(super) fn odometry_pair(pair: OdometryPair) -> &'static str {
    match pair {
        OdometryPair::Shared => "odometry in the tracker's pairs",
        OdometryPair::Own => "odometry in pairs of its own",
    }
}

/// The preset of visual odometry.
pub(super) fn preset(preset: OdometryPreset) -> &'static str {
    match preset {
        OdometryPreset::Sightline => "odometry as sightline",
        OdometryPreset::Mer2007 => "odometry as mer2007",
    }
}

/// The slip of the step to a stop as measured by visual odometry, or that the measurement was refused.
pub(super) fn slip(measured: &MeasuredMotion) -> String {
    match (measured.update.accepted, measured.update.slip) {
        (false, _) => "no update".to_owned(),
        (true, None) => "turned".to_owned(),
        (true, Some(slip)) => format!("{} % ± {:.1}", fixed(100.0 * slip.along, 1), 100.0 * slip.along_sigma),
    }
}

/// The ending, with the value and the limit that decided.
pub(super) fn ending(ending: &Ending) -> String {
    if let (StopReason::Arrived, Some(value), Some(limit)) = (ending.reason, ending.value, ending.limit) {
        let [value, limit] = [value, limit].map(|metres| fixed(100.0 * metres, 1));
        return format!("arrived: {value} cm from the goal by its own estimate, tolerance {limit} cm");
    }
    let unit = match ending.reason {
        StopReason::Tilt => "°",
        StopReason::Time => " min",
        StopReason::StopLimit => " stops",
        StopReason::OdometryRefused => " updates in a row",
        StopReason::NoRangeData => " points",
        StopReason::Arrived
        | StopReason::Completed
        | StopReason::Lost
        | StopReason::Stalled
        | StopReason::Slip
        | StopReason::LimitCycle
        | StopReason::NoSafePath
        | StopReason::GoalBlocked => "",
    };
    if let Some(detail) = &ending.detail {
        return format!("{}: {detail}", ending.reason.word());
    }
    match (ending.value, ending.limit) {
        (Some(value), Some(limit)) => {
            format!("{}: {}{unit}, limit {}", ending.reason.word(), digits(value), digits(limit))
        }
        _ => ending.reason.word().to_owned(),
    }
}

/// The outcome of a drive, with its errors if the ground truth is known.
pub(super) fn summary(summary: &DriveSummary) -> String {
    let mut words = format!(
        "{}, {} m driven in {} min on Mars",
        counted(summary.stops, "stop"),
        fixed(summary.driven_m, 2),
        fixed(summary.flight_minutes, 1)
    );
    if let Some(error_m) = summary.target_error_m {
        words += &format!("; by the truth: target error {} cm", fixed(100.0 * error_m, 1));
    }
    match (summary.goal_error_m, summary.reason.is_some()) {
        (Some(error_m), true) => words += &format!(", goal error {} cm", fixed(100.0 * error_m, 1)),
        (Some(left_m), false) => words += &format!(", {} m to the goal", fixed(left_m, 2)),
        (None, _) => {}
    }
    words
}

/// The rover's report of the drive from a stop.
pub(super) fn report(cycle: &Cycle) -> String {
    match cycle.report {
        None => String::new(),
        Some(report) => match report.stall {
            Some(stall) => format!("stalled after {} %", digits(100.0 * stall.completed)),
            None => format!("{} m, tilt {}°", digits(report.wheels_m), digits(report.tilt_deg)),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_veto_names_the_term_with_its_limit() {
        let of = |term, value, limit| veto(&Veto { in_site_m: [0.0; 2], along_m: 0.6, term, value, limit });
        assert_eq!(of(HazardTerm::Step, 0.25, 0.18), "step 25.0 cm at 0.60 m, limit 18.0 cm");
        assert_eq!(of(HazardTerm::Unknown, 0.5, 0.3), "50 % of the path is unknown, limit 30 %");
    }

    #[test]
    fn endings_have_words_and_values() {
        let named = |reason, value, detail| Ending { reason, value, limit: value, detail };
        let arrived = Ending { limit: Some(0.01), ..named(StopReason::Arrived, Some(0.008), None) };
        assert_eq!(ending(&arrived), "arrived: 0.8 cm from the goal by its own estimate, tolerance 1.0 cm");
        assert_eq!(ending(&named(StopReason::Lost, None, None)), "target lost");
        let detail = "a tilt limit of 17.2° instead of 16.0° opens 4 paths".to_owned();
        let blocked = ending(&named(StopReason::NoSafePath, None, Some(detail.clone())));
        assert_eq!(blocked, format!("no safe path: {detail}"));
    }
}
