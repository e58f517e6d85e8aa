//! An expression over all steps of all runs of a session: where it is true, and what its values are.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Session;
use super::expression::catalogue::Name;
use super::expression::{Answers, Expression, Value};
use crate::step::RunStep;

/// Asks an expression at every step.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Query {
    /// The expression.
    pub expression: String,
    /// Only this target; left out: all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<usize>,
    /// Whether the values are wanted, and not only the steps at which it is true.
    #[serde(default)]
    pub values: bool,
}

/// What an expression is at every step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct QueryAnswer {
    /// The expression, as it was understood.
    pub expression: String,
    /// What its values are.
    pub answers: Answers,
    /// Their unit; empty without one.
    pub unit: String,
    /// Steps at which it is true, in all runs.
    pub count: usize,
    /// Run by run.
    pub runs: Vec<RunAnswer>,
}

/// What an expression is at every step of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunAnswer {
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The stop of the run's first step.
    pub first_step: usize,
    /// How many steps were asked.
    pub steps: usize,
    /// The stops at which it is true.
    pub hits: Vec<usize>,
    /// Its values step by step: numbers, 1 and 0 for yes and no, null where missing; empty where they were not wanted.
    pub values: Vec<Option<f64>>,
}

/// The language, for whoever writes expressions in a program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Language {
    /// Every name.
    pub names: Vec<Name>,
    /// Every function.
    pub functions: Vec<FunctionView>,
    /// Every unit that a number may bear.
    pub units: Vec<String>,
    /// How many characters an expression may have.
    pub length_limit: usize,
    /// How many things may stand inside each other.
    pub depth_limit: usize,
    /// How many parts an expression may have.
    pub node_limit: usize,
}

/// A function of the language.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct FunctionView {
    /// Its name.
    pub name: String,
    /// How it is written.
    pub form: String,
    /// What it means.
    pub meaning: String,
}

/// Asks what could be written at a place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CompletionQuery {
    /// The text so far.
    pub text: String,
    /// The cursor, counted in characters.
    pub cursor: usize,
}

/// The steps of a target's runs as they are now; further steps do not change it.
#[derive(Clone, Debug)]
pub struct TargetSteps {
    /// The target's number.
    pub target: usize,
    /// Its runs.
    pub runs: Vec<Vec<Arc<RunStep>>>,
}

impl Session {
    /// The steps of one target, or of all that were not removed.
    pub fn steps_of(&self, only: Option<usize>) -> Vec<TargetSteps> {
        let there = self
            .targets
            .iter()
            .enumerate()
            .filter(|(number, target)| !target.removed && only.is_none_or(|only| only == *number));
        let steps = |(target, record): (usize, &super::TargetRecord)| TargetSteps {
            target,
            runs: record.runs.iter().map(|run| run.steps.clone()).collect(),
        };
        there.map(steps).collect()
    }
}

/// What `expression` is at every step of `targets`.
pub fn ask(expression: &Expression, targets: &[TargetSteps], with_values: bool) -> QueryAnswer {
    let mut answer = QueryAnswer {
        expression: expression.to_string(),
        answers: expression.answers(),
        unit: expression.unit().to_owned(),
        count: 0,
        runs: Vec::new(),
    };
    let compared = expression.runs_compared();
    for target in targets {
        let runs: Vec<&[Arc<RunStep>]> = target.runs.iter().map(Vec::as_slice).collect();
        for (run, steps) in runs.iter().enumerate() {
            if !compared.is_empty() && !compared.contains(&run) {
                continue;
            }
            let mut of_run = RunAnswer {
                target: target.target,
                run,
                first_step: steps.first().map_or(0, |first| first.step),
                steps: steps.len(),
                hits: Vec::new(),
                values: Vec::new(),
            };
            for (index, step) in steps.iter().enumerate() {
                let value = expression.value(&runs, run, index);
                if value == Value::Truth(true) {
                    of_run.hits.push(step.step);
                }
                if with_values {
                    of_run.values.push(plotted(&value));
                }
            }
            answer.count += of_run.hits.len();
            answer.runs.push(of_run);
        }
    }
    answer
}

/// A value as a number.
fn plotted(value: &Value) -> Option<f64> {
    match value {
        Value::Number(value) => Some(*value),
        Value::Truth(truth) => Some(f64::from(u8::from(*truth))),
        _ => None,
    }
}

/// The whole language of this build.
pub fn language() -> Language {
    use super::expression::{DEPTH_LIMIT, LENGTH_LIMIT, NODE_LIMIT, catalogue, functions, unit};
    let function = |info: &functions::FunctionInfo| FunctionView {
        name: info.name.to_owned(),
        form: info.form.to_owned(),
        meaning: info.meaning.to_owned(),
    };
    Language {
        names: catalogue::all_names(),
        functions: functions::FUNCTIONS.iter().map(function).collect(),
        units: unit::Unit::words().map(str::to_owned).collect(),
        length_limit: LENGTH_LIMIT,
        depth_limit: DEPTH_LIMIT,
        node_limit: NODE_LIMIT,
    }
}
