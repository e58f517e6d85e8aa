//! Semantic analysis: looks up names, checks kinds and units, and compiles the tree to `Code`.
//!
//! A number without a unit takes the unit of the other operand (`roll_deg > 3` is 3 deg). A name without a unit does not: a
//! score is compared with plain numbers only.

use std::ops::Range;

use super::Refused;
use super::catalogue::CATALOGUE;
use super::evaluate::Code;
use super::extract::Value;
use super::names;
use super::schema::Shape;
use super::tree::{Kind, Node, Operator, Segment};
use super::unit::Unit;

/// The type of a node.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Type {
    /// A number without a unit, which takes the unit of the other operand.
    Bare,
    /// A number with its unit.
    Number(Unit),
    /// Yes or no.
    Truth,
    /// A word, with the possible words; empty if any.
    Word(Vec<String>),
    /// A list.
    List,
    /// A record with fields.
    Record,
}

impl Type {
    /// The type as a part of a sentence.
    pub(super) fn in_words(&self) -> String {
        match self {
            Self::Bare => "a number".to_owned(),
            Self::Number(unit) => format!("a number {}", unit.in_words()),
            Self::Truth => "a yes or no".to_owned(),
            Self::Word(_) => "a word".to_owned(),
            Self::List => "a list".to_owned(),
            Self::Record => "a record".to_owned(),
        }
    }
}

/// The code and the type of a checked node.
pub(super) struct Checked {
    pub code: Code,
    pub kind: Type,
}

/// Checks a tree.
pub(super) struct Checker<'a> {
    /// The source text.
    pub text: &'a str,
    /// The runs that are compared, by number.
    pub runs: Vec<usize>,
    /// Whether the node being checked is inside a call of `differs`.
    pub inside_differs: bool,
}

