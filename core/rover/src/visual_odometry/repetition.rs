//! Detects ground with a repetitive pattern along the motion, like a rover's own tracks: another motion would fit as well.
//!
//! Some inliers are compared at all positions that other slip ratios would give them:
//! ```text
//! S(δ) = mean_i ncc_i(project(p_i by d + δ w/|w|))      repetition = highest other maximum of S / S(0)
//! ```
//! Ground without repetition has one high maximum. The value is near 1 if the motion depends on a repetitive pattern.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | d, w | motion of the rover's origin by vision, by the wheels | m, rover frame before |
//! | δ | displacement along the wheels' motion, for slip ratios of −0.4 to 1.4 | m |
//! | p_i | points | m, rover frame before |
//!
//! Source: ours; the need is that of Opportunity's sol 1066 (driving.md 3).

use nalgebra::Translation3;

use sightline_geometry::frames::{Pixel, Pose, Vector3};
use sightline_vision::correlate::zncc::Reference;
use sightline_vision::image::patch::crop;
use sightline_vision::image::{Patch, PixelRect};

use super::coarse::SLIPS;
use super::matches::Match;
use super::motion::Fitted;
use super::points::{Eyes, Point, ground_normal};
use super::settings::OdometrySettings;
use super::windows;

/// Approximate number of compared points.
const POINTS: usize = 16;
/// Smallest motion of the wheels with a defined direction, m.
const WHEELS_MIN_M: f64 = 0.02;
/// Image motion of the fastest point between neighbouring displacements, px.
const STEP_PX: f64 = 1.0;
/// Largest number of displacements.
const PLACES_MAX: f64 = 300.0;
/// Interval of displacements after which the windows are resampled, m.
const WINDOWS_M: f64 = 0.2;
/// Smallest fraction of the points that must be in view.
const IN_VIEW_MIN: f64 = 0.6;
/// Fraction of its height to which the motion's own maximum must fall before another one begins.
const FALLEN: f64 = 0.75;
/// Displacement from which on a maximum always counts as another one, m.
const APART_M: f64 = 0.025;

/// The highest other maximum relative to that of the motion; 0 without one, and if the wheels did not move.
pub(super) fn repetition(
    eyes: [&Eyes<'_>; 2],
    points: &[Point],
    (matches, fitted): (&[Match], &Fitted),
    wheels: &Vector3,
    settings: &OdometrySettings,
) -> f64 {
    let every = fitted.inliers.len().div_ceil(POINTS).max(1);
    let chosen: Vec<&Point> =
        fitted.inliers.iter().step_by(every).map(|&i| &points[matches[i].point]).collect();
    let line = Line::new(eyes, fitted, wheels, settings.window_px / 2);
    line.and_then(|line| line.scores(&chosen, wheels)).map_or(0.0, |scores| scores.repetition())
}

/// The motions that differ from that of vision by a displacement along the motion of the wheels.
struct Line<'a> {
    eyes: [&'a Eyes<'a>; 2],
    before_from_after: Pose,
    along: Vector3,
    /// Half of a window, px.
    half: u32,
}

impl<'a> Line<'a> {
    fn new(eyes: [&'a Eyes<'a>; 2], fitted: &Fitted, wheels: &Vector3, half: u32) -> Option<Self> {
        let along = wheels.try_normalize(WHEELS_MIN_M)?;
        Some(Self { eyes, before_from_after: fitted.after_from_before.inverse(), along, half })
    }

    /// The motion from the rover frame before to that after, farther by `way_m`.
    fn motion(&self, way_m: f64) -> Pose {
        let displaced = self.before_from_after.translation.vector + self.along * way_m;
        Pose::from_parts(Translation3::from(displaced), self.before_from_after.rotation).inverse()
    }

    fn pixel(&self, point: &Point, way_m: f64) -> Option<Pixel> {
        self.pixel_by(point, &self.motion(way_m))
    }

    fn pixel_by(&self, point: &Point, motion: &Pose) -> Option<Pixel> {
        self.eyes[1].left.camera.project(&(motion * point.position))
    }

    /// Spacing of neighbouring displacements, m; `None` if no point moves in the image.
    fn spacing_m(&self, points: &[&Point], wheels: &Vector3) -> Option<f64> {
        let px_per_m =
            |point: &&Point| Some(self.pixel(point, 0.01)?.distance(self.pixel(point, 0.0)?) / 0.01);
        let fastest = points.iter().filter_map(px_per_m).fold(0.0, f64::max);
        let least_m = (SLIPS[1] - SLIPS[0]) * wheels.norm() / PLACES_MAX;
        (fastest > 0.0).then(|| (STEP_PX / fastest).max(least_m))
    }

    /// The window of a point, resampled for a displacement.
    fn window(&self, point: &Point, way_m: f64) -> Option<Reference> {
        let [before, after] = self.eyes.map(|eyes| eyes.left);
        let motion = self.motion(way_m);
        let normal = ground_normal();
        let map = windows::map_of_plane(
            before.camera,
            after.camera,
            &motion,
            point.left,
            &point.position,
            &normal,
        )?;
        Reference::new(&windows::window(before.image, point.left, &map, self.half)?)
    }

