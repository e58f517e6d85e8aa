//! The tokens of an expression, each with its span. Built on `winnow`.

use std::ops::Range;

use winnow::Parser;
use winnow::Result;
use winnow::ascii::multispace0;
use winnow::combinator::{alt, delimited, opt, preceded};
use winnow::error::ContextError;
use winnow::stream::{AsChar, LocatingSlice, Location};
use winnow::token::{any, one_of, take_while};

use super::Refused;

type Input<'a> = LocatingSlice<&'a str>;

/// A token.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// A number without its sign.
    Number(f64),
    /// A name, a keyword, or a unit.
    Name(String),
    /// A text in quotes, without the quotes.
    Text(String),
    /// A sign of one or two characters.
    Sign(&'static str),
}

/// A token with its span in bytes.
pub(super) type Placed = (Token, Range<usize>);

/// The signs, those of two characters first, each with its canonical form.
const SIGNS: [(&str, &str); 22] = [
    ("&&", "&&"),
    ("||", "||"),
    ("<=", "<="),
    (">=", ">="),
    ("==", "=="),
    ("!=", "!="),
    ("≤", "<="),
    ("≥", ">="),
    ("≠", "!="),
    ("−", "-"),
    ("<", "<"),
    (">", ">"),
    ("!", "!"),
    ("+", "+"),
    ("-", "-"),
    ("*", "*"),
    ("/", "/"),
    ("%", "%"),
    ("(", "("),
    (")", ")"),
    (",", ","),
    (".", "."),
];

/// The tokens of a text.
pub(super) fn tokens(text: &str) -> std::result::Result<Vec<Placed>, Refused> {
    let mut input = LocatingSlice::new(text);
    let mut found = Vec::new();
    loop {
        // Succeeds even without space.
        let _: Result<&str> = multispace0.parse_next(&mut input);
        let at = input.current_token_start();
        if input.is_empty() {
            return Ok(found);
        }
        match token.with_span().parse_next(&mut input) {
            Ok((Token::Number(value), span)) if !value.is_finite() => {
                return Err(Refused::at(text, span, "this number is too large".to_owned()));
            }
            Ok(placed) => found.push(placed),
            Err(_) => return Err(unknown(text, at)),
        }
    }
}

/// Whether a text is a single name.
pub(super) fn is_name(text: &str) -> bool {
    name.parse(LocatingSlice::new(text)).is_ok()
}

/// The error of a character that cannot begin a token.
fn unknown(text: &str, at: usize) -> Refused {
    let rest = &text[at..];
    let first = rest.chars().next().unwrap_or(' ');
    let span = at..at + first.len_utf8();
    let sentence = match first {
        '=' => "`=` alone has no meaning: write `==` to compare".to_owned(),
        '&' => "`&` alone has no meaning: write `&&`".to_owned(),
        '|' => "`|` alone has no meaning: write `||`".to_owned(),
        '"' | '\'' => {
            return Refused::at(text, at..text.len(), "this text has no closing quote".to_owned());
        }
        other => format!("`{}` has no meaning here", other.escape_debug()),
    };
    Refused::at(text, span, sentence)
}

fn token(input: &mut Input<'_>) -> Result<Token> {
    alt((number.map(Token::Number), name.map(Token::Name), text.map(Token::Text), sign)).parse_next(input)
}

fn digits<'a>(input: &mut Input<'a>) -> Result<&'a str> {
    take_while(1.., AsChar::is_dec_digit).parse_next(input)
}

/// `12`, `0.5`, `.5`, `2e-3`. Numbers that overflow become infinite and are refused by the caller.
fn number(input: &mut Input<'_>) -> Result<f64> {
    let fraction = || preceded('.', digits);
    let exponent = (one_of(['e', 'E']), opt(one_of(['+', '-'])), digits);
    let mantissa = alt(((digits, opt(fraction())).void(), fraction().void()));
    (mantissa, opt(exponent)).take().try_map(str::parse::<f64>).parse_next(input)
}

fn name(input: &mut Input<'_>) -> Result<String> {
    let first = one_of(|c: char| c.is_ascii_alphabetic() || c == '_');
    let rest = take_while(0.., |c: char| c.is_ascii_alphanumeric() || c == '_');
    (first, rest).take().map(str::to_owned).parse_next(input)
}

/// A text in double or single quotes; a backslash escapes the next character.
fn text(input: &mut Input<'_>) -> Result<String> {
    alt((quoted('"'), quoted('\''))).parse_next(input)
}

fn quoted<'a>(quote: char) -> impl Parser<Input<'a>, String, ContextError> {
    let plain = any.verify(move |c: &char| *c != quote && *c != '\\');
    let character = alt((preceded('\\', any), plain));
    delimited(quote, winnow::combinator::repeat(0.., character), quote)
}

fn sign(input: &mut Input<'_>) -> Result<Token> {
    let rest: &str = input.as_ref();
    let found = SIGNS.into_iter().chain([("[", "["), ("]", "]")]).find(|(sign, _)| rest.starts_with(sign));
    match found {
        Some((sign, meaning)) => sign.value(Token::Sign(meaning)).parse_next(input),
        None => Err(ContextError::new()),
    }
}
