//! The settings of the shape tracker, with unit, default and source.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::limits::Domain;
use crate::settings_group;
use sightline_vision::registration::{CheckSettings, MeshSettings, Method, ShapeSettings};
use sightline_vision::stereo::{StereoMethod, StereoSettings};

/// Stops at which the target is located by the shape of its surroundings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeUse {
    /// At the last stop of a camera pair, and at a hand-off.
    #[default]
    AtEnd,
    /// As `at_end`, and at every stop where the features lose the target.
    WhenLost,
    /// At every stop.
    EveryStop,
}

/// Reach of the coarse search beyond 3σ of the prior, m; covers the disagreement of two camera pairs.
const SEARCH_LEAST_M: f64 = 0.04;

settings_group! {
    /// How a target is located by the shape of its surroundings (Deans et al. 2005).
    ShapeTrackerSettings as "shape" {
        /// Stops at which the combined tracker registers the shape; the shape tracker registers it at every stop.
        shape_use: ShapeUse = ShapeUse::AtEnd, "", Domain::choice(&["at_end", "when_lost", "every_stop"]), "Deans05 §4", if tracker = "combined";
        /// Propagates the line of sight of the designation and intersects it with the near surface, which removes the range
        /// error of the designation.
        carried_ray: bool = true, "", Domain::Switch, "ours; Deans05 §2";
        /// Method of the refinement: the paper's simplex over absolute differences, or robust point-to-plane least squares.
        shape_method: Method = Method::PointToPlane, "", Domain::choice(&["simplex_l1", "point_to_plane"]), "Deans05 §2, Eq. 12; ours";
        /// Half width of the registered surface; 0: measured on the first surface, or 0.25 m where that fails.
        shape_half_width_m: f64 = 0.0, "m", Domain::Between(0.0, 2.0), "ours";
        /// Reach of the coarse search to each side; 0: 3σ of the prior plus 4 cm, at most the half width.
        shape_search_m: f64 = 0.0, "m", Domain::Between(0.0, 2.0), "ours";
        /// Constrains the transform by its prior; the paper's simplex has none.
        shape_prior: bool = true, "", Domain::Switch, "ours";
        /// Attitude error of the pose estimates since the earlier view, 1σ about each axis.
        shape_attitude_deg: f64 = 1.0, "°", Domain::Between(0.01, 30.0), "ours", if shape_prior = true;
        /// Disagreement of two camera pairs about the target's position, 1σ on each axis.
        hand_off_shift_m: f64 = 0.02, "m", Domain::Between(0.0001, 1.0), "ours";
        /// Disagreement of two camera pairs about the target's attitude, 1σ about each axis.
        hand_off_turn_deg: f64 = 0.3, "°", Domain::Between(0.01, 30.0), "ours";
        /// At a hand-off, matches the last image, draped over the surface, in the other camera's image.
        hand_off_picture: bool = true, "", Domain::Switch, "ours";
        /// Side of the draped image.
        hand_off_window_px: u32 = 31, "px", Domain::OddBetween(7, 101), "ours", if hand_off_picture = true;
        /// Lowest match score of the draped image.
        hand_off_score_min: f64 = 0.7, "", Domain::Between(-1.0, 1.0), "ours", if hand_off_picture = true;
        /// Side of the virtual range sensor.
        shape_sensor_px: u32 = 64, "px", Domain::Between(16.0, 256.0), "ours";
        /// Margin of the virtual range sensor beyond the half width, as a fraction of it; the ground there constrains
        /// height and tilt.
        shape_margin: f64 = 0.4, "", Domain::Between(0.0, 3.0), "ours";
        /// Smallest overlap of the two surfaces, as a fraction of the target's pixels. The default was chosen on the
        /// simulated worlds 501 and 502.
        shape_overlap_min: f64 = 0.25, "", Domain::Between(0.05, 1.0), "ours; docs/shape.md";
        /// Spacing of mesh vertices; at least twice the error of their range.
        mesh_spacing_m: f64 = 0.01, "m", Domain::Between(0.0, 0.2), "ours";
        /// Largest ratio of the ranges of two joined vertices.
        mesh_ratio_max: f64 = 1.05, "", Domain::Between(1.001, 2.0), "Deans05 §2";
        /// Matching method of dense stereo.
        surface_method: StereoMethod = StereoMethod::SemiGlobal, "", Domain::choice(&["block_matching", "semi_global"]), "Hirschmueller08";
        /// Smallest depth that dense stereo searches; at least 0.3 times the distance of the target.
        surface_range_min_m: f64 = 0.4, "m", Domain::Between(0.05, 100.0), "ours";
        /// Noise of a disparity, 1σ; determines the noise of the points.
        surface_sigma_px: f64 = 0.1, "px", Domain::Between(0.01, 5.0), "ours";
        /// Error that all points of a surface share, 1σ on each axis; the stereo window shrinks convex surfaces.
        shape_common_m: f64 = 0.0008, "m", Domain::Between(0.0, 0.1), "ours";
        /// Smallest number of triangles of a surface.
        shape_triangles_min: u32 = 100, "", Domain::Between(1.0, 10_000.0), "ours";
        /// Largest 1σ error of the registered target in its weakest direction.
        shape_sigma_max_m: f64 = 0.02, "m", Domain::Between(0.0001, 1.0), "ours";
        /// Largest reduced misfit: RMS residual over its predicted σ (1 = consistent with the noise model).
        shape_misfit_max: f64 = 1.8, "", Domain::Between(0.1, 100.0), "ours";
        /// Largest rotation between the registration and the pose estimates.
        shape_turn_max_deg: f64 = 8.6, "°", Domain::Between(0.1, 90.0), "ours";
        /// Smallest ratio of the mean difference at the next minimum to that at the best one; near 1 the registration is
        /// ambiguous.
        shape_other_min: f64 = 1.15, "", Domain::Between(1.0, 10.0), "ours";
    }
}

