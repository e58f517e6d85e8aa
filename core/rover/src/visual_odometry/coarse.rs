//! Step `coarse_search`: the translation between two stops, independent of wheel odometry.
//!
//! With wheel slip the predicted points are off by hundreds of pixels, while gyro and accelerometers measure the rotation.
//! Images are reduced to about 64 px, where the whole step is a few pixels. Strong points are compared at all positions
//! that translations can give them; a translation scores the mean over the points that it keeps in view,
//! ```text
//! d(s, a)  = (1 − s) w + a n      s from −0.4 to 1.4, |a| ≤ 0.45 |w| + 5 cm
//! score(d) = mean_i ncc_i(project(p_i by d))
//! ```
//! If other translations score nearly as well, as along the rover's own tracks, the matches in the full images decide.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | w, n | motion by the wheels, its horizontal normal | m, rover frame before |
//! | s, a | slip ratio along the motion, motion aside | –, m |
//! | p_i | points | m, rover frame before |
//!
//! Source: ours.

use nalgebra::Translation3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_vision::correlate::Surface;

use super::points::{Eyes, Point, ground_normal};
use super::reduce::Reduced;
use super::settings::OdometryScore;
use super::windows;

/// Approximate width of the compared images, px.
const WIDTH_PX: u32 = 64;
/// Half of a window, px.
const HALF_PX: u32 = 3;
/// Largest number of compared points.
const POINTS_MAX: usize = 40;
/// Range of slip ratios along the motion.
pub(super) const SLIPS: [f64; 2] = [-0.4, 1.4];
/// Range of the motion aside: relative to the wheels' motion, and the minimum, m.
const ASIDE: f64 = 0.45;
const ASIDE_MIN_M: f64 = 0.05;
/// Image motion of a near point between neighbouring translations, px.
const STEP_PX: f64 = 1.0;
/// Smallest distance between distinct translations, in steps.
const APART_STEPS: f64 = 3.5;
/// Number of kept translations.
const KEPT: usize = 3;
/// Fraction of the best score from which on another translation is tried as well.
const NEARLY: f64 = 0.8;
/// Slip ratios for which the windows are resampled.
const WINDOW_SLIPS: [f64; 3] = [0.0, 0.5, 1.0];
/// Smallest fraction of the points that a translation must keep in view.
const IN_VIEW_MIN: f64 = 0.4;

/// A translation with its score.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = OdometryTranslation)]
pub struct Translation {
    /// Motion of the rover's origin in the rover frame before, m.
    pub translation_m: [f64; 3],
    /// Its score, −1 to 1.
    pub score: f64,
}

impl From<(Vector3, f64)> for Translation {
    fn from((translation, score): (Vector3, f64)) -> Self {
        Self { translation_m: translation.into(), score }
    }
}

/// The result of the coarse search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = OdometryCoarseSearch)]
pub struct CoarseSearch {
    /// The best translation.
    pub best: Translation,
    /// The next best distinct translations, best first.
    pub others: Vec<Translation>,
    /// Number of compared translations.
    pub translations: u32,
    /// Spacing of neighbouring translations, m.
    pub spacing_m: f64,
}

/// Finds the translation with the highest mean score; `None` if fewer than six points can be compared.
pub(super) fn coarse_search(
    before: &Eyes<'_>,
    after: &Eyes<'_>,
    points: &[Point],
    predicted_after_from_before: &Pose,
) -> Option<CoarseSearch> {
    let [before, after] = [before, after].map(|eyes| {
        let factor = (eyes.left.camera.width() / WIDTH_PX).max(1);
        Reduced::new(eyes.left, factor)
    });
    let before_from_after = predicted_after_from_before.inverse();
    let wheels = before_from_after.translation.vector;
    let motion = |displacement: Vector3| {
        Pose::from_parts(Translation3::from(displacement), before_from_after.rotation).inverse()
    };
    let maps = Maps::new(&before, &after, points, |slip| motion(wheels * (1.0 - slip)));
    if maps.points.len() < 6 {
        return None;
    }
    let grid = Grid::new(&wheels, maps.near_m(&before) * STEP_PX / focal_px(&before)?);
    let scored: Vec<(Vector3, f64)> = grid
        .displacements()
        .filter_map(|displacement| Some((displacement, maps.score(&motion(displacement), &after)?)))
        .collect();
    let count = scored.len();
    let [best, others @ ..] = apart(scored, APART_STEPS * grid.spacing_m);
    let (translation, score) = best?;
    let others: Vec<Translation> = others.into_iter().flatten().map(Translation::from).collect();
    let translation_m = translation.into();
    Some(CoarseSearch {
        best: Translation { translation_m, score },
        others,
        translations: count as u32,
        spacing_m: grid.spacing_m,
    })
}

/// The best translations, each at least `apart_m` from the previous ones.
fn apart(mut scored: Vec<(Vector3, f64)>, apart_m: f64) -> [Option<(Vector3, f64)>; KEPT] {
    let mut kept = [None; KEPT];
    for place in &mut kept {
        let Some(best) = scored.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        scored.retain(|other| (other.0 - best.0).norm() > apart_m);
        *place = Some(best);
    }
    kept
}

