//! Evaluates a checked expression at one step of a run. Evaluation is total: every expression has a value at every step, and
//! costs at most twice as many operations as it has nodes.
//!
//! Absent fields and non-finite numbers are missing; results computed from a missing value are missing. A comparison with a
//! missing value is false, `!=` included; a missing condition is false.

use std::cell::OnceCell;
use std::sync::Arc;

use super::catalogue::{Place, Root};
use super::extract::{Value, extract};
use super::recorded;
use super::tree::Operator;
use crate::step::{RunStep, StepRow};

/// A function of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    Abs,
    Min,
    Max,
    Sqrt,
    Hypot,
}

/// The compiled form of an expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Code {
    /// A constant.
    Constant(Value),
    /// A value of the step; numbers are divided by the number of their units in one base unit.
    Read(Place, f64),
    /// A number divided by the number of its units in one base unit.
    Scaled(Box<Code>, f64),
    Not(Box<Code>),
    Negate(Box<Code>),
    And(Box<Code>, Box<Code>),
    Or(Box<Code>, Box<Code>),
    Arithmetic(Operator, Box<Code>, Box<Code>),
    Compare(Operator, Box<Code>, Box<Code>),
    Equal {
        negated: bool,
        left: Box<Code>,
        right: Box<Code>,
    },
    Apply(Function, Vec<Code>),
    Before(Box<Code>),
    Changes(Box<Code>),
    Has(Box<Code>),
    Count(Box<Code>),
    Contains(Box<Code>, String),
    Differs {
        runs: [usize; 2],
        of: Box<Code>,
        beyond: f64,
    },
}

/// The runs of a target, each with its steps so far, the designation first.
pub type Runs<'a> = [&'a [Arc<RunStep>]];

/// One step of one run.
pub(super) struct Moment<'a> {
    runs: &'a Runs<'a>,
    run: usize,
    index: usize,
    row: OnceCell<StepRow>,
    before: OnceCell<Option<Box<Moment<'a>>>>,
}

impl<'a> Moment<'a> {
    /// The step at `index` of a run; `None` if there is none.
    pub(super) fn new(runs: &'a Runs<'a>, run: usize, index: usize) -> Option<Self> {
        runs.get(run)?.get(index)?;
        Some(Self { runs, run, index, row: OnceCell::new(), before: OnceCell::new() })
    }

    fn trace(&self) -> &'a RunStep {
        &self.runs[self.run][self.index]
    }

    fn before(&self) -> Option<&Self> {
        let make = || Some(Box::new(Self::new(self.runs, self.run, self.index.checked_sub(1)?)?));
        self.before.get_or_init(make).as_deref()
    }

    /// The same stop in another run.
    fn in_run(&self, run: usize) -> Option<Self> {
        let first = self.runs.get(run)?.first()?.step;
        Self::new(self.runs, run, self.trace().step.checked_sub(first)?)
    }

    fn read(&self, place: &Place) -> Value {
        match &place.root {
            Root::Row => extract(self.row.get_or_init(|| self.trace().row()), &place.path),
            Root::Step => extract(self.trace(), &place.path),
            Root::Stage => recorded::read(self.trace(), &place.path),
        }
    }
}

impl Code {
    /// The number, if it does not depend on the step.
    pub(super) fn constant(&self) -> Option<f64> {
        match self {
            Self::Constant(Value::Number(value)) => Some(*value),
            Self::Scaled(of, per_base) => Some(of.constant()? / per_base),
            Self::Negate(of) => Some(-of.constant()?),
            Self::Arithmetic(operator, a, b) => Some(arithmetic(*operator, a.constant()?, b.constant()?)),
            _ => None,
        }
    }

