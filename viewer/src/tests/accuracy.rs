//! The panels of exposure, stereo score and error budget.

use crate::command::{Command, Zoomable};
use crate::drawing::stretch::Stretch;
use crate::drawing::view2d::View2d;
use crate::panels::pane::Pane;
use crate::state::calculator::{Calculator, Pair};
use crate::tests::{Shown, fixture};
use crate::theme;
use crate::theme::ColourTheme;

#[test]
fn the_left_image_says_how_the_subframe_is_exposed_and_which_stretch_is_on() {
    let shown = Shown::pane(Pane::Left, |context| fixture::at_step(context, 2));
    shown.says("subframe 161 × 161 px: mean 0.40, 0.0 % saturated").says("automatic: ");
    let stretched = Shown::pane(Pane::Left, |context| {
        let mut state = fixture::at_step(context, 2);
        state.perform(Command::SetStretch(Stretch::None));
        state
    });
    stretched.says("as recorded: 0 is black");
    let by_hand = Shown::pane(Pane::Left, |context| {
        let mut state = fixture::at_step(context, 2);
        state.perform(Command::SetStretch(Stretch::NEUTRAL));
        state
    });
    by_hand.says("brightness").says("contrast").says("gamma");
}

/// Number of lines of this colour in a shape.
fn lines(shape: &egui::Shape, colour: egui::Color32) -> usize {
    use egui::Shape;
    let is_it = match shape {
        Shape::Vec(shapes) => return shapes.iter().map(|shape| lines(shape, colour)).sum(),
        Shape::LineSegment { stroke, .. } => stroke.color == colour,
        Shape::Path(path) => path.stroke.color == egui::epaint::ColorMode::Solid(colour),
        Shape::Circle(circle) => circle.stroke.color == colour || circle.fill == colour,
        _ => false,
    };
    usize::from(is_it)
}

#[test]
fn truth_is_white_on_an_image_in_the_light_looks_too() {
    for pane in [Pane::Left, Pane::CloseUp] {
        for colour_theme in [ColourTheme::Dark, ColourTheme::Light] {
            let shown = Shown::pane(pane, move |context| {
                theme::apply(context, colour_theme);
                let mut state = fixture::at_step(context, 2);
                let view = View2d::At { centre: fixture::PIXEL, scale: 1.0 };
                state.perform(Command::View(Zoomable::Left, view));
                state
            });
            let shapes = || shown.harness.output().shapes.iter();
            let count = |colour| shapes().map(|clipped| lines(&clipped.shape, colour)).sum::<usize>();
            // White in the dark scheme, black in the light ones.
            let of = [ColourTheme::Dark, ColourTheme::Light].map(|colour_theme| {
                theme::choose(colour_theme);
                theme::truth()
            });
            let [white, black] = of.map(count);
            assert!(white >= 2 && black == 0, "{pane:?} {colour_theme:?}: {white} white, {black} black");
        }
    }
}

#[test]
fn a_stretch_is_chosen_from_the_list() {
    let mut shown = Shown::pane(Pane::Left, |context| fixture::at_step(context, 2));
    shown.click("stretch, automatic: 0.326 is black, 0.965 is white");
    assert_eq!(shown.click("as recorded"), vec![Command::SetStretch(Stretch::None)]);
}

#[test]
fn the_stereo_profile_says_best_interval_and_prediction() {
    let shown = Shown::pane(Pane::StereoProfile, |context| fixture::at_step(context, 2));
    shown.says("best 6.000 m, score 0.910, disparity 61.00 px").says("left–right check: 0.10 px");
    shown.says("searched 0.25 to 20.00 m, 80 positions; predicted");
    Shown::pane(Pane::StereoProfile, |context| fixture::at_step(context, 0))
        .says("no prediction: the whole curve");
}

#[test]
fn the_budget_of_the_test_beds_navcam_is_that_of_the_paper() {
    let shown = Shown::pane(Pane::Budget, |context| {
        let mut state = fixture::at_step(context, 2);
        let calculator = Calculator { pair: Pair::TableOne(1), ..Calculator::default() };
        state.perform(Command::SetCalculator(calculator));
        state
    });
    shown.says("38.75 cm").says("41.92 cm").says("2.19 cm").says("below the 3 cm").says("2.50 px");
    shown.says("of 5 errors are within").says("errata").says("18.7");
}

#[test]
fn the_budget_says_what_it_lacks() {
    Shown::pane(Pane::Budget, |_| fixture::without_target()).says("The current cameras are known once");
}