impl CoarseSearch {
    /// Start motions for the matches, the best first: one with the predicted rotation for each translation that scores
    /// nearly as well as the best.
    pub(super) fn starts(&self, predicted_after_from_before: &Pose) -> Vec<Pose> {
        let turn = predicted_after_from_before.inverse().rotation;
        let nearly = |other: &&Translation| other.score >= NEARLY * self.best.score;
        let kept = std::iter::once(&self.best).chain(self.others.iter().filter(nearly));
        kept.map(|kept| {
            Pose::from_parts(Translation3::from(Vector3::from(kept.translation_m)), turn).inverse()
        })
        .collect()
    }
}

fn focal_px(reduced: &Reduced) -> Option<f64> {
    reduced.camera.model.focal_length_px(reduced.camera.centre_pixel())
}

/// The displacements of the search.
struct Grid {
    wheels: Vector3,
    aside: Vector3,
    aside_m: f64,
    spacing_m: f64,
}

impl Grid {
    fn new(wheels: &Vector3, spacing_m: f64) -> Self {
        let level = Vector3::new(wheels.x, wheels.y, 0.0);
        let along = level.try_normalize(1e-6).unwrap_or_else(Vector3::x);
        let aside = Vector3::new(-along.y, along.x, 0.0);
        Self { wheels: *wheels, aside, aside_m: ASIDE * level.norm() + ASIDE_MIN_M, spacing_m }
    }

    fn displacements(&self) -> impl Iterator<Item = Vector3> + '_ {
        // Wheels that hardly moved may have slid nevertheless.
        let level = Vector3::new(self.wheels.x, self.wheels.y, 0.0);
        let length_m = level.norm().max(ASIDE_MIN_M);
        let along = level.try_normalize(1e-6).unwrap_or_else(Vector3::x);
        let count = |length_m: f64| (length_m / self.spacing_m).ceil() as i32;
        let range = [(1.0 - SLIPS[1]) * length_m, (1.0 - SLIPS[0]) * length_m];
        let (first, last) = (-count(-range[0]), count(range[1]));
        let aside = count(self.aside_m);
        (first..=last).flat_map(move |i| {
            (-aside..=aside).map(move |j| {
                let along_m = f64::from(i) * self.spacing_m;
                // The ground's relief lifts the rover as it advances.
                let up = Vector3::z() * (self.wheels.z * along_m / length_m);
                along * along_m + self.aside * (f64::from(j) * self.spacing_m) + up
            })
        })
    }
}

/// The score maps of the compared points.
struct Maps {
    points: Vec<(Point3, Vec<Surface>)>,
}

impl Maps {
    fn new(before: &Reduced, after: &Reduced, points: &[Point], motion: impl Fn(f64) -> Pose) -> Self {
        let motions = WINDOW_SLIPS.map(motion);
        let every = points.len().div_ceil(POINTS_MAX).max(1);
        let maps = points.iter().step_by(every).filter_map(|point| {
            let pixel = before.camera.project(&point.position)?;
            let surfaces: Vec<Surface> =
                motions.iter().filter_map(|motion| surface(before, after, point, pixel, motion)).collect();
            (!surfaces.is_empty()).then_some((point.position, surfaces))
        });
        Self { points: maps.collect() }
    }

    /// The first quartile of the points' ranges, m.
    fn near_m(&self, before: &Reduced) -> f64 {
        let centre = before.camera.model.centre();
        let mut ranges: Vec<f64> = self.points.iter().map(|(point, _)| (point - centre).norm()).collect();
        ranges.sort_by(f64::total_cmp);
        ranges[ranges.len() / 4]
    }

    /// Mean score of the points in view under a motion; `None` if too few are in view.
    fn score(&self, after_from_before: &Pose, after: &Reduced) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0usize);
        for (point, surfaces) in &self.points {
            let Some(pixel) = after.camera.project(&(after_from_before * point)) else { continue };
            let (x, y) = (pixel.x.round() as i32, pixel.y.round() as i32);
            let scores = surfaces
                .iter()
                .filter_map(|surface| surface.index_of(x, y).and_then(|(x, y)| surface.at(x, y)));
            if let Some(score) = scores.max_by(f32::total_cmp) {
                sum += f64::from(score);
                count += 1;
            }
        }
        let is_enough = count as f64 >= IN_VIEW_MIN * self.points.len() as f64 && count >= 4;
        is_enough.then(|| sum / count as f64)
    }
}

/// Score map of one point's window, resampled for a motion, over the whole image.
fn surface(before: &Reduced, after: &Reduced, point: &Point, pixel: Pixel, motion: &Pose) -> Option<Surface> {
    let normal = ground_normal();
    let (from, to) = (&before.camera, &after.camera);
    let map = windows::map_of_plane(from, to, motion, pixel, &point.position, &normal)?;
    let template = windows::window(&before.image, pixel, &map, HALF_PX)?;
    windows::surface(&template, &after.image, after.inside(), OdometryScore::Normalised)
}
