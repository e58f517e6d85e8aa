//! The shape tracker's registration: where the target is, by the shape of its surroundings alone (Deans et al. 2005, D§2).
//!
//! ```text
//! points ─► mesh ─┐ fixed: the target's first view                ┌─ path, residuals before and after
//!                 ├─► range_sensor ─► coarse_register ─► refine_register ─► covariance ─► failure or not
//! points ─► mesh ─┘ moving: the present view       └─ J over (Δx, Δy)
//! ```
//! Every present view is registered to the *first* view of the target, so that errors do not add up (R189). What comes
//! out takes points of the present frame into the first one; the target, known there, is carried back.
//!
//! | file | what it does |
//! |---|---|
//! | `grid` | points in the order in which they were seen |
//! | `mesh` | triangles between neighbours, cut at jumps; level of detail |
//! | `range_sensor`, `rasterise` | a mesh as a picture of depths |
//! | `objective` | D-Eq 12 with a least overlap |
//! | `coarse_register` | D-Eq 13, 14 over all shifts |
//! | `refine_register`, `nelder_mead` | the six parameters; the paper's way and point to plane |
//! | `held` | what is known of the motion before |
//! | `pairs`, `slopes` | distances along normals with their noise |
//! | `covariance` | how well all that is known |
//! | `failure` | why it is not to be used |
//!
//! Frames: *fixed* and *moving* are the rover frames of the two views; *sensor* is that of the virtual sensor, at the
//! target. A result is `fixed_from_moving`. All are pure functions; rayon is used in the coarse search only, and the
//! bits do not depend on it.
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

/// What is registered.
#[derive(Clone, Copy, Debug)]
pub struct RegistrationInput<'a> {
    /// The first view of the target; its frame is `fixed`.
    pub fixed: &'a Mesh,
    /// The present view; its frame is `moving`.
    pub moving: &'a Mesh,
    /// Where the search begins (R197).
    pub start_fixed_from_moving: &'a Pose,
    /// The target in the first view, m.
    pub target_in_fixed: &'a Point3,
    /// Half the width of what is to be recognised, m.
    pub half_width_m: f64,
    /// How well the start is known; none: not at all.
    pub prior: Option<Prior>,
    /// The virtual sensor; none: one that looks at the target ([`sensor_for`]).
    pub sensor: Option<RangeSensor>,
    /// Once requested, the registration ends soon and its result is discarded.
    pub cancel: Cancel<'a>,
}

/// How well the start of a registration is known, before the surfaces are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Covariance of the target in the present view, m², frame of that.
    pub target_m2: Matrix3<f64>,
    /// 1σ of the attitude about each axis, rad.
    pub attitude_rad: f64,
}

/// Differences of depth, h − z, as the sensor sees them; m, row by row, not a number where not both are seen (R202).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DepthErrors {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The depths of the fixed surface, m; infinite where it is not seen.
    pub fixed_m: Vec<f32>,
    /// At the start.
    pub before_m: Vec<f32>,
    /// After the coarse search.
    pub coarse_m: Vec<f32>,
    /// After the refinement.
    pub fine_m: Vec<f32>,
}

/// A registration, whether it is to be used or not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Registration {
    /// Takes points of the present view into the first; the start where nothing was found.
    pub fixed_from_moving: Pose,
    /// The target in the present view, m.
    pub target_in_moving: Point3,
    /// The covariance of that by the registration alone, m²: the target's own in the first view comes on top.
    pub covariance_in_moving: Option<Matrix3<f64>>,
    /// How well the motion is known; in the axes of the sensor, about the target.
    pub precision: Option<Precision>,
    /// J at the start, after the coarse search, after the refinement.
    pub agreement: [Option<Agreement>; 3],
    /// How many times the surfaces differ as much as their noise explains; none where no noise is known.
    pub misfit: Option<f64>,
    /// How far the refinement turned from the start, rad.
    pub turn_rad: f64,
    /// The coarse search.
    pub coarse: CoarseSurface,
    /// The way of the refinement.
    pub path: Vec<PathStep>,
    /// What the sensor sees.
    pub depth_errors: DepthErrors,
    /// The sensor.
    pub sensor: Option<RangeSensor>,
    /// Why the result is not to be used; none where it is.
    pub failure: Option<Failure>,
}

/// What a registration tells in a few numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegistrationRecord {
    /// Takes points of the present view into the first.
    pub fixed_from_moving: PoseRecord,
    /// The target in the present view, m.
    pub target_in_moving: [f64; 3],
    /// 1σ of it in the weakest direction, m.
    pub sigma_m: Option<f64>,
    /// Covariance of the small motion about the target, axes of the sensor.
    pub covariance: Option<Matrix6<f64>>,
    /// J before, after the coarse search and at the end, m.
    pub mean_m: [Option<f64>; 3],
    /// Share of the target's pixels that both surfaces cover at the end.
    pub overlap: Option<f64>,
    /// How many times the surfaces differ as much as their noise explains.
    pub misfit: Option<f64>,
    /// Why it is not to be used.
    pub failure: Option<Failure>,
}

impl Registration {
    /// 1σ of the target in the weakest direction, m.
    pub fn sigma_m(&self) -> Option<f64> {
        self.covariance_in_moving.map(|covariance| covariance::weakest(&covariance).0)
    }

    /// The few numbers.
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

/// The sensor that looks at a target along the mean of both lines of sight and spans its surroundings.
pub fn sensor_for(input: &RegistrationInput<'_>, settings: &ShapeSettings) -> RangeSensor {
    let sight = |viewpoint: Point3| (input.target_in_fixed - viewpoint).normalize();
    let first = sight(input.fixed.viewpoint);
    let both = first + sight(input.start_fixed_from_moving * input.moving.viewpoint);
    // Views from opposite sides have no mean; the first then decides.
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
    // A sensor with a place of its own turns the surface about the target as well.
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

/// Refines the motion; where its start is known, once more with the number of pixels that were seen to err together.
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

/// What is known at the end of a registration, and whether it is to be used; by the offsets at the start, after the coarse
/// search and at the end, each with the part of the moving surface that is seen there.
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

/// How far around a target points are needed, m: the sensor's diagonal, and as far as the moving one may be off.
pub fn region_radius_m(half_width_m: f64, settings: &ShapeSettings, start_error_m: f64) -> f64 {
    let half_side_m = half_width_m * (1.0 + settings.margin);
    half_side_m * std::f64::consts::SQRT_2
        + settings.search_half_range_m.unwrap_or(half_width_m).max(start_error_m)
}

#[cfg(test)]
mod lidar_tests;
