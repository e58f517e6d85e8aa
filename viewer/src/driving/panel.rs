//! The panel “Drive”: the command, the buttons to drive, and the decision at every stop.

use egui::{Button, CollapsingHeader, ComboBox, DragValue, Grid, Label, Response, RichText, ScrollArea, Ui};
use sightline_rover::driving::{
    ArrivalAction, DriveCommand, GoalRule, NavigatorKind, OdometryPair, SlipCheck, StopReason, TrackedStops,
};
use sightline_rover::visual_odometry::{OdometryMode, OdometryPreset};
use sightline_session::driving::DriveView;
use sightline_session::pause::PauseSide;
use sightline_track::cycle_stage::CycleStage;

use crate::command::{Command, Go};
use crate::driving::{DrivingCommand, faults, map_pairs, motions, pause, visits, why, words};
use crate::panels::digits;
use crate::panels::panel::Panel;
use crate::state::{State, run_letter};
use crate::{panels, theme};

/// Initial limit of refused motions in the form.
const REFUSALS: u32 = 3;

/// The panel “Drive”.
pub(crate) struct Drive;

impl Panel for Drive {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.run().is_none().then(|| state.missing_target())
    }
}

/// Shows command, buttons and decisions.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        form(ui, state, out);
        visits::form(ui, state, out);
        match state.drive().filter(|_| state.is_on_commands()) {
            Some(drive) => {
                pause_form(ui, state, out);
                buttons(ui, state, drive, out);
                standing(ui, drive);
                visits::list(ui, state, drive);
                faults::list(ui, &drive.faults);
                faults::form(ui, state, out);
                if let Some(why) = &drive.why {
                    why::headline(ui, why, out);
                }
                decisions(ui, state, drive, out);
            }
            None if state.is_on_commands() => {
                ui.label(theme::note("Reading the drive …"));
            }
            None => {
                begin(ui, state, out);
                faults::form(ui, state, out);
            }
        }
    });
}

/// Shows the form of the command.
fn form(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut command = state.driving.command.clone();
    ui.horizontal_wrapped(|ui| {
        number(
            ui,
            "standoff",
            " m",
            &mut command.standoff_m,
            (0.3, 50.0),
            "Horizontal distance of the goal from the target",
        );
        number(
            ui,
            "tolerance",
            " m",
            &mut command.tolerance_m,
            (0.001, 1.0),
            "Distance from the goal at which the rover has arrived",
        );
        let mut percent = 100.0 * command.step_fraction;
        number(
            ui,
            "step",
            " %",
            &mut percent,
            (1.0, 50.0),
            "Longest step, as a fraction of the distance to the target",
        );
        if percent != 100.0 * command.step_fraction {
            command.step_fraction = percent / 100.0;
        }
        let rule = |rule| match rule {
            GoalRule::FollowsTarget => "goal follows the target",
            GoalRule::Fixed => "goal stays where it was",
        };
        let rules = [GoalRule::FollowsTarget, GoalRule::Fixed];
        choice(ui, "goal", 150.0, rules, &mut command.goal, rule);
        let modes = [OdometryMode::Off, OdometryMode::SlipCheck, OdometryMode::Full];
        choice(ui, "visual odometry", 160.0, modes, &mut command.odometry, words::odometry);
        let navigators = [NavigatorKind::Arcs, NavigatorKind::Gestalt, NavigatorKind::Morphin];
        let help = "Selects the motions. Hazard avoidance needs a pair of hazcams at every stop.";
        let shown = choice(ui, "navigator", 170.0, navigators, &mut command.navigator, words::navigator);
        shown.on_hover_text(help);
    });
    CollapsingHeader::new(theme::label("tracked stops, odometry, offset, limits"))
        .id_salt("drive limits")
        .show(ui, |ui| {
            limits(ui, state, &mut command);
        });
    if command != state.driving.command {
        out.push(Command::Drive(DrivingCommand::Form(command)));
    }
}

