//! A commanded drive that is paused between two stages of a stop.

use serde_json::{Value, json};
use sightline_api::event::Event;
use sightline_session::driving::Steering;
use sightline_session::step::RunStep;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::trace::StepKind;

use super::Shown;
use super::fixture::{self, trace};
use crate::cache::{ImageSide, Key, Slot};
use crate::command::{Command, Stage};
use crate::driving::{DrivingCommand, panel};
use crate::net::request::Request;
use crate::panels::bars;
use crate::panels::pane::Pane;
use crate::state::State;

/// The stop at which the drive is paused: its last one.
const STOP: usize = 3;

/// The record of the stop's step, paused before a stage.
fn begun(before: CycleStage) -> RunStep {
    let whole = trace(STOP).trace;
    let StepKind::Tracked { predict, capture, locate, judge } = whole.kind.clone() else {
        panic!("a tracked step")
    };
    let reached = |stage| before > stage;
    let kind = StepKind::Begun {
        predict,
        is_mast_pointed: reached(CycleStage::PointMast),
        capture: reached(CycleStage::Capture).then_some(capture),
        locate: reached(CycleStage::Locate).then_some(locate),
        judge: reached(CycleStage::Judge).then_some(judge),
    };
    let mut begun = RunStep { trace: whole, truth: None, odometry: None, took: Default::default() };
    begun.trace.kind = kind;
    begun
}

/// A drive whose rover is at its last stop, paused there before a stage.
fn paused(context: &egui::Context, before: CycleStage) -> State {
    let mut state = fixture::at_step(context, STOP);
    let steering = json!({ "target": 0, "run": 0 });
    let whole = before > CycleStage::Update;
    if let (Some(session), Some(traverse)) = (&mut state.session, &mut state.traverse) {
        traverse.stops.truncate(STOP + 1);
        session.stop_count = STOP + 1;
        session.steering = Some(serde_json::from_value::<Steering>(steering.clone()).unwrap());
        let run = &mut session.targets[0].runs[0];
        run.rows.truncate(STOP);
        match before {
            CycleStage::Predict => {}
            _ if whole => run.rows.push(trace(STOP).row()),
            _ => run.rows.push(begun(before).row()),
        }
    }
    match before {
        CycleStage::Predict => state.cache.forget(|key| matches!(key, Key::Trace(_) | Key::Arrays(_))),
        _ if whole => {}
        _ => fixture::load(&mut state, begun(before)),
    }
    let cycles: Vec<Value> =
        (0..STOP + usize::from(before > CycleStage::SetGoal)).map(fixture::cycle).collect();
    let paused = json!({ "stop": STOP, "before": before.word() });
    let view = json!({ "steering": steering, "cycles": cycles, "summary": null, "is_driving": false, "paused": paused });
    state.driving.view = Some(("s1".to_owned(), serde_json::from_value(view).unwrap()));
    state
}

fn bodies(state: &mut State) -> Vec<Value> {
    let calls = state.take_requests().into_iter().filter_map(|request| match request {
        Request::Call { call, .. } if call.path.ends_with("/drive") => call.body,
        _ => None,
    });
    calls.map(|body| serde_json::from_slice(&body).unwrap()).collect()
}

#[test]
fn the_stage_bar_shows_the_pause_and_the_stages_of_the_drive() {
    let bar = |before| Shown::new([1200.0, 60.0], move |context| paused(context, before), bars::stages);
    for before in CycleStage::ALL {
        bar(before).says(&format!("paused before {}", before.word()));
    }
    assert_eq!(bar(CycleStage::Judge).click("set_goal"), vec![Command::SelectStage(Stage::SET_GOAL)]);
    let replayed = Shown::new([1200.0, 60.0], |context| fixture::at_step(context, STOP), bars::stages);
    replayed.says("judge").hides("set_goal").hides("paused before");
}

#[test]
fn the_inspector_shows_what_exists_and_says_why_the_rest_does_not() {
    let inspector = |before, stage: Stage| {
        let make = move |context: &egui::Context| {
            let mut state = paused(context, before);
            state.perform(Command::SelectStage(stage));
            state
        };
        Shown::new([500.0, 500.0], make, |ui, state, out| {
            super::show_pane(ui, Pane::Inspector, state, out);
        })
    };
    let reason = "Not computed yet: the drive is paused before `judge`";
    inspector(CycleStage::Judge, Stage::CAPTURE).says("subframe").hides(reason);
    for stage in [Stage::JUDGE, Stage::UPDATE, Stage::SET_GOAL, Stage::SELECT_PATH, Stage::DRIVE] {
        inspector(CycleStage::Judge, stage).says(reason);
    }
    inspector(CycleStage::Predict, Stage::PREDICT).says("paused before `predict`");
    inspector(CycleStage::SelectPath, Stage::SET_GOAL).says("ahead of the rover").says("3.250 m");
    inspector(CycleStage::SelectPath, Stage::SELECT_PATH).says("paused before `select_path`");
    inspector(CycleStage::Drive, Stage::SELECT_PATH).says("radius 16 m right");
    inspector(CycleStage::Drive, Stage::DRIVE).says("paused before `drive`");
}

