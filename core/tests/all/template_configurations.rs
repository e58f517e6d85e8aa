//! Every configuration of the template matcher in a world with an analytic ground truth.

use std::sync::Arc;

use serde_json::{Value, json};

use super::template::{approach, designation, pose, run, turned_plane};
use sightline_session::step::RunStep;
use sightline_session::track;
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::locate::template::history::against_earlier;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::presets::{PRESETS, preset};
use sightline_track::target::TrackingState;

fn matched(step: &RunStep) -> &TemplateMatch {
    step.template().and_then(|e| e.match_template.as_ref()).unwrap()
}

fn err_px(step: &RunStep) -> f64 {
    step.truth.as_ref().unwrap().err_px.unwrap()
}

/// Two stops; the second is closer by a twentieth of the distance.
fn one_step() -> PlaneWorld {
    PlaneWorld::new(vec![pose(0.0, 0.0), pose(0.4, 0.0)])
}

#[test]
fn every_similarity_measure_finds_the_target() {
    for (measure, lowest) in [("sad", -0.1), ("ssd", -0.1), ("sdog", 0.7)] {
        let steps = run(&one_step(), &[("measure", json!(measure))]);
        assert!(err_px(&steps[1]) < 0.2, "{measure}: {} px", err_px(&steps[1]));
        let matched = matched(&steps[1]);
        assert!(
            matched.score > 0.98 && (lowest..1.0).contains(&matched.peak.score),
            "{measure}: {matched:?}"
        );
        assert!(matched.peak.score <= 0.0 || measure == "sdog", "{measure}: {}", matched.peak.score);
        let gate = &steps[1].verdict().unwrap().gates[0];
        assert_eq!(gate.value, Some(matched.score), "{measure}");
    }
}

#[test]
fn coarse_to_fine_agrees_with_exhaustive_at_a_tenth_the_cost() {
    let all = run(&PlaneWorld::new(approach()), &[]);
    let few = run(&PlaneWorld::new(approach()), &[("search", json!("coarse_to_fine"))]);
    for (all, few) in all[1..].iter().zip(&few[1..]) {
        let (all, few) = (matched(all), matched(few));
        assert_eq!(all.peak.integer, few.peak.integer);
        assert!(all.pixel.distance(few.pixel) < 1e-3);
        assert!(few.positions * 10 < all.positions, "{} of {}", few.positions, all.positions);
        let coarse = few.coarse.as_ref().unwrap();
        assert!(coarse.coarse.as_ref().unwrap().scores.len() > 500);
        assert!(few.surface.get().unwrap().valid_positions() < 200);
    }
}

#[test]
fn a_step_is_searched_again_both_ways_for_a_study() {
    let world = PlaneWorld::new(approach());
    let steps = run(&world, &[]);
    let settings = sightline_track::settings::Settings::default().template;
    for (before, step) in steps.iter().zip(&steps[1..]) {
        let pose = &world.estimates[step.step];
        let both = sightline_track::locate::template::compare_searches::compare_searches(
            &before.update.target,
            step,
            pose,
            &settings,
        )
        .unwrap();
        assert!(both.is_same && both.exhaustive == matched(step).peak, "{both:?}");
        assert_eq!(both.exhaustive_comparisons, u64::from(matched(step).positions));
    }
}

#[test]
fn the_affine_stage_follows_a_slope_that_scale_and_roll_do_not() {
    let plain = [("surface_warp", json!(false)), ("focus_px", json!(0.0))];
    let affine = [("refine", json!("affine")), ("refine_max_area_change", json!(0.5))];
    let with: Vec<(&str, Value)> = plain.iter().cloned().chain(affine).collect();
    let (without, with) = (run(&turned_plane(), &plain), run(&turned_plane(), &with));
    let refined = matched(&with[1]).affine.as_ref().unwrap();
    assert!(refined.accepted && refined.rejected.is_none(), "{refined:?}");
    assert!(matched(&with[1]).score > 0.995, "{} {}", matched(&without[1]).score, matched(&with[1]).score);
    assert!(matched(&without[1]).score < matched(&with[1]).score - 0.05);
    assert!(err_px(&with[1]) < 0.1, "{} {}", err_px(&without[1]), err_px(&with[1]));
    // Seen at 65° first and then at 65° − atan(1.2 / 7.2), the plane widens by the ratio of the cosines.
    let wider = (65_f64.to_radians() - (1.2_f64 / 7.2).atan()).cos() / 65_f64.to_radians().cos();
    let truth = nalgebra::Matrix2::new(wider, 0.0, 0.0, 1.0);
    assert!((refined.map - truth).norm() < 0.02, "{} for {truth}", refined.map);
}

