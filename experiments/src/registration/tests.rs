//! A small slice of the study of rocks.

use super::*;

impl Case {
    /// The first view of this rock with the present view of another, laid so that their targets fall together.
    fn with_present_of(&self, other: &Self) -> Self {
        let shift = Translation3::from(self.target_in_fixed - other.target_in_fixed);
        Self {
            views: [self.views[0].clone(), other.views[1].clone()],
            fixed_from_moving: shift * other.fixed_from_moving,
            ..self.clone()
        }
    }

    /// One registration from a drawn start, with the meshes made for it.
    fn measure(&self, from: (f64, u64), staging: &Staging, with: (&ShapeTrackerSettings, Method)) -> Row {
        let ((offset, seed), (tracker, method)) = (from, with);
        let start = self.start(offset, staging, seed);
        self.row(&self.register_as_tracked(&start, tracker, method), offset, method)
    }
}

/// Registers every rock from every offset by both methods: method by method, offset by offset.
fn basin(cases: &[Case], offsets: &[f64], staging: &Staging, tracker: &ShapeTrackerSettings) -> Vec<Row> {
    let mut rows = Vec::new();
    for method in [Method::SimplexL1, Method::PointToPlane] {
        for (number, &offset) in offsets.iter().enumerate() {
            let seed = |case: &Case| (case.rock * offsets.len() + number) as u64;
            let measure = |case: &Case| case.measure((offset, seed(case)), staging, (tracker, method));
            rows.extend(cases.iter().map(measure));
        }
    }
    rows
}

/// Registers every rock's first view to the present view of the rock `apart` numbers on, from half a half width.
fn wrong_rocks(cases: &[Case], apart: usize, staging: &Staging, tracker: &ShapeTrackerSettings) -> Vec<Row> {
    let with = (tracker, tracker.shape_method);
    let other = |case: &Case| case.with_present_of(&cases[(case.rock + apart) % cases.len()]);
    cases.iter().map(|case| other(case).measure((0.5, case.rock as u64), staging, with)).collect()
}

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
    let rows = basin(&cases, &[0.5, 2.0], &staging, &ShapeTrackerSettings::default());
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
    let wrong = wrong_rocks(&cases, 1, &staging, &ShapeTrackerSettings::default());
    assert!(wrong.iter().all(|row| row.failure.is_some()), "{wrong:?}");
}
