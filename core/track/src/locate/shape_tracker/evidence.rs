//! The evidence of the shape tracker, and the arrays that the views draw (R200–R203).

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::carried_ray::RayMeeting;
use super::drape::Draped;
use super::gates::GATES;
use super::placement::Placement;
use super::surface::SurfaceSeen;
use super::view::View;

use crate::array_name::ArrayName;
use crate::gate::Gate;
use crate::locate::features::evidence::{FeatureEvidence, Table};
use crate::locate::template::evidence::TemplateEvidence;
use sightline_geometry::frames::{Point3, Pose};
use sightline_record::{ArrayKind, Declaration, GateRecord, Record, Stage, Unit, Unsent};
use sightline_vision::registration::{Failure, Mesh, Method, Registration};

/// The evidence of the shape tracker; a step that was not reached is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ShapeEvidence {
    /// Point stereo of the designated pixel; at the designation of the shape tracker only.
    pub designation: Option<Box<TemplateEvidence>>,
    /// The evidence of the features; `combined` only.
    pub features: Option<Box<FeatureEvidence>>,
    /// Why the shape was registered here, or was not, as one sentence.
    pub why: String,
    /// Dense stereo of this stop.
    pub surface: Option<SurfaceSeen>,
    /// The registration with an earlier view.
    pub registration: Option<Registered>,
    /// Instrument-placement target after a hand-off; `None` until the target is re-acquired.
    pub placement: Option<Placement>,
    /// Whether the update is judged by the gates of the shape, not by those of the features.
    pub is_judged_by_shape: bool,
    /// Why the registration failed to start, as one sentence.
    pub missing: Option<String>,
    /// The view of this stop, to which later stops are registered.
    #[serde(skip)]
    #[schema(ignore)]
    pub view: Option<Arc<View>>,
    /// The arrays of this stop.
    #[serde(skip)]
    #[schema(ignore)]
    pub arrays: Unsent<ShapeArrays>,
}

/// A registration with an earlier view, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Registered {
    /// The stop of the earlier view.
    pub to_step: usize,
    /// Whether the earlier view is of other cameras: a hand-off.
    pub is_hand_off: bool,
    /// The method of refinement.
    pub method: Method,
    /// Half the width of the registered surface, m.
    pub half_width_m: f64,
    /// Side of the virtual sensor's field of view, m.
    pub sensor_side_m: Option<f64>,
    /// The start of the registration: the target's expected position, m, current rover frame.
    pub start_in_rover: [f64; 3],
    /// Distance of the registered target from the start, m.
    pub correction_m: Option<f64>,
    /// Result of the coarse search: Δx, Δy, Δz along the axes of the sensor, m.
    pub coarse_shift_m: Option<[f64; 3]>,
    /// Half range of the coarse search, m.
    pub search_m: f64,
    /// Mean distance of the surfaces before, after the coarse search and at the end, m.
    pub mean_m: [Option<f64>; 3],
    /// Number of evaluations of the objective in the refinement.
    pub evaluations: u32,
    /// Rotation of the refinement, deg.
    pub turn_deg: f64,
    /// 1σ of the target by the registration alone along the axes of its ellipsoid, m, largest first.
    pub sigmas_m: Option<[f64; 3]>,
    /// Intersection of the designation's line of sight with the surface; null without one.
    pub ray: Option<RayMeeting>,
    /// The match of the earlier image, draped over the surface, with the current one; at a hand-off.
    pub draped: Option<Draped>,
    /// Why that match failed, as one sentence.
    pub draped_missing: Option<String>,
    /// The gates of the registration.
    pub checks: Vec<Gate>,
    /// Why the registration is not used; null if it is used.
    pub failure: Option<Failure>,
    /// The failure as one sentence; null without one.
    pub reason: Option<String>,
}

impl ShapeEvidence {
    /// The stages of this evidence, in running order and at their paths in it.
    pub(in crate::locate) fn stages() -> Vec<Stage<Self>> {
        vec![
            Stage::of("surface", "Which surface does the pair show?", |e: &Self| e.surface.as_ref())
                .with(|e| e.arrays.get(), ShapeArrays::declare_surface)
                .at("surface"),
            Stage::of_parts("coarse_register", "By which shift does it fit the earlier surface, roughly?")
                .with(|e: &Self| e.registration.as_ref(), Registered::declare_coarse)
                .with(|e| e.arrays.get(), ShapeArrays::declare_coarse)
                .at("registration"),
            Stage::of(
                "refine_register",
                "By which motion does it fit best, and how certain is that?",
                |e: &Self| e.registration.as_ref(),
            )
            .with(|e| e.arrays.get(), ShapeArrays::declare_refine)
            .at("registration"),
            Stage::of("carried_ray", "Where does the first line of sight meet the surface?", |e: &Self| {
                e.registration.as_ref()?.ray.as_ref()
            })
            .at("registration.ray"),
            Stage::of(
                "hand_off",
                "Where does the last image of the target match in the new cameras?",
                |e: &Self| e.registration.as_ref()?.draped.as_ref(),
            )
            .at("registration.draped"),
            Stage::of("placement", "Can the arm reach the target, and where does it touch?", |e: &Self| {
                e.placement.as_ref()
            })
            .at("placement"),
        ]
    }