#[test]
fn an_excessive_affine_map_is_recorded_but_not_used() {
    let plain = [("surface_warp", json!(false)), ("focus_px", json!(0.0))];
    let strict = [("refine", json!("affine")), ("refine_max_area_change", json!(0.01))];
    let with: Vec<(&str, Value)> = plain.iter().cloned().chain(strict).collect();
    let (without, with) = (run(&turned_plane(), &plain), run(&turned_plane(), &with));
    let refined = matched(&with[1]).affine.as_ref().unwrap();
    assert!(!refined.accepted && refined.rejected.as_ref().unwrap().contains("refine_max_area_change"));
    assert_eq!(matched(&with[1]).pixel, matched(&without[1]).pixel);
    assert_eq!(matched(&with[1]).score, matched(&without[1]).score);
}

#[test]
fn klt_follows_small_steps_and_records_its_descent() {
    for stage in ["klt_translation", "klt_affine"] {
        let steps =
            run(&PlaneWorld::new(approach()), &[("first_stage", json!(stage)), ("focus_px", json!(0.0))]);
        assert!(steps.iter().all(|s| s.update.state == TrackingState::Tracking), "{stage}");
        assert!(err_px(&steps[5]) < 0.5, "{stage}: {} px", err_px(&steps[5]));
        let descent = matched(&steps[1]).descent.as_ref().unwrap();
        assert!(descent.iterations >= 3 && matched(&steps[1]).surface.get().unwrap().scores.is_empty());
        assert_eq!(descent.map == nalgebra::Matrix2::identity(), stage == "klt_translation");
    }
}

#[test]
fn only_klt_loses_a_target_forty_pixels_off_prediction() {
    let mut world = one_step();
    // 40 px at 7.3 m and f = 600 px.
    world.estimates[1].translation.vector.y += 40.0 * 7.3 / 600.0;
    let klt = run(&world, &[("first_stage", json!("klt_translation")), ("tolerance_factor", json!(100.0))]);
    let correlated = run(&world, &[("tolerance_factor", json!(100.0))]);
    assert_eq!(correlated[1].update.state, TrackingState::Tracking, "{:?}", correlated[1].row().reason);
    assert!(klt[1].update.state.is_lost(), "{:?}", klt[1].row());
}

#[test]
fn brute_force_search_finds_scale_and_roll() {
    let world = PlaneWorld::new(vec![pose(0.0, 0.0), pose(0.7, 5.0)]);
    let changes = [
        ("transform", json!("search")),
        ("search_roll_step_deg", json!(5.0)),
        ("search_roll_deg", json!(5.0)),
        ("search_window_px", json!(63)),
    ];
    let steps = run(&world, &changes);
    let (found, prepared) =
        (matched(&steps[1]), steps[1].template().and_then(|e| e.scale_roll.as_ref()).unwrap());
    // Scales of 1.05^-4 … 1.05^4 and rolls of -5°, 0° and 5°.
    assert_eq!(found.tried.len(), 9 * 3);
    assert_eq!(found.comparisons, 27 * u64::from(found.positions));
    assert!((prepared.applied_scale - 1.05_f64.powi(2)).abs() < 1e-9, "{}", prepared.applied_scale);
    assert!((prepared.applied_roll_rad.to_degrees() + 5.0).abs() < 1e-9);
    assert!(err_px(&steps[1]) < 0.2, "{}", err_px(&steps[1]));
}

#[test]
fn older_appearances_are_tried_and_carry_their_drift() {
    let changes = [("template_update", json!("every_update")), ("reference_templates", json!(3))];
    let steps = run(&PlaneWorld::new(approach()), &changes);
    let tried: Vec<_> = matched(&steps[4]).tried.iter().map(|t| (t.template_step, t.warped)).collect();
    assert_eq!(tried, [(3, true), (3, false), (2, true), (2, false), (1, true), (1, false)]);
    let best = matched(&steps[4]).tried.iter().filter_map(|t| t.focused_score).fold(-1.0, f64::max);
    assert_eq!(matched(&steps[4]).focused_score, Some(best));
    // At stop 2 the designated window is among them; back at it, a match adds no error of another match.
    let mut covered = PlaneWorld::new(approach());
    covered.true_poses[2] = covered.true_poses[1];
    covered.estimates[2] = covered.estimates[1];
    covered.true_poses[3] = covered.true_poses[0];
    covered.estimates[3] = covered.estimates[0];
    let back =
        run(&covered, &[("template_update", json!("every_update")), ("reference_templates", json!(9))]);
    let prepared = back[3].template().and_then(|e| e.scale_roll.as_ref()).unwrap();
    assert_eq!(prepared.template_step, 0);
    let error = back[3].located().unwrap().left_error;
    assert!((error.covariance_px2 - matched(&back[3]).covariance_px2).norm() < 1e-12);
}

