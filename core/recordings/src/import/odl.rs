//! Labels in ODL, the Object Description Language of PDS3 products.
//!
//! Source: domain.md 6.1, from the labels of real products. A label is a list of statements `KEY = VALUE`, grouped by
//! `GROUP = NAME … END_GROUP` and `OBJECT = NAME … END_OBJECT`, and ends at the word `END`; pixels may follow it in
//! the same file and are ignored.
//!
//! - Values: numbers (also with a radix, `2#0000111111111111#`), quoted strings over several lines, bare
//!   words, dates, tuples `( … )` and sets `{ … }` over several lines, nested; a unit `<rad>` after a number.
//! - A value is kept as the text that was written: its caller decides whether it is a number, because a bit mask
//!   without its radix (`0000111111111111`) can only be interpreted with the sample's width.
//! - Keys may have a caret (a pointer) or a namespace (`MSL:`); a key is found with or without its namespace.
//! - The same group may appear several times; [`Group::last_group`] returns the last, because products are corrected
//!   by appending (files of inverse look-up tables append their camera model).
//!
//! The reader departs from the standard where real labels do: a statement without a value is absent, an unterminated
//! comment ends with its line, and bytes that are not UTF-8 are replaced. It rejects errors that would put data in
//! the wrong place: a group that closes another, an unterminated string or tuple, a label without `END`. It never
//! panics, whatever the bytes (`arbitrary_bytes_never_panic`).

/// Largest nesting of groups, and of tuples, that is read.
const DEPTH_LIMIT: usize = 16;
/// Largest number of statements that is read.
const STATEMENT_LIMIT: usize = 50_000;

/// An error in a label.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OdlProblem {
    /// The line, counted from 1.
    pub line: usize,
    /// The problem on that line.
    pub problem: String,
}

impl std::fmt::Display for OdlProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {} of the label: {}", self.line, self.problem)
    }
}

/// The value of a statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Value {
    /// A number, word, date or string.
    Scalar {
        /// The text as written, without quotation marks; line breaks in a string become one space.
        text: String,
        /// The unit that followed, without its angle brackets.
        unit: Option<String>,
    },
    /// A tuple or a set.
    List(Vec<Value>),
}

impl Value {
    /// The text of a scalar; `None` for a list and for the words that mean absent (`N/A`, `UNK`, `NULL`).
    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Scalar { text, .. } if !matches!(text.as_str(), "" | "N/A" | "UNK" | "NULL") => Some(text),
            Self::Scalar { .. } | Self::List(_) => None,
        }
    }

    /// The finite number of a scalar, also one with a radix, or of a tuple of one element.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Scalar { text, .. } => number(text),
            Self::List(items) => match items.as_slice() {
                [one @ Self::Scalar { .. }] => one.number(),
                _ => None,
            },
        }
    }

    /// The elements of a list; a scalar counts as a list of one.
    pub fn items(&self) -> &[Value] {
        match self {
            Self::Scalar { .. } => std::slice::from_ref(self),
            Self::List(items) => items,
        }
    }

    /// Whether the scalar has this unit.
    pub(crate) fn has_unit(&self, unit: &str) -> bool {
        matches!(self, Self::Scalar { unit: Some(own), .. } if own == unit)
    }

    /// All elements as finite numbers; `None` if one is not.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.items().iter().map(Self::number).collect()
    }
}

fn number(text: &str) -> Option<f64> {
    if let Some((radix, digits)) = text.split_once('#') {
        let radix = radix.parse().ok().filter(|radix| (2..=36).contains(radix))?;
        let value = i64::from_str_radix(digits.strip_suffix('#')?, radix).ok()?;
        return Some(value as f64);
    }
    // Rust parses "inf" and "nan" as numbers too; in a label they are words.
    let starts_as_number = text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.'));
    text.parse().ok().filter(|v: &f64| starts_as_number && v.is_finite())
}

/// A label, or one of its groups or objects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// The name, in capitals; empty for the label itself.
    pub name: String,
    /// The statements in their order, keys in capitals.
    pub statements: Vec<(String, Value)>,
    /// The groups and objects in their order.
    pub groups: Vec<Group>,
}