impl Checker<'_> {
    pub(super) fn check(&mut self, node: &Node) -> Result<Checked, Refused> {
        match &node.kind {
            Kind::Number { value, unit } => Ok(number(*value, unit.as_deref())),
            Kind::Truth(truth) => {
                Ok(Checked { code: Code::Constant(Value::Truth(*truth)), kind: Type::Truth })
            }
            Kind::Text(text) => {
                Ok(Checked { code: Code::Constant(Value::Word(text.clone())), kind: Type::Word(Vec::new()) })
            }
            Kind::Path(path) => self.path(node, path),
            Kind::Not(of) => {
                let of = self.truth(of, "!")?;
                Ok(Checked { code: Code::Not(Box::new(of)), kind: Type::Truth })
            }
            Kind::Negate(of) => {
                let (code, kind) = self.number(of, "-")?;
                Ok(Checked { code: Code::Negate(Box::new(code)), kind })
            }
            Kind::Pair(operator, left, right) => self.pair(*operator, left, right, &node.span),
            Kind::Call(function, given) => self.call(node, function, given),
        }
    }

    pub(super) fn refuse<T>(&self, span: &Range<usize>, sentence: String) -> Result<T, Refused> {
        Err(Refused::at(self.text, span.clone(), sentence))
    }

    pub(super) fn source(&self, node: &Node) -> &str {
        &self.text[node.span.clone()]
    }

    fn path(&self, node: &Node, path: &[Segment]) -> Result<Checked, Refused> {
        let found =
            CATALOGUE.find(path).map_err(|unknown| names::unknown(self.text, node, path, &unknown))?;
        let (kind, per_base) = match found.shape {
            Shape::Number(unit) => {
                let unit = found.unit.unwrap_or_else(|| unit.clone());
                let per_base = unit.per_base();
                (Type::Number(unit), per_base)
            }
            Shape::Truth => (Type::Truth, 1.0),
            Shape::Word(words) => (Type::Word(words.clone()), 1.0),
            Shape::List(_) => (Type::List, 1.0),
            Shape::Record(_) => (Type::Record, 1.0),
        };
        Ok(Checked { code: Code::Read(found.place, per_base), kind })
    }

    /// Checks a node that must be a condition.
    fn truth(&mut self, node: &Node, by: &str) -> Result<Code, Refused> {
        let checked = self.check(node)?;
        if checked.kind == Type::Truth {
            return Ok(checked.code);
        }
        let (found, what) = (self.source(node), checked.kind.in_words());
        let sentence = format!("`{by}` takes conditions, and `{found}` is {what}");
        Err(Refused::at(self.text, node.span.clone(), sentence).hint("Compare it, for example with `<`."))
    }

    /// Checks a node that must be a number.
    pub(super) fn number(&mut self, node: &Node, by: &str) -> Result<(Code, Type), Refused> {
        let checked = self.check(node)?;
        match checked.kind {
            Type::Bare | Type::Number(_) => Ok((checked.code, checked.kind)),
            other => {
                let (found, what) = (self.source(node), other.in_words());
                self.refuse(&node.span, format!("`{by}` takes numbers, and `{found}` is {what}"))
            }
        }
    }

    fn pair(
        &mut self,
        operator: Operator,
        left: &Node,
        right: &Node,
        span: &Range<usize>,
    ) -> Result<Checked, Refused> {
        match operator {
            Operator::And | Operator::Or => {
                let sign = operator.sign();
                let both = [self.truth(left, sign)?, self.truth(right, sign)?].map(Box::new);
                let [left, right] = both;
                let code = match operator {
                    Operator::And => Code::And(left, right),
                    _ => Code::Or(left, right),
                };
                Ok(Checked { code, kind: Type::Truth })
            }
            Operator::Equal | Operator::Unequal => self.equality(operator, left, right, span),
            Operator::Times | Operator::Over => self.product(operator, left, right, span),
            _ => {
                let [a, b] = [self.number(left, operator.sign())?, self.number(right, operator.sign())?];
                let (a, b, kind) = self.alike((left, a), (right, b), operator.sign(), span)?;
                let (a, b) = (Box::new(a), Box::new(b));
                Ok(if operator.is_comparison() {
                    Checked { code: Code::Compare(operator, a, b), kind: Type::Truth }
                } else {
                    Checked { code: Code::Arithmetic(operator, a, b), kind }
                })
            }
        }
    }

    /// Checks that two numbers have the same dimension; a bare number takes the unit of the other.
    pub(super) fn alike(
        &self,
        (left, (a, of_a)): (&Node, (Code, Type)),
        (right, (b, of_b)): (&Node, (Code, Type)),
        by: &str,
        span: &Range<usize>,
    ) -> Result<(Code, Code, Type), Refused> {
        match (of_a, of_b) {
            (Type::Bare, Type::Number(unit)) => Ok((scaled(a, &unit), b, Type::Number(unit))),
            (Type::Number(unit), Type::Bare) => Ok((a, scaled(b, &unit), Type::Number(unit))),
            (Type::Number(first), Type::Number(second)) if !first.is_alike(&second) => {
                let (l, r) = (self.source(left), self.source(right));
                let (first, second) = (first.in_words(), second.in_words());
                let sentence = format!("`{by}` takes one unit, but `{l}` is {first} and `{r}` is {second}");
                self.refuse(span, sentence)
            }
            (kind, _) => Ok((a, b, kind)),
        }
    }

    fn product(
        &mut self,
        operator: Operator,
        left: &Node,
        right: &Node,
        span: &Range<usize>,
    ) -> Result<Checked, Refused> {
        let sign = operator.sign();
        let ((a, of_a), (b, of_b)) = (self.number(left, sign)?, self.number(right, sign)?);
        let power = if operator == Operator::Times { 1 } else { -1 };
        let unit_of = |kind: &Type| match kind {
            Type::Number(unit) => unit.clone(),
            _ => Unit::NONE,
        };
        let kind = match (&of_a, &of_b) {
            (Type::Bare, Type::Bare) => Type::Bare,
            _ => match unit_of(&of_a).times(&unit_of(&of_b), power) {
                Some(unit) => Type::Number(unit),
                None => return self.refuse(span, "this unit has too large a power".to_owned()),
            },
        };
        Ok(Checked { code: Code::Arithmetic(operator, Box::new(a), Box::new(b)), kind })
    }

    fn equality(
        &mut self,
        operator: Operator,
        left: &Node,
        right: &Node,
        span: &Range<usize>,
    ) -> Result<Checked, Refused> {
        let (a, b) = match (self.word_of(left), self.word_of(right)) {
            // A bare word is a constant only if the other operand is a word.
            (Some(word), None) => {
                let b = self.check(right)?;
                (self.bare_word(left, word, &b)?, b)
            }
            (None, Some(word)) => {
                let a = self.check(left)?;
                let b = self.bare_word(right, word, &a)?;
                (a, b)
            }
            _ => (self.check(left)?, self.check(right)?),
        };
        let (a, b) = match (a.kind, b.kind) {
            (Type::Truth, Type::Truth) => (a.code, b.code),
            (Type::Word(known), Type::Word(other)) => {
                self.check_word(&b.code, right, &known, left)?;
                self.check_word(&a.code, left, &other, right)?;
                (a.code, b.code)
            }
            (of_a @ (Type::Bare | Type::Number(_)), of_b @ (Type::Bare | Type::Number(_))) => {
                let (a, b, _) =
                    self.alike((left, (a.code, of_a)), (right, (b.code, of_b)), operator.sign(), span)?;
                (a, b)
            }
            (of_a, of_b) => {
                let (l, r) = (self.source(left), self.source(right));
                let (first, second) = (of_a.in_words(), of_b.in_words());
                return self
                    .refuse(span, format!("`{l}` is {first} and `{r}` is {second}: they are never equal"));
            }
        };
        let code =
            Code::Equal { negated: operator == Operator::Unequal, left: Box::new(a), right: Box::new(b) };
        Ok(Checked { code, kind: Type::Truth })
    }

    /// The word of a node that is not a name of the catalogue.
    pub(super) fn word_of(&self, node: &Node) -> Option<String> {
        match &node.kind {
            Kind::Path(path) => match path.as_slice() {
                [Segment::Field(word)] if CATALOGUE.find(path).is_err() => Some(word.clone()),
                _ => None,
            },
            _ => None,
        }
    }

    fn bare_word(&self, node: &Node, word: String, beside: &Checked) -> Result<Checked, Refused> {
        if matches!(beside.kind, Type::Word(_)) && !matches!(beside.code, Code::Constant(_)) {
            return Ok(Checked { code: Code::Constant(Value::Word(word)), kind: Type::Word(Vec::new()) });
        }
        let Kind::Path(path) = &node.kind else { return self.check_again(node) };
        self.path(node, path)
    }

    fn check_again(&self, node: &Node) -> Result<Checked, Refused> {
        self.refuse(&node.span, "unknown word".to_owned())
    }

    /// Checks that a constant word is a possible value of the other operand.
    fn check_word(&self, code: &Code, at: &Node, known: &[String], of: &Node) -> Result<(), Refused> {
        let Code::Constant(Value::Word(word)) = code else { return Ok(()) };
        if known.is_empty() || known.contains(word) {
            return Ok(());
        }
        let (of, all) = (self.source(of), known.join(", "));
        let refused =
            Refused::at(self.text, at.span.clone(), format!("`{of}` is never `{word}`: it is one of {all}"));
        let nearest = names::nearest(word, known.iter().map(String::as_str));
        Err(match nearest {
            Some(nearest) => refused.hint(format!("Did you mean `{nearest}`?")),
            None => refused,
        })
    }
}

fn number(value: f64, unit: Option<&str>) -> Checked {
    match unit.and_then(Unit::of_word) {
        Some(unit) => {
            let code = Code::Constant(Value::of_number(unit.to_base(value)));
            Checked { code, kind: Type::Number(unit) }
        }
        None => Checked { code: Code::Constant(Value::Number(value)), kind: Type::Bare },
    }
}

/// A bare number, converted from the unit that it takes to base units.
pub(super) fn scaled(code: Code, unit: &Unit) -> Code {
    if unit.per_base() == 1.0 { code } else { Code::Scaled(Box::new(code), unit.per_base()) }
}
