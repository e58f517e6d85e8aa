//! The functions of the language: arguments, notation and meaning.

use super::evaluate::Function;

/// How a function is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Signature {
    /// Numbers of one unit.
    Numbers(Function),
    /// The value at the previous step.
    Before,
    /// Whether the value differs from that of the previous step.
    Changes,
    /// Whether a value exists (true), or is missing (false).
    Has(bool),
    /// The number of entries of a list.
    Count,
    /// Whether a text contains another.
    Contains,
    /// Whether a value differs between two runs.
    Differs,
}

/// A function of the language.
#[derive(Clone, Copy, Debug)]
pub struct FunctionInfo {
    /// Its name.
    pub name: &'static str,
    /// Its notation.
    pub form: &'static str,
    /// Its meaning, as one sentence.
    pub meaning: &'static str,
    pub(super) signature: Signature,
    pub(super) takes: (usize, usize),
}

const fn function(
    name: &'static str,
    form: &'static str,
    meaning: &'static str,
    takes: (usize, usize),
    signature: Signature,
) -> FunctionInfo {
    FunctionInfo { name, form, meaning, signature, takes }
}

/// Maximum number of arguments of `min`, `max` and `hypot`.
const MOST: usize = 16;

/// All functions.
pub static FUNCTIONS: [FunctionInfo; 12] = [
    function("abs", "abs(x)", "The absolute value.", (1, 1), Signature::Numbers(Function::Abs)),
    function(
        "min",
        "min(x, y, …)",
        "The smallest; missing where one is missing.",
        (2, MOST),
        Signature::Numbers(Function::Min),
    ),
    function(
        "max",
        "max(x, y, …)",
        "The greatest; missing where one is missing.",
        (2, MOST),
        Signature::Numbers(Function::Max),
    ),
    function(
        "sqrt",
        "sqrt(x)",
        "The square root; missing for a negative number.",
        (1, 1),
        Signature::Numbers(Function::Sqrt),
    ),
    function(
        "hypot",
        "hypot(x, y, …)",
        "The square root of the sum of squares.",
        (2, MOST),
        Signature::Numbers(Function::Hypot),
    ),
    function(
        "prev",
        "prev(x)",
        "The value at the previous step; missing at the first step.",
        (1, 1),
        Signature::Before,
    ),
    function(
        "changes",
        "changes(x)",
        "Whether the value differs from that of the previous step; also `x changes`.",
        (1, 1),
        Signature::Changes,
    ),
    function("has", "has(x)", "Whether there is a value.", (1, 1), Signature::Has(true)),
    function("missing", "missing(x)", "Whether there is no value.", (1, 1), Signature::Has(false)),
    function("count", "count(list)", "How many entries a list has.", (1, 1), Signature::Count),
    function(
        "contains",
        "contains(text, \"part\")",
        "Whether a text holds another, in any case of letters.",
        (2, 2),
        Signature::Contains,
    ),
    function(
        "differs",
        "differs(A, B, x, by)",
        "Whether a value differs between two runs of the target by more than `by`; without `by`, by any amount.",
        (3, 4),
        Signature::Differs,
    ),
];
