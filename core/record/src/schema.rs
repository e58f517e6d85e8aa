//! The serialised form: schemas, sent once per run, and records, sent once per step.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{ArrayDecl, Kind, Unit, Value, unit_label};

/// The declaration of a quantity.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Quantity {
    /// The name, unique in the stage: the path of the field in the evidence where there is one.
    pub name: Cow<'static, str>,
    /// The name shown to people: without unit and frame.
    pub label: Cow<'static, str>,
    /// The unit.
    pub unit: Unit,
    /// The kind of its values.
    pub kind: Kind,
    /// One sentence: the meaning, the frame, and when it is missing.
    pub description: Cow<'static, str>,
    /// How it follows from its inputs; empty for a direct measurement.
    pub formula: Cow<'static, str>,
    /// What the formula reads: `name` of the same stage, `stage.name`, or `setting.key`.
    pub inputs: Vec<Cow<'static, str>>,
}

impl Quantity {
    /// The names of its columns in a table: one, or one per component.
    pub fn columns(&self) -> Vec<String> {
        match self.kind.components() {
            [] => vec![self.name.to_string()],
            parts => parts.iter().map(|part| format!("{}.{part}", self.name)).collect(),
        }
    }

    /// The unit's symbol with the frame that the name tells: `m, rover`.
    pub fn unit_label(&self) -> String {
        unit_label(&self.name, self.unit)
    }
}

/// On which side of its limit a value passes a gate.
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
    /// The side on which it passes.
    pub side: Side,
    /// The path of the setting behind the limit; empty where the limit is computed.
    pub setting: Cow<'static, str>,
}

/// A gate at one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GateRecord {
    /// The name of its declaration.
    pub name: String,
    /// The value; `None` where nothing was found to judge.
    pub value: Option<f64>,
    /// The limit.
    pub limit: f64,
}

/// The declaration of a stage.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct StageSchema {
    /// The stage's word.
    pub stage: Cow<'static, str>,
    /// The question that the stage answers.
    pub question: Cow<'static, str>,
    /// The path of its evidence in the serialised step; empty where the stage has no field of its own.
    pub path: Cow<'static, str>,
    /// Where else it is: in steps of other trackers.
    pub other_paths: Vec<Cow<'static, str>>,
    /// The quantities.
    pub quantities: Vec<Quantity>,
    /// Units of fields of the evidence that are no quantities: lists and models.
    #[schema(value_type = Vec<Object>)]
    pub fields: Vec<(Cow<'static, str>, Unit)>,
    /// The arrays.
    pub arrays: Vec<ArrayDecl>,
    /// The gates.
    pub gates: Vec<GateDecl>,
}

impl StageSchema {
    /// The quantity of a name.
    pub fn quantity(&self, name: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|quantity| quantity.name == name)
    }

    /// Every place of its evidence in a serialised step.
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
    /// A value for every quantity; missing ones where the stage was not reached.
    pub values: Vec<Value>,
    /// Width and height of every array; `None` where it does not exist at this step.
    pub arrays: Vec<Option<[u32; 2]>>,
    /// The gates that were evaluated.
    pub gates: Vec<GateRecord>,
    /// Why the stage gave no result, as one sentence.
    pub reason: Option<String>,
}