fn limits(ui: &mut Ui, state: &State, command: &mut DriveCommand) {
    ui.horizontal_wrapped(|ui| {
        let [north, east] = &mut command.offset_m;
        number(ui, "offset north", " m", north, (-20.0, 20.0), "Added to the goal");
        number(ui, "offset east", " m", east, (-20.0, 20.0), "Added to the goal");
        let stops = DragValue::new(&mut command.stops_max).range(2..=1000).prefix("stops ");
        ui.add(stops).accessible_name("stops").on_hover_text("Maximum number of stops, including the first");
        arrival(ui, command);
        motions::field(ui, command);
        let presets = [OdometryPreset::Sightline, OdometryPreset::Mer2007];
        let pairs = [OdometryPair::Shared, OdometryPair::Own];
        let stops = [TrackedStops::Every, TrackedStops::ByDistance];
        let help = "The stops at which the tracker looks for the target. Visual odometry needs steps of at most 0.75 m; at the \
                    stops in between it can run alone.";
        let shown = choice(ui, "tracked stops", 170.0, stops, &mut command.tracked_stops, words::tracked_stops);
        shown.on_hover_text(help);
        let help = "The stereo pairs in which visual odometry measures the motion";
        let shown = choice(ui, "odometry pairs", 190.0, pairs, &mut command.odometry_pair, words::odometry_pair);
        shown.on_hover_text(help);
        let help = "The settings of visual odometry: ours, or those flown on the rovers in 2007";
        let shown = choice(ui, "odometry preset", 170.0, presets, &mut command.odometry_preset, words::preset);
        shown.on_hover_text(help);
        let mut percent = 100.0 * command.slip_max;
        let help = "Largest slip of a step, by vision; the drive stops where it is exceeded";
        number(ui, "slip", " %", &mut percent, (5.0, 200.0), help);
        if percent != 100.0 * command.slip_max {
            command.slip_max = percent / 100.0;
        }
        let of = |check| match check {
            SlipCheck::Wheels => "slip of what the wheels drove",
            SlipCheck::Command => "slip of the whole command",
        };
        let help = "The motion that the slip is a part of: they differ where the time ends a motion early";
        let checks = [SlipCheck::Wheels, SlipCheck::Command];
        choice(ui, "slip check", 190.0, checks, &mut command.slip_check, of).on_hover_text(help);
        refusals(ui, command);
        number(ui, "tilt", "°", &mut command.tilt_max_deg, (1.0, 45.0), "Largest tilt after a step");
        let help = "Hazards nearer to the target than this are ignored, so that a large rock can be approached";
        number(ui, "exemption", " m", &mut command.exemption_radius_m, (0.0, 5.0), help);
        map_pairs::field(ui, state, command);
        number(ui, "time", " min", &mut command.flight_minutes_max, (1.0, 10_000.0), "Time on Mars");
    });
}

/// Shows the actions after arrival, in this order: an approach, looks, and the hand-off.
fn arrival(ui: &mut Ui, command: &mut DriveCommand) {
    let has = |action| command.on_arrival.contains(&action);
    let mut looks = command.on_arrival.iter().filter(|action| **action == ArrivalAction::Look).count();
    let (mut approaches, mut hands_off) = (has(ArrivalAction::Approach), has(ArrivalAction::HandOff));
    let before = (approaches, looks, hands_off);
    ui.checkbox(&mut approaches, "approach on arrival").on_hover_text(
        "Drives on from the goal to the final standoff, where the arm reaches the target: by arcs, if nothing high is under the rover on the way",
    );
    if approaches {
        let help = "Horizontal distance of the rover from the target after the approach";
        number(ui, "final standoff", " m", &mut command.final_standoff_m, (0.3, 50.0), help);
    }
    let drag = DragValue::new(&mut looks).range(0..=8).prefix("looks on arrival ");
    let help = "Stops at the goal at which the mast is pointed at the target again and another pair is taken";
    ui.add(drag).accessible_name("looks on arrival").on_hover_text(help);
    ui.checkbox(&mut hands_off, "hand off on arrival").on_hover_text(
        "Locates the target in the pair of hazcams, near the arm, after the looks. The configuration combined registers the \
         surface there; it needs hazcams at every stop.",
    );
    if hands_off && !before.2 {
        // Registration works best with the mesh of a look.
        looks = looks.max(1);
    }
    if (approaches, looks, hands_off) != before {
        command.on_arrival = approaches.then_some(ArrivalAction::Approach).into_iter().collect();
        command.on_arrival.extend(vec![ArrivalAction::Look; looks]);
        command.on_arrival.extend(hands_off.then_some(ArrivalAction::HandOff));
    }
}

