//! What the shape tracker saw, and the arrays that the views draw from it (R200–R203).

use std::sync::Arc;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::carried_ray::RayMeeting;
use super::drape::Draped;
use super::placement::Placement;
use super::surface::SurfaceSeen;
use super::view::View;

use crate::frames::{Point3, Pose};
use crate::locate::features::FeatureEvidence;
use crate::locate::features::evidence::Table;
use crate::locate::shape::{Failure, Mesh, Method, Registration, ShapeSettings};
use crate::locate::template::TemplateEvidence;

/// What the shape tracker saw; a step that was not reached is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ShapeEvidence {
    /// Point stereo of the designated pixel; at the designation of the shape tracker only.
    pub designation: Option<Box<TemplateEvidence>>,
    /// What the features said, where they are followed on the way.
    pub features: Option<Box<FeatureEvidence>>,
    /// Why the shape was asked here, or was not, as one sentence.
    pub why: String,
    /// Dense stereo of this stop.
    pub surface: Option<SurfaceSeen>,
    /// The registration with an earlier view.
    pub registration: Option<Registered>,
    /// What the arm is told, where other cameras took over and the target was found.
    pub placement: Option<Placement>,
    /// Whether the update is judged by it, rather than by the features.
    pub is_judged_by_shape: bool,
    /// Why there is no registration although it was asked for, as one sentence.
    pub missing: Option<String>,
    /// This stop, to be registered to by later ones.
    #[serde(skip)]
    #[schema(ignore)]
    pub view: Option<Arc<View>>,
    /// The arrays.
    #[serde(skip)]
    #[schema(ignore)]
    pub arrays: ShapeArrays,
}

/// A registration with an earlier view, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Registered {
    /// The stop whose view it was registered to.
    pub to_step: usize,
    /// Whether that view was seen by other cameras: the hand-off.
    pub is_hand_off: bool,
    /// How the motion was refined.
    pub method: Method,
    /// Half the width of what was recognised, m.
    pub half_width_m: f64,
    /// Side of what the virtual sensor spans, m.
    pub sensor_side_m: Option<f64>,
    /// Where the target was looked for, m, present rover frame.
    pub start_in_rover: [f64; 3],
    /// How far from there it was found, m.
    pub correction_m: Option<f64>,
    /// What the coarse search found: Δx, Δy, Δz along the axes of the sensor, m.
    pub coarse_shift_m: Option<[f64; 3]>,
    /// How far the coarse search went to each side, m.
    pub search_m: f64,
    /// Mean distance of the surfaces before, after the coarse search and at the end, m.
    pub mean_m: [Option<f64>; 3],
    /// Values of the objective that were computed in the refinement.
    pub evaluations: u32,
    /// How far the refinement turned, deg.
    pub turn_deg: f64,
    /// 1σ of the target by the registration alone along the axes of its ellipsoid, m, largest first.
    pub sigmas_m: Option<[f64; 3]>,
    /// Where the designation's line of sight met the surface; null where it was not carried along or met nothing.
    pub ray: Option<RayMeeting>,
    /// The earlier image draped over the surface and found in the present one; at a hand-off.
    pub draped: Option<Draped>,
    /// Why it was not found, as one sentence.
    pub draped_missing: Option<String>,
    /// Its numbers with their limits.
    pub checks: Vec<Check>,
    /// Why it is not used; null where it is.
    pub failure: Option<Failure>,
    /// The same as one sentence.
    pub reason: Option<String>,
}

impl Registered {
    /// Adds a picture that was found: what the surfaces alone let slide it holds, and its own score is judged instead.
    pub(super) fn add_picture(&mut self, draped: Draped, covariance: &Matrix3<f64>, score_min: f64) {
        let sigma_m = covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
        self.checks
            .retain(|check| !["shape_other_minimum", "shape_edge_distance_m"].contains(&check.name.as_str()));
        for check in self.checks.iter_mut().filter(|check| check.name == "shape_sigma_m") {
            check.value = Some(sigma_m);
        }
        self.checks.push(Check::new("picture_ncc", "", Some(draped.score), score_min, true));
        self.draped = Some(draped);
        (self.failure, self.reason) = (None, None);
    }
}

/// A number of a registration that must keep to a limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Check {
    /// Its name.
    pub name: String,
    /// Its unit; empty for shares and ratios.
    pub unit: String,
    /// The value; null where the registration did not come so far.
    pub value: Option<f64>,
    /// The limit.
    pub limit: f64,
    /// Whether the value must be at least the limit; otherwise at most.
    pub at_least: bool,
}

impl Check {
    fn new(name: &str, unit: &str, value: Option<f64>, limit: f64, at_least: bool) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), value, limit, at_least }
    }
}

