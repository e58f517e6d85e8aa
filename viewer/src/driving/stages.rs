//! The record of the stages that only a commanded drive has: the goal, the chosen motion, and the report of the drive.

use egui::{Grid, Label, ScrollArea, Ui};
use sightline_rover::driving::{Cycle, Motion};

use crate::command::Stage;
use crate::driving::{paths, pause, visits, words};
use crate::panels::{self, digits};
use crate::state::{State, run_letter};
use crate::theme;

/// Shows the record of the selected stage at the cursor's stop, or why there is none.
pub(crate) fn show(ui: &mut Ui, state: &State) {
    let (stage, step) = (state.stage(), state.cursor.step);
    let rows = match state.cycle_at(step).filter(|_| state.is_decided(stage)) {
        Some(cycle) => record(state, cycle, stage),
        None => {
            panels::missing(ui, "", &missing(state, stage));
            return;
        }
    };
    ScrollArea::vertical().auto_shrink(false).id_salt(stage).show(ui, |ui| {
        Grid::new("stage of the drive").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
            for (name, value) in rows {
                ui.label(theme::label(name).size(12.0));
                ui.label(theme::number(value));
                ui.end_row();
            }
        });
        if let Some(choice) = state.cycle_at(step).and_then(|cycle| cycle.choice.as_ref())
            && stage == Stage::SELECT_PATH
        {
            paths::table(ui, choice);
        }
        let driver = state.drive().and_then(|drive| drive.steering.as_ref());
        if let Some(driver) = driver.filter(|driver| driver.run != state.cursor.run) {
            let sentence = format!("Driven by the estimates of run {}.", run_letter(driver.run));
            ui.add(Label::new(theme::note(sentence)).wrap());
        }
    });
}

/// Why a stage of the drive has no record at the cursor's stop.
fn missing(state: &State, stage: Stage) -> String {
    let step = state.cursor.step;
    if let Some(before) = state.paused_before(step) {
        return pause::not_computed(before);
    }
    match state.cycle_at(step) {
        Some(cycle) if stage == Stage::DRIVE => match (cycle.ending.as_ref(), cycle.motion) {
            (Some(ending), _) => format!("The rover did not drive from here: {}.", words::ending(ending)),
            (None, None) => "The rover stays here for another pair of images.".to_owned(),
            (None, Some(_)) => "The rover has not driven from here yet.".to_owned(),
        },
        _ if state.drive().is_none() => "Reading the drive …".to_owned(),
        _ => format!("Step {step} is not computed yet, so that there is no decision at this stop."),
    }
}

/// The values of a stage: name, and value with unit.
fn record(state: &State, cycle: &Cycle, stage: Stage) -> Vec<(&'static str, String)> {
    match stage {
        Stage::SET_GOAL => goal(cycle),
        Stage::SELECT_PATH => motion(state, cycle),
        _ => report(cycle),
    }
}

fn goal(cycle: &Cycle) -> Vec<(&'static str, String)> {
    let metres = |value: f64| format!("{} m", digits(value));
    let ([north, east], [ahead, right]) = (cycle.goal.in_site_m, cycle.goal.in_rover_m);
    vec![
        ("goal, north", metres(north)),
        ("goal, east", metres(east)),
        ("ahead of the rover", metres(ahead)),
        ("to the right of the rover", metres(right)),
        ("distance", metres(cycle.goal.distance_m)),
        ("arrived", if cycle.goal.arrived { "yes" } else { "no" }.to_owned()),
    ]
}

fn motion(state: &State, cycle: &Cycle) -> Vec<(&'static str, String)> {
    let mut rows = match (&cycle.motion, &cycle.ending) {
        (Some(motion), _) => vec![("motion", words::motion(motion))],
        (None, Some(ending)) => vec![("the drive ends", words::ending(ending))],
        (None, None) => vec![("motion", format!("none: the rover {}", visits::mast_action(state, cycle)))],
    };
    match cycle.motion {
        Some(Motion::Arc { length_m, curvature_per_m }) => {
            rows.push(("length of the arc", format!("{} m", digits(length_m))));
            rows.push(("curvature, positive to the right", format!("{} 1/m", digits(curvature_per_m))));
        }
        Some(Motion::Turn { angle_rad }) => {
            rows.push(("angle, positive to the right", format!("{}°", digits(angle_rad.to_degrees()))));
        }
        None => {}
    }
    rows
}

fn report(cycle: &Cycle) -> Vec<(&'static str, String)> {
    let Some(report) = cycle.report else { return Vec::new() };
    let stall = match report.stall {
        Some(stall) => format!("after {} % of the motion", digits(100.0 * stall.completed)),
        None => "no".to_owned(),
    };
    vec![
        ("path of the wheels", format!("{} m", digits(report.wheels_m))),
        ("duration", format!("{} s", digits(report.duration_s))),
        ("tilt at the end", format!("{}°", digits(report.tilt_deg))),
        ("a wheel stalled", stall),
        ("time on Mars so far", format!("{} min", digits(cycle.flight_minutes))),
    ]
}
