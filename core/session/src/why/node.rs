//! A node of an explanation tree: a value with its formula, inputs and origin.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A value with its formula, inputs and origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Node {
    /// The name by which it can be requested.
    pub value: String,
    /// The step at which it can be requested.
    pub step: usize,
    /// A description in words.
    pub label: String,
    /// Its numbers: one, or the coordinates of a pixel, point or pose, or a matrix row by row; null where not finite.
    pub numbers: Vec<Option<f64>>,
    /// Its word; null for numbers.
    pub text: Option<String>,
    /// Its unit, empty for pure numbers.
    pub unit: String,
    /// The formula that computes it from its inputs, or the computation in words; null without one.
    pub formula: Option<String>,
    /// Whether the formula gives the value from the inputs up to rounding.
    pub is_closed_form: bool,
    /// The stage or step of `locate` that computed it.
    pub stage: String,
    /// Its origin outside the values of the step; null if there is none.
    pub origin: Option<Origin>,
    /// Whether it has inputs that are left out here; request it by name to get them.
    pub has_more: bool,
    /// Its inputs.
    #[schema(no_recursion)]
    pub inputs: Vec<Node>,
}

/// The origin of a value outside the values of the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Origin {
    /// The kind of origin.
    pub kind: OriginKind,
    /// Its name: a file, a stop, a setting.
    pub name: String,
    /// The stop to which it belongs; null if it belongs to none.
    pub step: Option<usize>,
}

/// The kinds of origins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OriginKind {
    /// An image file.
    Image,
    /// The estimated pose of a stop.
    Pose,
    /// The camera model of a stop.
    Camera,
    /// A setting.
    Setting,
    /// An action of a person.
    Person,
    /// A result of an earlier step.
    Step,
    /// The truth of the traverse.
    Truth,
}

/// A node whose inputs are not yet resolved.
#[derive(Clone, Debug, Default)]
pub(super) struct Draft {
    pub(super) label: String,
    pub(super) numbers: Vec<f64>,
    pub(super) text: Option<String>,
    pub(super) unit: String,
    pub(super) formula: Option<String>,
    pub(super) is_closed_form: bool,
    pub(super) stage: String,
    pub(super) origin: Option<Origin>,
    pub(super) step: Option<usize>,
    pub(super) inputs: Vec<String>,
}

impl Draft {
    /// A draft with numbers of a stage.
    pub(super) fn numbers(
        stage: &str,
        label: &str,
        unit: &str,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Self {
        Self {
            stage: stage.to_owned(),
            label: label.to_owned(),
            unit: unit.to_owned(),
            numbers: numbers.into_iter().collect(),
            ..Self::default()
        }
    }

    /// A draft with one number of a stage.
    pub(super) fn number(stage: &str, label: &str, unit: &str, number: f64) -> Self {
        Self::numbers(stage, label, unit, [number])
    }

    /// A draft with a word of a stage.
    pub(super) fn text(stage: &str, label: &str, text: impl Into<String>) -> Self {
        Self { text: Some(text.into()), ..Self::numbers(stage, label, "", []) }
    }

    /// Sets a formula that gives the value from the inputs up to rounding.
    pub(super) fn exactly(self, formula: &str, inputs: &[&str]) -> Self {
        Self { is_closed_form: true, ..self.roughly(formula, inputs) }
    }

    /// Sets a description of the computation from the inputs, in words.
    pub(super) fn roughly(mut self, formula: &str, inputs: &[&str]) -> Self {
        self.formula = Some(formula.to_owned());
        self.inputs = inputs.iter().map(|&input| input.to_owned()).collect();
        self
    }

    /// Sets the origin of the value.
    pub(super) fn from(mut self, kind: OriginKind, name: impl Into<String>, step: Option<usize>) -> Self {
        self.origin = Some(Origin { kind, name: name.into(), step });
        self
    }

    /// Sets the step at which the value can be requested.
    pub(super) fn at_step(mut self, step: usize) -> Self {
        self.step = Some(step);
        self
    }
}
