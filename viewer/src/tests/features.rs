//! A run by features: its panel, its marks on the images, and the explanations in the panels about templates.

use egui::Shape;
use serde_json::json;
use sightline_geometry::frames::Pixel;
use sightline_track::locate::features::rows::{Feature, moved_covariance_px2};
use sightline_track::trace::StepTrace;

use crate::command::{Command, Layer, Stage};
use crate::drawing::view2d::View2d;
use crate::panels::features::marks;
use crate::panels::pane::Pane;
use crate::panels::{bars, inspector};
use crate::state::State;
use crate::tables::FeatureView;
use crate::tests::feature_run;
use crate::tests::feature_run::{FIRST_INLIER, INLIERS, MATCHES};
use crate::tests::{Shown, fixture};
use crate::theme;

/// Maximum residual that ten inliers and no outlier satisfy: 10.5 mm.
fn small_residuals() -> FeatureView {
    FeatureView { residual_m: [0.0, 0.0105], ..FeatureView::default() }
}

/// The run at step 2 with all its features on the left image.
fn in_view(context: &egui::Context) -> State {
    let mut state = feature_run::at_step(context, 2);
    state.views.left = View2d::At { centre: Pixel::new(460.0, 450.0), scale: 0.45 };
    state
}

fn panel(state: impl FnOnce(&egui::Context) -> State + 'static) -> Shown<'static> {
    Shown::new([900.0, 700.0], state, |ui, state, out| {
        crate::layout::show_pane(ui, Pane::Features, state, out);
    })
}

fn left_image(state: impl FnOnce(&egui::Context) -> State + 'static) -> Shown<'static> {
    Shown::new([900.0, 700.0], state, |ui, state, out| {
        crate::layout::show_pane(ui, Pane::Left, state, out);
    })
}

/// Number of shapes on a screen that satisfy a condition.
fn painted(shown: &Shown<'_>, is_meant: impl Fn(&Shape) -> bool) -> usize {
    shown.harness.output().shapes.iter().filter(|clipped| is_meant(&clipped.shape)).count()
}

/// Number of inlier dots and of outlier crosses, including those of the legend.
fn dots_and_crosses(shown: &Shown<'_>) -> (usize, usize) {
    let dots = painted(shown, |shape| matches!(shape, Shape::Circle(c) if c.fill == theme::inlier()));
    let strokes = painted(shown, |shape| match shape {
        Shape::LineSegment { stroke, .. } => stroke.color == theme::outlier(),
        Shape::Path(path) => path.stroke.color == egui::epaint::ColorMode::Solid(theme::outlier()),
        _ => false,
    });
    (dots, strokes / 2)
}

#[test]
fn the_panel_counts_from_the_images_to_the_motion() {
    let shown = panel(|context| feature_run::at_step(context, 2));
    shown.says("60 and 62").says("48 (80 %)").says("45 (94 %)").says("median range 5.50 m");
    shown.says("30 (67 %)").says("24 (80 %)").says("matched with the 50 points of step 1");
    shown.says("● chosen").says("step 0: fewer than three matches").says("0.354").says("2.10");
    shown.says("best hypothesis 22, then 23 (9.0 mm) → 24 (8.0 mm)").says("by 5.0 cm against the prediction");
    shown.says("± 1 mm").says("gate 3.0 cm").says("in the end 24");
    let mut shown = shown;
    assert_eq!(shown.click("fit_motion"), vec![Command::SelectStage(Stage::FIT_MOTION)]);
}

#[test]
fn at_the_pick_the_panel_says_that_there_is_no_motion_yet() {
    let shown = panel(|context| feature_run::at_step(context, 0));
    shown.says("60 and 62").says("here the target was picked").says("No motion was fitted at this step");
}

#[test]
fn without_features_the_panel_says_how_to_get_them() {
    panel(|context| fixture::at_step(context, 2)).says("looks for no features").says("preset “features”");
    panel(|_| fixture::without_target()).says("press T");
}

#[test]
fn filters_hide_features_in_the_panel_and_on_the_image() {
    let filtered = |context: &egui::Context| {
        let mut state = in_view(context);
        state.perform(Command::SetFeatureView(small_residuals()));
        state
    };
    panel(in_view).says("shown: 24 inliers, 6 outliers, 30 features without a match");
    let mut shown = panel(filtered);
    shown.says("shown: 10 of 24 inliers, 0 of 6 outliers, 30 features without a match");
    assert_eq!(shown.click("Show all"), vec![Command::SetFeatureView(FeatureView::default())]);

    assert_eq!(dots_and_crosses(&left_image(in_view)), (INLIERS, MATCHES - INLIERS));
    assert_eq!(dots_and_crosses(&left_image(filtered)), (10, 0));
}

#[test]
fn inliers_and_outliers_are_layers_of_their_own_and_what_would_drown_the_picture_is_off() {
    let mut shown = left_image(in_view);
    shown.click("legend");
    for word in ["inliers 24", "outliers 6", "inliers from step 1", "residuals × 10", "bootstrap, 40 sets"] {
        shown.says(&format!("{word} (legend)"));
    }
    shown.says("moved here, 1σ 2σ 3σ");
    assert_eq!(shown.click("outliers 6 (legend)"), vec![Command::ToggleLayer(Layer::Outliers)]);
    let circles = |shown: &Shown<'_>| {
        painted(shown, |shape| matches!(shape, Shape::Circle(c) if c.stroke.color == theme::keypoint()))
    };
    let with_all = left_image(|context| {
        let mut state = in_view(context);
        state.perform(Command::ToggleLayer(Layer::Keypoints));
        state
    });
    assert_eq!(circles(&shown), 0);
    // Every fourth feature has no match and a fainter circle.
    assert_eq!(circles(&with_all), feature_run::POINTS);
}

#[test]
fn the_covariance_of_a_moved_target_is_projected_and_that_of_a_match_is_its_own() {
    let of = |trace: &StepTrace| moved_covariance_px2(trace.located().unwrap(), &trace.point_mast.left);
    let [long, short] = crate::drawing::ellipse::axes(&of(&feature_run::trace(2)).unwrap()).unwrap();
    // 1 cm across the line of sight at 6 m, with a focal length of about 1200 px.
    assert!((1.0..6.0).contains(&short.norm()) && long.norm() < 10.0, "{long} {short}");
    assert!(of(&fixture::trace(2)).is_none());
}

#[test]
fn the_right_image_shows_the_partners() {
    let mut shown = Shown::pane(Pane::Right, in_view);
    shown.click("legend");
    shown
        .says("inliers 24 (legend)")
        .says("matches of features in the other image (legend)")
        .says("moved here · run A (legend)");
}

#[test]
fn a_feature_says_its_scale_range_residual_and_verdict() {
    let state = in_view(&egui::Context::default());
    let features = state.features().ready().unwrap();
    let of = |is_meant: fn(&Feature) -> bool| {
        marks::words(features.iter().find(|f| is_meant(f)).unwrap(), Some(1))
    };
    let first = features.iter().find(|feature| feature.pixel == FIRST_INLIER).unwrap();
    let words = marks::words(first, Some(1));
    assert!(words.contains("scale 1.00 px") && words.contains("range 4.000 m"), "{words}");
    assert!(words.ends_with("at step 1 at 88.0, 194.0\nresidual 1.0 mm, 0.56 px: inlier"), "{words}");
    assert!(of(|f| f.matched.as_ref().is_some_and(|m| !m.is_inlier)).ends_with(": outlier"));
    assert!(of(|f| f.right.is_none()).contains("no match in the other image"));
}

#[test]
fn panels_about_the_template_say_where_to_look_instead() {
    for pane in [Pane::Strip, Pane::Surface, Pane::StereoProfile, Pane::History] {
        let shown = Shown::pane(pane, |context| feature_run::at_step(context, 2));
        shown.says("follows the features of the whole scene").says("“Features”");
    }
    Shown::pane(Pane::Tolerances, |context| feature_run::at_step(context, 2)).says("confidence alone");
    for pane in [Pane::Gates, Pane::Machine, Pane::Map, Pane::Plots] {
        Shown::pane(pane, |context| feature_run::at_step(context, 2));
    }
}

#[test]
fn the_stage_bar_has_the_steps_of_the_tracker_and_keeps_the_place_of_the_other_one() {
    let mut shown = Shown::new([1400.0, 60.0], |context| feature_run::at_step(context, 2), bars::stages);
    assert_eq!(shown.click("bootstrap"), vec![Command::SelectStage(Stage::BOOTSTRAP)]);
    let mut state = feature_run::at_step(&egui::Context::default(), 2);
    state.stage = Stage::MATCH_TEMPLATE;
    assert_eq!(state.stage(), Stage::MATCH_FEATURES);
    let mut template = fixture::at_step(&egui::Context::default(), 2);
    template.stage = Stage::DETECT;
    assert_eq!(template.stage(), Stage::SCALE_ROLL);
}

#[test]
fn every_step_of_the_feature_tracker_has_a_record() {
    let trace = feature_run::trace(2);
    for stage in Stage::of(sightline_track::settings::TrackerKind::Features) {
        assert!(inspector::is_reached(&trace, stage), "{}", stage.word());
        assert!(inspector::record(&trace, stage).is_some(), "{}", stage.word());
    }
    let matched = inspector::record(&trace, Stage::MATCH_FEATURES).unwrap();
    assert_eq!((&matched["detect"]["stereo_matches"], &matched["matches"]), (&json!(48), &json!(30)));
    let pick = inspector::record(&feature_run::trace(0), Stage::LOCATE).unwrap();
    assert!(pick["point_stereo"]["range_m"].is_number());
    let shown = Shown::pane(Pane::Inspector, |context| {
        let mut state = feature_run::at_step(context, 2);
        state.stage = Stage::FIT_MOTION;
        state
    });
    shown.says("fit_motion").says("roll pitch yaw").says("consensus by draw (20)");
}

#[test]
fn confidence_and_inliers_are_plotted_with_their_limits() {
    let shown = Shown::pane(Pane::Plots, |context| feature_run::at_step(context, 2));
    shown.says("lost below 0.5, back at 0.7").says("inliers").says("confidence one half");
    Shown::new([1200.0, 60.0], |context| feature_run::at_step(context, 2), bars::top).says("0.35").says("24");
    Shown::pane(Pane::Map, |context| feature_run::at_step(context, 2)).says("bootstrap of this step");
}

#[test]
fn the_preset_chooses_the_tracker_and_settings_of_the_other_one_are_folded() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.perform(Command::UsePreset("features"));
    assert_eq!(state.draft["tracker"], json!("features"));
    let shown = |state: fn(&egui::Context) -> State| {
        Shown::new([420.0, 2400.0], state, |ui, state, out| {
            crate::layout::show_pane(ui, Pane::Settings, state, out);
        })
    };
    shown(|context| fixture::at_step(context, 2)).says("FEATURES: NOT USED BY THIS TRACKER").says("ncc_min");
    let drafted = shown(|context| {
        let mut state = fixture::at_step(context, 2);
        state.perform(Command::UsePreset("features"));
        state
    });
    drafted.says("TEMPLATE: NOT USED BY THIS TRACKER").says("motion_draws");
}
