//! Step `match`: finds the points of the previous stop in the images of the current one.
//!
//! A point is predicted by the motion known so far and searched in the left image; its window is resampled as it appears
//! from there. The stereo match after the motion then gives its position there. The search runs twice: around the first
//! prediction, and within a few pixels of that of the motion fitted to the first matches, with windows resampled for it.

use nalgebra::Matrix2;

use sightline_geometry::estimate::weighted_motion::Correspondence;
use sightline_geometry::frames::{Pixel, Pose, Vector3};

use super::points::{Eyes, NoPoint, Point, ground_normal, point_near};
use super::settings::OdometrySettings;
use super::windows;

/// Search margin of the stereo match beyond that of the match between the stops, px.
const STEREO_MARGIN_PX: f64 = 2.0;

/// A point at both stops.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match {
    /// Index of the point.
    pub(super) point: usize,
    /// In the left image after, px.
    pub(super) left: Pixel,
    /// Change of the view: deviation of the window's affine map from the identity, px per px.
    pub(super) change: f64,
    /// The positions with their covariances.
    pub(super) pair: Correspondence,
    /// Derivative of the position after the motion with respect to a common shift of the matches, m per px.
    pub(super) by_shift: [Vector3; 3],
}

/// Why a point has no match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoMatch {
    /// Its prediction is outside the image after the motion, or too near to its border.
    OutOfView,
    /// No match between the stops is good enough.
    LowScore,
    /// No stereo match after the motion.
    NoStereo,
}

/// The match of a point within `reach_px` of its prediction by a motion.
pub(super) fn find(
    [before, after]: [&Eyes<'_>; 2],
    (number, point): (usize, &Point),
    motion: &Pose,
    reach_px: u32,
    settings: &OdometrySettings,
) -> Result<Match, NoMatch> {
    let predicted = motion * point.position;
    let camera = after.left.camera;
    let pixel = camera.project(&predicted).filter(|pixel| pixel.is_inside(camera.width(), camera.height()));
    let pixel = pixel.ok_or(NoMatch::OutOfView)?;
    let half = settings.window_px / 2;
    let (from, normal) = (before.left.camera, ground_normal());
    let map = windows::map_of_plane(from, camera, motion, point.left, &point.position, &normal);
    let map = map.ok_or(NoMatch::OutOfView)?;
    let change = (map - Matrix2::identity()).norm() * std::f64::consts::FRAC_1_SQRT_2;
    let template = windows::window(before.left.image, point.left, &map, half).ok_or(NoMatch::OutOfView)?;
    let region = windows::around(pixel, half, reach_px + 1);
    let surface = windows::surface(&template, after.left.image, region, settings.score);
    let surface = surface.ok_or(NoMatch::OutOfView)?;
    let found = windows::best(&surface, |_| true).filter(|found| found.score >= settings.match_score_min);
    let found = found.ok_or(NoMatch::LowScore)?;
    let sigma_px = settings.match_sigma_px.hypot(settings.relief_px * change);
    let left_px2 = found.covariance_px2 + Matrix2::identity() * sigma_px.powi(2);
    let reach = f64::from(reach_px) + STEREO_MARGIN_PX;
    let there = point_near(after, (found.pixel, left_px2), &predicted, reach, settings);
    let there = there.map_err(|_: NoPoint| NoMatch::NoStereo)?;
    let pair = Correspondence {
        before: point.position,
        after: there.position,
        before_covariance: point.covariance,
        after_covariance: there.covariance,
    };
    Ok(Match { point: number, left: found.pixel, change, pair, by_shift: there.by_shift })
}
