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
use sightline_record::Stage;

/// The evidence of the template locator; a step that was not reached is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemplateEvidence {
    /// Why the designated target may be unsuitable; at the designation only.
    pub warnings: Vec<Warning>,
    /// The template, scaled and rolled.
    pub scale_roll: Option<ScaleRoll>,
    /// Its match in the left image.
    pub match_template: Option<TemplateMatch>,
    /// The match of the designated window; null unless matches are corrected by it.
    pub drift_correction: Option<DriftCorrection>,
    /// The heights around the target; null without the height term.
    pub relief: Option<Relief>,
    /// The corresponding point in the right image.
    pub point_stereo: Option<PointStereo>,
    /// The position triangulated from both pixels.
    pub triangulate: Option<Triangulation>,
}

impl TemplateEvidence {
    /// The stages of this evidence, in running order and at their paths in it.
    pub(in crate::locate) fn stages() -> Vec<Stage<Self>> {
        vec![
            Stage::of("scale_roll", "How should the template look from here?", |e: &Self| {
                e.scale_roll.as_ref()
            })
            .at("scale_roll"),
            Stage::of("match_template", "Where does the template fit best in the left image?", |e: &Self| {
                e.match_template.as_ref()
            })
            .at("match_template"),
            Stage::of("drift_correction", "Where does the designated window fit?", |e: &Self| {
                e.drift_correction.as_ref()
            })
            .at("drift_correction"),
            Stage::of("relief", "What is the relief around the target?", |e: &Self| e.relief.as_ref())
                .at("relief"),
            Stage::of("point_stereo", "Which point of the right image is it?", |e: &Self| {
                e.point_stereo.as_ref()
            })
            .at("point_stereo"),
            Stage::of("triangulate", "Which point in space do both pixels see?", |e: &Self| {
                e.triangulate.as_ref()
            })
            .at("triangulate"),
        ]
    }
}
