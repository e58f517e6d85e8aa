//! Completion: the candidates at the cursor, each with unit and meaning.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::catalogue::{CATALOGUE, Name, NameKind};
use super::functions::FUNCTIONS;
use super::token::{Token, is_name, tokens};
use super::unit::Unit;
use super::{Answers, Expression, LENGTH_LIMIT};

/// Maximum number of candidates.
pub const CANDIDATES: usize = 12;

/// A candidate of a completion.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[schema(as = CompletionCandidate)]
pub struct Candidate {
    /// The text to insert.
    pub text: String,
    /// Its unit; empty without one.
    pub unit: String,
    /// Its meaning, as one sentence.
    pub meaning: String,
}

/// The candidates at a position.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Completion {
    /// The first character to replace, from 0.
    pub from: usize,
    /// The end of the range to replace (exclusive).
    pub to: usize,
    /// The candidates, the likeliest first.
    pub candidates: Vec<Candidate>,
}

/// The candidates at `cursor`, counted in characters.
pub fn complete(text: &str, cursor: usize) -> Completion {
    let characters: Vec<char> = text.chars().take(LENGTH_LIMIT).collect();
    let to = cursor.min(characters.len());
    let is_part = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '[' | ']');
    let begun = characters[..to].iter().rev().take_while(|c| is_part(c)).count();
    let from = to - begun;
    let (before, word): (String, String) =
        (characters[..from].iter().collect(), characters[from..to].iter().collect());
    let candidates = match place(&before, &word) {
        Where::Nothing => Vec::new(),
        Where::Unit => ranked(units(), &word),
        Where::Word(of) => {
            let words = words_of(&of).into_iter().map(|word| Candidate {
                meaning: format!("A value of `{of}`."),
                unit: String::new(),
                text: word,
            });
            ranked(words.collect(), &word)
        }
        Where::Joint => ranked(joints(), &word),
        Where::Value => values(&word, compared(&before).as_ref()),
    };
    Completion { from, to, candidates }
}

/// The kind of token that is expected at a position.
enum Where {
    /// Nothing that can be listed.
    Nothing,
    /// A unit, after a number.
    Unit,
    /// A possible word of this name.
    Word(String),
    /// An operator.
    Joint,
    /// A value.
    Value,
}

fn place(before: &str, word: &str) -> Where {
    let Ok(tokens) = tokens(before) else { return Where::Nothing };
    let tokens: Vec<Token> = tokens.into_iter().map(|(token, _)| token).collect();
    if word.starts_with(|c: char| c.is_ascii_digit()) {
        // `5c`: a number with the beginning of its unit.
        return Where::Nothing;
    }
    let is_joint = |word: &str| matches!(word, "and" | "or" | "not");
    match tokens.as_slice() {
        [.., Token::Number(_)] if !word.is_empty() || before.ends_with(' ') => Where::Unit,
        [rest @ .., Token::Sign("==" | "!=")] => match words_before(rest) {
            Some(of) => Where::Word(of),
            None => Where::Value,
        },
        [.., Token::Name(name)] if !is_joint(name) => Where::Joint,
        [.., Token::Sign(")" | "]" | "%") | Token::Text(_) | Token::Number(_)] => Where::Joint,
        _ => Where::Value,
    }
}

/// The name before a comparison; `None` if its value is not a word.
fn words_before(tokens: &[Token]) -> Option<String> {
    let is_part =
        |token: &&Token| matches!(token, Token::Name(_) | Token::Sign("." | "[" | "]") | Token::Number(_));
    let parts: Vec<_> = tokens.iter().rev().take_while(is_part).collect();
    let write = |token: &Token| match token {
        Token::Name(name) => name.clone(),
        Token::Sign(sign) => (*sign).to_owned(),
        Token::Number(number) => number.to_string(),
        Token::Text(_) => String::new(),
    };
    let name: String = parts.into_iter().rev().map(write).collect();
    (!words_of(&name).is_empty()).then_some(name)
}

/// The possible words of a name.
fn words_of(name: &str) -> Vec<String> {
    let Some(path) = super::path_of(name) else { return Vec::new() };
    match CATALOGUE.find(&path).map(|found| found.shape.clone()) {
        Ok(super::schema::Shape::Word(words)) => words,
        _ => Vec::new(),
    }
}

