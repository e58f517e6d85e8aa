//! The expression language: small, total questions about any value of any stage of a step.
//!
//! ```text
//! ncc < 0.6 && step > 10          state changes                 err_px > 2 px
//! sigma_m > 5 cm or state == lost judge.gates.ncc.margin < 5 %  differs(A, B, ncc, 0.02)
//! ```
//! Breakpoints are expressions that are yes or no; derived columns are expressions that are numbers. The whole language
//! is described in docs/expressions.md, which a test keeps true. Reading it goes text → `token` → `parse` →
//! `tree` → `check` → `evaluate`; names come from [`catalogue`], which is made from the schema of the record.
//!
//! There are no loops and no definitions; length, depth and parts are limited; every expression has a value at every
//! step. What is wrong with a text is one sentence with its place.

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

/// How many characters an expression may have.
pub const LENGTH_LIMIT: usize = 500;
/// How many things may stand inside each other.
pub const DEPTH_LIMIT: usize = 32;
/// How many parts an expression may have.
pub(crate) const NODE_LIMIT: usize = 200;

/// What is wrong with an expression, and where.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Refused {
    /// One sentence, without its beginning and its full stop.
    pub sentence: String,
    /// The first character at fault, from 0.
    pub from: usize,
    /// The first character after it.
    pub to: usize,
    /// How to mend it.
    pub hint: Option<String>,
}

impl fmt::Display for Refused {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "at character {}, {}", self.from + 1, self.sentence)
    }
}

/// What an expression's value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Answers {
    /// A number, with its unit.
    Number,
    /// Yes or no: it can be a breakpoint.
    Truth,
    /// A word: it can be compared, not plotted.
    Word,
}

/// An expression that was read and checked.
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
    /// What is wrong with it, and where.
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

    /// Reads an expression that is yes or no.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn condition(text: &str) -> Result<Self, Refused> {
        let read = Self::read(text)?;
        if read.answers == Answers::Truth {
            return Ok(read);
        }
        let refused = Refused::whole(text, "a breakpoint is a condition, and this is a value".to_owned());
        Err(refused.hint(format!("Compare it, for example `{} > 1`.", text.trim())))
    }

    /// Reads an expression that can be plotted: a number, or yes or no.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn column(text: &str) -> Result<Self, Refused> {
        let read = Self::read(text)?;
        if read.answers != Answers::Word {
            return Ok(read);
        }
        let refused = Refused::whole(text, "a word cannot be plotted".to_owned());
        Err(refused.hint(format!("Compare it, for example `{} == lost`.", text.trim())))
    }

    /// What its value is.
    pub fn answers(&self) -> Answers {
        self.answers
    }

    /// The unit of its value; empty without one.
    pub fn unit(&self) -> &str {
        self.unit.symbol()
    }

    /// The runs that it compares, by number; empty where it looks at one run alone.
    pub(crate) fn runs_compared(&self) -> &[usize] {
        &self.runs
    }

    /// The step that it names, where it is `step == 12` and nothing else.
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

    /// Its value at step `index` of a run, counted from the run's first one, in its unit. Where there is no such step
    /// it is missing.
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

/// The letter of a run, as pages name it: A to Z, then A1 and so on.
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

/// A path as it is written; none where the text is something else.
pub(crate) fn path_of(text: &str) -> Option<Vec<Segment>> {
    match parse::parse(text).ok()?.kind {
        Kind::Path(path) => Some(path),
        _ => None,
    }
}

/// How many characters stand before a byte.
fn chars_before(text: &str, byte: usize) -> usize {
    text.char_indices().take_while(|(at, _)| *at < byte).count()
}