    /// The checks of the registration; `None` without one.
    pub(super) fn checks(&self) -> Option<&[Gate]> {
        self.registration.as_ref().map(|found| found.checks.as_slice())
    }
}

impl Registered {
    /// Adds the match of the draped image. It constrains sliding along the surface, so that the registration has not failed.
    pub(super) fn add_picture(&mut self, draped: Draped) {
        self.draped = Some(draped);
        (self.failure, self.reason) = (None, None);
    }
}

/// The arrays of a stop, each empty if its step was not reached.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeArrays {
    /// Disparities of the aligned left image, px.
    pub disparities: Table,
    /// Distances from the left camera, m.
    pub ranges: Table,
    /// Depth of the earlier surface in the virtual sensor, m.
    pub sensor: Table,
    /// Current minus earlier depth at the start, m.
    pub error_before: Table,
    /// Current minus earlier depth after the coarse search, m.
    pub error_coarse: Table,
    /// Current minus earlier depth at the end, m.
    pub error_fine: Table,
    /// Mean distance for every shift of the coarse search, m; the first row has the smallest Δy.
    pub coarse: Table,
    /// The steps of the refinement, one row each, with the columns of [`PATH_COLUMNS`].
    pub path: Table,
    /// The earlier mesh in the current rover frame: one row per facet, x, y, z of its corners, m.
    pub mesh_fixed: Table,
    /// Triangles of the current mesh; columns and frame as in `mesh_fixed`.
    pub mesh_moving: Table,
}

/// Columns of [`ShapeArrays::path`]: evaluations so far, run, J (m), and the offset: shift (m) and rotation (rad).
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

/// Replaces infinite values by NaN, which marks a missing value.
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

impl Registered {
    /// Declares the coarse search.
    fn declare_coarse(r: &mut Declaration<Self>) {
        r.quantity("to_step", Unit::One, |f| f.to_step).describe("The stop of the earlier view.");
        r.quantity("start_in_rover", Unit::Metre, |f| f.start_in_rover)
            .describe("Start of the search in the present rover frame.");
        r.quantity("half_width_m", Unit::Metre, |f| f.half_width_m)
            .describe("Half the width of the registered surface.");
        r.quantity("sensor_side_m", Unit::Metre, |f| f.sensor_side_m)
            .describe("Side of the area that the virtual range sensor covers.");
        r.quantity("search_m", Unit::Metre, |f| f.search_m)
            .describe("Reach of the coarse search on each side.");
        r.quantity("coarse_shift_m", Unit::Metre, |f| f.coarse_shift_m)
            .describe("Shift found by the coarse search along the axes of the sensor.");
        r.quantity("mean_before_m", Unit::Metre, |f| f.mean_m[0])
            .describe("Mean distance of the surfaces before the registration.");
        r.quantity("mean_coarse_m", Unit::Metre, |f| f.mean_m[1])
            .describe("Mean distance of the surfaces after the coarse search.");
    }

    /// The value and the limit of a check.
    fn check(&self, name: &str) -> Option<&Gate> {
        self.checks.iter().find(|check| check.name == name)
    }
}