#[test]
fn images_that_are_not_taken_are_not_asked_for_and_their_panel_says_why() {
    let context = egui::Context::default();
    for (before, is_taken) in
        [(CycleStage::Predict, false), (CycleStage::Capture, false), (CycleStage::Locate, true)]
    {
        let state = paused(&context, before);
        let left = state.image_key(STOP, ImageSide::Left).unwrap();
        assert_eq!(state.needed_items().contains(&left), is_taken, "{}", before.word());
    }
    let panel = Shown::new(
        [500.0, 400.0],
        |context| paused(context, CycleStage::Capture),
        |ui, state, out| {
            super::show_pane(ui, Pane::Left, state, out);
        },
    );
    panel.says("the drive is paused before `capture`").says("is not taken yet");
}

#[test]
fn a_step_that_goes_on_replaces_its_row_and_its_record() {
    let context = egui::Context::default();
    let mut state = paused(&context, CycleStage::Judge);
    let _ = state.take_requests();
    assert!(!state.is_running(), "a run that waits with its drive is not computed");
    state.apply_event(Event::RunProgress {
        session: "s1".to_owned(),
        target: 0,
        run: 0,
        k: STOP + 1,
        n: STOP + 1,
        ended: true,
        doing: "done".to_owned(),
    });
    let asked = state.take_requests().into_iter().any(|request| {
        matches!(request, Request::Call { call, .. } if call.path.contains(&format!("from_row={STOP}")))
    });
    assert!(asked, "the row of the paused step is read again");
    let tail = |row| {
        let mut tail = paused(&context, CycleStage::Judge).run().unwrap().clone();
        tail.rows = vec![row];
        tail
    };
    state.on_rows_reply("s1", 0, STOP, tail(begun(CycleStage::Judge).row()));
    assert!(matches!(state.trace_at(STOP), Slot::Ready(_)), "nothing has changed");
    state.on_rows_reply("s1", 0, STOP, tail(trace(STOP).row()));
    assert_eq!(state.run().unwrap().rows.len(), STOP + 1);
    assert!(matches!(state.trace_at(STOP), Slot::Absent), "the record is older than the row");
    let key = state.step_key(STOP).unwrap();
    assert!(
        state.needed_items().contains(&Key::Trace(key.clone()))
            && state.needed_items().contains(&Key::Arrays(key))
    );
}

#[test]
fn the_panel_continues_to_the_chosen_stage_and_steps_by_one() {
    let mut shown = Shown::new([700.0, 500.0], |context| paused(context, CycleStage::Judge), panel::show);
    shown.says("paused at stop 3: after locate, before judge");
    assert_eq!(shown.click("Next stage"), vec![Command::Drive(DrivingCommand::NextStage)]);
    assert_eq!(shown.click("Continue"), vec![Command::Drive(DrivingCommand::Continue)]);

    let sent = |command: DrivingCommand, change: fn(&mut State)| {
        let mut state = paused(&egui::Context::default(), CycleStage::Judge);
        change(&mut state);
        let _ = state.take_requests();
        state.perform(Command::Drive(command));
        let body = bodies(&mut state).pop().unwrap();
        (body["pause_at"].clone(), body["pause"].clone())
    };
    let before = |stage: &str| json!({ "when": "before", "stage": stage });
    assert_eq!(sent(DrivingCommand::NextStage, |_| ()), (json!(STOP), before("update")));
    assert_eq!(sent(DrivingCommand::Continue, |_| ()), (json!(STOP), Value::Null), "before `drive`");
    assert_eq!(
        sent(DrivingCommand::Continue, |state| state.driving.pause.pause.stage = CycleStage::Locate),
        (json!(STOP + 1), before("locate"))
    );
    let once = |state: &mut State| {
        state.driving.pause.pause.stage = CycleStage::Locate;
        state.driving.pause.is_every_stop = false;
    };
    assert_eq!(sent(DrivingCommand::Continue, once), (Value::Null, Value::Null), "it drives on");
}
