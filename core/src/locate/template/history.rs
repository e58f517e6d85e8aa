//! The history of a run's templates: a filmstrip, and the present view against every earlier one (R72).
//!
//! Each accepted update shows the target once; the renewed templates among them are what later stops were matched with.
//! Held against the present view, each earlier template, prepared by the geometry from its own stop, says where *it* would
//! have put the target: the differences are the drift that the renewals have chained.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::scale_roll::scale_roll;
use super::settings::TemplateSettings;
use crate::correlate::{find_peak, zncc_surface};
use crate::frames::{Pixel, Pose};
use crate::image::PixelRect;
use crate::image::patch::{self, Patch};
use crate::trace::StepTrace;

/// How far around the present position an earlier template is looked for, px.
const REACH_PX: u32 = 10;

/// One picture of the filmstrip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Frame {
    /// The stop.
    pub step: usize,
    /// Where the target was located, px.
    pub centre: Pixel,
    /// By how much the template in use was magnified; null at the designation.
    pub scale: Option<f64>,
    /// By how much it was rolled, rad; null at the designation.
    pub roll_rad: Option<f64>,
    /// Score of its match; null at the designation.
    pub score: Option<f64>,
    /// Whether this picture became the template.
    pub is_template: bool,
    /// The image around the target.
    #[serde(skip)]
    #[schema(ignore)]
    pub patch: Patch,
}

/// The present view against one earlier template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AgainstEarlier {
    /// The stop of that template.
    pub template_step: usize,
    /// By how much it was magnified.
    pub scale: f64,
    /// By how much it was rolled, rad.
    pub roll_rad: f64,
    /// Its best score near the present position.
    pub score: f64,
    /// From the present position to its own, px.
    pub offset_px: [f64; 2],
}

/// Every stop of a run at which the target was located, in order.
pub fn filmstrip(steps: &[StepTrace], settings: &TemplateSettings) -> Vec<Frame> {
    let frame = |step: &StepTrace| -> Option<Frame> {
        let (capture, located) = (step.capture.as_ref()?, step.locate.as_ref()?);
        let centre = located.left_pixel?;
        let evidence = step.template();
        let prepared = evidence.and_then(|e| e.scale_roll.as_ref());
        Some(Frame {
            step: step.step,
            centre,
            scale: prepared.map(|p| p.applied_scale),
            roll_rad: prepared.map(|p| p.applied_roll_rad),
            score: evidence.and_then(|e| e.match_template.as_ref()).map(|m| m.score),
            is_template: step.update.template_renewed,
            patch: patch::extract(&capture.pair.left, centre, settings.template_size_px / 2, settings.kernel),
        })
    };
    steps.iter().filter_map(frame).collect()
}

/// The view of the last of `steps`, whose estimated pose is `site_from_rover`, against every template before it.
///
/// Empty where the last stop has no image or no position; templates that cannot be compared are left out.
pub fn against_earlier(
    steps: &[StepTrace],
    site_from_rover: &Pose,
    settings: &TemplateSettings,
) -> Vec<AgainstEarlier> {
    let Some((last, before)) = steps.split_last() else { return Vec::new() };
    let (Some(capture), Some(pointing)) = (&last.capture, &last.point_mast) else { return Vec::new() };
    let Some(here) = last.locate.as_ref().and_then(|located| located.left_pixel) else { return Vec::new() };
    let image = capture.pair.left.as_ref();
    let region = PixelRect::centred(here, settings.template_size_px + 2 * REACH_PX);
    let compare = |step: &StepTrace| -> Option<AgainstEarlier> {
        let appearance = &step.update.target.appearance;
        let now_from_then = site_from_rover.inverse() * appearance.site_from_rover;
        let prepared = scale_roll(appearance, &now_from_then, &pointing.left, settings, None).ok()?.record;
        let surface = zncc_surface(&prepared.rolled, image, region)?;
        let peak = find_peak(&surface, true)?;
        Some(AgainstEarlier {
            template_step: appearance.step,
            scale: prepared.applied_scale,
            roll_rad: prepared.applied_roll_rad,
            score: peak.score,
            offset_px: [peak.pixel.x - here.x, peak.pixel.y - here.y],
        })
    };
    before.iter().filter(|step| step.update.template_renewed).filter_map(compare).collect()
}