#[test]
fn drift_correction_leaves_the_error_of_one_match() {
    let changes = |policy: &str| [("template_update", json!(policy)), ("sub_pixel", json!(false))];
    let world = PlaneWorld::new(approach());
    let (chained, corrected) =
        (run(&world, &changes("every_update")), run(&world, &changes("drift_corrected")));
    let last = corrected[5].template().unwrap();
    let correction = last.drift_correction.as_ref().unwrap();
    assert!(correction.accepted && correction.template_step == 0 && correction.score > 0.9, "{correction:?}");
    assert_eq!(corrected[5].located().unwrap().left_pixel, Some(correction.pixel));
    let sigma = |steps: &[RunStep]| steps[5].located().unwrap().left_error.covariance_px2.trace();
    assert!(sigma(&corrected) < 0.5 * sigma(&chained), "{} {}", sigma(&corrected), sigma(&chained));
    assert!(err_px(&corrected[5]) < err_px(&chained[5]).max(0.75), "{}", err_px(&corrected[5]));
    assert!(corrected[1].template().unwrap().drift_correction.is_none());
}

#[test]
fn a_correction_that_moves_too_far_is_recorded_and_not_used() {
    let changes = [("template_update", json!("drift_corrected")), ("drift_reach_px", json!(0.0))];
    let steps = run(&PlaneWorld::new(approach()), &changes);
    let last = steps[5].template().unwrap();
    assert!(!last.drift_correction.as_ref().unwrap().accepted);
    assert_eq!(steps[5].located().unwrap().left_pixel, Some(matched(&steps[5]).pixel));
}

#[test]
fn presets_track_a_facing_plane_except_by_shape() {
    let mut poses = vec![pose(0.0, 0.0)];
    while poses.len() < 4 {
        let x = poses[poses.len() - 1].translation.vector.x;
        poses.push(pose(x + (8.0 - x) * 0.05, 0.0));
    }
    let world = PlaneWorld::new(poses);
    for preset in PRESETS {
        let mut settings = preset.settings().unwrap();
        settings.template.search_window_px = 63;
        let steps = track::run(&world, designation(118.3, 131.6), &settings).unwrap();
        let last = &steps[3];
        if preset.name == "shape" {
            assert!(
                last.update.state.is_lost()
                    && last.row().reason.unwrap().contains("target uncertainty after registration")
            );
            continue;
        }
        assert_eq!(last.update.state, TrackingState::Tracking, "{}: {:?}", preset.name, last.row().reason);
        let limit = if preset.name == "integer-peak" { 2.0 } else { 1.0 };
        assert!(err_px(last) < limit, "{}: {} px", preset.name, err_px(last));
    }
}

#[test]
fn the_eight_paper_presets_combine_scale_roll_and_affine() {
    for (scale, roll, affine) in [false, true].into_iter().flat_map(|s| {
        [false, true].into_iter().flat_map(move |r| [false, true].into_iter().map(move |a| (s, r, a)))
    }) {
        let name = format!(
            "ncc{}{}{}",
            if scale { "-scale" } else { "" },
            if roll { "-roll" } else { "" },
            if affine { "-affine" } else { "" }
        );
        let template = preset(&name).unwrap().settings().unwrap().template;
        let has_affine = template.refine == sightline_track::locate::template::settings::Refine::Affine;
        assert_eq!((template.scale, template.roll, has_affine), (scale, roll, affine), "{name}");
        assert!(!template.surface_warp && template.focus_px == 0.0, "{name}");
    }
}

#[test]
fn settings_that_contradict_each_other_are_refused_by_name() {
    let mut settings = sightline_track::settings::Settings::default();
    (settings.template.template_size_px, settings.template.search_window_px) = (41, 21);
    let refused = track::run(&one_step(), designation(118.3, 131.6), &settings).unwrap_err().to_string();
    assert!(refused.contains("template_size_px 41") && refused.contains("search_window_px 21"), "{refused}");
    settings.template.template_size_px = 20;
    let refused = track::run(&one_step(), designation(118.3, 131.6), &settings).unwrap_err().to_string();
    assert!(refused.contains("template_size_px") && refused.contains("odd"), "{refused}");
    let mut settings = preset("coarse-to-fine").unwrap().settings().unwrap();
    settings.template.template_size_px = 11;
    let refused = track::run(&one_step(), designation(118.3, 131.6), &settings).unwrap_err().to_string();
    assert!(refused.contains("coarse_levels 2") && refused.contains("template_size_px 11"), "{refused}");
    let mut settings = preset("scale-roll-search").unwrap().settings().unwrap();
    (settings.template.search_roll_deg, settings.template.search_roll_step_deg) = (20.0, 0.1);
    let refused = track::run(&one_step(), designation(118.3, 131.6), &settings).unwrap_err().to_string();
    assert!(refused.contains("search_roll_step_deg") && refused.contains("3609 pairs"), "{refused}");
}