impl Group {
    /// Reads a label from the beginning of `bytes` up to its `END`.
    ///
    /// # Errors
    /// The first line that cannot be parsed, or a label that does not end.
    pub fn parse(bytes: &[u8]) -> Result<Self, OdlProblem> {
        let mut reader = Reader { bytes, at: 0, line: 1 };
        let mut open = vec![Self::default()];
        for _ in 0..STATEMENT_LIMIT {
            let key = reader.word()?;
            let key = key.to_ascii_uppercase();
            if key == "END" && !reader.next_is(b'=') {
                return match <[Self; 1]>::try_from(open) {
                    Ok([label]) => Ok(label),
                    Err(open) => {
                        let name = open.last().map_or("", |group| group.name.as_str());
                        Err(reader.problem(format!("the label ends inside {name}")))
                    }
                };
            }
            reader.statement(key, &mut open)?;
        }
        Err(reader.problem(format!("more than {STATEMENT_LIMIT} statements")))
    }

    /// The value of `key`, with or without its namespace; the last one if it is repeated.
    pub fn value(&self, key: &str) -> Option<&Value> {
        let matches = |k: &str| k == key || k.split_once(':').is_some_and(|(_, bare)| bare == key);
        self.statements.iter().rev().find(|(k, _)| matches(k)).map(|(_, value)| value)
    }

    /// The text of `key`; `None` if it is missing, a list, or marked as absent.
    pub fn text(&self, key: &str) -> Option<&str> {
        self.value(key)?.text()
    }

    /// The number of `key`.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.value(key)?.number()
    }

    /// The numbers of `key`, whether a tuple or one scalar.
    pub fn numbers(&self, key: &str) -> Option<Vec<f64>> {
        self.value(key)?.numbers()
    }

    /// The last group or object of this level whose name passes `matches`.
    pub(crate) fn last_group(&self, matches: impl Fn(&str) -> bool) -> Option<&Self> {
        self.groups.iter().rev().find(|group| matches(&group.name))
    }
}

