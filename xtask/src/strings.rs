//! `cargo xtask strings`: lists the texts that users can see, read from the sources, one `file:line<TAB>text` per line.
//!
//! Texts are string literals (including those inside macros), the help of the command line and of settings (doc comments),
//! the descriptions of scenarios, and the text of the page's HTML. Tests, panics, keys and identifiers, scripts and markup
//! are excluded. The list is for language reviews, and for the rule that no such text cites a requirement number.

mod sources;
mod text;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};

use crate::cmd;
use crate::house_rules::{Finding, files, read};
use sources::{folder_of_modules, is_of_tests};
use text::{is_for_users, quotes_requirement, texts_of_page};

/// Folders of crates without user-visible texts.
const SILENT: [&str; 4] = ["core/benches", "core/sources", "core/testing", "core/tests"];

/// Macros whose texts are for developers only.
const OF_DEVELOPERS: [&str; 17] = [
    "assert",
    "assert_eq",
    "assert_ne",
    "cfg",
    "debug_assert",
    "debug_assert_eq",
    "debug_assert_ne",
    "env",
    "include",
    "include_bytes",
    "include_image",
    "include_str",
    "option_env",
    "panic",
    "todo",
    "unimplemented",
    "unreachable",
];

/// Attributes with user-visible texts.
const SHOWN_ATTRIBUTES: [&str; 5] = ["arg", "clap", "command", "error", "value"];

/// Derived traits that turn doc comments into help.
const HELP_TRAITS: [&str; 4] = ["Args", "Parser", "Subcommand", "ValueEnum"];

/// The folder with the scenarios of the library, whose descriptions are user-visible.
const SCENARIOS: &str = "core/world/src/library";

/// A user-visible text.
#[derive(Debug, PartialEq)]
struct Text {
    file: PathBuf,
    line: usize,
    text: String,
}

/// Prints all texts of files whose path contains `filter`.
///
/// # Errors
/// A source that cannot be read or parsed.
pub(crate) fn strings(filter: Option<&str>) -> Result<()> {
    for Text { file, line, text } in texts(&cmd::root())? {
        let file = file.display().to_string();
        if filter.is_none_or(|part| file.contains(part)) {
            cmd::print_line(format!("{file}:{line}\t{}", text.replace('\n', "\\n").replace('\t', "\\t")));
        }
    }
    Ok(())
}

/// Texts that cite a requirement number.
///
/// # Errors
/// A source that cannot be read or parsed.
pub(crate) fn findings(root: &Path) -> Result<Vec<Finding>> {
    let numbered = texts(root)?.into_iter().filter(|text| quotes_requirement(&text.text));
    let found = numbered.map(|Text { file, line, text }| {
        let message = format!(
            "users see `{text}`: cite the source as in docs/references.md, not a requirement's number"
        );
        Finding::new(file, line, message)
    });
    Ok(found.collect())
}

/// All texts below `root`, in the order of files and lines.
fn texts(root: &Path) -> Result<Vec<Text>> {
    let mut found = Vec::new();
    for folder in ["core", "server", "viewer"] {
        let mut of_tests = BTreeSet::new();
        let mut sources = Vec::new();
        for file in files(root, Path::new(folder), "rs")? {
            let is_source = file.components().any(|part| part.as_os_str() == "src");
            if !is_source || is_of_tests(&file) || SILENT.iter().any(|silent| file.starts_with(silent)) {
                continue;
            }
            let mut reader = Reader::default();
            let tokens = read(root, &file)?.parse::<TokenStream>();
            reader.tokens(tokens.map_err(|error| anyhow!("{}: {error}", file.display()))?, Docs::Hidden);
            of_tests.extend(reader.test_modules.iter().map(|module| folder_of_modules(&file).join(module)));
            sources.push((file, reader.found));
        }
        sources.retain(|(file, _)| !file.ancestors().any(|part| of_tests.contains(&part.with_extension(""))));
        found.extend(sources.into_iter().flat_map(|(file, texts)| {
            texts.into_iter().map(move |(line, text)| Text { file: file.clone(), line, text })
        }));
    }
    for file in files(root, Path::new(SCENARIOS), "toml")? {
        let described = read(root, &file)?;
        let lines = described.lines().enumerate().filter(|(_, line)| line.starts_with("description"));
        found.extend(lines.map(|(at, line)| Text {
            file: file.clone(),
            line: at + 1,
            text: line.to_owned(),
        }));
    }
    for file in files(root, Path::new("web"), "html")? {
        let texts = texts_of_page(&read(root, &file)?);
        found.extend(texts.into_iter().map(|(line, text)| Text { file: file.clone(), line, text }));
    }
    Ok(found)
}

/// Whether doc comments are user-visible texts.
#[derive(Clone, Copy, PartialEq)]
enum Docs {
    Hidden,
    /// Only inside the braces of the group, as in `settings_group!`.
    Inside,
    Shown,
}

/// Reads the texts of one file from its tokens.
#[derive(Default)]
struct Reader {
    found: Vec<(usize, String)>,
    /// Names of modules that are compiled only for tests.
    test_modules: Vec<String>,
}

