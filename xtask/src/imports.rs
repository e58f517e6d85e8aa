//! The paths used in a source file, read from its tokens: in code, in imports and inside macros.

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// A path as written, with the prefix of its import group.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NamedPath {
    /// The segments between the double colons; an imported `*` counts as a segment.
    pub(crate) segments: Vec<String>,
    /// The line of the first segment after the prefix.
    pub(crate) line: usize,
    /// True if arguments follow and all of them are literals.
    pub(crate) has_literal_arguments: bool,
}

impl NamedPath {
    /// True if the path starts with these names.
    pub(crate) fn begins_with(&self, names: &[&str]) -> bool {
        self.segments.len() >= names.len()
            && self.segments.iter().zip(names).all(|(segment, name)| segment == name)
    }
}

/// All paths in the order of the text; a single name is a path of one segment.
pub(crate) fn named_paths(tokens: TokenStream) -> Vec<NamedPath> {
    let mut paths = Vec::new();
    collect(tokens, &[], &mut paths);
    paths
}

/// Collects the paths of one group of tokens, each with `prefix`.
fn collect(tokens: TokenStream, prefix: &[String], paths: &mut Vec<NamedPath>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    while at < tokens.len() {
        match &tokens[at] {
            TokenTree::Ident(_) => at = collect_path(&tokens, at, prefix, paths),
            TokenTree::Group(group) => {
                collect(group.stream(), &[], paths);
                at += 1;
            }
            TokenTree::Punct(_) | TokenTree::Literal(_) => at += 1,
        }
    }
}

/// Collects the path that starts at `at`, and the paths of an import group after it; returns the index of its end.
fn collect_path(tokens: &[TokenTree], mut at: usize, prefix: &[String], paths: &mut Vec<NamedPath>) -> usize {
    let line = tokens[at].span().start().line;
    let mut segments = prefix.to_vec();
    while let Some(TokenTree::Ident(name)) = tokens.get(at) {
        segments.push(name.to_string());
        at += 1;
        if !is_double_colon(tokens, at) {
            break;
        }
        match tokens.get(at + 2) {
            Some(TokenTree::Ident(_)) => at += 2,
            Some(TokenTree::Punct(star)) if star.as_char() == '*' => {
                segments.push("*".to_owned());
                at += 3;
                break;
            }
            Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                collect(group.stream(), &segments, paths);
                return at + 3;
            }
            _ => break,
        }
    }
    let has_literal_arguments = matches!(tokens.get(at), Some(TokenTree::Group(group))
        if group.delimiter() == Delimiter::Parenthesis && has_only_literals(group.stream()));
    paths.push(NamedPath { segments, line, has_literal_arguments });
    at
}

/// True if the two tokens from `at` are the double colon of a path.
fn is_double_colon(tokens: &[TokenTree], at: usize) -> bool {
    let is_colon =
        |at: usize| matches!(tokens.get(at), Some(TokenTree::Punct(colon)) if colon.as_char() == ':');
    is_colon(at) && is_colon(at + 1)
}

/// True if the tokens are literals, punctuation and groups of these.
fn has_only_literals(tokens: TokenStream) -> bool {
    tokens.into_iter().all(|token| match token {
        TokenTree::Literal(_) | TokenTree::Punct(_) => true,
        TokenTree::Group(group) => has_only_literals(group.stream()),
        TokenTree::Ident(_) => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(text: &str) -> Vec<String> {
        let paths = named_paths(text.parse().expect("tokens"));
        paths.iter().map(|path| path.segments.join("::")).collect()
    }

    #[test]
    fn import_groups_are_spelt_out() {
        let found = written("use std::{thread, time::{Duration, Instant as Now}, fmt::*};");
        for expected in ["std::thread", "std::time::Duration", "std::time::Instant", "std::fmt::*"] {
            assert!(found.iter().any(|path| path == expected), "{expected} is not in {found:?}");
        }
    }

    #[test]
    fn paths_inside_macros_are_found() {
        assert!(
            written("fn f() { assert!(ok(tokio::spawn(g))); }").iter().any(|path| path == "tokio::spawn")
        );
    }

    #[test]
    fn only_constant_arguments_are_literal() {
        let paths = named_paths("f(1, -2, [3]); g(x, 1);".parse().expect("tokens"));
        assert!(paths[0].has_literal_arguments && !paths[1].has_literal_arguments);
    }
}