/// A position in the bytes of a label.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl Reader<'_> {
    fn problem(&self, problem: impl Into<String>) -> OdlProblem {
        OdlProblem { line: self.line, problem: problem.into() }
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn advance(&mut self) {
        if self.peek() == Some(b'\n') {
            self.line += 1;
        }
        self.at += 1;
    }

    /// Skips white space and comments.
    fn skip_blank(&mut self) {
        while let Some(byte) = self.peek() {
            match byte {
                _ if byte.is_ascii_whitespace() => self.advance(),
                _ if self.bytes[self.at..].starts_with(b"/*") => self.skip_comment(),
                _ => break,
            }
        }
    }

    fn skip_comment(&mut self) {
        let rest = &self.bytes[self.at..];
        let end_of_line = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += rest[..end_of_line].windows(2).position(|w| w == b"*/").map_or(end_of_line, |at| at + 2);
    }

    /// Whether `byte` is next after blanks; it is not consumed.
    fn next_is(&mut self, byte: u8) -> bool {
        self.skip_blank();
        self.peek() == Some(byte)
    }

    /// A run of bytes up to a blank or a punctuation mark of the grammar; also a name in quotation marks.
    fn word(&mut self) -> Result<String, OdlProblem> {
        self.skip_blank();
        let start = self.at;
        while self.peek().is_some_and(|b| !b.is_ascii_whitespace() && !b"=,(){}<>\"'".contains(&b)) {
            self.at += 1;
        }
        match (start == self.at, self.peek()) {
            (false, _) => Ok(String::from_utf8_lossy(&self.bytes[start..self.at]).into_owned()),
            (true, Some(quote @ (b'"' | b'\''))) => self.quoted(quote),
            (true, Some(byte)) => {
                Err(self.problem(format!("unexpected character '{}'", byte.escape_ascii())))
            }
            (true, None) => Err(self.problem("the label stops before its END")),
        }
    }

    /// A string in quotation marks; every run of blanks with a line break becomes one space.
    fn quoted(&mut self, quote: u8) -> Result<String, OdlProblem> {
        let opened = self.line;
        self.advance();
        let start = self.at;
        while self.peek() != Some(quote) {
            if self.peek().is_none() {
                let problem = "a string that is opened here is never closed".to_owned();
                return Err(OdlProblem { line: opened, problem });
            }
            self.advance();
        }
        let text = String::from_utf8_lossy(&self.bytes[start..self.at]).into_owned();
        self.advance();
        if !text.contains('\n') {
            return Ok(text.trim().to_owned());
        }
        Ok(text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" "))
    }

    fn value(&mut self, depth: usize) -> Result<Value, OdlProblem> {
        let close = match (self.next_is(b'('), self.peek()) {
            (true, _) => b')',
            (false, Some(b'{')) => b'}',
            (false, _) => return self.scalar(),
        };
        if depth >= DEPTH_LIMIT {
            return Err(self.problem(format!("tuples nested deeper than {DEPTH_LIMIT}")));
        }
        self.advance();
        let mut items = Vec::new();
        while !self.next_is(close) {
            items.push(self.value(depth + 1)?);
            if self.next_is(b',') {
                self.advance();
            } else if !self.next_is(close) {
                return Err(self.problem("expected ',' or the end of a tuple"));
            }
        }
        self.advance();
        // A unit after the closing bracket applies to all elements; no caller needs it.
        self.unit()?;
        Ok(Value::List(items))
    }

    fn scalar(&mut self) -> Result<Value, OdlProblem> {
        let text = self.word()?;
        Ok(Value::Scalar { text, unit: self.unit()? })
    }

    fn unit(&mut self) -> Result<Option<String>, OdlProblem> {
        if !self.next_is(b'<') {
            return Ok(None);
        }
        let rest = &self.bytes[self.at + 1..];
        let end = rest.iter().position(|b| b"<>\n".contains(b)).filter(|&end| rest[end] == b'>');
        let end = end.ok_or_else(|| self.problem("a unit without its closing '>'"))?;
        self.at += end + 2;
        Ok(Some(String::from_utf8_lossy(&rest[..end]).trim().to_owned()))
    }

    /// Reads the rest of the statement of `key` into the innermost open group.
    fn statement(&mut self, key: String, open: &mut Vec<Group>) -> Result<(), OdlProblem> {
        if matches!(key.as_str(), "END_GROUP" | "END_OBJECT") {
            return self.close(&key, open);
        }
        if !self.next_is(b'=') {
            return Err(self.problem(format!("expected '=' after {}", shortened(&key))));
        }
        self.advance();
        let line = self.line;
        self.skip_blank();
        let (start, start_line) = (self.at, self.line);
        let value = self.value(0)?;
        if start_line > line && self.next_is(b'=') {
            // The value is missing, and the next line's key was read in its place.
            (self.at, self.line) = (start, start_line);
            return Ok(());
        }
        if matches!(key.as_str(), "GROUP" | "OBJECT" | "BEGIN_GROUP" | "BEGIN_OBJECT") {
            if open.len() > DEPTH_LIMIT {
                return Err(self.problem(format!("groups nested deeper than {DEPTH_LIMIT}")));
            }
            let name = value.text().unwrap_or_default().to_ascii_uppercase();
            open.push(Group { name, ..Group::default() });
        } else if let Some(group) = open.last_mut() {
            group.statements.push((key, value));
        }
        Ok(())
    }

    fn close(&mut self, key: &str, open: &mut Vec<Group>) -> Result<(), OdlProblem> {
        let mut name = None;
        if self.next_is(b'=') {
            self.advance();
            name = Some(self.word()?.to_ascii_uppercase());
        }
        let (Some(group), Some(parent)) = (open.pop(), open.last_mut()) else {
            return Err(self.problem(format!("{key} without a group to close")));
        };
        if let Some(name) = name.filter(|name| *name != group.name) {
            let name = shortened(&name);
            return Err(self.problem(format!("{key} = {name} closes {}", shortened(&group.name))));
        }
        parent.groups.push(group);
        Ok(())
    }
}

/// At most forty characters of a name, so that a binary file does not fill the sentence.
fn shortened(name: &str) -> String {
    name.chars().take(40).filter(|c| !c.is_control()).collect()
}

#[cfg(test)]
#[path = "odl_tests.rs"]
mod tests;
