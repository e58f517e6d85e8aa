//! One line of a tree: a value with where it came from.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A value with where it came from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Node {
    /// The name by which it can be asked for.
    pub value: String,
    /// The step at which it is to be asked for.
    pub step: usize,
    /// What it is, in words.
    pub label: String,
    /// Its numbers: one, or the coordinates of a pixel, point or pose, or a matrix row by row; null where not finite.
    pub numbers: Vec<Option<f64>>,
    /// Its word, where it is no number.
    pub text: Option<String>,
    /// Its unit, empty for pure numbers.
    pub unit: String,
    /// How it follows from its inputs.
    pub formula: Option<String>,
    /// Whether the formula gives the value from the inputs to rounding.
    pub is_closed_form: bool,
    /// The stage or step of `locate` that made it.
    pub stage: String,
    /// Where it came from, where that is no other value.
    pub origin: Option<Origin>,
    /// Whether it has inputs that are left out here: ask for it.
    pub has_more: bool,
    /// What it was made of.
    #[schema(no_recursion)]
    pub inputs: Vec<Node>,
}

/// What a value came from that is no other value of the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Origin {
    /// What it is.
    pub kind: OriginKind,
    /// Its name: a file, a stop, a setting.
    pub name: String,
    /// The stop that it belongs to, where it belongs to one.
    pub step: Option<usize>,
}

/// The kinds of what a value may come from.
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
    /// What a person did.
    Person,
    /// What the previous step left.
    Step,
    /// The truth of the traverse.
    Truth,
}

/// A node before its inputs were looked up.
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
    /// Numbers of a stage.
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

    /// One number of a stage.
    pub(super) fn number(stage: &str, label: &str, unit: &str, number: f64) -> Self {
        Self::numbers(stage, label, unit, [number])
    }

    /// A word of a stage.
    pub(super) fn text(stage: &str, label: &str, text: impl Into<String>) -> Self {
        Self { text: Some(text.into()), ..Self::numbers(stage, label, "", []) }
    }

    /// A formula that gives the value from the inputs.
    pub(super) fn exactly(self, formula: &str, inputs: &[&str]) -> Self {
        Self { is_closed_form: true, ..self.roughly(formula, inputs) }
    }

    /// What the stage did with the inputs, in words.
    pub(super) fn roughly(mut self, formula: &str, inputs: &[&str]) -> Self {
        self.formula = Some(formula.to_owned());
        self.inputs = inputs.iter().map(|&input| input.to_owned()).collect();
        self
    }

    /// Where the value came from.
    pub(super) fn from(mut self, kind: OriginKind, name: impl Into<String>, step: Option<usize>) -> Self {
        self.origin = Some(Origin { kind, name: name.into(), step });
        self
    }

    /// The step at which the value is to be asked for.
    pub(super) fn at_step(mut self, step: usize) -> Self {
        self.step = Some(step);
        self
    }
}