    /// The score of a window at the point's projection under a motion.
    fn score(&self, window: &Reference, point: &Point, motion: &Pose) -> Option<f64> {
        let image = self.eyes[1].left.image;
        let there = windows::around(self.pixel_by(point, motion)?, self.half, 0);
        let is_whole = there.intersect(&PixelRect::whole(image.width(), image.height())) == Some(there);
        let seen = is_whole.then(|| Patch::from(crop(image, &there)))?;
        window.score(&seen).map(f64::from)
    }

    /// The mean scores at all displacements.
    fn scores(&self, points: &[&Point], wheels: &Vector3) -> Option<Scores> {
        let spacing_m = self.spacing_m(points, wheels)?;
        let seen_m = self.before_from_after.translation.vector.dot(&self.along);
        let places = SLIPS.map(|slip| ((1.0 - slip) * wheels.norm() - seen_m) / spacing_m);
        let first = places[1].floor().clamp(-PLACES_MAX, -1.0) as i32;
        let last = places[0].ceil().clamp(1.0, PLACES_MAX) as i32;
        let places = (first..=last).map(|place| f64::from(place) * spacing_m);
        let places: Vec<(f64, Pose)> = places.map(|way_m| (way_m, self.motion(way_m))).collect();
        let mut sums = vec![(0.0, 0usize); places.len()];
        for point in points {
            let mut window = (None, None);
            for ((way_m, motion), sum) in places.iter().zip(&mut sums) {
                let number = (way_m / WINDOWS_M).round();
                if window.0 != Some(number) {
                    window = (Some(number), self.window(point, number * WINDOWS_M));
                }
                let score = window.1.as_ref().and_then(|window| self.score(window, point, motion));
                if let Some(score) = score {
                    *sum = (sum.0 + score, sum.1 + 1);
                }
            }
        }
        let enough = IN_VIEW_MIN * points.len() as f64;
        let mean = |(sum, count): (f64, usize)| (count as f64 >= enough).then(|| sum / count as f64);
        Some(Scores { first, spacing_m, means: sums.into_iter().map(mean).collect() })
    }
}

/// The mean scores over the displacements along the motion; `None` if too few points are in view.
struct Scores {
    /// Index of the first displacement; that of the motion is 0.
    first: i32,
    spacing_m: f64,
    means: Vec<Option<f64>>,
}

impl Scores {
    fn at(&self, place: i32) -> Option<f64> {
        let index = usize::try_from(place - self.first).ok()?;
        self.means.get(index).copied().flatten()
    }

    fn repetition(&self) -> f64 {
        let own = (-1..=1).filter_map(|place| self.at(place)).fold(0.0, f64::max);
        if own <= 0.0 {
            return 0.0;
        }
        let last = self.first + self.means.len() as i32 - 1;
        let others = (self.first..=last).filter(|place| !self.is_own(*place, own) && self.is_maximum(*place));
        others.filter_map(|place| self.at(place)).fold(0.0, f64::max) / own
    }

    /// Whether a displacement belongs to the motion's own maximum, which ends where the scores have fallen, at the latest at
    /// `APART_M`.
    fn is_own(&self, place: i32, own: f64) -> bool {
        let mut between = place.min(0)..=place.max(0);
        f64::from(place.abs()) * self.spacing_m < APART_M
            && between.all(|place| self.at(place).is_none_or(|score| score > FALLEN * own))
    }

    fn is_maximum(&self, place: i32) -> bool {
        let Some(score) = self.at(place) else { return false };
        [place - 1, place + 1].into_iter().all(|beside| self.at(beside).is_none_or(|beside| score >= beside))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scores at displacements 1 cm apart, with the motion in the middle.
    fn scores(of: impl Fn(i32) -> f64) -> Scores {
        Scores { first: -40, spacing_m: 0.01, means: (-40..=40).map(|place| Some(of(place))).collect() }
    }

    #[test]
    fn one_maximum_has_no_other_and_repeated_ones_are_told() {
        let one = scores(|place| 0.9 * (-f64::from(place * place) / 4.0).exp());
        assert!(one.repetition() < 0.01, "{}", one.repetition());
        let fence = scores(|place| 0.8 * (f64::from(place) * std::f64::consts::TAU / 4.0).cos());
        assert!((fence.repetition() - 1.0).abs() < 1e-9);
        let faint = scores(|place| match place {
            0 => 0.9,
            _ if place % 8 == 0 => 0.45,
            _ => -0.1,
        });
        assert!((faint.repetition() - 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_slope_of_the_own_maximum_is_no_other_one() {
        let wide = scores(|place| if place == 2 { 0.85 } else { 0.9 - 0.04 * f64::from(place.abs()) });
        assert_eq!(wide.repetition(), 0.0);
        let nothing = Scores { first: -1, spacing_m: 0.01, means: vec![None; 3] };
        assert_eq!(nothing.repetition(), 0.0);
    }
}
