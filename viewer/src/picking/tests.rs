//! Picking: the map is requested and cancelled, its verdicts have words, a position that is not good has alternatives below
//! the image, and keys can do all of it.

use std::rc::Rc;

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use sightline_api::endpoints::{CancelTrackability, DesignateTarget, ShowTrackability};
use sightline_api::event::Event;
use sightline_api::wire::{Designated, Problem};
use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::map::Cell;
use sightline_rover::trackability::{Aspect, MapProgress, TrackabilityMap, Verdict};

use crate::command::keys;
use crate::command::{Command, Layer, Mode};
use crate::panels::images_left;
use crate::panels::pane::Pane;
use crate::picking;
use crate::picking::aim::Aim;
use crate::state::{ImagePosition, Refusal, State};
use crate::tests::calls::{self, bodies, calls_of};
use crate::tests::{Shown, fixture};
use crate::trackability::limits;
use crate::trackability::update::map_call;

const PLACE: Pixel = Pixel::new(20.0, 30.0);
const GOOD: Pixel = Pixel::new(44.0, 36.0);

/// A map of the fixture's image of 64 px: the left half is bad, then a risky column, the rest is good.
fn map(rows_done: usize) -> TrackabilityMap {
    let (columns, rows) = (8, 8);
    let letters: Vec<char> = (0..columns * rows_done)
        .map(|cell| match cell % columns {
            0..4 => Verdict::Bad.letter(),
            4 => Verdict::Risky.letter(),
            _ => Verdict::Good.letter(),
        })
        .collect();
    let edge = Aspect::DepthEdge.letter();
    TrackabilityMap {
        step: 0,
        cell_px: 8,
        columns,
        rows,
        limits: Default::default(),
        template_size_px: 21,
        verdicts: letters.iter().collect(),
        reasons: letters.iter().map(|letter| if *letter == 'g' { '-' } else { edge }).collect(),
        values: letters.iter().map(|letter| (*letter != 'g').then_some(2.0)).collect(),
        ranges_m: vec![Some(6.0); letters.len()],
        longest_steps_m: vec![Some(0.6); letters.len()],
        words: Default::default(),
    }
}

fn progress(k: usize) -> MapProgress {
    MapProgress { k, n: 8, ended: k == 8, failed: None, map: Some(map(k)) }
}

fn requests_map(state: &mut State) -> bool {
    !calls_of::<ShowTrackability>(state).is_empty()
}

fn answer(state: &mut State, progress: &MapProgress) {
    calls::answer::<ShowTrackability>(state, progress);
}

fn picking(context: &egui::Context) -> State {
    let mut state = fixture::at_step(context, 0);
    state.perform(Command::SetMode(Mode::Pick));
    state.take_requests();
    answer(&mut state, &progress(8));
    state
}

fn refused(context: &egui::Context) -> State {
    let mut state = picking(context);
    let place = ImagePosition { step: 0, pixel: PLACE, camera: None };
    state.refusal = Some(Refusal {
        place,
        sentence: "no 3-D position here".to_owned(),
        nearest: Some(GOOD),
        is_advice: false,
    });
    state
}

#[test]
fn the_map_is_asked_for_while_picking_again_with_new_rows_and_given_up_with_the_pick() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    assert!(!requests_map(&mut state), "nobody picks");
    state.perform(Command::SetMode(Mode::Pick));
    assert!(requests_map(&mut state));
    assert!(!requests_map(&mut state), "once");
    answer(&mut state, &progress(3));
    assert_eq!(state.trackability_map().unwrap().rows_done(), 3);
    let rows =
        |step| Event::TrackabilityProgress { traverse: "drive".to_owned(), step, k: 5, n: 8, ended: false };
    state.apply_event(rows(4));
    assert!(!requests_map(&mut state), "another stop");
    state.apply_event(rows(0));
    assert!(requests_map(&mut state));
    answer(&mut state, &progress(5));
    state.perform(Command::SetMode(Mode::Look));
    let cancelled = |state: &mut State| calls_of::<CancelTrackability>(state).len();
    assert_eq!(cancelled(&mut state), 1, "nobody wants the rest");
    assert!(state.trackability_map().is_none());
    // A complete map needs no cancelling.
    let mut state = picking(&egui::Context::default());
    state.apply_event(rows(0));
    assert!(!requests_map(&mut state));
    state.perform(Command::SetMode(Mode::Look));
    assert_eq!(cancelled(&mut state), 0);
}

