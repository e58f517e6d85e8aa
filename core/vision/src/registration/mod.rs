//! Registration for the shape tracker: locates the target by the shape of its surroundings alone (Deans et al. 2005,
//! D§2).
//!
//! ```text
//! points ─► mesh ─┐ fixed: the target's first view                ┌─ path, residuals before and after
//!                 ├─► range_sensor ─► coarse_register ─► refine_register ─► covariance ─► failure or not
//! points ─► mesh ─┘ moving: the current view       └─ J over (Δx, Δy)
//! ```
//! Every current view is registered to the *first* view of the target, so that errors do not accumulate (R189). The
//! result maps points of the current frame into the first one; its inverse maps the target's first position into the
//! current frame.
//!
//! | file | contents |
//! |---|---|
//! | `grid` | points in the order of the instrument's rows and columns |
//! | `mesh` | triangles between neighbours, cut at jumps; level of detail |
//! | `range_sensor`, `rasterise` | rendered depth map of a mesh |
//! | `objective` | D-Eq 12 with a minimum overlap |
//! | `coarse_register` | D-Eq 13, 14 over all shifts |
//! | `refine_register`, `nelder_mead` | all six parameters; the paper's method and point to plane |
//! | `held` | prior of the motion |
//! | `pairs`, `slopes` | point-to-plane residuals with their noise |
//! | `covariance` | covariance of the result |
//! | `failure` | reasons to reject the result |
//!
//! Frames: *fixed* and *moving* are the rover frames of the two views; *sensor* is the frame of the virtual sensor,
//! centred at the target. A result is `fixed_from_moving`. All functions are pure; only the coarse search uses rayon,
//! and its bits do not depend on the number of threads.
//!
//! Source: Deans et al. 2005, D§2 "3D shape based tracker"; R187–R204; E24, E27, E28, E31.

pub mod grid;
pub mod mesh;
pub mod range_sensor;
mod rasterise;
mod render;
pub mod objective;
mod slopes;
mod pairs;
mod held;
pub mod coarse_register;
pub mod nelder_mead;
pub mod refine_register;
pub mod covariance;
pub mod failure;
mod settings;
mod checks;

use nalgebra::{Matrix3, Matrix6};
use serde::{Deserialize, Serialize};

use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Pose, PoseRecord};

pub use coarse_register::{CoarseSurface, Minimum};
pub use covariance::Precision;
pub use failure::{Failure, Side};
pub use grid::{PointGrid, Scan};
pub use mesh::{Detail, Mesh, MeshSettings, Region};
pub use nelder_mead::{PathStep, SimplexSettings};
pub use objective::{Agreement, Offset};
pub use range_sensor::{Projection, RangeImage, RangeSensor};
pub use settings::{CheckSettings, Method, PlaneSettings, ShapeSettings};

use coarse_register::{CoarseInput, coarse_register};
use covariance::{arm, covariance_of_point, precision};
use held::Held;
use objective::{Objective, motion};
use pairs::{Moving, Template};
use refine_register::{Refinement, refine_register};

/// Input of a registration.
#[derive(Clone, Copy, Debug)]
pub struct RegistrationInput<'a> {
    /// The first view of the target; its frame is `fixed`.
    pub fixed: &'a Mesh,
    /// The current view; its frame is `moving`.
    pub moving: &'a Mesh,
    /// Initial estimate of the motion (R197).
    pub start_fixed_from_moving: &'a Pose,
    /// The target in the first view, m.
    pub target_in_fixed: &'a Point3,
    /// Half the width of the object around the target, m.
    pub half_width_m: f64,
    /// Uncertainty of the start; `None`: no prior.
    pub prior: Option<Prior>,
    /// The virtual sensor; `None`: one that points at the target ([`sensor_for`]).
    pub sensor: Option<RangeSensor>,
    /// Once requested, the registration ends soon and its result is discarded.
    pub cancel: Cancel<'a>,
}

/// Prior uncertainty of the start of a registration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Covariance of the target in the current view, m², in the frame of that view.
    pub target_m2: Matrix3<f64>,
    /// 1σ of the attitude about each axis, rad.
    pub attitude_rad: f64,
}

/// Differences of depth, h − z, in the sensor's image; m, row by row; NaN unless both surfaces cover the pixel (R202).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DepthErrors {
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// Depths of the fixed surface, m; infinite where it does not cover the pixel.
    pub fixed_m: Vec<f32>,
    /// At the start.
    pub before_m: Vec<f32>,
    /// After the coarse search.
    pub coarse_m: Vec<f32>,
    /// After the refinement.
    pub fine_m: Vec<f32>,
}