/// The unit of the left operand, if the text ends with an operator whose operands must have the same unit.
fn compared(before: &str) -> Option<Unit> {
    const ALIKE: [&str; 8] = ["<", ">", "<=", ">=", "==", "!=", "+", "-"];
    let tokens = tokens(before).ok()?;
    let ((_, sign), left) = tokens.split_last().filter(|((last, _), _)| is_one_of(last, &ALIKE))?;
    let begins = |token: &Token| {
        is_one_of(token, &["&&", "||", "!", "(", ","])
            || matches!(token, Token::Name(word) if matches!(word.as_str(), "and" | "or" | "not"))
    };
    let from = left.iter().rev().find(|(token, _)| begins(token)).map_or(0, |(_, place)| place.end);
    let read = Expression::read(before.get(from..sign.start)?).ok()?;
    (read.answers() == Answers::Number).then_some(read.unit)
}

fn is_one_of(token: &Token, signs: &[&str]) -> bool {
    matches!(token, Token::Sign(sign) if signs.contains(sign))
}

/// Names and functions that begin with the word or contain it; numbers of the same dimension as `unit` first.
fn values(word: &str, unit: Option<&Unit>) -> Vec<Candidate> {
    let parent = word.rfind('.').map(|dot| &word[..dot]);
    if let Some(parent) = parent {
        let names = super::path_of(parent).map(|path| CATALOGUE.under(&path)).unwrap_or_default();
        return ranked(names.into_iter().map(candidate).collect(), word);
    }
    if !word.is_empty() && !is_name(word) {
        let names = super::path_of(word).map(|path| CATALOGUE.under(&path)).unwrap_or_default();
        return names.into_iter().map(candidate).take(CANDIDATES).collect();
    }
    let functions = FUNCTIONS.iter().map(|function| Candidate {
        text: format!("{}(", function.name),
        unit: String::new(),
        meaning: format!("{}: {}", function.form, function.meaning),
    });
    let mut names = CATALOGUE.under(&[]);
    if let Some(unit) = unit {
        let is_like = |name: &Name| Unit::of_symbol(&name.unit).is_some_and(|other| other.is_alike(unit));
        names.sort_by_key(|name| name.kind != NameKind::Number || !is_like(name));
    }
    ranked(names.into_iter().map(candidate).chain(functions).collect(), word)
}

fn candidate(name: Name) -> Candidate {
    let text = match name.kind {
        NameKind::Record => format!("{}.", name.name),
        _ => name.name,
    };
    Candidate { text, unit: name.unit, meaning: name.meaning }
}

fn units() -> Vec<Candidate> {
    let meaning = |word: &str| match word {
        "%" => "Hundredths.".to_owned(),
        "deg" | "rad" => "An angle.".to_owned(),
        "px" => "Pixels.".to_owned(),
        "s" => "Seconds.".to_owned(),
        _ => "A length.".to_owned(),
    };
    let unit =
        |word: &str| Candidate { text: word.to_owned(), unit: word.to_owned(), meaning: meaning(word) };
    Unit::words().map(unit).collect()
}

/// The operators that may follow a value.
fn joints() -> Vec<Candidate> {
    let all = [
        ("< ", "Less than."),
        ("> ", "More than."),
        ("<= ", "At most."),
        (">= ", "At least."),
        ("== ", "Equal."),
        ("!= ", "Not equal."),
        ("&& ", "Both conditions."),
        ("|| ", "Either condition."),
        ("changes", "Whether the value differs from that of the previous step."),
        ("and ", "Both conditions."),
        ("or ", "Either condition."),
    ];
    let unit = String::new;
    all.map(|(text, meaning)| Candidate { text: text.to_owned(), unit: unit(), meaning: meaning.to_owned() })
        .into()
}

/// The candidates that begin with `word`, then the others that contain it, in their given order; an exact match is left out.
fn ranked(candidates: Vec<Candidate>, word: &str) -> Vec<Candidate> {
    let lower = word.to_lowercase();
    let rank = |candidate: &Candidate| {
        let text = candidate.text.to_lowercase();
        match (text.starts_with(&lower), text.contains(&lower)) {
            (true, _) => Some(0),
            (false, true) => Some(1),
            _ => None,
        }
    };
    let mut found: Vec<_> = candidates
        .into_iter()
        .filter(|c| c.text != word)
        .filter_map(|c| rank(&c).map(|rank| (rank, c)))
        .collect();
    found.sort_by_key(|(rank, _)| *rank);
    found.into_iter().map(|(_, candidate)| candidate).take(CANDIDATES).collect()
}
