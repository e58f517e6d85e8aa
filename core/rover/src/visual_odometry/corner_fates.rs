//! The fates of the corners during the search for matches.

use sightline_geometry::frames::Pixel;

use super::matches::{Match, NoMatch};
use super::motion::{self, Fitted};
use super::outcome::{Fate, OdometryCorner};
use super::points::{NoPoint, Point};

/// The fates of the corners so far.
pub(super) struct CornerFates {
    corners: Vec<Pixel>,
    fates: Vec<Fate>,
    ranges_m: Vec<Option<f64>>,
    after: Vec<Option<Pixel>>,
    sigmas: Vec<Option<f64>>,
    factor: u32,
}

impl CornerFates {
    pub(super) fn new(corners: impl Iterator<Item = Pixel>, factor: u32) -> Self {
        let corners: Vec<Pixel> = corners.collect();
        let count = corners.len();
        Self {
            corners,
            fates: vec![Fate::Unused; count],
            ranges_m: vec![None; count],
            after: vec![None; count],
            sigmas: vec![None; count],
            factor,
        }
    }

    /// Number of corners.
    pub(super) fn count(&self) -> usize {
        self.corners.len()
    }

    /// Records that a corner has no point.
    pub(super) fn without_point(&mut self, corner: usize, reason: NoPoint) {
        self.fates[corner] = match reason {
            NoPoint::Outside | NoPoint::LowScore => Fate::NoStereo,
            NoPoint::OutOfRange => Fate::OutOfRange,
        };
    }

    /// Records that a corner's point has no match.
    pub(super) fn without_match(&mut self, corner: usize, reason: NoMatch) {
        self.fates[corner] = match reason {
            NoMatch::OutOfView => Fate::OutOfView,
            NoMatch::LowScore => Fate::NoMatch,
            NoMatch::NoStereo => Fate::NoStereoAfter,
        };
    }

    /// Adds points, matches and residuals.
    pub(super) fn add(&mut self, points: &[(usize, Point)], matches: &[Match], fitted: Option<&Fitted>) {
        for (corner, point) in points {
            self.ranges_m[*corner] = Some(point.position.coords.norm());
        }
        for (number, found) in matches.iter().enumerate() {
            let corner = points[found.point].0;
            self.after[corner] = Some(found.left);
            let Some(fitted) = fitted else {
                self.fates[corner] = Fate::Unused;
                continue;
            };
            let square = motion::squared_distance(&found.pair, &fitted.after_from_before);
            self.sigmas[corner] = square.map(f64::sqrt);
            let is_inlier = fitted.inliers.binary_search(&number).is_ok();
            self.fates[corner] = if is_inlier { Fate::Inlier } else { Fate::Outlier };
        }
    }

    pub(super) fn table(self) -> Vec<OdometryCorner> {
        let factor = f64::from(self.factor);
        let whole = |pixel: Pixel| [pixel.x, pixel.y].map(|at| factor * at + 0.5 * (factor - 1.0));
        let row = |corner: usize| OdometryCorner {
            before_px: whole(self.corners[corner]),
            after_px: self.after[corner].map(whole),
            range_m: self.ranges_m[corner],
            residual_sigmas: self.sigmas[corner],
            fate: self.fates[corner],
        };
        (0..self.corners.len()).map(row).collect()
    }
}