#[test]
fn without_a_map_picking_works_and_the_panel_says_why_there_is_none() {
    let state = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 0);
        state.perform(Command::SetMode(Mode::Pick));
        state.take_requests();
        let problem = Problem {
            code: "request".to_owned(),
            title: String::new(),
            status: 422,
            detail: "the pair cannot be aligned".to_owned(),
            hint: None,
            nearest_pixel: None,
            received: None,
        };
        calls::refuse::<ShowTrackability>(&mut state, problem);
        assert!(state.messages.newest().is_none(), "it is no problem of the person's");
        state
    };
    Shown::pane(Pane::Left, state);
    let mut state = state(&egui::Context::default());
    assert!(state.trackability.progress.as_ref().unwrap().failed.is_some());
    state.perform(Command::Pick(GOOD));
    assert!(!calls_of::<DesignateTarget>(&mut state).is_empty());
}

#[test]
fn verdict_reason_range_and_longest_step_are_said_in_words_and_the_layer_can_be_switched_off() {
    let map = map(8);
    assert_eq!(
        picking::words(&map.at(PLACE).unwrap()),
        "Poor: depth edge 2 px away · range 6.00 m · step ≤ 0.60 m"
    );
    assert!(picking::words(&map.at(Pixel::new(36.0, 30.0)).unwrap()).starts_with("Risky: depth edge"));
    assert_eq!(picking::words(&map.at(GOOD).unwrap()), "Good · range 6.00 m · step ≤ 0.60 m");
    let mut shown = Shown::new(
        [900.0, 420.0],
        |context| {
            let mut state = picking(context);
            state.perform(Command::Aim(Aim::Put(PLACE)));
            state
        },
        |ui, state, out| {
            images_left::show(ui, state, out);
        },
    );
    shown
        .says("trackability: 38 % good, 12 % risky, 50 % poor")
        .says("at 20.0, 30.0: Poor: depth edge 2 px away");
    for word in ["good (legend)", "risky (legend)", "poor (legend)"] {
        shown.says(word);
    }
    assert_eq!(shown.click("risky (legend)"), vec![Command::ToggleLayer(Layer::Trackability)]);
}

#[test]
fn a_refused_pick_offers_the_nearest_good_pixel_by_button_and_by_enter() {
    let mut shown = Shown::pane(Pane::Left, refused);
    shown.says("No 3-D position here.").hides("Pick anyway");
    assert_eq!(shown.click("Use (44, 36)"), vec![Command::Aim(Aim::TakeNearest)]);
    for aim in [Aim::TakeNearest, Aim::Accept] {
        let mut state = refused(&egui::Context::default());
        state.perform(Command::Aim(aim));
        let picked: Vec<_> = bodies::<DesignateTarget>(&mut state).iter().map(|new| new.pixel).collect();
        assert_eq!(picked, [Some(GOOD)]);
    }
    let mut state = fixture::without_target();
    state.perform(Command::SetMode(Mode::Pick));
    state.perform(Command::Aim(Aim::Accept));
    assert!(state.designating.is_none(), "nothing was aimed at");
}

#[test]
fn the_servers_refusal_brings_the_nearest_good_pixel_along() {
    let mut state = fixture::without_target();
    state.perform(Command::SetMode(Mode::Pick));
    state.perform(Command::Pick(PLACE));
    let problem = Problem {
        code: "target".to_owned(),
        title: String::new(),
        status: 422,
        detail: "no 3-D position".to_owned(),
        hint: Some("The nearest good pixel is (44, 36).".to_owned()),
        nearest_pixel: Some(Box::new(GOOD)),
        received: None,
    };
    calls::refuse::<DesignateTarget>(&mut state, problem);
    assert_eq!(state.refusal.as_ref().unwrap().nearest, Some(GOOD));
}

