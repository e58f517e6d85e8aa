//! The location hovered in one panel is marked in the others.

use std::sync::Arc;

use sightline_api::wire::StopDetail;
use sightline_geometry::frames::Pixel;

use crate::cache::Item;
use crate::hovered::Hovered;
use crate::state::State;
use crate::tests::fixture::{PIXEL, at_step, trace, without_target};
use crate::tests::{Command, Pane, Shown};

fn pointing(context: &egui::Context, at: Hovered) -> State {
    let mut state = at_step(context, 2);
    state.hovered = Some(at);
    state
}

fn pane(pane: Pane, at: Hovered) -> Shown<'static> {
    Shown::pane(pane, move |context| pointing(context, at))
}

/// The location that a panel reports while the pointer is at its centre.
fn hovered_in(pane: Pane) -> Vec<Hovered> {
    let mut shown = Shown::pane(pane, |context| at_step(context, 2));
    shown.harness.hover_at(egui::pos2(260.0, 180.0));
    shown.harness.run_steps(2);
    let commands = std::mem::take(shown.harness.state_mut()).into_iter();
    commands.filter_map(|command| if let Command::Hover(at) = command { Some(at) } else { None }).collect()
}

#[test]
fn a_pixel_of_the_left_image_has_its_curve_its_score_and_its_patch() {
    let at = Hovered::Left(PIXEL.offset(4.0, -3.0));
    pane(Pane::Right, at).says("curve of x 516.3  y 477.6 of the left image");
    pane(Pane::Surface, at).says("x 516  y 478");
    // The image of the fixed drive is small, so that the window about the target exceeds it.
    pane(Pane::Strip, at).says("at the pointer: leaves the image");
    pane(Pane::Strip, Hovered::Left(Pixel::new(30.0, 31.0)))
        .says("at the pointer: outside of the search window");
}

#[test]
fn a_pixel_of_the_right_image_and_a_place_of_the_scores_are_in_the_left_one() {
    let words = "curve of x 450.0  y 480.0 of the right image";
    pane(Pane::Left, Hovered::Right(Pixel::new(450.0, 480.0))).says(words);
    pane(Pane::Left, Hovered::Score(Pixel::new(515.0, 482.0))).says("template at x 515  y 482");
    pane(Pane::Right, Hovered::Range(5.0)).says("range 5.00 m");
}

#[test]
fn hidden_marks_hide_what_is_pointed_at() {
    let at = Hovered::Left(PIXEL);
    let hidden = move |context: &egui::Context| {
        let mut state = pointing(context, at);
        state.marks = false;
        state
    };
    Shown::pane(Pane::Strip, hidden).says("at the pointer: point at the scores or at the left image");
}

#[test]
fn panels_tell_what_the_pointer_is_over() {
    assert!(matches!(hovered_in(Pane::Left)[..], [.., Hovered::Left(_)]));
    assert!(matches!(hovered_in(Pane::Right)[..], [.., Hovered::Right(_)]));
    assert!(matches!(hovered_in(Pane::StereoProfile)[..], [.., Hovered::Range(_)]));
    assert!(matches!(hovered_in(Pane::Plots)[..], [.., Hovered::Step(_)]));
    let [.., Hovered::Score(at)] = hovered_in(Pane::Surface)[..] else { panic!("a place of the scores") };
    assert_eq!(at, Pixel::new(at.x.round(), at.y.round()), "scores are at whole pixels");
}

#[test]
fn before_there_is_a_target_the_stop_tells_its_cameras() {
    let at = Pixel::new(20.0, 30.0);
    let mut state = without_target();
    state.hovered = Some(Hovered::Left(at));
    assert!(state.stereo_cameras().is_none());
    let key = state.stop_detail_key(0).unwrap();
    assert!(state.needed_items().contains(&key), "the page asks for them");
    let pointing = trace(0).trace.point_mast;
    let stop = state.stop().unwrap().clone();
    let detail =
        StopDetail { stop, left: pointing.left, right: pointing.right, mast: None, cameras: Vec::new() };
    state.cache.store(key, Ok(Item::Stop(Arc::new(detail))), 0.0);
    assert!(state.stereo_cameras().is_some());
    // The record of a computed step contains them.
    let computed = at_step(&egui::Context::default(), 2);
    assert!(!computed.needed_items().contains(&computed.stop_detail_key(2).unwrap()));
}

#[test]
fn only_another_step_than_the_present_one_is_pointed_at() {
    let hovered = |step| pointing(&egui::Context::default(), Hovered::Step(step)).hovered_step();
    assert_eq!((hovered(4), hovered(2), hovered(99)), (Some(4), None, None));
}