/// The numbers of a registration that `failure` weighs, in its order.
pub(super) fn checks(found: &Registration, half_width_m: f64, settings: &ShapeSettings) -> Vec<Check> {
    let limits = &settings.checks;
    let agreement = found.agreement[2];
    let best = found.coarse.best;
    // Without another minimum none is nearly as good.
    let ratio =
        best.map(|best| found.coarse.other.map_or(99.0, |other| (other.mean_m / best.mean_m).min(99.0)));
    let range_m = settings.search_half_range_m.unwrap_or(half_width_m);
    let from_edge_m = best.map(|best| {
        let [x, y, _] = best.shift_m;
        if best.is_at_edge { 0.0 } else { range_m - x.abs().max(y.abs()) }
    });
    vec![
        Check::new("shape_overlap", "", agreement.map(|a| a.overlap), settings.overlap_min, true),
        Check::new("shape_misfit", "", found.misfit, limits.misfit_max, false),
        Check::new("shape_sigma_m", "m", found.sigma_m(), limits.sigma_max_m, false),
        Check::new(
            "shape_turn_deg",
            "°",
            agreement.map(|_| found.turn_rad.to_degrees()),
            limits.turn_max_rad.to_degrees(),
            false,
        ),
        Check::new("shape_other_minimum", "", ratio, limits.other_min, true),
        Check::new("shape_edge_distance_m", "m", from_edge_m, 0.5 * found.coarse.step_m, true),
    ]
}

/// The arrays of a stop, each empty where its step was not reached.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeArrays {
    /// Disparities of the aligned left image, px.
    pub disparities: Table,
    /// Distances from the left camera, m.
    pub ranges: Table,
    /// The earlier surface as the virtual sensor sees it: depth, m.
    pub sensor: Table,
    /// Present less earlier depth there at the start, m.
    pub error_before: Table,
    /// The same after the coarse search.
    pub error_coarse: Table,
    /// The same at the end.
    pub error_fine: Table,
    /// Mean distance for every shift of the coarse search, m, the first row at the least Δy.
    pub coarse: Table,
    /// The way of the refinement: a row a step, with the columns of [`PATH_COLUMNS`].
    pub path: Table,
    /// The earlier mesh in the present rover frame: a row a facet, x, y, z of its corners, m.
    pub mesh_fixed: Table,
    /// The present mesh alike.
    pub mesh_moving: Table,
}

/// Columns of [`ShapeArrays::path`]: values computed so far, run, J (m), and the offset: shift (m) and turn (rad).
pub const PATH_COLUMNS: usize = 9;

/// Columns of a mesh.
pub const MESH_COLUMNS: usize = 9;

impl ShapeArrays {
    /// The arrays of a registration; `moving_from_fixed` places the earlier mesh.
    pub(super) fn add(
        &mut self,
        found: &Registration,
        [fixed, moving]: [&Mesh; 2],
        moving_from_fixed: &Pose,
    ) {
        let errors = &found.depth_errors;
        let of = |values: &Vec<f32>| Table { columns: errors.width as u32, values: finite(values) };
        self.sensor = of(&errors.fixed_m);
        self.error_before = of(&errors.before_m);
        self.error_coarse = of(&errors.coarse_m);
        self.error_fine = of(&errors.fine_m);
        let side = if found.coarse.mean_m.is_empty() { 0 } else { 2 * found.coarse.steps as u32 + 1 };
        self.coarse = Table { columns: side, values: finite(&found.coarse.mean_m) };
        let path = found.path.iter().flat_map(|step| {
            let head = [step.evaluations as f32, step.run as f32, step.value_m as f32];
            head.into_iter().chain(step.offset.map(|value| value as f32))
        });
        self.path = Table { columns: PATH_COLUMNS as u32, values: path.collect() };
        self.mesh_fixed = facets(fixed, moving_from_fixed);
        self.mesh_moving = facets(moving, &Pose::identity());
    }
}

/// What is not finite is not there.
fn finite(values: &[f32]) -> Vec<f32> {
    values.iter().map(|value| if value.is_finite() { *value } else { f32::NAN }).collect()
}

fn facets(mesh: &Mesh, frame_from_mesh: &Pose) -> Table {
    let vertices: Vec<[f32; 3]> = mesh.vertices.iter().map(|v| place(&(frame_from_mesh * v))).collect();
    let corners = mesh.triangles.iter().flatten().flat_map(|&corner| vertices[corner as usize]);
    Table { columns: MESH_COLUMNS as u32, values: corners.collect() }
}

fn place(point: &Point3) -> [f32; 3] {
    [point.x, point.y, point.z].map(|value| value as f32)
}
