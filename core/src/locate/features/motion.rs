//! Steps `match_features` (then to now), `fit_motion` and `bootstrap`: the rigid motion between two stops (D§2, R161–R169,
//! R173–R175).
//!
//! It is a motion of the whole scene and knows no target: all targets share it (R168, R207). With a prior, a feature is
//! looked for only near where the pose estimates expect it.

use crate::camera::Camera;
use crate::estimate::bootstrap::{Bootstrap, bootstrap};
use crate::estimate::ransac::{MotionFit, fit_motion};
use crate::estimate::weighted_motion::Correspondence;
use crate::frames::{Pixel, Pose};
use crate::sift::Descriptor;
use crate::sift::matching::{self, Match};

use super::detect::StopFeatures;
use super::settings::FeatureSettings;

/// The motion between two stops, with all that led to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Matches of points: `query` of the earlier stop, `train` of the present one.
    pub matches: Vec<Match>,
    /// The motion that most of them agree with; takes points of the earlier rover frame into the present one.
    pub fit: MotionFit,
    /// How certain it is; none where there is no motion.
    pub bootstrap: Option<Bootstrap>,
}

/// What a motion is measured from.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// The features of the earlier stop.
    pub then: &'a StopFeatures,
    /// The features of the present stop.
    pub now: &'a StopFeatures,
    /// The motion by the pose estimates.
    pub expected_now_from_then: &'a Pose,
    /// The left camera of the present stop, in its rover frame.
    pub left: &'a Camera,
    /// The configuration.
    pub settings: &'a FeatureSettings,
}

/// Measures the motion between two stops.
pub fn motion(input: &MotionInput<'_>) -> Motion {
    let MotionInput { then, now, settings, .. } = *input;
    let matches = match_points(input);
    let correspondences: Vec<Correspondence> = matches
        .iter()
        .map(|m| {
            let (before, after) = (&then.points[m.query as usize], &now.points[m.train as usize]);
            Correspondence {
                before: before.position_in_rover,
                after: after.position_in_rover,
                before_covariance: before.covariance_in_rover,
                after_covariance: after.covariance_in_rover,
            }
        })
        .collect();
    let fit = fit_motion(&correspondences, &settings.ransac());
    let agreeing: Vec<Correspondence> = fit.inliers.iter().map(|index| correspondences[*index]).collect();
    let bootstrap = fit.motion().and_then(|pose| bootstrap(&agreeing, &pose, &settings.bootstrap()));
    Motion { matches, fit, bootstrap }
}

/// Matches of points by the descriptors of their left features (R160, R161).
fn match_points(input: &MotionInput<'_>) -> Vec<Match> {
    let MotionInput { then, now, settings, .. } = *input;
    let (before, after) = (descriptors(then), descriptors(now));
    if settings.prior_radius_px <= 0.0 {
        return matching::matches(&before, &after, &settings.matching());
    }
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

fn descriptors(features: &StopFeatures) -> Vec<Descriptor> {
    features.points.iter().map(|point| features.left.descriptors[point.stereo.left as usize]).collect()
}