#[test]
fn a_flat_target_is_rejected_and_an_outside_window_is_a_loss() {
    let mut world = one_step();
    world.troubles[0] = Trouble::Covered;
    let refused =
        track::run(&world, designation(118.3, 131.6), &sightline_track::settings::Settings::default());
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("no contrast") && refused.contains("template_size_px"), "{refused}");
    let mut world = one_step();
    // The prediction is a metre and a half to the side: outside the image.
    world.estimates[1].translation.vector.y += 3.0;
    let steps = run(&world, &[]);
    let reason = steps[1].row().reason.unwrap();
    assert!(steps[1].update.state.is_lost() && reason.contains("search_window_px"), "{reason}");
}

#[test]
fn each_gate_of_the_peak_is_a_named_loss_once_it_is_switched_on() {
    let world = one_step();
    assert_eq!(run(&world, &[])[1].verdict().unwrap().gates.len(), 4);
    for (key, value, name) in [
        ("second_peak_ratio_max", 0.01, "second_peak_ratio"),
        ("match_sigma_max_px", 0.001, "match_sigma_px"),
        ("edge_distance_min_px", 100.0, "edge_distance_px"),
    ] {
        let steps = run(&world, &[(key, json!(value))]);
        let verdict = steps[1].verdict().unwrap();
        let gate = verdict.gates.last().unwrap();
        assert_eq!((gate.name.as_str(), gate.limit), (name, value));
        let reason = verdict.reason.as_ref().unwrap();
        assert!(steps[1].update.state.is_lost() && reason.starts_with(name), "{reason}");
    }
    let loose = [
        ("second_peak_ratio_max", json!(0.9)),
        ("match_sigma_max_px", json!(1.0)),
        ("edge_distance_min_px", json!(3.0)),
    ];
    let steps = run(&world, &loose);
    assert_eq!(steps[1].update.state, TrackingState::Tracking, "{:?}", steps[1].row().reason);
    assert_eq!(steps[1].verdict().unwrap().gates.len(), 7);
}

#[test]
fn only_a_grazing_plane_warns_of_its_depth_range() {
    let evidence = |world: &PlaneWorld| run(world, &[])[0].template().unwrap().clone();
    assert!(evidence(&one_step()).warnings.is_empty(), "{:?}", evidence(&one_step()).warnings);
    let warnings = evidence(&turned_plane()).warnings;
    // 65°: over 20 px of 600 the range changes by 2 tan 65° / 30, 7 %; at 78° by 16 %.
    assert!(warnings.is_empty(), "{warnings:?}");
    let mut grazing = one_step();
    let angle = 78_f64.to_radians();
    grazing.normal = sightline_geometry::frames::Vector3::new(angle.cos(), -angle.sin(), 0.0);
    let warnings = evidence(&grazing).warnings;
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!((warnings[0].value - 2.0 * angle.tan() / 60.0).abs() < 0.03, "{warnings:?}");
}

#[test]
fn the_current_view_is_compared_with_every_earlier_template() {
    let world = PlaneWorld::new(approach());
    let steps = run(&world, &[("template_update", json!("every_update"))]);
    let settings = sightline_track::settings::Settings::default().template;
    let image = Arc::clone(&steps[5].capture().unwrap().pair.left);
    let earlier = steps[..5].iter().map(|step| &step.update.target.memory.template().unwrap().appearance);
    let held = against_earlier(&steps[5], &image, &world.estimates[5], earlier, &settings);
    assert_eq!(held.iter().map(|h| h.template_step).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    for earlier in &held {
        let [x, y] = earlier.offset_px;
        assert!(earlier.score > 0.9 && x.hypot(y) < 0.5, "{earlier:?}");
    }
    assert!(held[0].scale > held[4].scale);
}

#[test]
fn the_height_term_selects_the_right_maximum() {
    let changes =
        [("height_weight", json!(0.5)), ("height_scale_m", json!(0.2)), ("search_window_px", json!(103))];
    let steps = run(&turned_plane(), &changes);
    let weighed = &matched(&steps[1]).weighed;
    assert_eq!(weighed.len(), 5, "{weighed:?}");
    let best = weighed.iter().map(|w| w.total).fold(-1.0, f64::max);
    let right = weighed.iter().find(|w| w.total == best).unwrap();
    assert!(right.pixel.distance(matched(&steps[1]).pixel) < 1.5 && right.agreement > 0.5, "{weighed:?}");
    assert!(err_px(&steps[1]) < 0.15);
    assert!(matched(&run(&turned_plane(), &[])[1]).weighed.is_empty());
}
