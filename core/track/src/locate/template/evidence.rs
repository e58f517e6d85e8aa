//! The evidence of the template tracker: the record of each step of `locate`, in running order.
//!
//! Arrays (windows and score maps) are kept beside the numbers but never serialised with them: the interface serves them
//! one by one.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::drift_correction::DriftCorrection;
use super::match_template::TemplateMatch;
use super::point_stereo::PointStereo;
use super::relief::Relief;
use super::scale_roll::ScaleRoll;
use super::triangulate::Triangulation;
use super::warnings::Warning;

/// What the template locator saw; a step that was not reached is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemplateEvidence {
    /// Why the target may be badly picked; at the designation only.
    pub warnings: Vec<Warning>,
    /// The template, scaled and rolled.
    pub scale_roll: Option<ScaleRoll>,
    /// Its match in the left image.
    pub match_template: Option<TemplateMatch>,
    /// The match of the designated window, where matches are corrected by it.
    pub drift_correction: Option<DriftCorrection>,
    /// The heights around the target, where they are weighed.
    pub relief: Option<Relief>,
    /// The corresponding point in the right image.
    pub point_stereo: Option<PointStereo>,
    /// The position from both.
    pub triangulate: Option<Triangulation>,
}