    /// The value at a step.
    pub(super) fn value(&self, moment: &Moment<'_>) -> Value {
        match self {
            Self::Constant(value) => value.clone(),
            Self::Read(place, per_base) => divided(moment.read(place), *per_base),
            Self::Scaled(of, per_base) => divided(of.value(moment), *per_base),
            Self::Not(of) => Value::Truth(!of.is_true(moment)),
            Self::Negate(of) => of.number(moment).map_or(Value::Missing, |value| Value::of_number(-value)),
            Self::And(a, b) => Value::Truth(a.is_true(moment) && b.is_true(moment)),
            Self::Or(a, b) => Value::Truth(a.is_true(moment) || b.is_true(moment)),
            Self::Arithmetic(operator, a, b) => {
                let both = a.number(moment).zip(b.number(moment));
                both.map_or(Value::Missing, |(a, b)| Value::of_number(arithmetic(*operator, a, b)))
            }
            Self::Compare(operator, a, b) => {
                let both = a.number(moment).zip(b.number(moment));
                Value::Truth(both.is_some_and(|(a, b)| compare(*operator, a, b)))
            }
            Self::Equal { negated, left, right } => {
                let (a, b) = (left.value(moment), right.value(moment));
                let both = a != Value::Missing && b != Value::Missing;
                Value::Truth(both && (a == b) != *negated)
            }
            Self::Apply(function, of) => {
                let numbers: Option<Vec<f64>> = of.iter().map(|code| code.number(moment)).collect();
                numbers.map_or(Value::Missing, |numbers| Value::of_number(apply(*function, &numbers)))
            }
            Self::Before(of) => moment.before().map_or(Value::Missing, |before| of.value(before)),
            Self::Changes(of) => {
                let before = moment.before().map(|before| of.value(before));
                Value::Truth(before.is_some_and(|before| before != of.value(moment)))
            }
            Self::Has(of) => Value::Truth(of.value(moment) != Value::Missing),
            Self::Count(of) => match of.value(moment) {
                Value::List(count) => Value::Number(count as f64),
                _ => Value::Missing,
            },
            Self::Contains(of, part) => match of.value(moment) {
                Value::Word(text) => Value::Truth(text.to_lowercase().contains(&part.to_lowercase())),
                _ => Value::Truth(false),
            },
            Self::Differs { runs, of, beyond } => Value::Truth(differs(moment, *runs, of, *beyond)),
        }
    }

    fn number(&self, moment: &Moment<'_>) -> Option<f64> {
        match self.value(moment) {
            Value::Number(value) => Some(value),
            _ => None,
        }
    }

    fn is_true(&self, moment: &Moment<'_>) -> bool {
        self.value(moment) == Value::Truth(true)
    }
}

fn divided(value: Value, per_base: f64) -> Value {
    match value {
        Value::Number(value) => Value::of_number(value / per_base),
        other => other,
    }
}

fn arithmetic(operator: Operator, a: f64, b: f64) -> f64 {
    match operator {
        Operator::Plus => a + b,
        Operator::Minus => a - b,
        Operator::Times => a * b,
        Operator::Over => a / b,
        _ => f64::NAN,
    }
}

fn compare(operator: Operator, a: f64, b: f64) -> bool {
    match operator {
        Operator::Less => a < b,
        Operator::AtMost => a <= b,
        Operator::More => a > b,
        Operator::AtLeast => a >= b,
        _ => false,
    }
}

fn apply(function: Function, of: &[f64]) -> f64 {
    match function {
        Function::Abs => of[0].abs(),
        Function::Sqrt => of[0].sqrt(),
        Function::Min => of.iter().copied().fold(f64::INFINITY, f64::min),
        Function::Max => of.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        Function::Hypot => of.iter().copied().fold(0.0, f64::hypot),
    }
}

/// Whether a value differs between two runs at this stop; false if one of them lacks the stop.
fn differs(moment: &Moment<'_>, runs: [usize; 2], of: &Code, beyond: f64) -> bool {
    let [Some(a), Some(b)] = runs.map(|run| moment.in_run(run)) else { return false };
    match (of.value(&a), of.value(&b)) {
        (Value::Number(a), Value::Number(b)) => (a - b).abs() > beyond,
        (a, b) => a != b,
    }
}
