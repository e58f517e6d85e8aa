//! A drive to several targets: those to visit afterwards, and the outcomes of the visits.

use egui::{Label, RichText, Ui};
use sightline_rover::driving::{Cycle, StopReason};
use sightline_session::driving::DriveView;
use sightline_session::visits::Visit;

use crate::command::Command;
use crate::driving::DrivingCommand;
use crate::panels::numbers::fixed;
use crate::state::State;
use crate::theme;

/// Shows a check box for each target that can be visited after the current one; they are visited in the order of checking.
pub(super) fn form(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(session) = &state.session else { return };
    let driver = state.drive().and_then(|drive| drive.steering.as_ref()).map(|steering| steering.target);
    let first = driver.or(state.cursor.target);
    let others: Vec<_> = session.targets.iter().filter(|target| Some(target.number) != first).collect();
    if others.is_empty() {
        return;
    }
    let mut then = state.driving.then.clone();
    ui.horizontal_wrapped(|ui| {
        ui.label(theme::label("then visit"));
        for target in others {
            let place = then.iter().position(|number| *number == target.number);
            let name = match place {
                Some(place) => format!("{} ({})", target.label, place + 2),
                None => target.label.clone(),
            };
            let mut is_visited = place.is_some();
            let help = "The rover drives to it afterwards; the number is its place in the order. It is tracked meanwhile where it is in \
                        view, and the mast looks at it at intervals. A target that is lost or cannot be reached is dropped.";
            let shown = ui.checkbox(&mut is_visited, name).on_hover_text(help);
            if shown.accessible_name(format!("then visit {}", target.label)).changed() {
                then.retain(|number| *number != target.number);
                if is_visited {
                    then.push(target.number);
                }
            }
        }
    });
    if !then.is_empty() {
        let mut command = state.driving.command.clone();
        let help = "The mast looks at a waiting target, at an extra stop, once the rover has moved by the longest step (as a part of the \
                    distance to that target) since it was last in view. Otherwise a target that is out of view is carried by the pose \
                    estimate alone.";
        let shown = ui.checkbox(&mut command.look_at_waiting, "look at the waiting targets");
        if shown.on_hover_text(help).changed() {
            out.push(Command::Drive(DrivingCommand::Form(command)));
        }
    }
    if then != state.driving.then {
        out.push(Command::Drive(DrivingCommand::Then(then)));
    }
}

/// The action of the mast after a decision without a motion.
pub(super) fn mast_action(state: &State, cycle: &Cycle) -> String {
    let targets = state.session.iter().flat_map(|session| &session.targets);
    let is_it = |designation| targets.into_iter().find(|target| target.designation == designation);
    match cycle.looks_at.map(is_it) {
        None => "looks again".to_owned(),
        Some(None) => "looks at a waiting target".to_owned(),
        Some(Some(target)) => format!("looks at {}", target.label),
    }
}

/// Shows one line per completed visit, and the remaining targets.
pub(super) fn list(ui: &mut Ui, state: &State, drive: &DriveView) {
    let label = |number: usize| {
        let targets = state.session.iter().flat_map(|session| &session.targets);
        let found = targets.into_iter().find(|target| target.number == number);
        found.map_or_else(|| format!("target {}", number + 1), |target| target.label.clone())
    };
    for visit in &drive.visits {
        let colour = theme::verdict(visit.reason == StopReason::Arrived);
        let text = RichText::new(sentence(&label(visit.target), visit)).color(colour).small();
        ui.add(Label::new(text).wrap());
    }
    let Some(steering) = drive.steering.as_ref().filter(|_| !drive.visits.is_empty()) else { return };
    if drive.visits.iter().all(|visit| visit.target != steering.target) {
        let mut words = format!("now: {}", label(steering.target));
        if !steering.then.is_empty() {
            let left: Vec<String> = steering.then.iter().map(|number| label(*number)).collect();
            words += &format!("; then {}", left.join(", "));
        }
        ui.add(Label::new(theme::note(words)).wrap());
    }
}

/// The outcome of a visit.
fn sentence(label: &str, visit: &Visit) -> String {
    let reason = match visit.reason {
        StopReason::Arrived => "arrived".to_owned(),
        other => format!("dropped, {}", other.word()),
    };
    let mut words = format!("{label}: {reason} at stop {}", visit.until);
    if let Some(why) = &visit.why {
        words += &format!(". {}", why.sentence);
    }
    if visit.reason == StopReason::Arrived
        && let (Some(target_m), Some(goal_m)) = (visit.target_error_m, visit.goal_error_m)
    {
        let [target, goal] = [target_m, goal_m].map(|error_m| fixed(100.0 * error_m, 1));
        words += &format!("; by the truth: target error {target} cm, goal error {goal} cm");
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_visit_says_whether_the_target_was_reached() {
        let visit = |reason| Visit {
            target: 1,
            since: 4,
            until: 9,
            reason,
            detail: None,
            why: None,
            target_error_m: Some(0.004),
            goal_error_m: Some(0.012),
        };
        let arrived = sentence("flat rock", &visit(StopReason::Arrived));
        assert_eq!(
            arrived,
            "flat rock: arrived at stop 9; by the truth: target error 0.4 cm, goal error 1.2 cm"
        );
        assert_eq!(
            sentence("flat rock", &visit(StopReason::Lost)),
            "flat rock: dropped, target lost at stop 9"
        );
        let why = serde_json::json!({ "step": 9, "reason": "lost", "cause": null, "sentence": "The target was lost at stop 7: hidden.",
            "evidence": [], "changes": [] });
        let lost = Visit { why: Some(serde_json::from_value(why).unwrap()), ..visit(StopReason::Lost) };
        assert_eq!(
            sentence("flat rock", &lost),
            "flat rock: dropped, target lost at stop 9. The target was lost at stop 7: hidden."
        );
    }
}
