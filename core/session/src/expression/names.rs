//! Errors for unknown names, with the most similar known name as a hint.

use super::catalogue::{Unknown, gates};
use super::functions::FUNCTIONS;
use super::tree::{Node, Segment, path_text};
use super::{Refused, chars_before};

/// The name most similar to `word`; `None` if none is similar.
pub(super) fn nearest<'a>(word: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |name: &'a str| {
        let contains = name.len() > 3 && word.len() > 3 && (name.contains(word) || word.contains(name));
        let likeness = strsim::jaro_winkler(word, name).max(if contains { 0.9 } else { 0.0 });
        (likeness, name)
    };
    let best = names.map(likeness).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(likeness, _)| *likeness > 0.75).map(|(_, name)| name)
}

/// The error of an unknown path.
pub(super) fn unknown(text: &str, node: &Node, path: &[Segment], unknown: &Unknown) -> Refused {
    let at = unknown.at.min(path.len().saturating_sub(1));
    let (before, with) = (path_text(&path[..at]), path_text(&path[..=at]));
    let segment = with[before.len()..].trim_start_matches('.');
    let span = place(text, node, &before, &with);
    let sentence = match (&unknown.within, unknown.possible.is_empty()) {
        (None, _) => format!("there is no name `{segment}`"),
        (Some(within), true) => format!("`{within}` has no parts, so `{segment}` is not one of them"),
        (Some(within), false) => format!("`{within}` has no part `{segment}`"),
    };
    let refused = Refused::at(text, span, sentence);
    let possible = || unknown.possible.iter().map(String::as_str);
    match nearest(segment, possible()) {
        Some(nearest) => refused.hint(format!("Did you mean `{nearest}`?")),
        None if unknown.within.is_some() && possible().count() > 0 => {
            let few: Vec<_> = possible().take(gates().len()).collect();
            refused.hint(format!("It has: {}.", few.join(", ")))
        }
        None => refused.hint("Completion in the box lists all names; so does docs/expressions.md."),
    }
}

/// The span of the segment at fault; the whole path if it contains spaces.
fn place(text: &str, node: &Node, before: &str, with: &str) -> std::ops::Range<usize> {
    let span = node.span.clone();
    if text[span.clone()].starts_with(with) {
        let from = span.start + before.len();
        let from = if text[from..].starts_with('.') { from + 1 } else { from };
        from..span.start + with.len()
    } else {
        span
    }
}

/// The error of an unknown function.
pub(super) fn unknown_function(text: &str, node: &Node, name: &str) -> Refused {
    let span = node.span.start..node.span.start + name.len();
    let refused = Refused::at(text, span, format!("there is no function `{name}`"));
    let names = FUNCTIONS.iter().map(|function| function.name);
    match nearest(name, names.clone()) {
        Some(nearest) => refused.hint(format!("Did you mean `{nearest}`?")),
        None => refused.hint(format!("The functions are {}.", names.collect::<Vec<_>>().join(", "))),
    }
}

impl Refused {
    /// An error at these bytes of the text.
    pub(super) fn at(text: &str, span: std::ops::Range<usize>, sentence: String) -> Self {
        let from = chars_before(text, span.start);
        let to = chars_before(text, span.end.max(span.start));
        Self { sentence, from, to, hint: None }
    }

    /// An error of the whole text.
    pub(super) fn whole(text: &str, sentence: String) -> Self {
        Self::at(text, 0..text.len(), sentence)
    }

    /// Adds a hint for the correction.
    #[must_use]
    pub(super) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}
