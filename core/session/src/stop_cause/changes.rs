//! Changes that alter the decision at the last stop: one field of the command, or one limit of the hazard map.
//!
//! Each change of the command is verified by repeating the decision with it, on the images and the map of that stop.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::{
    Cycle, DriveCommand, Ending, GoalRule, NavigatorKind, PathInput, SlipCheck, StopReason,
};
use sightline_rover::navigation::counterfactual::counterfactual;
use sightline_rover::navigation::{HazardNavigator, NavigatorPreset};

use super::StoppedDrive;
use super::blocked::has_no_arc;
use super::words::motion;
use crate::format::number;

/// A change that alters the decision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DecisionChange {
    /// Field or setting, new value and current value.
    pub text: String,
    /// The decision under the changed command or limit.
    pub decision: String,
    /// The command with the change; null for a limit that is not part of a command.
    pub command: Option<DriveCommand>,
}

impl StoppedDrive<'_> {
    /// All changes that lead to another decision than `ending`.
    pub(super) fn changes(&self, ending: &Ending) -> Vec<DecisionChange> {
        let mut changes: Vec<DecisionChange> =
            self.candidates(ending).into_iter().filter_map(|change| self.verified(ending, change)).collect();
        changes.extend(self.of_limits());
        changes
    }

    /// Changes of the command that may lead to another decision.
    fn candidates(&self, ending: &Ending) -> Vec<(String, DriveCommand)> {
        let command = self.command;
        let mut all = of_reason(command, ending);
        let distance_m = self.cycles.last().map_or(f64::INFINITY, |last| last.goal.distance_m);
        let tolerance_m = raised(distance_m, 0.01);
        if tolerance_m <= 1.0 && tolerance_m < command.standoff_m && ending.reason != StopReason::Lost {
            let values = [tolerance_m, command.tolerance_m].map(number);
            all.push(changed(command, "tolerance_m", values, |c| c.tolerance_m = tolerance_m));
        }
        let others = [NavigatorKind::Gestalt, NavigatorKind::Morphin, NavigatorKind::Arcs];
        for other in
            others.into_iter().filter(|other| command.navigator.needs_map() && *other != command.navigator)
        {
            let values = [other, command.navigator].map(|navigator| navigator.name().to_owned());
            all.push(changed(command, "navigator", values, |c| c.navigator = other));
        }
        all
    }

    /// The change with its decision; `None` if the reason of the ending stays the same.
    fn verified(&self, ending: &Ending, (text, command): (String, DriveCommand)) -> Option<DecisionChange> {
        command.validate().ok()?;
        let decided = self.decide(&command)?;
        let reason = decided.ending.as_ref().map(|ending| ending.reason);
        if reason == Some(ending.reason) {
            return None;
        }
        let decision = match (&decided.motion, reason) {
            (_, Some(reason)) => reason.word().to_owned(),
            (Some(next), None) => format!("the drive goes on: {}", motion(next)),
            (None, None) => "the drive goes on".to_owned(),
        };
        Some(DecisionChange { text, decision, command: Some(command) })
    }

    /// The decision at the last stop under another command.
    fn decide(&self, command: &DriveCommand) -> Option<Cycle> {
        let last = self.steps.len() - 1;
        let input = CycleInput {
            command,
            navigator: &*command.navigator.navigator(),
            first: self.steps.first()?,
            last: self.steps.get(last)?,
            before: last.checked_sub(1).and_then(|before| self.cycles.get(before)),
            hazards: self.hazards.last().map(|hazards| &**hazards),
        };
        Some(executive::decide(self.stops, &input))
    }

    /// Changes of limits of the hazard map that open paths.
    pub(super) fn of_limits(&self) -> Vec<DecisionChange> {
        let preset = match self.command.navigator {
            NavigatorKind::Arcs => return Vec::new(),
            NavigatorKind::Gestalt => NavigatorPreset::Gestalt,
            NavigatorKind::Morphin => NavigatorPreset::Morphin,
        };
        let Some(last) = self.cycles.last() else { return Vec::new() };
        let choice = last.choice.as_ref().filter(|choice| has_no_arc(choice));
        let (Some(choice), Some(hazards)) = (choice, self.hazards.last()) else { return Vec::new() };
        let site_from_rover = self.stops.site_from_rover(last.step);
        let input = PathInput {
            goal_m: last.goal.in_rover_m,
            step_m: 0.0,
            before: None,
            map: Some(&hazards.map),
            site_from_rover: &site_from_rover,
        };
        let settings = HazardNavigator { settings: preset.settings() }.settings;
        counterfactual(choice, &input, &settings, None)
            .into_iter()
            .map(|change| DecisionChange {
                text: format!("{} {} ({})", change.setting, number(change.setting_value), change.sentence()),
                decision: format!("{} safe paths", change.opens.len()),
                command: None,
            })
            .collect()
    }
}

/// Changes of the fields whose check ended the drive.
fn of_reason(command: &DriveCommand, ending: &Ending) -> Vec<(String, DriveCommand)> {
    let with_number = |name: &str, values: [f64; 2], change: &dyn Fn(&mut DriveCommand)| {
        changed(command, name, values.map(number), change)
    };
    match (ending.reason, ending.value) {
        (StopReason::Slip, Some(slip)) => {
            let new = raised(slip, 0.05);
            let mut all = vec![with_number("slip_max", [new, command.slip_max], &|c| c.slip_max = new)];
            if command.slip_check == SlipCheck::Command {
                let values = ["wheels", "command"].map(str::to_owned);
                all.push(changed(command, "slip_check", values, |c| c.slip_check = SlipCheck::Wheels));
            }
            all
        }
        (StopReason::OdometryRefused, _) => {
            let old = command.refusals_max.map_or_else(|| "none".to_owned(), |most| most.to_string());
            vec![changed(command, "refusals_max", ["none".to_owned(), old], |c| c.refusals_max = None)]
        }
        (StopReason::Tilt, Some(tilt_deg)) => {
            let new = raised(tilt_deg, 1.0);
            vec![with_number("tilt_max_deg", [new, command.tilt_max_deg], &|c| c.tilt_max_deg = new)]
        }
        (StopReason::Time, Some(minutes)) => {
            let new = raised(minutes, 10.0);
            let values = [new, command.flight_minutes_max];
            vec![with_number("flight_minutes_max", values, &|c| c.flight_minutes_max = new)]
        }
        (StopReason::StopLimit, _) => {
            let new = (command.stops_max + 50).min(1000);
            let values = [new, command.stops_max].map(f64::from);
            vec![with_number("stops_max", values, &|c| c.stops_max = new)]
        }
        (StopReason::Lost, _) => {
            let values = ["fixed", "follows_target"].map(str::to_owned);
            vec![changed(command, "goal", values, |c| c.goal = GoalRule::Fixed)]
        }
        _ => Vec::new(),
    }
}

/// A change of one field, with its new and current value in words.
fn changed(
    command: &DriveCommand,
    name: &str,
    [new, old]: [String; 2],
    change: impl FnOnce(&mut DriveCommand),
) -> (String, DriveCommand) {
    let mut changed = command.clone();
    change(&mut changed);
    (format!("{name} {new} instead of {old}"), changed)
}

/// The next multiple of `step` above `value`.
fn raised(value: f64, step: f64) -> f64 {
    ((value / step).floor() + 1.0) * step
}