impl ShapeTrackerSettings {
    /// The settings of dense stereo for a target at a distance.
    ///
    /// Disparities nearer than the target's surroundings only cost time. The range limit is rounded down to a power
    /// of two, so that targets at similar distances share their surfaces.
    pub fn stereo(&self, distance_m: f64) -> StereoSettings {
        let nearest_m = (0.3 * distance_m).max(0.01);
        let range_min_m = 2f64.powf(nearest_m.log2().floor()).max(self.surface_range_min_m);
        StereoSettings { method: self.surface_method, range_min_m, ..StereoSettings::default() }
    }

    /// Reach of the coarse search to each side, m, for a start with a standard deviation of `sigma_m`.
    pub fn search_m(&self, sigma_m: f64, half_width_m: f64) -> f64 {
        if self.shape_search_m > 0.0 {
            self.shape_search_m
        } else {
            (3.0 * sigma_m + SEARCH_LEAST_M).min(half_width_m)
        }
    }

    /// The settings of the registration.
    pub fn registration(&self) -> ShapeSettings {
        let defaults = ShapeSettings::default();
        ShapeSettings {
            mesh: MeshSettings {
                spacing_m: self.mesh_spacing_m,
                depth_ratio_max: self.mesh_ratio_max,
                ..defaults.mesh
            },
            sensor_px: self.shape_sensor_px as usize,
            margin: self.shape_margin,
            overlap_min: self.shape_overlap_min,
            common_sigma_m: self.shape_common_m,
            method: self.shape_method,
            checks: CheckSettings {
                triangles_min: self.shape_triangles_min as usize,
                sigma_max_m: self.shape_sigma_max_m,
                misfit_max: self.shape_misfit_max,
                turn_max_rad: self.shape_turn_max_deg.to_radians(),
                other_min: self.shape_other_min,
                ..defaults.checks
            },
            ..defaults
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_registration_but_for_its_method_its_overlap_and_a_rounded_angle() {
        let own = ShapeTrackerSettings::default().registration();
        let mut other =
            ShapeSettings { method: Method::PointToPlane, overlap_min: 0.25, ..ShapeSettings::default() };
        assert!((own.checks.turn_max_rad - other.checks.turn_max_rad).abs() < 1e-3);
        other.checks.turn_max_rad = own.checks.turn_max_rad;
        assert_eq!(own, other);
    }
}
