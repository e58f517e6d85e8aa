//! Evaluation of an expression at all steps of all runs of a session: its hits and its values.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Session;
use super::expression::catalogue::Name;
use super::expression::{Answers, Expression, Value};
use crate::step::RunStep;

/// Requests the evaluation of an expression at every step.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Query {
    /// The expression.
    pub expression: String,
    /// Only this target; default: all targets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<usize>,
    /// Whether to return the values in addition to the steps at which it is true.
    #[serde(default)]
    pub values: bool,
}

/// The result of an expression at every step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct QueryAnswer {
    /// The expression in canonical form.
    pub expression: String,
    /// The type of its values.
    pub answers: Answers,
    /// Their unit; empty without one.
    pub unit: String,
    /// Number of steps of all runs at which it is true.
    pub count: usize,
    /// The results by run.
    pub runs: Vec<RunAnswer>,
}

/// The result of an expression at every step of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunAnswer {
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The stop of the run's first step.
    pub first_step: usize,
    /// Number of evaluated steps.
    pub steps: usize,
    /// The stops at which it is true.
    pub hits: Vec<usize>,
    /// Its values by step: numbers, 1 and 0 for yes and no, null if missing; empty if they were not requested.
    pub values: Vec<Option<f64>>,
}

/// A description of the expression language for programs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Language {
    /// Every name.
    pub names: Vec<Name>,
    /// Every function.
    pub functions: Vec<FunctionView>,
    /// Every unit that may follow a number.
    pub units: Vec<String>,
    /// Maximum number of characters of an expression.
    pub length_limit: usize,
    /// Maximum depth of nesting.
    pub depth_limit: usize,
    /// Maximum number of nodes of an expression.
    pub node_limit: usize,
}

/// A function of the language.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct FunctionView {
    /// Its name.
    pub name: String,
    /// Its notation.
    pub form: String,
    /// Its meaning, as one sentence.
    pub meaning: String,
}

/// Requests the completions at a position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CompletionQuery {
    /// The text so far.
    pub text: String,
    /// The cursor, counted in characters.
    pub cursor: usize,
}

/// A snapshot of the steps of a target's runs.
#[derive(Clone, Debug)]
pub struct TargetSteps {
    /// The target's number.
    pub target: usize,
    /// Its runs.
    pub runs: Vec<Vec<Arc<RunStep>>>,
}

impl Session {
    /// The steps of one target, or of all targets that were not removed.
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

/// Evaluates `expression` at every step of `targets`.
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

/// The value as a number for plots; `None` for missing values and other types.
fn plotted(value: &Value) -> Option<f64> {
    match value {
        Value::Number(value) => Some(*value),
        Value::Truth(truth) => Some(f64::from(u8::from(*truth))),
        _ => None,
    }
}

/// The expression language of this build.
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