/// Shows whether refused motions end the drive, and the maximum number in a row.
fn refusals(ui: &mut Ui, command: &mut DriveCommand) {
    let mut ends = command.refusals_max.is_some();
    ui.checkbox(&mut ends, "stop when odometry refuses").on_hover_text(
        "The drive stops when visual odometry has refused more motions in a row than this; otherwise it goes on by wheels and gyro",
    );
    if ends != command.refusals_max.is_some() {
        command.refusals_max = ends.then_some(REFUSALS);
    }
    if let Some(most) = &mut command.refusals_max {
        let drag = DragValue::new(most).range(0..=1000).prefix("refusals ");
        ui.add(drag).accessible_name("refusals").on_hover_text("Largest number of refused motions in a row");
    }
}

fn number(ui: &mut Ui, name: &str, unit: &str, value: &mut f64, (low, high): (f64, f64), help: &str) {
    let drag = DragValue::new(value).range(low..=high).speed(0.01).max_decimals(3);
    ui.add(drag.prefix(format!("{name} ")).suffix(unit)).accessible_name(name).on_hover_text(help);
}

/// Shows the button that starts a drive, or why none can be started.
fn begin(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let is_simulated = state.traverse.as_ref().is_some_and(|traverse| traverse.simulated);
    if !is_simulated {
        let sentence = "This drive was recorded: the rover cannot be sent anywhere else. Open a scenario to drive in it.";
        ui.add(Label::new(RichText::new(sentence).color(theme::lost())).wrap());
        return;
    }
    let run = run_letter(state.cursor.run);
    if ui
        .button("Drive")
        .on_hover_text("Begins a drive from the first stop, in a session of its own")
        .clicked()
    {
        out.push(Command::Drive(DrivingCommand::Begin));
    }
    let sentence = format!(
        "This session replays a drive that was planned beforehand. “Drive” sends the rover from the first stop towards the target \
         on the estimates of run {run}."
    );
    ui.add(Label::new(theme::note(sentence)).wrap());
}

/// Shows the choice of the pause: side, stage, and stops.
fn pause_form(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut form = state.driving.pause;
    ui.horizontal_wrapped(|ui| {
        ui.label(theme::label("pause"));
        let side = |side| if side == PauseSide::Before { "before" } else { "after" };
        let sides = [PauseSide::Before, PauseSide::After];
        choice(ui, "pause before or after", 60.0, sides, &mut form.pause.when, side);
        choice(ui, "stage of the pause", 100.0, CycleStage::ALL, &mut form.pause.stage, CycleStage::word);
        let stops = |is_every| if is_every { "at every stop" } else { "at this stop only" };
        choice(ui, "stops of the pause", 120.0, [true, false], &mut form.is_every_stop, stops);
    });
    if form != state.driving.pause {
        out.push(Command::Drive(DrivingCommand::PauseForm(form)));
    }
}

/// Shows a combo box of values.
fn choice<T: Copy + PartialEq, const N: usize>(
    ui: &mut Ui,
    name: &str,
    width: f32,
    all: [T; N],
    value: &mut T,
    word: impl Fn(T) -> &'static str,
) -> Response {
    let list = ComboBox::from_id_salt(name).width(width).selected_text(word(*value));
    let shown = list.show_ui(ui, |ui| {
        for one in all {
            if panels::entry(ui, *value == one, word(one)).clicked() {
                *value = one;
            }
        }
    });
    shown.response.accessible_name(name)
}

/// Whether the motion at a stop is not chosen yet, because the drive is paused earlier.
fn is_undecided(drive: &DriveView, step: usize) -> bool {
    drive.paused.is_some_and(|halt| halt.stop == step && halt.before <= CycleStage::SelectPath)
}