#[test]
fn arrows_nudge_the_aim_by_a_tenth_of_a_pixel_and_enter_takes_it() {
    let mut state = refused(&egui::Context::default());
    let mut press = |key: Key, modifiers: Modifiers| {
        let command = keys::command(key, modifiers, &state).expect("a command");
        state.perform(command);
        state.trackability.aim
    };
    assert_eq!(press(Key::ArrowRight, Modifiers::NONE), Some(Pixel::new(20.1, 30.0)));
    assert_eq!(press(Key::ArrowDown, Modifiers::SHIFT), Some(Pixel::new(20.1, 31.0)));
    assert_eq!(press(Key::ArrowLeft, Modifiers::NONE), Some(Pixel::new(20.0, 31.0)));
    assert_eq!(press(Key::Enter, Modifiers::NONE), None);
    let refusal = state.refusal.clone().unwrap();
    assert_eq!(refusal.place.pixel, Pixel::new(20.0, 31.0), "the aim comes before the offer");
    assert!(refusal.is_advice, "the left half of the map is bad");
    state.perform(Command::Aim(Aim::Put(Pixel::new(50.0, 31.0))));
    let command = keys::command(Key::Enter, Modifiers::NONE, &state).unwrap();
    state.perform(command);
    assert_eq!(state.designating.unwrap().pixel, Pixel::new(50.0, 31.0));
    // Except while picking, the arrows step along the drive.
    let look = fixture::without_target();
    assert!(matches!(keys::command(Key::ArrowRight, Modifiers::NONE, &look), Some(Command::Go(_))));
}

#[test]
fn the_hint_tells_how_far_the_map_is() {
    let shown = Shown::pane(Pane::Left, |context| {
        let mut state = picking(context);
        state.trackability.progress = Some(progress(3));
        state
    });
    // Painted words have no accessibility node; the image describes the computed part.
    shown.says("trackability: 38 % good");
    assert!(shown.harness.query_by_label_contains("left image of step 0").is_some());
}

fn typed(state: &mut State, key: &str, text: &str) {
    let (key, text) = (key.to_owned(), text.to_owned());
    state.perform(Command::Limits(limits::LimitsCommand::Type { key, text }));
}

#[test]
fn limits_are_typed_refused_in_a_sentence_and_used_for_a_map_of_their_own() {
    let mut state = picking(&egui::Context::default());
    state.perform(Command::Limits(limits::LimitsCommand::Open));
    assert_eq!(keys::command(Key::T, Modifiers::NONE, &state), None, "the window has the keyboard");
    typed(&mut state, "edge_bad_px", "99");
    typed(&mut state, "cell_px", "16");
    state.perform(Command::Limits(limits::LimitsCommand::Use));
    let form = state.trackability.form.clone().unwrap();
    assert!(form.refused.unwrap().contains("edge_bad_px: must be a number from 0 to 50, not 99"));
    assert_eq!(form.texts["cell_px"], "16", "nothing typed is lost");
    typed(&mut state, "edge_bad_px", "4,5");
    state.perform(Command::Limits(limits::LimitsCommand::Use));
    assert!(state.trackability.form.is_none());
    assert!(state.trackability_map().is_none() || requests_map(&mut state));
    let limits = state.trackability.limits.clone();
    let text = sightline_rover::trackability::TrackabilityLimits::text(&limits);
    assert_eq!(text, "cell_px=16,edge_bad_px=4.5");
    let call = map_call::<ShowTrackability>(&("drive".to_owned(), 0, limits.clone()));
    let curl = crate::exports::as_text::http("http://localhost", call);
    assert!(
        curl.contains("/traverses/drive/steps/0/trackability?limits=cell_px%3D16%2Cedge_bad_px%3D4.5"),
        "{curl}"
    );
    // A reply for the previous limits is ignored.
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    state.perform(Command::SetMode(Mode::Pick));
    assert!(requests_map(&mut state));
    state.trackability.limits = limits;
    assert!(requests_map(&mut state));
    answer(&mut state, &progress(8));
    assert!(state.trackability_map().is_none());
    answer(&mut state, &progress(8));
    assert!(state.trackability_map().is_some());
}