impl Record for Registered {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("is_hand_off", Unit::One, |f| f.is_hand_off)
            .describe("Whether the earlier view is of other cameras: the hand-off.");
        r.quantity("correction_m", Unit::Metre, |f| f.correction_m)
            .describe("Distance of the registered target from the start of the search.");
        r.quantity("mean_fine_m", Unit::Metre, |f| f.mean_m[2])
            .describe("Mean distance of the surfaces after the refinement.");
        r.quantity("evaluations", Unit::One, |f| f.evaluations)
            .describe("Evaluations of the objective in the refinement.");
        r.quantity("turn_deg", Unit::Degree, |f| f.turn_deg).describe("Rotation of the refinement.");
        r.quantity("sigmas_m", Unit::Metre, |f| f.sigmas_m)
            .describe("1σ axes of the target by the registration alone, largest first.");
        r.quantity("overlap", Unit::One, |f| f.check("shape_overlap")?.value)
            .describe("Share of the target's pixels that both surfaces cover.");
        r.quantity("misfit", Unit::One, |f| f.check("shape_misfit")?.value)
            .describe("RMS residual over its predicted σ (1 = consistent with the noise model).");
        r.quantity("sigma_m", Unit::Metre, |f| f.check("shape_sigma_m")?.value)
            .describe("Largest 1σ axis of the target.");
        for kind in GATES {
            r.gate(kind.name, kind.unit, kind.side, kind.setting.unwrap_or_default());
        }
        r.gates(|f| f.checks.iter().map(GateRecord::from).collect());
        r.reason(|f| f.reason.clone());
    }
}

impl ShapeArrays {
    /// Declares the arrays of dense stereo.
    fn declare_surface(r: &mut Declaration<Self>) {
        use ArrayKind::DepthMap;
        r.array("disparities", DepthMap, "Disparities of the aligned left image; bright is near", |a| {
            (&a.disparities).into()
        })
        .unit(Unit::Pixel);
        r.array("ranges", DepthMap, "Distances in the aligned left image; bright is far", |a| {
            (&a.ranges).into()
        })
        .unit(Unit::Metre);
    }

    /// Declares the arrays of the coarse search.
    fn declare_coarse(r: &mut Declaration<Self>) {
        r.array(
            "sensor",
            ArrayKind::DepthMap,
            "The earlier surface in the virtual range sensor; bright is far",
            |a| (&a.sensor).into(),
        )
        .unit(Unit::Metre);
        r.array(
            "error_before",
            ArrayKind::Difference,
            "Present less earlier depth before the registration; grey is no difference",
            |a| (&a.error_before).into(),
        )
        .unit(Unit::Metre);
        r.array(
            "error_coarse",
            ArrayKind::Difference,
            "Present less earlier depth after the coarse search; grey is no difference",
            |a| (&a.error_coarse).into(),
        )
        .unit(Unit::Metre);
        r.array(
            "coarse_search",
            ArrayKind::CostMap,
            "Mean distance of the surfaces for every shift; dark is a better fit",
            |a| (&a.coarse).into(),
        )
        .unit(Unit::Metre);
    }

    /// Declares the arrays of the refinement.
    fn declare_refine(r: &mut Declaration<Self>) {
        r.array(
            "error_fine",
            ArrayKind::Difference,
            "Present less earlier depth at the end; grey is no difference",
            |a| (&a.error_fine).into(),
        )
        .unit(Unit::Metre);
        r.array("refine_path", ArrayKind::Table, "Steps of the refinement, a row each", |a| (&a.path).into());
        r.array("mesh_fixed", ArrayKind::Mesh, "The earlier mesh in the present rover frame", |a| {
            (&a.mesh_fixed).into()
        });
        r.array("mesh_moving", ArrayKind::Mesh, "The present mesh", |a| (&a.mesh_moving).into());
    }
}

/// Names of the arrays of this stage that a panel draws individually.
impl ArrayName {
    /// Disparities of the aligned left image, px.
    pub const DISPARITIES: Self = Self::new("disparities");
    /// Distances from the left camera in the aligned left image, m.
    pub const RANGES: Self = Self::new("ranges");
    /// Depth of the earlier surface in the virtual range sensor, m.
    pub const SENSOR: Self = Self::new("sensor");
    /// Current minus earlier depth before the registration, m.
    pub const ERROR_BEFORE: Self = Self::new("error_before");
    /// Current minus earlier depth after the coarse search, m.
    pub const ERROR_COARSE: Self = Self::new("error_coarse");
    /// Current minus earlier depth at the end, m.
    pub const ERROR_FINE: Self = Self::new("error_fine");
    /// Mean distance of the surfaces for every shift of the coarse search, m.
    pub const COARSE_SEARCH: Self = Self::new("coarse_search");
    /// Steps of the refinement, a row each, with the columns of [`PATH_COLUMNS`].
    pub const REFINE_PATH: Self = Self::new("refine_path");
    /// The earlier mesh, one row per facet: x, y, z of its corners in the current rover frame, m.
    pub const MESH_FIXED: Self = Self::new("mesh_fixed");
    /// The current mesh: columns and frame as in `mesh_fixed`.
    pub const MESH_MOVING: Self = Self::new("mesh_moving");
}
