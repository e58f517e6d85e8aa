//! Explanations: the derivation of any value of a step.
//!
//! ```text
//! value, unit ◄── formula ◄── inputs (each explained in turn) ◄── stage ◄── file, pose, setting or click
//! ```
//! A tree is built from the records of the step and the previous one; its values are exactly those of the records. If a node
//! has `is_closed_form`, its formula gives its value from its inputs up to rounding (tests recompute them). Otherwise the
//! formula describes the computation of the stage in words; the header of the stage's module has the details.
//!
//! | file | contents |
//! |---|---|
//! | `gates` | values and margins of gates |
//! | `limits` | limits of gates, the tolerances of [Kim09 §4.6] term by term, settings |
//! | `template` | the match and point stereo |
//! | `prediction`, `position` | prediction, position, covariance |
//! | `odometry` | the gates of visual odometry, and its part in a loss |
//! | `truth` | errors against the truth |
//! | `others` | features, shape, state, error budget |
//! | `recorded` | all other quantities, as their stages declare them |
//! | `sentence` | the summary of a step: headline and bullets, from the evidence |
//! | `cause`, `jump` | the root cause of a loss, found without the truth |
//! | `pose_change` | the change of the pose estimate at a step, with its σ |

mod cause;
pub mod gates;
mod jump;
mod leaving;
mod limits;
mod node;
pub(crate) mod odometry;
mod others;
pub mod pose_change;
mod position;
mod prediction;
mod recorded;
pub mod sentence;
mod template;
mod truth;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod odometry_tests;
#[cfg(test)]
mod cause_tests;
#[cfg(test)]
mod scenario_tests;
pub mod words;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use self::node::{Node, Origin, OriginKind};
pub use self::recorded::is_explained;
use crate::records::StageQuantity;
use crate::step::RunStep;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Pose};
use sightline_geometry::odometry_error::OdometryError;
use sightline_track::settings::Settings;
use sightline_track::stages::judge::Gate;

/// Maximum depth of a tree; deeper nodes can be requested by name.
const DEPTH: usize = 12;

/// Access to the data of a traverse from which its steps were computed.
pub trait Sources {
    /// The estimated pose of a stop.
    fn site_from_rover(&self, step: usize) -> Pose;
    /// The error model of the pose estimates.
    fn pose_error(&self) -> OdometryError;
    /// The name of the left (0) or right (1) image file of a stop; `None` if unknown.
    fn image_file(&self, step: usize, eye: usize) -> Option<String>;
}

impl Sources for sightline_recordings::Traverse {
    fn site_from_rover(&self, step: usize) -> Pose {
        Self::site_from_rover(self, step)
    }

    fn pose_error(&self) -> OdometryError {
        self.index().odometry_error
    }

    fn image_file(&self, step: usize, eye: usize) -> Option<String> {
        let stop = self.index().stops.get(step)?;
        Some([&stop.left, &stop.right][eye.min(1)].image.clone())
    }
}

/// The inputs of an explanation: recorded steps, settings and sources.
#[derive(Clone, Copy)]
pub struct Book<'a> {
    /// The step.
    pub trace: &'a RunStep,
    /// The previous step; `None` at the designation.
    pub before: Option<&'a RunStep>,
    /// The run's configuration.
    pub settings: &'a Settings,
    /// The prediction of this step in the left image as displaced by a person, px; `None`: by dead reckoning.
    pub prediction_px: Option<Pixel>,
    /// The poses, error model and file names of the traverse.
    pub sources: &'a dyn Sources,
}

/// The explanation of a step's verdict, and of one of its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Explanation {
    /// The step.
    pub step: usize,
    /// The root cause of a loss, then the verdict with its evidence, in sentences.
    pub sentence: String,
    /// The gates, worst margin first.
    pub gates: Vec<Gate>,
    /// The names of the values that can be explained at this step.
    pub values: Vec<String>,
    /// The derivation of the requested value; null if none was requested.
    pub tree: Option<Node>,
}

impl<'a> Book<'a> {
    /// Explains the step, and optionally one value.
    ///
    /// # Errors
    /// [`Error::Request`] if the step has no such value.
    pub fn explain(&self, value: Option<&str>) -> Result<Explanation> {
        let tree = value.map(|value| self.ask(value)).transpose()?;
        let gates = self.trace.verdict().into_iter().flat_map(|verdict| gates::by_margin(&verdict.gates));
        Ok(Explanation {
            step: self.trace.step,
            sentence: self.summary().text(),
            gates: gates.map(|margin| margin.gate.clone()).collect(),
            values: self.names(),
            tree,
        })
    }