#[test]
fn the_map_says_by_which_limits_it_was_made() {
    let default = Shown::pane(Pane::Left, picking);
    default.says("Map made with the default limits");
    let mut changed = Shown::pane(Pane::Left, |context| {
        let mut state = picking(context);
        let mut progress = progress(8);
        progress.map.as_mut().unwrap().limits.insert("edge_bad_px".to_owned(), serde_json::json!(4.5));
        state.trackability.progress = Some(progress);
        state
    });
    changed.says("Map made with edge_bad_px 4.5 px");
    assert_eq!(changed.click("limits of trackability"), vec![Command::Limits(limits::LimitsCommand::Open)]);
    let mut window = Shown::new(
        [800.0, 900.0],
        |context| {
            let mut state = picking(context);
            state.perform(Command::Limits(limits::LimitsCommand::Open));
            state
        },
        crate::trackability::limits_window::show,
    );
    window.harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "slant_risky_deg");
    window.says("default 80.0").says("deg");
    assert_eq!(window.click("Apply"), vec![Command::Limits(limits::LimitsCommand::Use)]);
    assert_eq!(window.click("Reset"), vec![Command::Limits(limits::LimitsCommand::Defaults)]);
}

/// The first cell of a verdict on the map of [`picking`].
fn cell(state: &State, verdict: Verdict) -> Cell {
    state.trackability_map().unwrap().cells().find(|cell| cell.verdict == verdict).unwrap()
}

fn is_designated(state: &mut State) -> bool {
    !calls_of::<DesignateTarget>(state).is_empty()
}

#[test]
fn a_risky_or_poor_place_gives_its_reason_and_can_be_picked_anyway() {
    for (verdict, word) in [(Verdict::Bad, "Poor"), (Verdict::Risky, "Risky")] {
        let mut state = picking(&egui::Context::default());
        let place = cell(&state, verdict);
        let nearest = state.trackability_map().unwrap().nearest_good(place.pixel);
        assert!(nearest.is_some());
        state.perform(Command::Pick(place.pixel));
        assert!(!is_designated(&mut state), "the person is asked first");
        let refusal = state.refusal.clone().unwrap();
        assert_eq!((refusal.place.pixel, refusal.nearest, refusal.is_advice), (place.pixel, nearest, true));
        assert_eq!(refusal.sentence, format!("{word}: depth edge 2 px away"));
        assert_eq!(state.mode, Mode::Pick, "the person chooses on");
        state.perform(Command::Aim(Aim::Insist));
        assert!(is_designated(&mut state) && state.refusal.is_none());
    }
    let mut state = picking(&egui::Context::default());
    let good = cell(&state, Verdict::Good);
    state.perform(Command::Pick(good.pixel));
    assert!(is_designated(&mut state) && state.refusal.is_none());

    let mut state = picking(&egui::Context::default());
    let poor = cell(&state, Verdict::Bad);
    state.perform(Command::Pick(poor.pixel));
    state.perform(Command::Aim(Aim::TakeNearest));
    assert!(is_designated(&mut state), "the nearest good one is designated at once");
    // The server tried this position, so that insisting is impossible.
    let mut state = refused(&egui::Context::default());
    state.perform(Command::Aim(Aim::Insist));
    assert!(!is_designated(&mut state) && state.refusal.is_some());
}

fn advised(context: &egui::Context) -> State {
    let mut state = picking(context);
    state.perform(Command::Pick(PLACE));
    state
}

#[test]
fn advice_is_below_the_image_and_no_control_covers_it_or_another() {
    for size in [[360.0, 300.0], [520.0, 420.0], [900.0, 500.0]] {
        let place = Rc::new(std::cell::Cell::new(None));
        let kept = Rc::clone(&place);
        let mut shown = Shown::new(size, advised, move |ui, state, out| {
            kept.set(images_left::show(ui, state, out).map(|(transform, _)| transform.rect));
        });
        let image: egui::Rect = place.get().expect("an image");
        let control = |label: &str| shown.harness.get_by_label(label).rect();
        let labels = ["(20, 30) Poor: depth edge 2 px away.", "Use (44, 28)", "Pick anyway"];
        let controls = labels.map(control);
        for (number, control) in controls.iter().enumerate() {
            assert!(control.top() >= image.bottom(), "{control:?} covers the image {image:?}");
            assert!(control.bottom() <= size[1], "{control:?} leaves the panel");
            let others = controls.iter().skip(number + 1);
            assert!(others.into_iter().all(|other| !other.intersects(*control)), "{controls:?}");
        }
        assert_eq!(shown.click("Pick anyway"), vec![Command::Aim(Aim::Insist)]);
    }
}

