//! The expression language: small, total expressions over the values of all stages of a step.
//!
//! ```text
//! ncc < 0.6 && step > 10          state changes                 err_px > 2 px
//! sigma_m > 5 cm or state == lost judge.gates.ncc.margin < 5 %  differs(A, B, ncc, 0.02)
//! ```
//! Breakpoints are conditions; derived columns are numbers or conditions. docs/expressions.md describes the whole language;
//! a test compares it with the code. The passes are text → `token` → `parse` → `tree` → `check` → `evaluate`; the names are
//! in [`catalogue`], which is built from the schema of the record.
//!
//! There are no loops and no definitions; length, depth and number of nodes are limited; every expression has a value at
//! every step. An error is one sentence with its position in the text.

mod calls;
pub mod catalogue;
mod check;
pub mod complete;
mod evaluate;
mod extract;
pub mod functions;
mod names;
mod parse;
mod recorded;
mod schema;
mod token;
pub(crate) mod tree;
pub mod unit;

#[cfg(test)]
mod property_tests;
#[cfg(test)]
mod tests;

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::check::{Checker, Type};
pub use self::evaluate::Runs;
use self::evaluate::{Code, Moment};
pub use self::extract::Value;
use self::tree::{Kind, Node, Segment};
use self::unit::Unit;

/// Maximum number of characters of an expression.
pub const LENGTH_LIMIT: usize = 500;
/// Maximum depth of nesting.
pub const DEPTH_LIMIT: usize = 32;
/// Maximum number of nodes of an expression.
pub(crate) const NODE_LIMIT: usize = 200;

/// An error in an expression, with its position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Refused {
    /// The error as a clause, without capital letter and full stop.
    pub sentence: String,
    /// The first character at fault, from 0.
    pub from: usize,
    /// The first character after the fault.
    pub to: usize,
    /// How to correct it.
    pub hint: Option<String>,
}

impl fmt::Display for Refused {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "at character {}, {}", self.from + 1, self.sentence)
    }
}

/// The type of an expression's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Answers {
    /// A number, with its unit.
    Number,
    /// Yes or no; can be a breakpoint.
    Truth,
    /// A word; can be compared, but not plotted.
    Word,
}

/// A parsed and checked expression.
#[derive(Clone, Debug)]
pub struct Expression {
    tree: Node,
    code: Code,
    answers: Answers,
    unit: Unit,
    runs: Vec<usize>,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// The error and its position.
    pub fn read(text: &str) -> Result<Self, Refused> {
        let tree = parse::parse(text)?;
        let mut checker = Checker { text, runs: Vec::new(), inside_differs: false };
        let checked = checker.check(&tree)?;
        let runs = checker.runs;
        let (answers, unit) = match checked.kind {
            Type::Bare => (Answers::Number, Unit::NONE),
            Type::Number(unit) => (Answers::Number, unit),
            Type::Truth => (Answers::Truth, Unit::NONE),
            Type::Word(_) => (Answers::Word, Unit::NONE),
            Type::List => {
                let refused = Refused::whole(text, "this is a list".to_owned());
                return Err(
                    refused.hint("Name one of its entries, as in `[0]`, or count them with `count(…)`.")
                );
            }
            Type::Record => {
                let refused = Refused::whole(text, "this is a record".to_owned());
                return Err(refused.hint("Add a dot: completion lists its fields."));
            }
        };
        Ok(Self { tree, code: checked.code, answers, unit, runs })
    }

    /// Reads a condition.
    ///
    /// # Errors
    /// The error and its position.
    pub fn condition(text: &str) -> Result<Self, Refused> {
        let read = Self::read(text)?;
        if read.answers == Answers::Truth {
            return Ok(read);
        }
        let refused = Refused::whole(text, "a breakpoint is a condition, and this is a value".to_owned());
        Err(refused.hint(format!("Compare it, for example `{} > 1`.", text.trim())))
    }

    /// Reads an expression that can be plotted: a number or a condition.
    ///
    /// # Errors
    /// The error and its position.
    pub fn column(text: &str) -> Result<Self, Refused> {
        let read = Self::read(text)?;
        if read.answers != Answers::Word {
            return Ok(read);
        }
        let refused = Refused::whole(text, "a word cannot be plotted".to_owned());
        Err(refused.hint(format!("Compare it, for example `{} == lost`.", text.trim())))
    }

    /// The type of its value.
    pub fn answers(&self) -> Answers {
        self.answers
    }

    /// The unit of its value; empty without one.
    pub fn unit(&self) -> &str {
        self.unit.symbol()
    }

    /// The numbers of the runs that it compares; empty if it does not compare runs.
    pub(crate) fn runs_compared(&self) -> &[usize] {
        &self.runs
    }

    /// The step in `step == 12`; `None` for any other expression.
    pub fn step_named(&self) -> Option<usize> {
        let Kind::Pair(tree::Operator::Equal, left, right) = &self.tree.kind else { return None };
        let is_step = left.kind == Kind::Path(vec![Segment::Field("step".to_owned())]);
        match right.kind {
            Kind::Number { value, unit: None } if is_step && value.fract() == 0.0 && value < 1e9 => {
                Some(value as usize)
            }
            _ => None,
        }
    }

    /// Its value at step `index` of a run, counted from the run's first step, in its unit; missing if there is no such step.
    pub fn value(&self, runs: &Runs<'_>, run: usize, index: usize) -> Value {
        let value = Moment::new(runs, run, index).map_or(Value::Missing, |moment| self.code.value(&moment));
        match value {
            Value::Number(value) => Value::of_number(self.unit.from_base(value)),
            other => other,
        }
    }

    /// Whether it is true at a step.
    pub(crate) fn is_true(&self, runs: &Runs<'_>, run: usize, index: usize) -> bool {
        self.value(runs, run, index) == Value::Truth(true)
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}", self.tree)
    }
}

/// The letter of a run: A to Z, then A1 and so on.
pub fn run_letter(number: usize) -> String {
    let letter = char::from(b'A' + (number % 26) as u8);
    if number < 26 { letter.to_string() } else { format!("{letter}{}", number / 26) }
}

/// The number of a run by its letter.
pub(crate) fn run_number(letter: &str) -> Option<usize> {
    let first = letter.chars().next().filter(char::is_ascii_uppercase)?;
    let place = usize::from(first as u8 - b'A');
    let round = if letter.len() == 1 { 0 } else { letter[1..].parse().ok().filter(|round| *round < 1000)? };
    let number = place + 26 * round;
    (run_letter(number) == letter).then_some(number)
}

/// Parses a path; `None` if the text is not a path.
pub(crate) fn path_of(text: &str) -> Option<Vec<Segment>> {
    match parse::parse(text).ok()?.kind {
        Kind::Path(path) => Some(path),
        _ => None,
    }
}

/// Number of characters before a byte offset.
fn chars_before(text: &str, byte: usize) -> usize {
    text.char_indices().take_while(|(at, _)| *at < byte).count()
}