    /// The derivation of a value.
    ///
    /// # Errors
    /// [`Error::Request`] if the step has no such value.
    pub fn ask(&self, value: &str) -> Result<Node> {
        self.node(value, DEPTH).ok_or_else(|| {
            let step = self.trace.step;
            Error::Request(format!(
                "value: step {step} has no value of that name; leave it out to see the names there are"
            ))
        })
    }

    /// The names of the values that exist at this step and can be explained.
    pub fn names(&self) -> Vec<String> {
        let gates = self.trace.verdict().into_iter().flat_map(|verdict| &verdict.gates);
        let of_odometry = self.trace.odometry.iter().flat_map(|measured| &measured.update.gates);
        let gates = gates.chain(of_odometry);
        let of_gates = gates.flat_map(|gate| {
            [format!("gate.{}", gate.name), format!("value.{}", gate.name), format!("limit.{}", gate.name)]
        });
        let plain = NAMES.iter().map(|&name| name.to_owned());
        let columns = recorded::columns().filter(|name| !NAMES.contains(name)).map(str::to_owned);
        of_gates
            .chain(plain)
            .chain(columns)
            .chain(StageQuantity::all().map(StageQuantity::name))
            .filter(|name| self.node(name, 0).is_some())
            .collect()
    }

    /// The node of a name, with `depth` levels of inputs.
    fn node(&self, name: &str, depth: usize) -> Option<Node> {
        let (group, rest) = name.split_once('.').unwrap_or(("", name));
        let draft = match group {
            "gate" => self.gate(rest),
            "value" => self.gate_value(rest),
            "limit" => self.gate_limit(rest),
            "setting" => self.setting(rest),
            "" => self.of_name(rest).or_else(|| self.of_record("step", rest)),
            stage => self.of_quantity(stage, rest),
        }?;
        Some(self.finish(name, draft, depth))
    }

    /// A value with its own explanation.
    fn of_name(&self, name: &str) -> Option<node::Draft> {
        self.of_template(name)
            .or_else(|| self.of_stereo(name))
            .or_else(|| self.of_position(name))
            .or_else(|| self.of_truth(name))
            .or_else(|| self.of_tolerance(name))
            .or_else(|| self.of_others(name))
    }

    /// Resolves the inputs of a draft, `depth` levels deep.
    fn finish(&self, name: &str, draft: node::Draft, depth: usize) -> Node {
        let inputs = match depth.checked_sub(1) {
            Some(less) => draft.inputs.iter().filter_map(|input| self.node(input, less)).collect(),
            None => Vec::new(),
        };
        let has_more = inputs.is_empty() && !draft.inputs.is_empty();
        Node {
            value: name.to_owned(),
            step: draft.step.unwrap_or(self.trace.step),
            label: draft.label,
            numbers: draft.numbers.into_iter().map(|number| Some(number).filter(|v| v.is_finite())).collect(),
            text: draft.text,
            unit: draft.unit,
            formula: draft.formula,
            is_closed_form: draft.is_closed_form,
            stage: draft.stage,
            origin: draft.origin,
            has_more,
            inputs,
        }
    }
}

/// The values with their own explanation, in addition to those of gates; all others are explained as declared.
const NAMES: [&str; 58] = [
    "state",
    "ncc",
    "stereo_score",
    "confidence",
    "inliers",
    "err_px",
    "err_m",
    "nees",
    "tracked",
    "tolerance_px",
    "sigma_m",
    "range_m",
    "scale",
    "roll_deg",
    "pose_change",
    "pose_change_sigma",
    "predicted_left",
    "predicted_position",
    "predicted_sigma_px",
    "predicted_covariance_px2",
    "search_window_px",
    "search_window",
    "template_size_px",
    "match_px",
    "match_sigma_px",
    "match_covariance_px2",
    "peak",
    "peak_score",
    "second_peak_score",
    "edge_distance_px",
    "innovation_sigma",
    "correction_px",
    "correction_m",
    "right_px",
    "disparity_px",
    "left_right_px",
    "gap_px",
    "position",
    "position_in_site",
    "position_covariance_m2",
    "left_error_px2",
    "predicted_covariance_m2",
    "initial_position_in_site",
    "last_position",
    "old_distance_m",
    "new_distance_m",
    "range_located_m",
    "predicted_range_m",
    "focal_px",
    "baseline_m",
    "travelled_m",
    "travelled_since_update_m",
    "budget_without_m",
    "budget_with_m",
    "matches",
    "feature_covariance",
    "feature_sigma_m",
    "shape_correction_m",
];
