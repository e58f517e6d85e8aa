//! Ground truth of a target, and the comparison of a tracking step with it (R116).
//!
//! *Truth of a target*: the surface point under the designated sub-pixel, seen through the true camera. If no surface
//! is known but the true poses are, the first estimate carried by the true poses replaces it, and the error is then
//! the drift: what tracking added.
//!
//! `err_m` is measured in the current rover frame, so that the drift of the site frame does not count:
//! `│ p_estimated,rover − (site_from_rover,true)⁻¹ T_site │`. A target counts as tracked when its pixel error is at most
//! max(5 px, 0.5 px × magnification so far).
//!
//! The stage crates must not be able to name these types: their documentation contains this line as `compile_fail`.
//!
//! ```
//! use sightline_world::target_truth::TruthSource;
//! ```

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{Camera, CameraName};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_record::{Declaration, Record, Unit};
use sightline_track::target::TrackingState;
use sightline_track::trace::StepTrace;

/// Source of the ground truth of a traverse.
pub trait TruthSource: Send + Sync {
    /// Builds data that the truth needs and that takes long, so that this can be cancelled.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Cancelled`] soon after `cancel` is requested.
    fn prepare(&self, _cancel: Cancel<'_>) -> Result<()> {
        Ok(())
    }
    /// The true pose at a stop; `None` if unknown.
    fn true_site_from_rover(&self, step: usize) -> Option<Pose>;
    /// The true left camera of the main pair, or of a further camera by its name, in the rover frame; `None` at a stop that
    /// lacks it.
    fn true_left_camera(&self, step: usize, camera: Option<CameraName>) -> Option<&Camera>;
    /// The surface point under a pixel of that camera's image, site frame, m; `None` if no surface is known.
    fn surface_point_in_site(&self, step: usize, camera: Option<CameraName>, pixel: Pixel) -> Option<Point3>;
    /// Whether a point of the site frame is unoccluded in that camera's image.
    fn is_visible(&self, step: usize, camera: Option<CameraName>, point_in_site: &Point3) -> bool;
    /// Shadowed fraction of a square window of that camera's image, 0 to 1; `None` if the light is unknown.
    fn shadow_share(
        &self,
        _step: usize,
        _camera: Option<CameraName>,
        _centre: Pixel,
        _size_px: u32,
    ) -> Option<f64> {
        None
    }
}

/// Definition of a target's truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TruthKind {
    /// The surface point under the designated pixel, seen through the true camera.
    Surface,
    /// The first estimate carried by the true poses: what remains is what tracking added (its drift).
    Carried,
}

/// The comparison of one step with the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StepTruth {
    /// Definition of the truth.
    pub kind: TruthKind,
    /// The true position in the true rover frame of this stop, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// The truth in the left image, px; null where it is not visible.
    pub left_pixel: Option<Pixel>,
    /// Distance between estimated and true position in the current rover frame, m.
    pub err_m: f64,
    /// Distance between located and true pixel, px; null where nothing was located or the truth is hidden.
    pub err_px: Option<f64>,
    /// Squared Mahalanobis distance of the error, 3 degrees of freedom; null without a covariance.
    pub nees: Option<f64>,
    /// Magnification since the designation.
    pub magnification: f64,
    /// The error up to which the target counts as tracked, px.
    pub tolerance_px: f64,
    /// Whether the target is tracked: state `tracking` and within the tolerance; null where the truth is hidden, and at a
    /// stop at which visual odometry runs alone.
    pub tracked: Option<bool>,
}

/// The truth of one target.
pub struct TargetTruth<'a> {
    source: &'a dyn TruthSource,
    kind: TruthKind,
    position_in_site: Point3,
    initial_distance_m: f64,
    camera: Option<CameraName>,
}

impl<'a> TargetTruth<'a> {
    /// Uses the surface point under the designated pixel, or else `estimate_in_rover` carried by the true poses.
    /// `None` if not even the true poses are known.
    pub fn new(
        source: &'a dyn TruthSource,
        designation: sightline_track::target::Designation,
        estimate_in_rover: Option<&Point3>,
    ) -> Option<Self> {
        let (step, camera) = (designation.step, designation.camera);
        let site_from_rover = source.true_site_from_rover(step)?;
        let surface = source.surface_point_in_site(step, camera, designation.pixel);
        let (kind, position_in_site) = match surface {
            Some(point) => (TruthKind::Surface, point),
            None => (TruthKind::Carried, site_from_rover * estimate_in_rover?),
        };
        let centre_in_site = site_from_rover * source.true_left_camera(step, camera)?.model.centre();
        let initial_distance_m = (position_in_site - centre_in_site).norm();
        Some(Self { source, kind, position_in_site, initial_distance_m, camera })
    }

    /// The truth's position in the true site frame, m.
    pub fn position_in_site(&self) -> Point3 {
        self.position_in_site
    }

    /// Compares a step with the truth. `None` if the true pose of that stop is unknown, or the stop lacks the
    /// target's pair.
    pub fn compare(&self, trace: &StepTrace) -> Option<StepTruth> {
        let site_from_rover = self.source.true_site_from_rover(trace.step)?;
        let camera = self.source.true_left_camera(trace.step, self.camera)?;
        let position_in_rover = site_from_rover.inverse() * self.position_in_site;
        let distance_m = (position_in_rover - camera.model.centre()).norm();
        let magnification = self.initial_distance_m / distance_m;
        let tolerance_px = (0.5 * magnification).max(5.0);
        let visible = camera.sees(&position_in_rover)
            && self.source.is_visible(trace.step, self.camera, &self.position_in_site);
        let left_pixel = if visible { camera.project(&position_in_rover) } else { None };
        let located = trace.located().and_then(|l| l.left_pixel);
        let err_px = left_pixel.zip(located).map(|(a, b)| a.distance(b));
        let target = &trace.update.target;
        let error = target.position_in_rover - position_in_rover;
        let nees = target.covariance_in_rover.try_inverse().map(|inverse| error.dot(&(inverse * error)));
        let within = err_px.is_some_and(|e| e <= tolerance_px);
        let tracking = trace.update.state == TrackingState::Tracking;
        Some(StepTruth {
            kind: self.kind,
            position_in_rover,
            left_pixel,
            err_m: error.norm(),
            err_px,
            nees: nees.filter(|n| n.is_finite()),
            magnification,
            tolerance_px,
            tracked: (visible && !trace.is_odometry_alone()).then_some(tracking && within),
        })
    }
}

impl Record for StepTruth {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("position_in_rover", Unit::Metre, |t| t.position_in_rover)
            .describe("The true position in the true rover frame of this stop.");
        r.quantity("left_pixel", Unit::Pixel, |t| t.left_pixel)
            .describe("The truth in the left image; missing where it is hidden.");
        r.quantity("err_m", Unit::Metre, |t| t.err_m)
            .describe("Distance between estimated and true position in the present rover frame.");
        r.quantity("err_px", Unit::Pixel, |t| t.err_px)
            .describe("Distance between located and true pixel.")
            .formula("│located − true│", &["locate.left_pixel", "left_pixel"]);
        r.quantity("nees", Unit::One, |t| t.nees)
            .describe("Squared Mahalanobis distance of the error, 3 degrees of freedom.");
        r.quantity("magnification", Unit::One, |t| t.magnification)
            .describe("Magnification since the designation.");
        r.quantity("tolerance_px", Unit::Pixel, |t| t.tolerance_px)
            .describe("The error up to which the target counts as tracked.");
        r.quantity("tracked", Unit::One, |t| t.tracked)
            .describe("Whether the target is tracked; missing where the truth is hidden or the tracker did not look for the target.");
    }
}