/// The attributes before an item, a field or an expression.
#[derive(Default)]
struct Attributes {
    docs: Vec<(usize, String)>,
    is_help: bool,
    is_test: bool,
    shown: Vec<TokenStream>,
}

impl Reader {
    fn tokens(&mut self, tokens: TokenStream, docs: Docs) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut inner = if docs == Docs::Shown { Docs::Shown } else { Docs::Hidden };
        let mut at = 0;
        while at < tokens.len() {
            let (attributes, next) = attributes(&tokens, at);
            if next > at {
                at = next;
                if attributes.is_test {
                    at = self.skip_item(&tokens, at);
                    continue;
                }
                if attributes.is_help {
                    inner = Docs::Shown;
                }
                if attributes.is_help || docs == Docs::Shown {
                    self.paragraphs(attributes.docs);
                }
                for shown in attributes.shown {
                    self.tokens(shown, Docs::Hidden);
                }
                continue;
            }
            match &tokens[at] {
                TokenTree::Literal(literal) => {
                    if let Ok(text) = syn::parse_str::<syn::LitStr>(&literal.to_string()) {
                        self.add(literal.span().start().line, text.value());
                    }
                }
                TokenTree::Group(group) if !is_of_developers(&tokens[..at], group) => {
                    let is_settings =
                        called_macro(&tokens[..at]).is_some_and(|name| name == "settings_group");
                    let is_body = group.delimiter() == Delimiter::Brace;
                    let of_group = match docs {
                        _ if is_settings => Docs::Inside,
                        Docs::Inside if is_body => Docs::Shown,
                        _ => inner,
                    };
                    self.tokens(group.stream(), of_group);
                    if is_body && docs != Docs::Shown {
                        inner = Docs::Hidden;
                    }
                }
                _ => {}
            }
            at += 1;
        }
    }

    /// Skips a test item; returns the index after it.
    fn skip_item(&mut self, tokens: &[TokenTree], from: usize) -> usize {
        let is_word = |at: usize, words: &[&str]| matches!(tokens.get(at), Some(TokenTree::Ident(name)) if words.contains(&name.to_string().as_str()));
        let mut at = from;
        while is_word(at, &["pub", "async"])
            || matches!(&tokens[at..], [TokenTree::Group(group), ..] if group.delimiter() == Delimiter::Parenthesis)
        {
            at += 1;
        }
        if is_word(at, &["mod"]) && matches!(tokens.get(at + 2), Some(TokenTree::Punct(_))) {
            self.test_modules.extend(tokens.get(at + 1).map(ToString::to_string));
        }
        let has_body =
            is_word(at, &["mod", "fn", "impl", "struct", "enum", "trait", "macro_rules", "thread_local"]);
        let is_long = has_body || is_word(at, &["use", "const", "static", "type", "let"]);
        while let Some(token) = tokens.get(at) {
            at += 1;
            match token {
                TokenTree::Group(group) if has_body && group.delimiter() == Delimiter::Brace => break,
                TokenTree::Punct(sign) if sign.as_char() == ';' => break,
                TokenTree::Punct(sign) if sign.as_char() == ',' && !is_long => break,
                _ => {}
            }
        }
        at
    }

    /// Adds doc comments, with the lines of each paragraph joined.
    fn paragraphs(&mut self, docs: Vec<(usize, String)>) {
        let mut paragraph: Option<(usize, String)> = None;
        for (line, text) in docs {
            match &mut paragraph {
                _ if text.trim().is_empty() => self.found.extend(paragraph.take()),
                Some((_, joined)) => {
                    joined.push(' ');
                    joined.push_str(text.trim());
                }
                None => paragraph = Some((line, text.trim().to_owned())),
            }
        }
        self.found.extend(paragraph);
    }

    fn add(&mut self, line: usize, text: String) {
        if is_for_users(&text) {
            self.found.push((line, text));
        }
    }
}

/// The attributes from `at`, and the index after them.
fn attributes(tokens: &[TokenTree], mut at: usize) -> (Attributes, usize) {
    let mut found = Attributes::default();
    loop {
        let group = match &tokens[at..] {
            [TokenTree::Punct(hash), TokenTree::Group(group), ..] if hash.as_char() == '#' => {
                at += 2;
                group
            }
            [TokenTree::Punct(hash), TokenTree::Punct(_), TokenTree::Group(group), ..]
                if hash.as_char() == '#' =>
            {
                at += 3;
                group
            }
            _ => return (found, at),
        };
        let content: Vec<TokenTree> = group.stream().into_iter().collect();
        let words = group.stream().to_string();
        let contains =
            |word: &str| words.split(|letter: char| !letter.is_alphanumeric()).any(|part| part == word);
        match content.as_slice() {
            [TokenTree::Ident(name), .., TokenTree::Literal(text)] if name == "doc" => {
                let text = syn::parse_str::<syn::LitStr>(&text.to_string());
                found.docs.extend(text.map(|text| (group.span().start().line, text.value())));
            }
            [TokenTree::Ident(name), ..] if name == "test" => found.is_test = true,
            [TokenTree::Ident(name), ..] if name == "cfg" => {
                found.is_test |= contains("test") && !contains("not");
            }
            [TokenTree::Ident(name), ..] if name == "derive" => {
                found.is_help |= HELP_TRAITS.iter().any(|help| contains(help));
            }
            [TokenTree::Ident(name), rest @ ..] if SHOWN_ATTRIBUTES.iter().any(|shown| name == shown) => {
                found.shown.push(rest.iter().cloned().collect());
            }
            _ => {}
        }
    }
}

