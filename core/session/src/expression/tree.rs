//! An expression as a tree, and its formatting: parsing the formatted text gives the same tree.

use std::fmt;
use std::ops::Range;

/// One step of a path into a record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Segment {
    /// A field, or the entry of a list with this `name`.
    Field(String),
    /// An entry of a list, from 0.
    Index(usize),
}

/// A binary operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operator {
    /// `||`
    Or,
    /// `&&`
    And,
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    More,
    /// `>=`
    AtLeast,
    /// `==`
    Equal,
    /// `!=`
    Unequal,
    /// `+`
    Plus,
    /// `-`
    Minus,
    /// `*`
    Times,
    /// `/`
    Over,
}

impl Operator {
    /// Its canonical sign.
    pub(crate) const fn sign(self) -> &'static str {
        match self {
            Self::Or => "||",
            Self::And => "&&",
            Self::Less => "<",
            Self::AtMost => "<=",
            Self::More => ">",
            Self::AtLeast => ">=",
            Self::Equal => "==",
            Self::Unequal => "!=",
            Self::Plus => "+",
            Self::Minus => "-",
            Self::Times => "*",
            Self::Over => "/",
        }
    }

    /// Its precedence: a greater number binds more strongly.
    pub(super) const fn strength(self) -> u8 {
        match self {
            Self::Or => 1,
            Self::And => 2,
            Self::Less | Self::AtMost | Self::More | Self::AtLeast | Self::Equal | Self::Unequal => 4,
            Self::Plus | Self::Minus => 5,
            Self::Times | Self::Over => 6,
        }
    }

    /// Whether it is a comparison.
    pub(crate) const fn is_comparison(self) -> bool {
        self.strength() == 4
    }
}

/// The precedence of `!`: lower than that of a comparison, so that `!a < b` is `!(a < b)`.
pub(super) const NOT: u8 = 3;
/// The precedence of the unary minus.
pub(super) const NEGATE: u8 = 7;
/// The precedence of nodes that never need parentheses.
const ATOM: u8 = 9;

/// The kind of a node, with its operands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    /// A number with the unit that follows it.
    Number {
        /// The number.
        value: f64,
        /// The word of its unit; `None` without one.
        unit: Option<String>,
    },
    /// `true` or `false`.
    Truth(bool),
    /// A text in quotes.
    Text(String),
    /// A name, a path into the record of a step, or a bare word.
    Path(Vec<Segment>),
    /// `!`
    Not(Box<Node>),
    /// A unary minus.
    Negate(Box<Node>),
    /// A binary operator with its operands.
    Pair(Operator, Box<Node>, Box<Node>),
    /// A call of a function, with its arguments.
    Call(String, Vec<Node>),
}

/// A node with its span; equality ignores the spans.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Its kind.
    pub kind: Kind,
    /// Its span in the text, bytes.
    pub span: Range<usize>,
}

impl PartialEq for Node {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind
    }
}

impl Node {
    fn strength(&self) -> u8 {
        match &self.kind {
            Kind::Pair(operator, ..) => operator.strength(),
            Kind::Not(_) => NOT,
            Kind::Negate(_) => NEGATE,
            _ => ATOM,
        }
    }

    /// Writes the node, in parentheses if its precedence is below `least`.
    fn write(&self, out: &mut fmt::Formatter<'_>, least: u8) -> fmt::Result {
        if self.strength() < least {
            return write!(out, "({self})");
        }
        match &self.kind {
            Kind::Number { value, unit } => {
                write_number(out, *value)?;
                unit.as_ref().map_or(Ok(()), |unit| write!(out, " {unit}"))
            }
            Kind::Truth(truth) => write!(out, "{truth}"),
            Kind::Text(text) => {
                write!(out, "\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
            }
            Kind::Path(segments) => write_path(out, segments),
            Kind::Not(of) => {
                write!(out, "!")?;
                of.write(out, NOT)
            }
            Kind::Negate(of) => {
                write!(out, "-")?;
                of.write(out, NEGATE)
            }
            Kind::Pair(operator, left, right) => {
                let strength = operator.strength();
                // Operators of equal precedence associate to the left; comparisons do not associate.
                left.write(out, strength + u8::from(operator.is_comparison()))?;
                write!(out, " {} ", operator.sign())?;
                right.write(out, strength + 1)
            }
            Kind::Call(function, given) => {
                write!(out, "{function}(")?;
                for (i, node) in given.iter().enumerate() {
                    write!(out, "{}{node}", if i > 0 { ", " } else { "" })?;
                }
                write!(out, ")")
            }
        }
    }
}

impl fmt::Display for Node {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(out, 0)
    }
}

/// Writes the shortest representation that parses to the same number.
fn write_number(out: &mut fmt::Formatter<'_>, value: f64) -> fmt::Result {
    if value == 0.0 || (1e-5..1e15).contains(&value) {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    }
}

fn write_path(out: &mut fmt::Formatter<'_>, segments: &[Segment]) -> fmt::Result {
    for (i, segment) in segments.iter().enumerate() {
        match segment {
            Segment::Field(name) if i == 0 => write!(out, "{name}")?,
            Segment::Field(name) => write!(out, ".{name}")?,
            Segment::Index(index) => write!(out, "[{index}]")?,
        }
    }
    Ok(())
}

/// A path as text: `judge.gates[0].value`.
pub(crate) fn path_text(segments: &[Segment]) -> String {
    let node = Node { kind: Kind::Path(segments.to_vec()), span: 0..0 };
    node.to_string()
}
