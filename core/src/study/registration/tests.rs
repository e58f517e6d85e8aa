//! A small slice of the study of rocks.

use super::*;

#[test]
fn a_case_seen_without_noise_lies_on_itself_under_the_true_motion() {
    let stereo = Stereo { sigma_px: 0.0, wrong: 0.0, ..Stereo::default() };
    let staging = Staging { start_turn_rad: 0.0, ..Staging::default() };
    let case = &rock_cases(1, &staging, &stereo, 11)[0];
    let settings = ShapeSettings::default();
    assert!(
        (case.start(0.0, &staging, 1).inverse() * case.fixed_from_moving).translation.vector.norm() < 1e-12
    );
    let [fixed, moving] = case.meshes(&case.fixed_from_moving, &settings);
    let found = case.register([&fixed, &moving], &case.fixed_from_moving, &settings);
    // Facets of 1 cm miss curved ground and cut edges; without a motion nothing else is left.
    let errors = found.depth_errors.before_m.iter().filter(|error| !error.is_nan()).map(|error| error.abs());
    let mut errors: Vec<f32> = errors.collect();
    errors.sort_by(f32::total_cmp);
    assert!(
        errors.len() > 2500 && errors[errors.len() / 2] < 2e-4,
        "{} {}",
        errors.len(),
        errors[errors.len() / 2]
    );
    let moved = case.start(1.0, &staging, 1) * case.fixed_from_moving.inverse() * case.target_in_fixed;
    let across_m = (moved - case.target_in_fixed).norm();
    assert!((case.half_width_m..1.3 * case.half_width_m).contains(&across_m), "{across_m}");
}

#[test]
fn a_slice_of_the_study_finds_rocks_in_the_basin_and_refuses_the_others() {
    let staging = Staging::default();
    let cases = rock_cases(4, &staging, &Stereo::default(), 21);
    let rows = basin(&cases, &[0.5, 2.0], &staging, &ShapeSettings::default());
    for summary in summarise(&rows) {
        println!("{summary:?}");
        assert_eq!(summary.false_results, 0, "{summary:?}");
        if summary.offset < 1.0 {
            assert!(summary.success >= 0.75, "{summary:?}");
            assert!(summary.error_m.is_some_and(|[median_m, _]| median_m < 6e-3), "{summary:?}");
            // Four rocks: the band of the mean is wide, and a covariance wrong by a factor of four is outside.
            assert!(
                summary.calibration.as_ref().is_some_and(|c| (0.6..8.0).contains(&c.mean_nees)),
                "{summary:?}"
            );
        } else {
            assert!(summary.accepted <= 0.2, "{summary:?}");
        }
    }
    let settings = ShapeSettings { method: Method::PointToPlane, ..ShapeSettings::default() };
    let wrong = wrong_rocks(&cases, 1, &staging, &settings);
    assert!(wrong.iter().all(|row| row.failure.is_some()), "{wrong:?}");
}