#[test]
fn the_image_stays_in_its_place_while_a_target_is_picked() {
    let image = |state: fn(&egui::Context) -> State| {
        let place = Rc::new(std::cell::Cell::new(None));
        let kept = Rc::clone(&place);
        Shown::new([520.0, 420.0], state, move |ui, state, out| {
            kept.set(images_left::show(ui, state, out).map(|(transform, _)| transform));
        });
        place.get().expect("an image")
    };
    let looking = image(|context| fixture::at_step(context, 0));
    assert_eq!(looking, image(picking));
    assert_eq!(looking, image(advised));
    assert_eq!(looking, image(refused));
    let designating = |context: &egui::Context| {
        let mut state = picking(context);
        state.perform(Command::Pick(GOOD));
        state
    };
    assert_eq!(looking, image(designating));
}

#[test]
fn without_a_target_a_click_on_the_left_image_picks() {
    let without = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 0);
        state.session.as_mut().unwrap().targets.clear();
        state.keep_cursor_valid();
        state
    };
    let click = |state: fn(&egui::Context) -> State| {
        let mut shown = Shown::pane(Pane::Left, state);
        let middle = egui::pos2(260.0, 210.0);
        shown.harness.event(egui::Event::PointerMoved(middle));
        shown.harness.run_steps(2);
        for pressed in [true, false] {
            let button = egui::PointerButton::Primary;
            let modifiers = Modifiers::NONE;
            shown.harness.event(egui::Event::PointerButton { pos: middle, button, pressed, modifiers });
            shown.harness.run_steps(1);
        }
        shown.take_commands().into_iter().filter(|command| matches!(command, Command::Pick(_))).count()
    };
    assert_eq!(click(without), 1);
    assert_eq!(click(|context| fixture::at_step(context, 0)), 0, "a target is there: T begins another pick");
    Shown::pane(Pane::Left, without).says("Click a rock to track it.");
    // The first click is judged like any other: nothing is designated before the map has a verdict.
    for (pixel, is_good) in [(GOOD, true), (PLACE, false)] {
        let mut state = without(&egui::Context::default());
        state.perform(Command::Pick(pixel));
        assert!(state.trackability.judged.is_some() && !is_designated(&mut state), "{pixel:?}");
        state.take_requests();
        answer(&mut state, &progress(3));
        assert!(!is_designated(&mut state), "its row is not made yet");
        state.apply_event(Event::TrackabilityProgress {
            traverse: "drive".to_owned(),
            step: 0,
            k: 8,
            n: 8,
            ended: true,
        });
        state.take_requests();
        answer(&mut state, &progress(8));
        assert_eq!((is_designated(&mut state), state.refusal.is_none()), (is_good, is_good), "{pixel:?}");
    }
    // One Esc ends the pick with its advice.
    let mut state = without(&egui::Context::default());
    state.perform(Command::Pick(PLACE));
    state.take_requests();
    answer(&mut state, &progress(8));
    assert!(state.refusal.is_some());
    let escape = keys::command(Key::Escape, Modifiers::NONE, &state).unwrap();
    state.perform(escape);
    assert!(state.refusal.is_none() && state.mode == Mode::Look);
}

#[test]
fn the_note_about_a_pick_is_forgotten_with_its_session() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    let session = state.session.clone().unwrap();
    state.perform(Command::SetMode(Mode::Pick));
    state.perform(Command::Pick(GOOD));
    let answer = Designated { target: 0, gap_m: None, session: session.clone() };
    calls::answer::<DesignateTarget>(&mut state, &answer);
    let note = |state: &State| state.messages.newest().map(|message| message.text.clone());
    assert_eq!(note(&state).as_deref(), Some("Ridge set; tracking all stops … Use ← →."));
    let mut other = session;
    (other.id, other.targets) = ("s2".to_owned(), Vec::new());
    state.apply_event(Event::RunProgress {
        session: "s1".to_owned(),
        target: 0,
        run: 0,
        k: 6,
        n: 6,
        ended: true,
        doing: "done".to_owned(),
    });
    assert_eq!(note(&state), None, "all stops are tracked");
    state.adopt(other, false);
    assert_eq!(note(&state), None, "the other session has no target");
}
