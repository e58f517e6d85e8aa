//! Parses tokens into a tree by precedence climbing. Length, depth and the number of nodes are limited.

use std::ops::Range;

use super::catalogue::CATALOGUE;
use super::token::{Placed, Token, tokens};
use super::tree::{Kind, NEGATE, NOT, Node, Operator, Segment};
use super::unit::Unit;
use super::{DEPTH_LIMIT, LENGTH_LIMIT, NODE_LIMIT, Refused};
use crate::records;

/// Reads an expression.
pub(super) fn parse(text: &str) -> Result<Node, Refused> {
    let length = text.chars().count();
    if length > LENGTH_LIMIT {
        let sentence = format!("an expression may have {LENGTH_LIMIT} characters, not {length}");
        return Err(Refused::whole(text, sentence));
    }
    let tokens = tokens(text)?;
    if tokens.is_empty() {
        let refused = Refused::whole(text, "there is no expression yet".to_owned());
        return Err(refused.hint("Write for example `ncc < 0.6 && step > 10`."));
    }
    let mut parser = Parser { text, tokens: &tokens, at: 0, depth: 0, nodes: 0 };
    let node = parser.expression(0)?;
    match parser.tokens.get(parser.at) {
        None => Ok(node),
        Some((token, span)) => Err(parser.left_over(token, span.clone())),
    }
}

/// Whether a word is a known name, so that it was not meant as a unit.
fn is_known(word: &str) -> bool {
    CATALOGUE.find(&[Segment::Field(word.to_owned())]).is_ok()
}

/// The first label of several words, as shown by panels, that the text contains, with the name of its quantity.
fn named_by_label(text: &str) -> Option<(String, String)> {
    let text = text.to_lowercase();
    let columns = records::row_columns().iter().filter_map(|column| records::row_quantity(&column.name));
    let mut labels = columns.map(|quantity| (quantity.label.to_string(), quantity.name.to_string()));
    labels.find(|(label, _)| label.contains(' ') && text.contains(&label.to_lowercase()))
}

struct Parser<'a> {
    text: &'a str,
    tokens: &'a [Placed],
    at: usize,
    depth: usize,
    nodes: usize,
}