/// Shows the buttons of a drive.
fn buttons(ui: &mut Ui, state: &State, drive: &DriveView, out: &mut Vec<Command>) {
    let has_ended = drive.cycles.last().is_some_and(|cycle| cycle.ending.is_some());
    let is_driver = drive.steering.as_ref().is_some_and(|steering| {
        state.cursor.target == Some(steering.target) && state.cursor.run == steering.run
    });
    let is_other_command = drive.steering.as_ref().is_some_and(|steering| {
        // The server adds the waiting targets to the command.
        let waiting = steering.command.waiting.clone();
        let form = DriveCommand { waiting, ..state.driving.command.clone() };
        steering.command != form || steering.then != state.driving.then
    });
    ui.horizontal_wrapped(|ui| {
        let mut button = |name: &str, is_on: bool, help: &str, command: DrivingCommand| {
            if ui.add_enabled(is_on, Button::new(name)).on_hover_text(help).clicked() {
                out.push(Command::Drive(command));
            }
        };
        if drive.is_driving {
            button(
                "Pause",
                true,
                "The drive waits at the chosen stage of the present stop, or of the next one that it comes to",
                DrivingCommand::Pause,
            );
        } else {
            let is_paused = drive.paused.is_some();
            button("Continue", is_paused, "Goes on to the chosen pause; without one ahead it drives on", DrivingCommand::Continue);
            button("Next stage", is_paused, "Computes the next stage and waits after it", DrivingCommand::NextStage);
            let goes_on = !has_ended || is_other_command || !is_driver;
            let name = if is_driver {
                "Drive on".to_owned()
            } else {
                format!("Drive on with run {}", run_letter(state.cursor.run))
            };
            button(&name, goes_on, "Drives on from the last stop under this command", DrivingCommand::GoOn);
            button("One stop", goes_on, "Drives to the next stop and waits there", DrivingCommand::OneStop);
        }
        let branch = format!("Branch at stop {}", state.cursor.step);
        button(
            &branch,
            true,
            "Drives from the selected stop, in a world and a session of its own",
            DrivingCommand::Begin,
        );
    });
}

/// Shows the state of the drive.
fn standing(ui: &mut Ui, drive: &DriveView) {
    let ending = drive.cycles.last().and_then(|cycle| cycle.ending.as_ref());
    let (text, colour) = match (ending, drive.is_driving, drive.paused) {
        (Some(ending), ..) => (words::ending(ending), theme::verdict(ending.reason == StopReason::Arrived)),
        (None, true, _) => ("drives".to_owned(), theme::text()),
        (None, false, Some(halt)) => (pause::in_words(halt), theme::accent()),
        (None, false, None) => ("waits".to_owned(), theme::text()),
    };
    ui.add(Label::new(RichText::new(text).color(colour)).wrap());
    if let Some(summary) = &drive.summary {
        ui.add(Label::new(theme::note(words::summary(summary))).wrap());
    }
}

/// Shows the decisions, one line per stop.
fn decisions(ui: &mut Ui, state: &State, drive: &DriveView, out: &mut Vec<Command>) {
    Grid::new("decisions").num_columns(6).striped(true).spacing([12.0, 2.0]).show(ui, |ui| {
        for head in ["stop", "slip on the way", "to the goal", "motion", "reported", "on Mars"] {
            ui.label(theme::note(head));
        }
        ui.end_row();
        for cycle in &drive.cycles {
            let is_here = cycle.step == state.cursor.step;
            if ui.selectable_label(is_here, theme::number(cycle.step.to_string())).clicked() {
                out.push(Command::Go(Go::Step(cycle.step)));
            }
            let measured = state.measured_motion(cycle.step);
            let slip = ui.label(theme::number(measured.map(words::slip).unwrap_or_default()));
            if let Some(refusal) = measured.and_then(|measured| measured.update.refusal()) {
                slip.on_hover_text(refusal);
            }
            ui.label(theme::number(format!("{} m", digits(cycle.goal.distance_m))));
            let motion = match (&cycle.motion, &cycle.ending) {
                (Some(motion), _) => words::motion(motion),
                (None, Some(ending)) => ending.reason.word().to_owned(),
                (None, None) if is_undecided(drive, cycle.step) => "not chosen yet".to_owned(),
                (None, None) => visits::mast_action(state, cycle),
            };
            ui.label(theme::label(motion).size(12.0));
            ui.label(theme::number(words::report(cycle)));
            ui.label(theme::number(format!("{} min", digits(cycle.flight_minutes))));
            ui.end_row();
        }
    });
}
