//! Stereo criteria of a point: its range, the nearest depth edge, and the plane of its window.
//!
//! A depth edge is between two neighbours with a disparity, or across a hole of at most `HOLE_PX`, when
//! ```text
//! │d₁ − d₂│ > edge_share · max(d₁, d₂) + edge_slope · gap
//! ```
//! The second term is the disparity step of the steepest surface whose slope the tracker accepts. Distances to edges are
//! chamfer distances (3, 4), within 6 % of Euclidean ones.
//!
//! The inverse range of a plane is linear over the image, as in `locate/template/warnings.rs`.
//!
//! Frames: px of the aligned left image, which is nearly the left one, or nodes of a grid of the left image if the rows of
//! a pair cannot be aligned (`point_ranges`); points in the rover frame, m.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::limits::TrackabilityLimits;
use super::point_ranges::{PointRanges, SPACING_PX, node_of};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3};
use sightline_track::locate::shape_tracker::surface::StopSurface;
use sightline_track::locate::template::warnings::{Ranged, departure, plane};
use sightline_vision::stereo::{DisparityMap, Outcome};

/// Largest width of a hole, px, across which depth edges are searched.
const HOLE_PX: usize = 24;
/// Distance along a pixel's ray at which its aligned pixel is looked up, m.
const ALONG_M: f64 = 5.0;
/// Samples along a side of a window.
const SAMPLES: i32 = 5;
/// Smallest number of samples for statistics of a window's ranges.
const SAMPLES_MIN: usize = 9;
/// Neighbourhood searched for ranges around a pixel without one, px.
const NEAR_PX: i32 = 2;
/// Smallest number of neighbours that must have a range.
const NEAR_MIN: usize = 9;

/// The ranges of a stop, from dense stereo or from point stereo.
pub(super) enum Surface {
    /// Ranges of every pixel of the aligned left image.
    Dense(Arc<StopSurface>),
    /// Ranges at the nodes of a grid of the left image.
    Points(PointRanges),
}

impl Surface {
    /// Disparities and outcomes.
    pub(super) fn map(&self) -> &DisparityMap {
        match self {
            Self::Dense(surface) => &surface.disparities,
            Self::Points(points) => &points.nodes,
        }
    }

    /// The points of the map, m, rover frame; NaN without a range.
    fn points_m(&self) -> &[[f32; 3]] {
        match self {
            Self::Dense(surface) => &surface.points_m,
            Self::Points(points) => &points.points_m,
        }
    }

    /// The centre of the left camera, m, rover frame.
    fn viewpoint(&self) -> Point3 {
        match self {
            Self::Dense(surface) => surface.viewpoint,
            Self::Points(points) => points.viewpoint,
        }
    }

    /// Pixels between two neighbours of the map.
    fn spacing_px(&self) -> u32 {
        match self {
            Self::Dense(_) => 1,
            Self::Points(_) => SPACING_PX,
        }
    }

    /// The distance from each element of the map to the nearest depth edge, px.
    ///
    /// An edge between two nodes of a grid is half a spacing away from either of them.
    pub(super) fn edge_distances_px(&self, limits: &TrackabilityLimits) -> Vec<f32> {
        let (spacing_px, mut distances) = (self.spacing_px(), edge_distances(self.map(), limits));
        if spacing_px > 1 {
            distances.iter_mut().for_each(|nodes| *nodes = (*nodes + 0.5) * spacing_px as f32);
        }
        distances
    }
}