/// A registration, accepted or rejected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Registration {
    /// Maps points of the current view into the first; the start if the registration ended early.
    pub fixed_from_moving: Pose,
    /// The target in the current view, m.
    pub target_in_moving: Point3,
    /// Covariance of `target_in_moving` from the registration alone, m²; excludes the target's own error in the first
    /// view.
    pub covariance_in_moving: Option<Matrix3<f64>>,
    /// Covariance of the motion, in the axes of the sensor, about the target.
    pub precision: Option<Precision>,
    /// J at the start, after the coarse search and after the refinement.
    pub agreement: [Option<Agreement>; 3],
    /// Reduced misfit: RMS residual over its predicted σ (1 = consistent with the noise model). `None` without a noise
    /// model.
    pub misfit: Option<f64>,
    /// Rotation angle of the refinement from the start, rad.
    pub turn_rad: f64,
    /// The coarse search.
    pub coarse: CoarseSurface,
    /// Steps of the refinement.
    pub path: Vec<PathStep>,
    /// Differences of depth in the sensor's image.
    pub depth_errors: DepthErrors,
    /// The virtual sensor; `None` if the registration ended before it was chosen.
    pub sensor: Option<RangeSensor>,
    /// Reason for rejecting the result; `None` if it is accepted.
    pub failure: Option<Failure>,
}

/// Summary of a registration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegistrationRecord {
    /// Maps points of the current view into the first.
    pub fixed_from_moving: PoseRecord,
    /// The target in the current view, m.
    pub target_in_moving: [f64; 3],
    /// 1σ of the target in its least constrained direction, m.
    pub sigma_m: Option<f64>,
    /// Covariance of the offset (t, ω) about the target, axes of the sensor.
    pub covariance: Option<Matrix6<f64>>,
    /// J at the start, after the coarse search and at the end, m.
    pub mean_m: [Option<f64>; 3],
    /// Fraction of the fixed surface's pixels that both surfaces cover at the end.
    pub overlap: Option<f64>,
    /// Reduced misfit: RMS residual over its predicted σ.
    pub misfit: Option<f64>,
    /// Reason for rejecting the result; `None` if it is accepted.
    pub failure: Option<Failure>,
}

impl Registration {
    /// 1σ of the target in its least constrained direction, m.
    pub fn sigma_m(&self) -> Option<f64> {
        self.covariance_in_moving.map(|covariance| covariance::weakest(&covariance).0)
    }

    /// Returns the summary.
    pub fn record(&self) -> RegistrationRecord {
        RegistrationRecord {
            fixed_from_moving: PoseRecord::from(&self.fixed_from_moving),
            target_in_moving: self.target_in_moving.coords.into(),
            sigma_m: self.sigma_m(),
            covariance: self.precision.as_ref().and_then(|precision| precision.covariance),
            mean_m: self.agreement.map(|agreement| agreement.map(|agreement| agreement.mean_m)),
            overlap: self.agreement[2].map(|agreement| agreement.overlap),
            misfit: self.misfit,
            failure: self.failure,
        }
    }

    fn failed(mut self, failure: Failure) -> Self {
        self.failure = Some(failure);
        self
    }
}

/// The sensor that points at the target along the mean of both lines of sight and spans its surroundings.
pub fn sensor_for(input: &RegistrationInput<'_>, settings: &ShapeSettings) -> RangeSensor {
    let sight = |viewpoint: Point3| (input.target_in_fixed - viewpoint).normalize();
    let first = sight(input.fixed.viewpoint);
    let both = first + sight(input.start_fixed_from_moving * input.moving.viewpoint);
    // Opposite lines of sight have no mean; the first view's is used.
    let direction = if both.norm() > 0.2 { both } else { first };
    let side_m = 2.0 * input.half_width_m * (1.0 + settings.margin);
    RangeSensor::looking_at(input.target_in_fixed, &direction, side_m, settings.sensor_px)
}

/// Registers two surfaces: coarse search, refinement, covariance, checks.
pub fn register(input: &RegistrationInput<'_>, settings: &ShapeSettings) -> Registration {
    let mut result = Registration {
        fixed_from_moving: *input.start_fixed_from_moving,
        target_in_moving: input.start_fixed_from_moving.inverse() * input.target_in_fixed,
        ..Registration::default()
    };
    if let Some(failure) = checks::surfaces(input, &settings.checks) {
        return result.failed(failure);
    }
    let sensor = input.sensor.unwrap_or_else(|| sensor_for(input, settings));
    result.sensor = Some(sensor);
    // The target is the pivot of rotations also if the caller gave the sensor.
    let pivot = sensor.sensor_from_fixed * input.target_in_fixed;
    let template = Template::new(sensor, input.fixed, pivot, settings);
    let moving = Moving::new(input.moving, &(sensor.sensor_from_fixed * input.start_fixed_from_moving));
    if template.image.covered() == 0.0 {
        return result.failed(Failure::EmptySurface { side: Side::Fixed });
    }
    let coarse = coarse_register(&CoarseInput {
        sensor: &sensor,
        fixed_m: &template.image.depth_m,
        facets: &moving.facets,
        pivot,
        half_range_m: settings.search_half_range_m.unwrap_or(input.half_width_m),
        apart_m: settings.checks.apart * input.half_width_m,
        overlap_min: settings.overlap_min,
        cancel: input.cancel,
    });
    let best = coarse.best;
    let overlap_best = coarse.overlap_best;
    result.coarse = coarse;
    let Some(best) = best else {
        return result.failed(Failure::NoOverlap { share: overlap_best, least: settings.overlap_min });
    };
    let (near, start) = (refine_register::near(&template, &moving, &best.offset()), best.offset());
    let held = Held::new(input, &sensor);
    let (end, path) = refine(&template, &near, &start, &held, (settings, input.cancel));
    result.path = path;
    let ways = [(Offset::zeros(), &moving), (start, &near), (end, &near)];
    finish(result, &template, ways, (input, &held), settings)
}

