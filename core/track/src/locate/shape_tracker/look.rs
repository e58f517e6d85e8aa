//! The surface of a stop around a target, by dense stereo; shared by the designation and by later stops.

use std::sync::Arc;

use super::evidence::ShapeEvidence;
use super::failure::ShapeFailure;
use super::surface::StopSurface;
use crate::locate::store::Shared;
use crate::locate::tracker::LocateInput;
use crate::settings::Settings;
use crate::stages::capture::Capture;
use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Point3;
use sightline_vision::registration::{Mesh, Region, ShapeSettings, region_radius_m};

/// The input of dense stereo at a stop.
#[derive(Clone, Copy)]
pub(super) struct Look<'a> {
    pub(super) capture: &'a Capture,
    pub(super) cameras: [&'a Camera; 2],
    pub(super) shared: Option<Shared<'a>>,
    pub(super) settings: &'a Settings,
    pub(super) cancel: Cancel<'a>,
}

impl Look<'_> {
    /// Returns the surface of the stop around a target.
    pub(super) fn surface(&self, target: &Point3) -> Result<Arc<StopSurface>, ShapeFailure> {
        let distance_m = (target - self.cameras[0].model.centre()).norm();
        let stereo = self.settings.shape.stereo(distance_m);
        StopSurface::shared(self.shared, &self.capture.pair, self.cameras, &stereo, self.cancel)
            .map_err(|error| ShapeFailure::NoSurface(error.to_string()))
    }
}

/// The region around the target that a mesh covers.
pub(super) fn region(centre: Point3, half_width_m: f64, settings: &ShapeSettings) -> Region {
    Region { centre, radius_m: region_radius_m(half_width_m, settings, 0.0) }
}

/// Records the surface of a stop in its evidence.
pub(super) fn note(evidence: &mut ShapeEvidence, surface: &StopSurface, mesh: &Mesh) {
    evidence.surface = Some(surface.seen(mesh));
    let arrays = evidence.arrays.get_or_default();
    (arrays.disparities, arrays.ranges) = (surface.shown_disparities(), surface.shown_ranges());
}

/// The confidence that the features must reach: `confidence_min`, or `confidence_return` once the target is lost (R185).
pub(super) fn least_confidence(input: &LocateInput<'_>) -> f64 {
    let limits = &input.settings.limits;
    if input.lost_count > 0 { limits.confidence_return } else { limits.confidence_min }
}
