//! Compares the current view with every earlier template of a run (R72).
//!
//! Each earlier template, prepared by the geometry from its own stop, gives its own position of the target. The
//! differences are the drift accumulated by the renewals.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::memory::Appearance;
use super::scale_roll::{Preparation, scale_roll};
use super::settings::TemplateSettings;
use crate::trace::StepTrace;
use sightline_geometry::frames::Pose;
use sightline_vision::correlate::{find_peak, zncc_surface};
use sightline_vision::image::{GrayImage, PixelRect};

/// Radius around the current position in which an earlier template is searched for, px.
const REACH_PX: u32 = 10;

/// The comparison of the current view with one earlier template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AgainstEarlier {
    /// The step of that template.
    pub template_step: usize,
    /// Scale applied to it.
    pub scale: f64,
    /// Roll applied to it, rad.
    pub roll_rad: f64,
    /// Its best score near the current position.
    pub score: f64,
    /// Its position relative to the current one (x, y), px.
    pub offset_px: [f64; 2],
}

impl AgainstEarlier {
    /// The distance between both positions, px.
    pub fn shift_px(&self) -> f64 {
        self.offset_px[0].hypot(self.offset_px[1])
    }
}

/// Compares the current view with earlier appearances of the target, in their order.
///
/// `image` is the left image of the stop of `recorded`, whose estimated pose is `site_from_rover`. Empty if that stop
/// has no position; templates that cannot be compared are omitted.
pub fn against_earlier<'a>(
    recorded: &StepTrace,
    image: &GrayImage,
    site_from_rover: &Pose,
    earlier: impl IntoIterator<Item = &'a Appearance>,
    settings: &TemplateSettings,
) -> Vec<AgainstEarlier> {
    let Some(here) = recorded.located().and_then(|located| located.left_pixel) else {
        return Vec::new();
    };
    let region = PixelRect::centred(here, settings.template_size_px + 2 * REACH_PX);
    let compare = |appearance: &Appearance| -> Option<AgainstEarlier> {
        let now_from_then = site_from_rover.inverse() * appearance.site_from_rover;
        let prepared =
            scale_roll(appearance, &now_from_then, &recorded.point_mast.left, settings, Preparation::Surface)
                .ok()?;
        let surface = zncc_surface(&prepared.rolled, image, region)?;
        let peak = find_peak(&surface, true)?;
        Some(AgainstEarlier {
            template_step: appearance.step,
            scale: prepared.record.applied_scale,
            roll_rad: prepared.record.applied_roll_rad,
            score: peak.score,
            offset_px: [peak.pixel.x - here.x, peak.pixel.y - here.y],
        })
    };
    earlier.into_iter().filter_map(compare).collect()
}
