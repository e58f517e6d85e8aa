//! Registration by shape where the motion is known: basin of convergence, accuracy, calibration, false results (R204).
//!
//! A *case* is a rock of a simulated plain, seen from two places as stereo would measure it (`views`): first from 3 m,
//! then from 2 m and 15° round it, the rover tilted otherwise. The truth is exact. A registration starts from the true
//! motion disturbed about the target: a shift across the line of sight, as long as asked, in a drawn direction; a third
//! as much along it; a turn of 1° (1σ) about each axis.
//!
//! ```text
//! error     e = x̂ − x,  x = T⁻¹ f    the target in the present frame; f the true target in the first
//! turn      ∠(R⁻¹ R̂)                 rad
//! NEES      eᵀ P⁻¹ e                  P of the registration alone
//! success   no failure named, |e| ≤ 2 cm
//! false     no failure named, |e| > 5 cm and eᵀ P⁻¹ e > 9
//! ```
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | T | [`Case::fixed_from_moving`] | rover frames of the two views |
//! | f | [`Case::target_in_fixed`] | m |
//!
//! The study registers as the tracker does after dead reckoning, with its settings, its search and its prior; only the
//! method of refinement is varied. The covariance of the prediction is left out of the prior, where half of the basin
//! dominates it.
//!
//! Source: R204; domain.md 3.4 for the noise; the rest is ours.

mod rocks;
mod summary;
pub mod views;

use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

pub use rocks::rock_cases;
use rocks::rover;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Pose, Vector3};
use sightline_track::locate::shape_tracker::ShapeTrackerSettings;
use sightline_vision::registration::{
    Failure, Mesh, Method, PointGrid, Prior, Region, Registration, RegistrationInput, ShapeSettings,
    region_radius_m, register,
};
pub use summary::{Summary, summarise};
use views::{Eye, Stereo, look};

/// Error up to which a registration has succeeded, m.
pub(crate) const SUCCESS_M: f64 = 0.02;
/// Error beyond which one that was not refused is false, m …
pub(crate) const FALSE_M: f64 = 0.05;
/// … if it is also that many standard deviations.
pub(crate) const FALSE_SIGMA: f64 = 3.0;
/// Where the left camera is on the rover, m.
const CAMERA_IN_ROVER: [f64; 3] = [0.45, -0.1, -1.25];
/// Height of the rover frame's origin above the ground, m.
const ORIGIN_HEIGHT_M: f64 = 0.294;

/// From where a rock is seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Staging {
    /// Distances of the camera from the rock in the first and the present view, m.
    pub distances_m: [f64; 2],
    /// Angle between the two views about the rock, rad.
    pub round_rad: f64,
    /// 1σ of the rover's roll and pitch, rad.
    pub tilt_rad: f64,
    /// 1σ of each turn of the start, rad.
    pub start_turn_rad: f64,
    /// Shift of the start along the line of sight over that across it.
    pub start_depth: f64,
}

impl Default for Staging {
    fn default() -> Self {
        Self {
            distances_m: [3.0, 2.0],
            round_rad: 15f64.to_radians(),
            tilt_rad: 0.04,
            start_turn_rad: 1f64.to_radians(),
            start_depth: 1.0 / 3.0,
        }
    }
}

/// A rock seen twice.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its number.
    pub rock: usize,
    /// The two views, each in its rover frame.
    pub views: [PointGrid; 2],
    /// The left camera in both.
    pub viewpoint_in_rover: Point3,
    /// T.
    pub fixed_from_moving: Pose,
    /// f, m.
    pub target_in_fixed: Point3,
    /// Half the rock's diameter, m.
    pub half_width_m: f64,
}

/// One registration against the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The rock.
    pub rock: usize,
    /// How it was refined.
    pub method: Method,
    /// Shift of the start across the line of sight over the rock's half width.
    pub offset: f64,
    /// Half width, m.
    pub half_width_m: f64,
    /// Why it was refused, if it was.
    pub failure: Option<Failure>,
    /// Length of the target's error, m.
    pub error_m: f64,
    /// Error of the attitude, rad.
    pub error_rad: f64,
    /// Squared Mahalanobis distance of the target's error.
    pub nees: Option<f64>,
    /// 1σ of the target in its weakest direction, m.
    pub sigma_m: Option<f64>,
    /// How many times the surfaces differ as much as their noise explains.
    pub misfit: Option<f64>,
    /// J of the next minimum of the coarse search over that of the best.
    pub other: Option<f64>,
    /// Share of the target's pixels that both cover.
    pub overlap: Option<f64>,
    /// J at the end, m.
    pub mean_m: Option<f64>,
    /// Evaluations of the objective, or steps.
    pub evaluations: u32,
}

impl Row {
    /// Whether it was accepted and is right.
    pub fn is_success(&self) -> bool {
        self.failure.is_none() && self.error_m <= SUCCESS_M
    }

    /// Whether it was accepted and is wrong by its own account.
    pub fn is_false(&self) -> bool {
        let far = self.nees.is_none_or(|nees| nees > FALSE_SIGMA * FALSE_SIGMA);
        self.failure.is_none() && self.error_m > FALSE_M && far
    }
}