/// The distance from each pixel of the aligned image to the nearest depth edge, px; infinite if there is none.
pub fn edge_distances(map: &DisparityMap, limits: &TrackabilityLimits) -> Vec<f32> {
    let (width, height) = (map.width as usize, map.height as usize);
    let mut steps = vec![f32::INFINITY; width * height];
    let mut along = |first: usize, stride: usize, count: usize| {
        let mut last: Option<usize> = None;
        for number in 0..count {
            let at = first + number * stride;
            let disparity = f64::from(map.disparity_px[at]);
            if !disparity.is_finite() {
                continue;
            }
            if let Some(before) = last.filter(|before| number - before <= HOLE_PX) {
                let other = f64::from(map.disparity_px[first + before * stride]);
                let gap = (number - before) as f64;
                let allowed = limits.edge_share * disparity.max(other) + limits.edge_slope * gap;
                if (disparity - other).abs() > allowed {
                    (steps[at], steps[first + before * stride]) = (0.0, 0.0);
                }
            }
            last = Some(number);
        }
    };
    (0..height).for_each(|y| along(y * width, 1, width));
    (0..width).for_each(|x| along(x, width, height));
    chamfer(&mut steps, width, height);
    steps
}

/// Distance transform from the zeros, in a forward and a backward pass.
fn chamfer(distance: &mut [f32], width: usize, height: usize) {
    const STRAIGHT: f32 = 1.0;
    const SLANTED: f32 = 4.0 / 3.0;
    let mut relax = |at: usize, x: usize, from: [(Option<usize>, bool, bool, f32); 4]| {
        for (other, left, right, step) in from {
            if (left && x == 0) || (right && x + 1 == width) {
                continue;
            }
            if let Some(value) = other.and_then(|other| distance.get(other)).map(|value| value + step)
                && value < distance[at]
            {
                distance[at] = value;
            }
        }
    };
    for at in 0..width * height {
        let up = at.checked_sub(width);
        relax(
            at,
            at % width,
            [
                (at.checked_sub(1), true, false, STRAIGHT),
                (up, false, false, STRAIGHT),
                (up.and_then(|up| up.checked_sub(1)), true, false, SLANTED),
                (up.map(|up| up + 1), false, true, SLANTED),
            ],
        );
    }
    for at in (0..width * height).rev() {
        let down = at + width;
        relax(
            at,
            at % width,
            [
                (Some(at + 1), false, true, STRAIGHT),
                (Some(down), false, false, STRAIGHT),
                (Some(down + 1), false, true, SLANTED),
                (down.checked_sub(1), true, false, SLANTED),
            ],
        );
    }
}

/// Statistics of the ranges in a window; each is `None` with too few ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WindowRanges {
    /// (farthest − nearest)/range.
    pub(super) spread: Option<f64>,
    /// Largest departure from a plane, relative to the range.
    pub(super) departure: Option<f64>,
    /// Angle between the surface's normal and the line of sight, rad.
    pub(super) incidence_rad: Option<f64>,
}

/// The ranges under the pixels of a left image.
pub(super) struct Ranges<'a> {
    /// The ranges of the stop.
    pub(super) surface: &'a Surface,
    /// The left camera.
    pub(super) left: &'a Camera,
}

