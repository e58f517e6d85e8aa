//! Steps `match_features` (earlier to current stop), `fit_motion` and `bootstrap`: the rigid motion between two stops
//! (D§2, R161–R169, R173–R175).
//!
//! The motion is that of the whole scene and independent of any target: all targets share it (R168, R207). With a
//! prior, a feature is searched for only near the pixel predicted from the pose estimates. If that gives fewer than
//! n_conf inliers, the estimates may be wrong: the whole image is searched, and the motion with more inliers is used.

use nalgebra::Vector6;

use sightline_geometry::camera::Camera;
use sightline_geometry::estimate::bootstrap::{Bootstrap, block_bootstrap};
use sightline_geometry::estimate::horn::rigid_motion;
use sightline_geometry::estimate::motion_parameters::MotionParameters;
use sightline_geometry::estimate::ransac::{MotionFit, RansacSettings, Weighting, fit_motion};
use sightline_geometry::estimate::weighted_motion::{Correspondence, rigid_motion_by_covariance};
use sightline_geometry::frames::{Pixel, Pose};
use sightline_vision::sift::Descriptor;
use sightline_vision::sift::matching::{self, Match};

use super::detect::StopFeatures;
use super::settings::FeatureSettings;
use crate::locate::store::HeapBytes;

/// Pixel shift for the numerical derivative of the motion, px: small compared with the non-linearity of the motion.
const SHIFT_PX: f64 = 0.05;

/// Index of the shift of the right pixels alone in `Point::by_shift_m`.
const DISPARITY: usize = 2;

/// The motion between two stops, with its matches and covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Matches of points: `query` of the earlier stop, `train` of the current one.
    pub matches: Vec<Match>,
    /// The motion with the most inliers; maps points in the earlier rover frame to the current one.
    pub fit: MotionFit,
    /// Its covariance; `None` without a motion.
    pub bootstrap: Option<Bootstrap>,
    /// Its change by 1σ of each error that all features share: right, down, and disparity of both stops.
    pub by_shared_error: Option<[Vector6<f64>; 3]>,
    /// Whether the prior gave too few inliers and the search of the whole image gave more.
    pub prior_given_up: bool,
}

impl HeapBytes for Motion {
    fn heap_bytes(&self) -> usize {
        size_of_val(&*self.matches) + size_of_val(&*self.fit.inliers)
    }
}

/// The input of a measurement of motion.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// The features of the earlier stop.
    pub then: &'a StopFeatures,
    /// The features of the current stop.
    pub now: &'a StopFeatures,
    /// The motion predicted by the pose estimates.
    pub expected_now_from_then: &'a Pose,
    /// The left camera of the current stop, in its rover frame.
    pub left: &'a Camera,
    /// The settings.
    pub settings: &'a FeatureSettings,
}

/// Measures the motion between two stops.
pub fn motion(input: &MotionInput<'_>) -> Motion {
    let settings = input.settings;
    let expected = motion_of(input, match_points(input));
    let agree = expected.fit.inliers.len();
    if settings.prior_radius_px <= 0.0 || agree as f64 >= settings.confidence_matches {
        return expected;
    }
    let free = motion_of(input, match_everywhere(input));
    if free.fit.inliers.len() > agree { Motion { prior_given_up: true, ..free } } else { expected }
}

/// Returns the motion with the most inliers among the matches.
fn motion_of(input: &MotionInput<'_>, matches: Vec<Match>) -> Motion {
    let MotionInput { then, now, settings, .. } = *input;
    let correspondence = |m: &Match| {
        let (before, after) = (&then.points[m.query as usize], &now.points[m.train as usize]);
        Correspondence {
            before: before.position_in_rover,
            after: after.position_in_rover,
            before_covariance: before.covariance_in_rover,
            after_covariance: after.covariance_in_rover,
        }
    };
    let correspondences: Vec<Correspondence> = matches.iter().map(correspondence).collect();
    let fit = fit_motion(&correspondences, &settings.ransac());
    let agreeing: Vec<Match> = fit.inliers.iter().map(|index| matches[*index]).collect();
    let pairs: Vec<Correspondence> = fit.inliers.iter().map(|index| correspondences[*index]).collect();
    let blocks: Vec<u32> = fit.inliers.iter().zip(&agreeing).map(|(i, m)| block(input, *i, m)).collect();
    let scatter = |pose| block_bootstrap(&pairs, &blocks, &pose, &settings.bootstrap());
    let bootstrap = fit.motion().and_then(scatter);
    let is_shared = bootstrap.is_some() && settings.feature_common_px > 0.0;
    let by_shared_error = if is_shared { by_shared_error(input, &agreeing, &pairs) } else { None };
    Motion { matches, fit, bootstrap, by_shared_error, prior_given_up: false }
}