impl Case {
    /// A surface seen twice: a target (site frame, m) near `centre`, both views from a bearing (rad) about it.
    pub fn of_surface(
        cast: &views::Cast<'_>,
        target_in_site: &Point3,
        half_width_m: f64,
        bearing_rad: f64,
        (staging, stereo, seed): (&Staging, &Stereo, u64),
    ) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let eye = |view: usize, random: &mut Pcg64| {
            let from_rad = bearing_rad + if view == 0 { 0.0 } else { staging.round_rad };
            let distance_m = staging.distances_m[view];
            let needed_m = region_radius_m(half_width_m, &ShapeSettings::default(), 0.0);
            let half_angle = (needed_m / distance_m).min(0.8);
            Eye {
                site_from_rover: rover(target_in_site, from_rad, distance_m, staging.tilt_rad, random),
                viewpoint_in_rover: Point3::from(CAMERA_IN_ROVER),
                centre_in_site: *target_in_site,
                side_px: (2.0 * stereo.focal_px * half_angle) as usize,
            }
        };
        let eyes = [eye(0, &mut random), eye(1, &mut random)];
        let view = |k: usize| look(cast, &eyes[k], stereo, seed.wrapping_mul(2) + k as u64);
        let fixed_from_site = eyes[0].site_from_rover.inverse();
        Self {
            rock: 0,
            views: [view(0), view(1)],
            viewpoint_in_rover: Point3::from(CAMERA_IN_ROVER),
            fixed_from_moving: fixed_from_site * eyes[1].site_from_rover,
            target_in_fixed: fixed_from_site * target_in_site,
            half_width_m,
        }
    }

    /// Where a registration starts: `offset` half widths beside the truth.
    pub fn start(&self, offset: f64, staging: &Staging, seed: u64) -> Pose {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x5eed_0ff5);
        let angle = random.random_range(0.0..std::f64::consts::TAU);
        let size_m = offset * self.half_width_m;
        let away = (self.target_in_fixed - self.viewpoint_in_rover).normalize();
        let right = Vector3::z().cross(&away).normalize();
        let across = right * angle.cos() + away.cross(&right) * angle.sin();
        let depth: f64 = StandardNormal.sample(&mut random);
        let shift = across * size_m + away * (size_m * staging.start_depth * depth.clamp(-2.0, 2.0));
        let turn = Vector3::from_fn(|_, _| {
            let turn: f64 = StandardNormal.sample(&mut random);
            turn * staging.start_turn_rad
        });
        let turn = UnitQuaternion::from_scaled_axis(turn);
        let target = self.target_in_fixed.coords;
        Pose::from_parts(Translation3::from(target + shift - turn * target), turn) * self.fixed_from_moving
    }

    /// The meshes of both views around where the target is taken to be.
    pub fn meshes(&self, start_fixed_from_moving: &Pose, settings: &ShapeSettings) -> [Mesh; 2] {
        let radius_m = region_radius_m(self.half_width_m, settings, 0.0);
        let centres = [self.target_in_fixed, start_fixed_from_moving.inverse() * self.target_in_fixed];
        [0, 1].map(|k| {
            let region = Region { centre: centres[k], radius_m };
            Mesh::from_grid(&self.views[k], &self.viewpoint_in_rover, Some(&region), &settings.mesh)
        })
    }

    /// Registers the meshes of this case, or of this and another, without a prior.
    pub fn register(&self, meshes: [&Mesh; 2], start: &Pose, settings: &ShapeSettings) -> Registration {
        self.register_with(meshes, start, settings, None)
    }

    /// What the tracker registers a surface with after dead reckoning: settings and prior.
    pub fn of_tracker(
        &self,
        tracker: &ShapeTrackerSettings,
        method: Method,
    ) -> (ShapeSettings, Option<Prior>) {
        let basin_m = self.half_width_m / 2.0;
        let search_m = tracker.search_m(basin_m, self.half_width_m);
        let settings =
            ShapeSettings { method, search_half_range_m: Some(search_m), ..tracker.registration() };
        let prior = Prior {
            target_m2: Matrix3::identity() * basin_m.powi(2),
            attitude_rad: tracker.shape_attitude_deg.to_radians(),
        };
        (settings, Some(prior).filter(|_| tracker.shape_prior))
    }

    /// Registers meshes that are made for a start, as the tracker would with this method.
    pub fn register_as_tracked(
        &self,
        start: &Pose,
        tracker: &ShapeTrackerSettings,
        method: Method,
    ) -> Registration {
        let (settings, prior) = self.of_tracker(tracker, method);
        let [fixed, moving] = self.meshes(start, &settings);
        self.register_with([&fixed, &moving], start, &settings, prior)
    }

    fn register_with(
        &self,
        meshes: [&Mesh; 2],
        start: &Pose,
        settings: &ShapeSettings,
        prior: Option<Prior>,
    ) -> Registration {
        let input = RegistrationInput {
            fixed: meshes[0],
            moving: meshes[1],
            start_fixed_from_moving: start,
            target_in_fixed: &self.target_in_fixed,
            half_width_m: self.half_width_m,
            prior,
            sensor: None,
            cancel: Cancel::default(),
        };
        register(&input, settings)
    }

    /// A registration beside the truth.
    pub fn row(&self, found: &Registration, offset: f64, method: Method) -> Row {
        let truth = self.fixed_from_moving.inverse() * self.target_in_fixed;
        let error = found.target_in_moving - truth;
        let nees = found
            .covariance_in_moving
            .and_then(|covariance| covariance.cholesky().map(|factor| error.dot(&factor.solve(&error))));
        let other = found.coarse.best.zip(found.coarse.other).map(|(best, other)| other.mean_m / best.mean_m);
        Row {
            rock: self.rock,
            method,
            offset,
            half_width_m: self.half_width_m,
            failure: found.failure,
            error_m: error.norm(),
            error_rad: found.fixed_from_moving.rotation.angle_to(&self.fixed_from_moving.rotation),
            nees,
            sigma_m: found.sigma_m(),
            misfit: found.misfit,
            other,
            overlap: found.agreement[2].map(|agreement| agreement.overlap),
            mean_m: found.agreement[2].map(|agreement| agreement.mean_m),
            evaluations: found.path.last().map_or(0, |step| step.evaluations),
        }
    }
}

#[cfg(test)]
mod tests;