impl Ranges<'_> {
    /// The element of the map that corresponds to a pixel of the left image.
    pub(super) fn aligned(&self, pixel: Pixel) -> Option<[u32; 2]> {
        let seen = match self.surface {
            Surface::Dense(surface) => {
                let ray = self.left.ray(pixel)?;
                surface.alignment.left.project(&ray.at(ALONG_M))?
            }
            Surface::Points(_) => node_of(pixel),
        };
        let map = self.surface.map();
        seen.is_inside(map.width, map.height).then(|| [seen.x.round() as u32, seen.y.round() as u32])
    }

    /// The point of an aligned pixel, or the median one of its neighbours; in a grid that of the node only.
    pub(super) fn point(&self, [x, y]: [u32; 2]) -> Option<Point3> {
        if let Some(point) = self.at(i64::from(x), i64::from(y)) {
            return Some(point);
        }
        // The neighbours of a node are as far away as the window extends.
        if self.surface.spacing_px() > 1 {
            return None;
        }
        let around = (-NEAR_PX..=NEAR_PX).flat_map(|v| (-NEAR_PX..=NEAR_PX).map(move |u| (u, v)));
        let mut near: Vec<Point3> = around
            .filter_map(|(u, v)| self.at(i64::from(x) + i64::from(u), i64::from(y) + i64::from(v)))
            .collect();
        if near.len() < NEAR_MIN {
            return None;
        }
        near.sort_by(|a, b| self.range_m(a).total_cmp(&self.range_m(b)));
        Some(near[near.len() / 2])
    }

    /// Why an aligned pixel has no range.
    pub(super) fn outcome(&self, [x, y]: [u32; 2]) -> Outcome {
        let map = self.surface.map();
        map.outcome.get((y * map.width + x) as usize).copied().unwrap_or(Outcome::Outside)
    }

    /// The score of point stereo; `None` for dense stereo.
    pub(super) fn stereo_score(&self, [x, y]: [u32; 2]) -> Option<f64> {
        let Surface::Points(points) = self.surface else { return None };
        let score = points.scores.get((y * points.nodes.width + x) as usize)?;
        score.is_finite().then(|| f64::from(*score))
    }

    /// The distance of a point from the left camera, m.
    pub(super) fn range_m(&self, point: &Point3) -> f64 {
        (point - self.surface.viewpoint()).norm()
    }

    /// Statistics of the window of `half_px` around an aligned pixel at `range_m`.
    pub(super) fn window(&self, [x, y]: [u32; 2], range_m: f64, half_px: f64) -> WindowRanges {
        let spacing_px = f64::from(self.surface.spacing_px());
        // Whole elements of the map, inside the window.
        let offset = |k: i32| {
            let offset_px = (half_px * (2.0 * f64::from(k) / f64::from(SAMPLES - 1) - 1.0)).round();
            (offset_px / spacing_px).trunc()
        };
        let places = (0..SAMPLES).flat_map(|v| (0..SAMPLES).map(move |u| (offset(u), offset(v))));
        let points: Vec<(f64, f64, Point3)> = places
            .filter_map(|(u, v)| {
                let point = self.at(i64::from(x) + u as i64, i64::from(y) + v as i64)?;
                Some((u * spacing_px, v * spacing_px, point))
            })
            .collect();
        if points.len() < SAMPLES_MIN {
            return WindowRanges::default();
        }
        let ranged = |(u_px, v_px, point): &(f64, f64, Point3)| Ranged {
            u_px: *u_px,
            v_px: *v_px,
            range_m: self.range_m(point),
        };
        let ranges: Vec<Ranged> = points.iter().map(ranged).collect();
        let Some(fitted) = plane(&ranges) else { return WindowRanges::default() };
        let nearest = ranges.iter().map(|r| r.range_m).fold(f64::INFINITY, f64::min);
        let farthest = ranges.iter().map(|r| r.range_m).fold(0.0, f64::max);
        WindowRanges {
            spread: Some((farthest - nearest) / range_m),
            departure: Some(departure(&fitted, &ranges, range_m)),
            incidence_rad: self.incidence_rad(&points),
        }
    }

    /// Angle between the normal of the plane through the points and the line of sight to their centroid, rad.
    fn incidence_rad(&self, points: &[(f64, f64, Point3)]) -> Option<f64> {
        let sum = points.iter().fold(Vector3::zeros(), |sum, (_, _, point)| sum + point.coords);
        let middle = sum / points.len() as f64;
        let scatter = points.iter().fold(Matrix3::zeros(), |sum, (_, _, point)| {
            let from = point.coords - middle;
            sum + from * from.transpose()
        });
        let eigen = scatter.symmetric_eigen();
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let sight = (middle - self.surface.viewpoint().coords).try_normalize(1e-9)?;
        Some(normal.dot(&sight).abs().min(1.0).acos())
    }

    fn at(&self, x: i64, y: i64) -> Option<Point3> {
        let map = self.surface.map();
        let (x, y) = (u32::try_from(x).ok()?, u32::try_from(y).ok()?);
        if x >= map.width || y >= map.height {
            return None;
        }
        let point = self.surface.points_m().get((y * map.width + x) as usize)?;
        point[0].is_finite().then(|| Point3::from(point.map(f64::from)))
    }
}