/// Returns the change of the motion when all pixels of this stop shift, and when all disparities of both stops shift.
/// The shift is `feature_common_px`, times the displacement of the camera over the median range: the appearance of
/// relief changes in proportion to that ratio.
fn by_shared_error(
    input: &MotionInput<'_>,
    agreeing: &[Match],
    pairs: &[Correspondence],
) -> Option<[Vector6<f64>; 3]> {
    let motion = refit(pairs, input.settings)?;
    let unmoved = MotionParameters::from(&motion);
    let centre = input.left.model.centre();
    let mut ranges_m: Vec<f64> = pairs.iter().map(|pair| (pair.after - centre).norm()).collect();
    ranges_m.sort_by(f64::total_cmp);
    let way = (motion * centre - centre).norm() / ranges_m[ranges_m.len() / 2];
    let sigma_px = input.settings.feature_common_px * way;
    let mut changes = [Vector6::zeros(); 3];
    for (shift, change) in changes.iter_mut().enumerate() {
        let mut moved = pairs.to_vec();
        for (pair, matched) in moved.iter_mut().zip(agreeing) {
            pair.after += input.now.points[matched.train as usize].by_shift_m[shift] * SHIFT_PX;
            if shift == DISPARITY {
                pair.before += input.then.points[matched.query as usize].by_shift_m[shift] * SHIFT_PX;
            }
        }
        *change =
            MotionParameters::from(&refit(&moved, input.settings)?).minus(unmoved) * (sigma_px / SHIFT_PX);
    }
    Some(changes)
}

/// Fits the motion to its inliers, with the weights of the RANSAC fit.
fn refit(pairs: &[Correspondence], settings: &FeatureSettings) -> Option<Pose> {
    let RansacSettings { weighting, loss, .. } = settings.ransac();
    match weighting {
        Weighting::None => {
            let (before, after): (Vec<_>, Vec<_>) =
                pairs.iter().map(|pair| (pair.before, pair.after)).unzip();
            rigid_motion(&before, &after, None).ok()
        }
        Weighting::Range => Some(rigid_motion_by_covariance(pairs, loss).ok()?.after_from_before),
    }
}

/// Matches points by the descriptors of their left features (R160, R161), over the whole image.
fn match_everywhere(input: &MotionInput<'_>) -> Vec<Match> {
    matching::matches(&descriptors(input.then), &descriptors(input.now), &input.settings.matching())
}

/// Matches points; with a prior, only near the pixels predicted by the pose estimates.
fn match_points(input: &MotionInput<'_>) -> Vec<Match> {
    let MotionInput { then, now, settings, .. } = *input;
    if settings.prior_radius_px <= 0.0 {
        return match_everywhere(input);
    }
    let (before, after) = (descriptors(then), descriptors(now));
    let expected: Vec<Option<Pixel>> = then
        .points
        .iter()
        .map(|point| input.left.project(&(input.expected_now_from_then * point.position_in_rover)))
        .collect();
    let pixels: Vec<Pixel> = now.points.iter().map(|point| StopFeatures::pixel(now.left_of(point))).collect();
    let is_near = |query: usize, train: usize| {
        expected[query].is_some_and(|pixel| pixel.distance(pixels[train]) <= settings.prior_radius_px)
    };
    matching::matches_where(&before, &after, &settings.matching(), is_near)
}

/// Returns the bootstrap block of a match: its image cell in the current stop, or its index without cells.
fn block(input: &MotionInput<'_>, index: usize, matched: &Match) -> u32 {
    let cell_px = input.settings.bootstrap_cell_px;
    if cell_px <= 0.0 {
        return index as u32;
    }
    let keypoint = input.now.left_of(&input.now.points[matched.train as usize]);
    let cell = |v: f32| (f64::from(v).max(0.0) / cell_px) as u32;
    (cell(keypoint.y) << 16) | cell(keypoint.x)
}

fn descriptors(features: &StopFeatures) -> Vec<Descriptor> {
    features.points.iter().map(|point| features.left.descriptors[point.stereo.left as usize]).collect()
}
