//! Why: any number of a step leads to where it came from.
//!
//! ```text
//! value, unit ◄── formula ◄── inputs (each asked for in turn) ◄── stage ◄── file, pose, setting or click
//! ```
//! A tree is built from the step's record and the one before it; its values are those of the record, digit by digit. A
//! node that says `is_closed_form` has a value that its formula gives from its inputs, to rounding (tests recompute them);
//! of the others the formula says in words what the stage did, as the header of its module has it.
//!
//! | file | of what |
//! |---|---|
//! | `gates` | criteria, margins, the setting behind a limit |
//! | `limits` | the limits, the tolerances of K§4.6 term by term |
//! | `template` | the match and point stereo |
//! | `prediction`, `position` | prediction, position, covariance |
//! | `odometry` | the gates of visual odometry, and its part in a loss |
//! | `truth` | errors against the truth |
//! | `others` | features, shape, state, settings |
//! | `recorded` | every other quantity, as its stage declares it |
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

/// How deep a tree goes; what lies deeper can be asked for by name.
const DEPTH: usize = 12;

/// Where a traverse has what its steps were computed from.
pub trait Sources {
    /// The estimated pose of a stop.
    fn site_from_rover(&self, step: usize) -> Pose;
    /// The error model of the pose estimates.
    fn pose_error(&self) -> OdometryError;
    /// The name of the left (0) or right (1) image file of a stop, where it is known.
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

/// The recorded steps and settings from which an explanation is made.
#[derive(Clone, Copy)]
pub struct Book<'a> {
    /// The step.
    pub trace: &'a RunStep,
    /// The step before it; none at the designation.
    pub before: Option<&'a RunStep>,
    /// The run's configuration.
    pub settings: &'a Settings,
    /// Where a person put the prediction of this step in the left image, px.
    pub prediction_px: Option<Pixel>,
    /// Where the traverse has the rest.
    pub sources: &'a dyn Sources,
}

/// What is known of a step's verdict and of one of its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Explanation {
    /// The step.
    pub step: usize,
    /// The root cause of a loss, then the verdict with its evidence, in sentences.
    pub sentence: String,
    /// The criteria, worst margin first.
    pub gates: Vec<Gate>,
    /// The names that can be asked for at this step.
    pub values: Vec<String>,
    /// Where the value that was asked for came from; null where none was asked for.
    pub tree: Option<Node>,
}

impl<'a> Book<'a> {
    /// What is known of the step, with the tree of one value.
    ///
    /// # Errors
    /// [`Error::Request`] when the step has no such value.
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

    /// Where a value came from.
    ///
    /// # Errors
    /// [`Error::Request`] when the step has no such value.
    pub fn ask(&self, value: &str) -> Result<Node> {
        self.node(value, DEPTH).ok_or_else(|| {
            let step = self.trace.step;
            Error::Request(format!(
                "value: step {step} has no value of that name; leave it out to see the names there are"
            ))
        })
    }

    /// The names that can be asked for: those that have a value at this step.
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

    /// The node of a name, its inputs `depth` levels deep.
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

    /// A value that is explained in words of its own.
    fn of_name(&self, name: &str) -> Option<node::Draft> {
        self.of_template(name)
            .or_else(|| self.of_stereo(name))
            .or_else(|| self.of_position(name))
            .or_else(|| self.of_truth(name))
            .or_else(|| self.of_tolerance(name))
            .or_else(|| self.of_others(name))
    }

    /// A draft with its inputs.
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

/// The values that are explained in words of their own, beside those of the criteria; all others as declared.
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