/// Refines the motion. With a prior, repeats the fit using the measured correlation of the residuals.
fn refine(
    template: &Template,
    near: &Moving,
    start: &Offset,
    held: &Held,
    (settings, cancel): (&ShapeSettings, Cancel<'_>),
) -> (Offset, Vec<PathStep>) {
    let how = Refinement { settings, cancel };
    let (end, mut path) = refine_register(template, near, start, &how, held);
    if held.is_free() || settings.method == Method::SimplexL1 {
        return (end, path);
    }
    let (image, pairs) = template.pairs(near, &end);
    let alike_px = precision(template, &image, &pairs, settings.method, held).alike_px;
    let held = Held { alike_px, ..*held };
    let (end, again) = refine_register(template, near, &end, &how, &held);
    let before = path.last().map_or(0, |last| last.evaluations);
    path.extend(again.into_iter().map(|step| PathStep {
        evaluations: step.evaluations + before,
        run: 1,
        ..step
    }));
    (end, path)
}

/// Computes residuals, covariance and verdict at the end of a registration. `ways` are the offsets at the start, after
/// the coarse search and at the end, each with the part of the moving surface to render.
fn finish(
    mut result: Registration,
    template: &Template,
    ways: [(Offset, &Moving); 3],
    (input, held): (&RegistrationInput<'_>, &Held),
    settings: &ShapeSettings,
) -> Registration {
    let sensor = &template.sensor;
    let fixed_m = &template.image.depth_m;
    let [(before_m, before), (coarse_m, coarse), (fine_m, fine)] = ways.map(|(offset, moving)| {
        let overlap_min = settings.overlap_min;
        let mut objective = Objective::new(sensor, fixed_m, &moving.facets, template.pivot, overlap_min);
        let agreement = objective.at(&offset);
        (objective.differences_m(), Some(agreement))
    });
    result.agreement = [before, coarse, fine];
    let (width, height) = (sensor.width, sensor.height);
    result.depth_errors = DepthErrors { width, height, fixed_m: fixed_m.clone(), before_m, coarse_m, fine_m };
    let (end, near) = ways[2];
    let motion = motion(&end, &template.pivot);
    let fixed_from_sensor = sensor.sensor_from_fixed.inverse();
    result.fixed_from_moving =
        fixed_from_sensor * motion * sensor.sensor_from_fixed * input.start_fixed_from_moving;
    result.target_in_moving = result.fixed_from_moving.inverse() * input.target_in_fixed;
    let (image, pairs) = template.pairs(near, &end);
    let precision = precision(template, &image, &pairs, settings.method, held);
    let target = arm(&(sensor.sensor_from_fixed * input.target_in_fixed), &template.pivot);
    result.covariance_in_moving = precision.covariance.map(|covariance| {
        let turn = (result.fixed_from_moving.inverse() * fixed_from_sensor).rotation.to_rotation_matrix();
        let common = Matrix3::identity() * settings.common_sigma_m.powi(2);
        turn.matrix() * covariance_of_point(&covariance, &target) * turn.matrix().transpose() + common
    });
    result.misfit = checks::misfit(&pairs);
    result.turn_rad = end.fixed_rows::<3>(3).norm();
    result.precision = Some(precision);
    result.failure = checks::result(&result, &settings.checks, settings.overlap_min);
    result
}

/// Radius around the target within which points are needed, m: half the sensor's diagonal plus the larger of search
/// range and start error.
pub fn region_radius_m(half_width_m: f64, settings: &ShapeSettings, start_error_m: f64) -> f64 {
    let half_side_m = half_width_m * (1.0 + settings.margin);
    half_side_m * std::f64::consts::SQRT_2
        + settings.search_half_range_m.unwrap_or(half_width_m).max(start_error_m)
}

#[cfg(test)]
mod lidar_tests;
