//! Explanations of declared quantities: value, unit, formula and inputs as declared, unless another file explains them.

use crate::records::{self, StageQuantity};
use sightline_record::{StageSchema, Value};

use super::Book;
use super::node::{Draft, OriginKind};

impl Book<'_> {
    /// A field of a stage, by its own explanation if there is one, else as declared.
    pub(super) fn of_quantity(&self, stage: &str, field: &str) -> Option<Draft> {
        let name = format!("{stage}.{field}");
        let declared = self.of_record(stage, field);
        let is_missing = declared.is_none() && StageQuantity::named(&name).is_some();
        let own = own_words(&name).filter(|_| !is_missing).and_then(|name| self.of_name(name));
        own.or(declared)
    }

    /// A quantity of a stage as declared.
    pub(super) fn of_record(&self, stage: &str, name: &str) -> Option<Draft> {
        let stage = records::stage(stage).filter(|stage| stage.is_reached(self.trace))?;
        let (schema, quantity) = (stage.schema(), stage.schema().quantity(name)?);
        let (label, word) = (quantity.description.trim_end_matches('.'), schema.stage.as_ref());
        let draft = match stage.value_of(self.trace, name)? {
            Value::Missing => return None,
            Value::Flag(flag) => Draft::text(word, label, if flag { "yes" } else { "no" }),
            Value::Word(text) => Draft::text(word, label, text),
            Value::Count(count) => Draft::number(word, label, "", count as f64),
            Value::Number(number) => Draft::number(word, label, quantity.unit.symbol(), number),
            Value::Components(numbers) => Draft::numbers(word, label, quantity.unit.symbol(), numbers),
        };
        let draft = self.origin_of(word, draft);
        if quantity.formula.is_empty() {
            return Some(draft);
        }
        let inputs: Vec<String> = quantity.inputs.iter().map(|input| qualified(schema, input)).collect();
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        Some(draft.roughly(&quantity.formula, &inputs))
    }

    /// Adds the origin of the quantities of a stage.
    pub(super) fn origin_of(&self, stage: &str, draft: Draft) -> Draft {
        let step = self.trace.step;
        match stage {
            "predict" | "point_mast" | "update" => {
                draft.from(OriginKind::Pose, format!("pose estimate of stop {step}"), Some(step))
            }
            "truth" => draft.from(OriginKind::Truth, "truth of the traverse", Some(step)),
            _ => {
                let file = self.sources.image_file(step, 0);
                draft.from(
                    OriginKind::Image,
                    file.unwrap_or_else(|| format!("left image of stop {step}")),
                    Some(step),
                )
            }
        }
    }
}

/// The names of the columns of a row.
pub(super) fn columns() -> impl Iterator<Item = &'static str> {
    let row = records::stage("step").into_iter().flat_map(|stage| &stage.schema().quantities);
    row.map(|quantity| quantity.name.as_ref())
}

/// Whether a field of a stage can be explained: a quantity, or a field with its own explanation.
pub fn is_explained(field: &str) -> bool {
    own_words(field).is_some() || StageQuantity::named(field).is_some()
}

/// The name of a field's own explanation; `None` without one.
pub(super) fn own_words(field: &str) -> Option<&'static str> {
    OWN_WORDS.iter().find(|(own, _)| *own == field).map(|(_, name)| *name)
}

/// The fields with their own explanation, and the name of that explanation.
const OWN_WORDS: [(&str, &str); 47] = [
    ("predict.position_in_rover", "predicted_position"),
    ("predict.covariance_in_rover", "predicted_covariance_m2"),
    ("predict.travelled_m", "travelled_m"),
    ("predict.travelled_since_update_m", "travelled_since_update_m"),
    ("point_mast.predicted_left", "predicted_left"),
    ("point_mast.predicted_covariance_px2", "predicted_covariance_px2"),
    ("scale_roll.scale", "scale"),
    ("scale_roll.old_distance_m", "old_distance_m"),
    ("scale_roll.new_distance_m", "new_distance_m"),
    ("match_template.score", "ncc"),
    ("match_template.pixel", "match_px"),
    ("match_template.covariance_px2", "match_covariance_px2"),
    ("match_template.match_sigma_px", "match_sigma_px"),
    ("match_template.search_window", "search_window"),
    ("match_template.peak.score", "peak_score"),
    ("match_template.second_peak.score", "second_peak_score"),
    ("match_template.second_peak.ratio", "second_peak_ratio"),
    ("point_stereo.score", "stereo_score"),
    ("point_stereo.right_pixel", "right_px"),
    ("point_stereo.disparity_px", "disparity_px"),
    ("point_stereo.left_right_px", "left_right_px"),
    ("triangulate.gap_px", "gap_px"),
    ("detect.left", "features_left"),
    ("detect.points", "points"),
    ("match_features.matches", "matches"),
    ("fit_motion.inliers", "inliers"),
    ("bootstrap.covariance", "feature_covariance"),
    ("refine_register.correction_m", "shape_correction_m"),
    ("locate.left_pixel", "left_px"),
    ("locate.position_in_rover", "located_position"),
    ("locate.confidence", "confidence"),
    ("judge.state_before", "state_before"),
    ("judge.state", "state"),
    ("update.state", "state"),
    ("update.correction_m", "correction_m"),
    ("update.correction_px", "correction_px"),
    ("update.target.position_in_rover", "position"),
    ("update.target.covariance_in_rover", "position_covariance_m2"),
    ("update.target.initial_position_in_site", "initial_position_in_site"),
    ("update.target.initial_distance_m", "initial_distance_m"),
    ("truth.position_in_rover", "true_position"),
    ("truth.left_pixel", "true_px"),
    ("truth.magnification", "magnification"),
    ("truth.err_px", "err_px"),
    ("truth.err_m", "err_m"),
    ("truth.nees", "nees"),
    ("truth.tolerance_px", "tolerance_px"),
];

/// The name of an input with its stage.
fn qualified(schema: &StageSchema, input: &str) -> String {
    match schema.quantity(input) {
        Some(_) => format!("{}.{input}", schema.stage),
        None => input.to_owned(),
    }
}