/// The name of the macro whose arguments follow these tokens.
fn called_macro(before: &[TokenTree]) -> Option<String> {
    match before {
        [.., TokenTree::Ident(name), TokenTree::Punct(sign)] if sign.as_char() == '!' => {
            Some(name.to_string())
        }
        _ => None,
    }
}

/// True for the arguments of a macro that panics or names a file, and for the message of `.expect("…")`.
fn is_of_developers(before: &[TokenTree], group: &Group) -> bool {
    if called_macro(before).is_some_and(|name| OF_DEVELOPERS.contains(&name.as_str())) {
        return true;
    }
    let is_message =
        || matches!(group.stream().into_iter().collect::<Vec<_>>().as_slice(), [TokenTree::Literal(_)]);
    matches!(before, [.., TokenTree::Punct(dot), TokenTree::Ident(name)] if dot.as_char() == '.' && name == "expect")
        && is_message()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts_of(source: &str) -> Vec<String> {
        let mut reader = Reader::default();
        reader.tokens(source.parse().expect("tokens"), Docs::Hidden);
        reader.found.into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn literals_are_found_inside_macros_with_their_lines() {
        let source = "fn f() {\n say!(json!({\"key\": format!(\"no step {step}\")}));\n}";
        let mut reader = Reader::default();
        reader.tokens(source.parse().expect("tokens"), Docs::Hidden);
        assert_eq!(reader.found, [(2, "no step {step}".to_owned())]);
    }

    #[test]
    fn tests_panics_and_other_attributes_are_left_out() {
        let source = r#"
            #[cfg(test)] mod tests { const A: &str = "in a test"; }
            #[cfg(test)] use a::{b, c};
            #[test] fn g() { say("in a test"); }
            #[expect(dead_code, reason = "a reason for us")]
            fn f() { a.expect("an inner message"); assert!(b, "an inner claim"); say("seen by all"); }
            #[derive(Error)] enum E { #[error("not found: {0}")] A(u8) }
        "#;
        assert_eq!(texts_of(source), ["seen by all", "not found: {0}"]);
    }

    #[test]
    fn help_is_found_and_other_documentation_is_not() {
        let source = r#"
            /// Not shown.
            struct A { /** Not shown. */ a: u8 }
            /// Shows
            /// this.
            ///
            /// And this.
            #[derive(Args)] struct B { /// And that.
                b: u8 }
            settings_group! { /// Not shown.
                C as "c" { /// Of a setting.
                    c: u8 = 1, "px", D, "Kim09 Eq. 1"; } }
        "#;
        let expected = ["Shows this.", "And this.", "And that.", "Of a setting.", "Kim09 Eq. 1"];
        assert_eq!(texts_of(source), expected);
    }

    #[test]
    fn a_planted_requirement_number_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        for source in ["core/a/src", "core/world/src/library", "server/src", "viewer/src/panels", "web"] {
            std::fs::create_dir_all(folder.path().join(source)).unwrap();
        }
        let write = |file: &str, text: &str| std::fs::write(folder.path().join(file), text).unwrap();
        write(
            "core/a/src/lib.rs",
            "#[cfg(test)]\nmod helper;\n/// R1 in a comment.\nfn f() { say(\"as in R71\"); }\n",
        );
        write("core/a/src/helper.rs", "fn f() { say(\"tests R71\"); }\n");
        write("server/src/lib.rs", "");
        write("viewer/src/panels/tests.rs", "fn f() { say(\"tests R71\"); }\n");
        write("core/world/src/library/ramp.toml", "# as in R126\ndescription = \"A ramp (R124).\"\n");
        write("web/index.html", "<p>R9 is here</p>\n");
        let found: Vec<String> = findings(folder.path()).unwrap().iter().map(ToString::to_string).collect();
        assert_eq!(found.len(), 3, "{found:?}");
        assert!(found[0].starts_with("core/a/src/lib.rs:4: ") && found[0].contains("as in R71"), "{found:?}");
        assert!(found[1].starts_with("core/world/src/library/ramp.toml:2: "), "{found:?}");
        assert!(found[2].starts_with("web/index.html:1: "), "{found:?}");
    }

    #[test]
    fn the_workspace_shows_no_requirement_number() {
        let found: Vec<String> =
            findings(&crate::cmd::root()).unwrap().iter().map(ToString::to_string).collect();
        assert!(found.is_empty(), "mend these:\n{}", found.join("\n"));
    }
}
