//! Checks calls of functions: their arguments, and the unit of their value.

use std::ops::Range;

use super::check::{Checked, Checker, Type, scaled};
use super::evaluate::{Code, Function};
use super::extract::Value;
use super::functions::{FUNCTIONS, Signature};
use super::names;
use super::tree::{Kind, Node, Segment};
use super::unit::Unit;
use super::{Refused, run_number};

impl Checker<'_> {
    pub(super) fn call(&mut self, node: &Node, name: &str, given: &[Node]) -> Result<Checked, Refused> {
        let Some(function) = FUNCTIONS.iter().find(|function| function.name == name) else {
            return Err(names::unknown_function(self.text, node, name));
        };
        let (least, most) = function.takes;
        if !(least..=most).contains(&given.len()) {
            let (count, form) = (given.len(), function.form);
            let sentence = format!("`{name}` has {count} arguments, but its form is `{form}`");
            return self.refuse(&node.span, sentence);
        }
        match function.signature {
            Signature::Numbers(what) => self.numbers(what, name, given, &node.span),
            Signature::Before => {
                let Checked { code, kind } = self.check(&given[0])?;
                Ok(Checked { code: Code::Before(Box::new(code)), kind })
            }
            Signature::Changes => {
                let Checked { code, kind } = self.check(&given[0])?;
                if kind == Type::Record {
                    let what = self.source(&given[0]);
                    return self
                        .refuse(&given[0].span, format!("`{what}` is a record: name one of its fields"));
                }
                Ok(Checked { code: Code::Changes(Box::new(code)), kind: Type::Truth })
            }
            Signature::Has(wanted) => {
                let code = Code::Has(Box::new(self.check(&given[0])?.code));
                let code = if wanted { code } else { Code::Not(Box::new(code)) };
                Ok(Checked { code, kind: Type::Truth })
            }
            Signature::Count => self.count(&given[0]),
            Signature::Contains => self.contains(given),
            Signature::Differs => self.differs(node, given),
        }
    }

    fn numbers(
        &mut self,
        what: Function,
        name: &str,
        given: &[Node],
        span: &Range<usize>,
    ) -> Result<Checked, Refused> {
        let (mut codes, mut kind) = (Vec::new(), Type::Bare);
        for (i, node) in given.iter().enumerate() {
            let next = self.number(node, name)?;
            if i == 0 {
                codes.push(next.0);
                kind = next.1;
                continue;
            }
            // The earlier arguments have one unit; if they were bare numbers, they all take the unit of this one.
            let was_bare = kind == Type::Bare;
            let before = (Code::Constant(Value::Missing), kind);
            let (_, code, joined) = self.alike((&given[0], before), (node, next), name, span)?;
            if let (true, Type::Number(unit)) = (was_bare, &joined) {
                codes = codes.into_iter().map(|code| scaled(code, unit)).collect();
            }
            codes.push(code);
            kind = joined;
        }
        if let (Function::Sqrt, Type::Number(unit)) = (what, &kind) {
            kind = match unit.root() {
                Some(root) => Type::Number(root),
                None => {
                    let (found, unit) = (self.source(&given[0]), unit.in_words());
                    return self.refuse(span, format!("`{found}` is {unit}, which has no square root"));
                }
            };
        }
        Ok(Checked { code: Code::Apply(what, codes), kind })
    }

    fn count(&mut self, of: &Node) -> Result<Checked, Refused> {
        let Checked { code, kind } = self.check(of)?;
        if kind == Type::List {
            return Ok(Checked { code: Code::Count(Box::new(code)), kind: Type::Number(Unit::NONE) });
        }
        let (found, what) = (self.source(of), kind.in_words());
        self.refuse(&of.span, format!("`count` takes a list, and `{found}` is {what}"))
    }

    fn contains(&mut self, given: &[Node]) -> Result<Checked, Refused> {
        let text = self.check(&given[0])?;
        let part = match (&given[1].kind, self.word_of(&given[1])) {
            (Kind::Text(part), _) => part.clone(),
            (_, Some(word)) => word,
            _ => {
                let sentence = "the second argument of `contains` must be a text in quotes".to_owned();
                return self.refuse(&given[1].span, sentence);
            }
        };
        if !matches!(text.kind, Type::Word(_)) {
            let (found, what) = (self.source(&given[0]), text.kind.in_words());
            return self.refuse(&given[0].span, format!("`contains` takes a text, and `{found}` is {what}"));
        }
        Ok(Checked { code: Code::Contains(Box::new(text.code), part), kind: Type::Truth })
    }

    fn differs(&mut self, node: &Node, given: &[Node]) -> Result<Checked, Refused> {
        if self.inside_differs {
            return self.refuse(&node.span, "`differs` cannot be nested in another `differs`".to_owned());
        }
        let run = |of: &Node| {
            let letter = match &of.kind {
                Kind::Path(path) => match path.as_slice() {
                    [Segment::Field(letter)] => run_number(letter),
                    _ => None,
                },
                _ => None,
            };
            let sentence = format!("`{}` is not a run: name a run by its letter, such as A", self.source(of));
            letter.ok_or_else(|| Refused::at(self.text, of.span.clone(), sentence))
        };
        let runs = [run(&given[0])?, run(&given[1])?];
        if runs[0] == runs[1] {
            let sentence = "a run never differs from itself: name two runs".to_owned();
            return self.refuse(&given[1].span, sentence);
        }
        self.inside_differs = true;
        let of = self.check(&given[2])?;
        self.inside_differs = false;
        let beyond = match given.get(3) {
            None => 0.0,
            Some(beyond) => self.tolerance(beyond, &given[2], &of.kind)?,
        };
        if matches!(of.kind, Type::List | Type::Record) {
            let (found, what) = (self.source(&given[2]), of.kind.in_words());
            return self.refuse(&given[2].span, format!("`{found}` is {what}: name one of its values"));
        }
        for run in runs {
            if !self.runs.contains(&run) {
                self.runs.push(run);
            }
        }
        Ok(Checked { code: Code::Differs { runs, of: Box::new(of.code), beyond }, kind: Type::Truth })
    }

    /// The tolerance of `differs`, in base units.
    fn tolerance(&mut self, node: &Node, of: &Node, kind: &Type) -> Result<f64, Refused> {
        if !matches!(kind, Type::Bare | Type::Number(_)) {
            let (found, what) = (self.source(of), kind.in_words());
            return self.refuse(
                &node.span,
                format!("`{found}` is {what}, which has no tolerance: leave the last argument out"),
            );
        }
        let given = self.number(node, "differs")?;
        let measured = (Code::Constant(Value::Missing), kind.clone());
        let (_, code, _) = self.alike((of, measured), (node, given), "differs", &node.span)?;
        match code.constant() {
            Some(beyond) if beyond >= 0.0 => Ok(beyond),
            _ => {
                let sentence = "the last argument of `differs` must be a constant number from 0";
                self.refuse(&node.span, sentence.to_owned())
            }
        }
    }
}