impl Parser<'_> {
    /// Parses a value and all following operators of at least precedence `least`.
    fn expression(&mut self, least: u8) -> Result<Node, Refused> {
        self.depth += 1;
        if self.depth > DEPTH_LIMIT {
            let sentence = format!("more than {DEPTH_LIMIT} levels of nesting");
            return Err(Refused::at(self.text, self.here(), sentence));
        }
        let mut left = self.prefixed(least)?;
        while let Some(operator) = self.operator().filter(|operator| operator.strength() >= least) {
            let sign = self.here();
            self.at += 1;
            let right = self.expression(operator.strength() + 1)?;
            self.refuse_chain(operator, sign, &left, &right)?;
            let span = left.span.start..right.span.end;
            left = self.node(Kind::Pair(operator, Box::new(left), Box::new(right)), span)?;
        }
        self.depth -= 1;
        Ok(left)
    }

    /// Refuses chained comparisons, whose meaning differs between languages.
    fn refuse_chain(
        &self,
        operator: Operator,
        sign: Range<usize>,
        a: &Node,
        b: &Node,
    ) -> Result<(), Refused> {
        let next = self.operator().filter(|next| next.is_comparison());
        let Some(next) = next.filter(|_| operator.is_comparison()) else { return Ok(()) };
        let (a, b) = (&self.text[a.span.clone()], &self.text[b.span.clone()]);
        let sentence = "comparisons do not chain: join two of them with `&&`".to_owned();
        let hint = format!("Write `{a} {} {b} && {b} {} …`.", operator.sign(), next.sign());
        Err(Refused::at(self.text, sign.start..self.here().end, sentence).hint(hint))
    }

    /// Parses a value with its prefix `!` or `-`, or its suffix `changes`.
    fn prefixed(&mut self, least: u8) -> Result<Node, Refused> {
        let start = self.here().start;
        if self.is_sign("!") || self.is_word("not") {
            if least > NOT {
                let sentence = "`!` is not allowed here: put it and its operand in parentheses".to_owned();
                return Err(Refused::at(self.text, self.here(), sentence));
            }
            self.at += 1;
            let of = self.expression(NOT)?;
            let span = start..of.span.end;
            return self.node(Kind::Not(Box::new(of)), span);
        }
        if self.is_sign("-") {
            self.at += 1;
            let of = self.expression(NEGATE)?;
            let span = start..of.span.end;
            return self.node(Kind::Negate(Box::new(of)), span);
        }
        let mut node = self.value()?;
        while self.is_word("changes") {
            let span = node.span.start..self.here().end;
            self.at += 1;
            node = self.node(Kind::Call("changes".to_owned(), vec![node]), span)?;
        }
        Ok(node)
    }

    /// Parses a number, a text, a name, a call, or an expression in parentheses.
    fn value(&mut self) -> Result<Node, Refused> {
        let Some((token, span)) = self.tokens.get(self.at).cloned() else {
            return Err(Refused::at(self.text, self.here(), "the expression ends too soon".to_owned()));
        };
        self.at += 1;
        match token {
            Token::Number(value) => self.number(value, span),
            Token::Text(text) => self.node(Kind::Text(text), span),
            Token::Name(name) => match name.as_str() {
                "true" | "false" => self.node(Kind::Truth(name == "true"), span),
                "null" => {
                    let sentence = "nothing can be compared with `null`".to_owned();
                    Err(Refused::at(self.text, span, sentence).hint("Write `missing(x)` or `has(x)`."))
                }
                "and" | "or" => Err(self.misplaced(&name, span)),
                _ if self.is_sign("(") => self.call(name, span),
                _ => self.path(name, span),
            },
            Token::Sign("(") => {
                let inner = self.expression(0)?;
                self.expect(")", &span)?;
                Ok(Node { span: span.start..self.before().end, ..inner })
            }
            Token::Sign(sign) => Err(self.misplaced(sign, span)),
        }
    }

    fn number(&mut self, value: f64, mut span: Range<usize>) -> Result<Node, Refused> {
        let unit = match self.tokens.get(self.at) {
            Some((Token::Sign("%"), _)) => Some("%".to_owned()),
            Some((Token::Name(word), _)) if Unit::of_word(word).is_some() => Some(word.clone()),
            _ => None,
        };
        if unit.is_some() {
            span.end = self.here().end;
            self.at += 1;
        }
        self.node(Kind::Number { value, unit }, span)
    }

    fn call(&mut self, name: String, span: Range<usize>) -> Result<Node, Refused> {
        let open = self.here();
        self.at += 1;
        let mut given = Vec::new();
        if !self.is_sign(")") {
            given.push(self.expression(0)?);
            while self.is_sign(",") {
                self.at += 1;
                given.push(self.expression(0)?);
            }
        }
        self.expect(")", &open)?;
        let span = span.start..self.before().end;
        self.node(Kind::Call(name, given), span)
    }

    fn path(&mut self, first: String, mut span: Range<usize>) -> Result<Node, Refused> {
        let mut segments = vec![Segment::Field(first)];
        loop {
            if self.is_sign(".") {
                self.at += 1;
                match self.tokens.get(self.at) {
                    Some((Token::Name(name), _)) => segments.push(Segment::Field(name.clone())),
                    _ => {
                        let sentence = "the name of a field must follow the dot".to_owned();
                        return Err(Refused::at(self.text, self.here(), sentence));
                    }
                }
                self.at += 1;
            } else if self.is_sign("[") {
                let open = self.here();
                self.at += 1;
                match self.tokens.get(self.at) {
                    Some((Token::Number(n), _)) if n.fract() == 0.0 && *n < 1e9 => {
                        segments.push(Segment::Index(*n as usize));
                    }
                    _ => {
                        let sentence = "the index in brackets must be a whole number from 0".to_owned();
                        return Err(Refused::at(self.text, self.here(), sentence));
                    }
                }
                self.at += 1;
                self.expect("]", &open)?;
            } else {
                break;
            }
            span.end = self.before().end;
        }
        self.node(Kind::Path(segments), span)
    }

    fn node(&mut self, kind: Kind, span: Range<usize>) -> Result<Node, Refused> {
        self.nodes += 1;
        if self.nodes > NODE_LIMIT {
            let sentence = format!("an expression may have {NODE_LIMIT} parts, this one has more");
            return Err(Refused::at(self.text, span, sentence));
        }
        Ok(Node { kind, span })
    }

    fn operator(&self) -> Option<Operator> {
        let (token, _) = self.tokens.get(self.at)?;
        Some(match token {
            Token::Sign("||") => Operator::Or,
            Token::Sign("&&") => Operator::And,
            Token::Sign("<") => Operator::Less,
            Token::Sign("<=") => Operator::AtMost,
            Token::Sign(">") => Operator::More,
            Token::Sign(">=") => Operator::AtLeast,
            Token::Sign("==") => Operator::Equal,
            Token::Sign("!=") => Operator::Unequal,
            Token::Sign("+") => Operator::Plus,
            Token::Sign("-") => Operator::Minus,
            Token::Sign("*") => Operator::Times,
            Token::Sign("/") => Operator::Over,
            Token::Name(word) if word == "or" => Operator::Or,
            Token::Name(word) if word == "and" => Operator::And,
            _ => return None,
        })
    }

    fn is_sign(&self, sign: &str) -> bool {
        matches!(self.tokens.get(self.at), Some((Token::Sign(found), _)) if *found == sign)
    }

    fn is_word(&self, word: &str) -> bool {
        matches!(self.tokens.get(self.at), Some((Token::Name(found), _)) if found == word)
    }

    fn expect(&mut self, sign: &str, open: &Range<usize>) -> Result<(), Refused> {
        if self.is_sign(sign) {
            self.at += 1;
            return Ok(());
        }
        if let Some((token, span)) = self.tokens.get(self.at)
            && sign == ")"
            && *token != Token::Sign(",")
        {
            return Err(self.left_over(token, span.clone()));
        }
        let sentence = format!("`{}` is never closed: `{sign}` is missing", &self.text[open.clone()]);
        Err(Refused::at(self.text, open.clone(), sentence))
    }

    /// The span of the next token; empty at the end of the text.
    fn here(&self) -> Range<usize> {
        self.tokens.get(self.at).map_or(self.text.len()..self.text.len(), |(_, span)| span.clone())
    }

    /// The span of the previous token.
    fn before(&self) -> Range<usize> {
        self.at.checked_sub(1).and_then(|at| self.tokens.get(at)).map_or(0..0, |(_, span)| span.clone())
    }

    fn misplaced(&self, what: &str, span: Range<usize>) -> Refused {
        Refused::at(self.text, span, format!("a value is missing before `{what}`"))
    }

    /// The error of a token that no operator connects with the preceding expression.
    fn left_over(&self, token: &Token, span: Range<usize>) -> Refused {
        let after_number = self.at > 0 && matches!(self.tokens[self.at - 1].0, Token::Number(_));
        match token {
            Token::Name(word) if after_number && !is_known(word) => {
                let units: Vec<_> = Unit::words().collect();
                let sentence = format!("`{word}` is no unit; the units are {}", units.join(", "));
                Refused::at(self.text, span, sentence)
            }
            Token::Sign(")") => Refused::at(self.text, span, "`)` has no matching `(`".to_owned()),
            _ => {
                let found = &self.text[span.clone()];
                let sentence = format!("an operator is missing before `{found}`");
                let refused = Refused::at(self.text, span, sentence);
                match named_by_label(self.text) {
                    Some((label, name)) => refused.hint(format!("In expressions, “{label}” is `{name}`.")),
                    None => refused.hint("Join two conditions with `&&` or `||`."),
                }
            }
        }
    }
}
