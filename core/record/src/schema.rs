//! The serialised form: schemas, sent once per run, and records, sent once per step.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{ArrayDecl, Kind, Unit, Value, unit_label};

/// The declaration of a quantity.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Quantity {
    /// The name, unique in the stage; the path of the field if the quantity is a field of the evidence.
    pub name: Cow<'static, str>,
    /// The name shown to people: without unit and frame.
    pub label: Cow<'static, str>,
    /// The unit.
    pub unit: Unit,
    /// The kind of its values.
    pub kind: Kind,
    /// One sentence: the meaning, the frame, and when the value is missing.
    pub description: Cow<'static, str>,
    /// The formula that computes it from its inputs; empty for a direct measurement.
    pub formula: Cow<'static, str>,
    /// The inputs of the formula: `name` of the same stage, `stage.name`, or `setting.key`.
    pub inputs: Vec<Cow<'static, str>>,
}

impl Quantity {
    /// The names of its columns in a table: its own name, or one name per component.
    pub fn columns(&self) -> Vec<String> {
        match self.kind.components() {
            [] => vec![self.name.to_string()],
            parts => parts.iter().map(|part| format!("{}.{part}", self.name)).collect(),
        }
    }

    /// The unit's symbol, followed by the frame if the name ends with one: `m, rover`.
    pub fn unit_label(&self) -> String {
        unit_label(&self.name, self.unit)
    }
}

/// The side of the limit on which a value passes a gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The value must be at least the limit.
    AtLeast,
    /// The value must be at most the limit.
    AtMost,
}

/// The declaration of a gate.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct GateDecl {
    /// The name.
    pub name: Cow<'static, str>,
    /// The unit of value, limit and margin.
    pub unit: Unit,
    /// The side of the limit on which the value passes.
    pub side: Side,
    /// The path of the setting that gives the limit; empty if the limit is computed.
    pub setting: Cow<'static, str>,
}

/// A gate that was evaluated at one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GateRecord {
    /// The name of the gate, as declared.
    pub name: String,
    /// The value; `None` if the stage found nothing to judge.
    pub value: Option<f64>,
    /// The limit.
    pub limit: f64,
}

/// The declaration of a stage.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct StageSchema {
    /// The stage's name.
    pub stage: Cow<'static, str>,
    /// The question that the stage answers.
    pub question: Cow<'static, str>,
    /// The path of its evidence in the serialised step; empty if the stage has no field of its own.
    pub path: Cow<'static, str>,
    /// Further paths of its evidence, in the steps of other trackers.
    pub other_paths: Vec<Cow<'static, str>>,
    /// The quantities.
    pub quantities: Vec<Quantity>,
    /// Units of fields of the evidence that are not quantities: lists and models.
    #[schema(value_type = Vec<Object>)]
    pub fields: Vec<(Cow<'static, str>, Unit)>,
    /// The arrays.
    pub arrays: Vec<ArrayDecl>,
    /// The gates.
    pub gates: Vec<GateDecl>,
}

impl StageSchema {
    /// The quantity with this name.
    pub fn quantity(&self, name: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|quantity| quantity.name == name)
    }

    /// All paths of its evidence in a serialised step.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        let first = Some(self.path.as_ref()).filter(|path| !path.is_empty());
        first.into_iter().chain(self.other_paths.iter().map(AsRef::as_ref))
    }
}

/// The plain values of a stage at one step, in the order of the schema.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageRecord {
    /// Whether the stage was reached.
    pub reached: bool,
    /// One value for each quantity; all missing if the stage was not reached.
    pub values: Vec<Value>,
    /// Width and height of each array; `None` if it does not exist at this step.
    pub arrays: Vec<Option<[u32; 2]>>,
    /// The gates that were evaluated.
    pub gates: Vec<GateRecord>,
    /// Why the stage gave no result, as one sentence.
    pub reason: Option<String>,
}
