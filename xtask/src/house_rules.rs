//! The project's own rules, as far as a program can check them; each message says how to resolve the finding.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use proc_macro2::TokenStream;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

use crate::imports::{self, NamedPath};

/// Maximum number of lines of a file of the tracker, the server and these commands.
const FILE_LINES: usize = 400;

/// The crates, and the maximum number of lines of their functions.
const CRATES: [(&str, Option<usize>); 6] = [
    ("core", Some(60)),
    ("experiments", Some(60)),
    ("server", Some(60)),
    ("viewer", Some(80)),
    ("tests", None),
    ("xtask", Some(60)),
];

/// Dependencies and modules forbidden in the core: it also runs in the browser, and the same input must give the same bits.
const NOT_IN_CORE: [&[&str]; 12] = [
    &["tokio"],
    &["axum"],
    &["egui"],
    &["eframe"],
    &["rerun"],
    &["std", "time", "Instant"],
    &["std", "time", "SystemTime"],
    &["std", "time", "*"],
    &["time", "Instant"],
    &["time", "SystemTime"],
    &["std", "thread"],
    &["thread", "spawn"],
];

/// One violation of a rule.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Finding {
    file: PathBuf,
    line: usize,
    message: String,
}

impl Finding {
    /// A violation at a line of a file.
    pub(crate) const fn new(file: PathBuf, line: usize, message: String) -> Self {
        Self { file, line, message }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}: {}", self.file.display(), self.line, self.message)
    }
}

/// Every violation in the workspace at `root`.
pub(crate) fn broken_rules(root: &Path) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for (name, function_lines) in CRATES {
        for file in files(root, Path::new(name), "toml")? {
            if file.ends_with("Cargo.toml") && !read(root, &file)?.contains("[lints]\nworkspace = true") {
                let message =
                    "the crate does not take the workspace's lints: add `[lints]` with `workspace = true`";
                findings.push(Finding { file, line: 1, message: message.to_owned() });
            }
        }
        for file in files(root, Path::new(name), "rs")? {
            let text = read(root, &file)?;
            findings.extend(broken_in_source(name, function_lines, &file, &text)?);
        }
    }
    for extension in ["html", "js", "css"] {
        for file in files(root, Path::new("web"), extension)? {
            findings.extend(unnumbered_tasks(&file, &read(root, &file)?));
        }
    }
    Ok(findings)
}

/// The files below `directory` with this extension, in a fixed order.
pub(crate) fn files(root: &Path, directory: &Path, extension: &str) -> Result<Vec<PathBuf>> {
    let full = root.join(directory);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(&full).with_context(|| format!("{} cannot be read", full.display()))? {
        let entry = entry?;
        let path = directory.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            found.extend(files(root, &path, extension)?);
        } else if path.extension().is_some_and(|found| found == extension) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

pub(crate) fn read(root: &Path, file: &Path) -> Result<String> {
    std::fs::read_to_string(root.join(file)).with_context(|| format!("{} cannot be read", file.display()))
}

/// Every violation in one Rust file.
fn broken_in_source(
    crate_name: &str,
    function_lines: Option<usize>,
    file: &Path,
    text: &str,
) -> Result<Vec<Finding>> {
    let syntax = syn::parse_file(text).with_context(|| format!("{} is no Rust source", file.display()))?;
    let tokens: TokenStream =
        text.parse().map_err(|error| anyhow::anyhow!("{} is no Rust source: {error}", file.display()))?;
    let paths = imports::named_paths(tokens);
    let mut findings = unnumbered_tasks(file, text);
    let mut report =
        |line: usize, message: String| findings.push(Finding { file: file.into(), line, message });
    if let Some(message) = header_fault(text) {
        report(1, message.to_owned());
    }
    let lines = text.lines().count();
    if lines > FILE_LINES && matches!(crate_name, "core" | "experiments" | "server" | "xtask") {
        report(
            1,
            format!("the file has {lines} lines, {FILE_LINES} are allowed: move one of its ideas to its own"),
        );
    }
    if let Some(allowed) = function_lines {
        let mut long = LongFunctions { allowed, found: Vec::new() };
        long.visit_file(&syntax);
        for (line, name, lines) in long.found {
            report(
                line,
                format!("`{name}` has {lines} lines, {allowed} are allowed: split it into named steps"),
            );
        }
    }
    for path in &paths {
        if let Some(message) = path_fault(crate_name, file, path, &paths) {
            report(path.line, format!("{} {message}", path.segments.join("::")));
        }
    }
    Ok(findings)
}

/// The fault of the file's header, if any.
fn header_fault(text: &str) -> Option<&'static str> {
    let header: Vec<&str> = text.lines().map_while(|line| line.strip_prefix("//!")).collect();
    let words = header.join(" ");
    if header.is_empty() {
        Some("the file has no header: begin it with `//!` and a sentence that says what lies here")
    } else if !words.contains('.') || words.split_whitespace().count() < 3 {
        Some("the header is no sentence: say in its `//!` lines what lies here")
    } else {
        None
    }
}

/// Why this path must not be used in this file, if so.
fn path_fault(crate_name: &str, file: &Path, path: &NamedPath, all: &[NamedPath]) -> Option<&'static str> {
    // `server/src/…` and `core/track/src/…`
    let is_source = file.components().skip(1).take(2).any(|part| part.as_os_str() == "src");
    let own_module = || {
        let is_local = |other: &NamedPath| {
            other.segments.len() > 1
                && matches!(other.segments[0].as_str(), "crate" | "self" | "super")
                && other.segments.last() == path.segments.first()
        };
        let is_declared = |pair: &[NamedPath]| {
            pair[0].segments == ["mod"] && pair[1].segments.as_slice() == &path.segments[..1]
        };
        all.iter().any(is_local) || all.windows(2).any(is_declared)
    };
    let names = |prefix: &&[&str]| path.segments.len() > 1 && path.begins_with(prefix);
    if path.segments == ["unsafe"] {
        return Some("is forbidden: use a safe crate that does this");
    }
    match crate_name {
        "core" if is_source && NOT_IN_CORE.iter().any(names) && !own_module() => Some(
            "is not for core, which has no clock, thread, network or screen: take the value as an argument, or move \
             this to the server or the viewer",
        ),
        "viewer" | "server" if path.begins_with(&["sightline_core"]) => {
            Some("is the facade of all crates: name the single crate, so that fewer edits rebuild this one")
        }
        "viewer" if path.begins_with(&["sightline_server"]) => {
            Some("is not for the viewer: what both sides exchange belongs to sightline_api")
        }
        "server" if path.begins_with(&["sightline_viewer"]) => {
            Some("is not for the server: what both sides exchange belongs to sightline_api")
        }
        "viewer" if is_source && !file.starts_with("viewer/src/theme") && is_colour(path) => {
            Some("is a colour outside viewer/src/theme: give it a name there")
        }
        _ => None,
    }
}

/// True if the path constructs a colour from constants.
fn is_colour(path: &NamedPath) -> bool {
    let [.., owner, name] = path.segments.as_slice() else {
        return path.segments == ["hex_color"];
    };
    if name == "hex_color" {
        return true;
    }
    if !matches!(owner.as_str(), "Color32" | "Rgba") {
        return false;
    }
    let is_constant = name.chars().all(|letter| letter.is_ascii_uppercase() || letter == '_');
    name.starts_with("from_rgb")
        || (name.starts_with("from_") && path.has_literal_arguments)
        || (is_constant && !matches!(name.as_str(), "TRANSPARENT" | "PLACEHOLDER"))
}

/// Tasks in the text without an issue number.
fn unnumbered_tasks(file: &Path, text: &str) -> Vec<Finding> {
    // Assembled here, so that this file does not contain the words.
    let words = [concat!("TO", "DO"), concat!("FIX", "ME")];
    let mut findings = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let unnumbered = words.iter().any(|word| {
            line.split(word).skip(1).any(|rest| {
                let number = rest.trim_start_matches(['(', ' ', ':']).strip_prefix('#');
                !number.is_some_and(|number| number.starts_with(|letter: char| letter.is_ascii_digit()))
            })
        });
        if unnumbered {
            let message = format!("a {} needs the number of its issue, as in `{}(#12)`", words[0], words[0]);
            findings.push(Finding { file: file.into(), line: index + 1, message });
        }
    }
    findings
}

/// Finds functions that are too long, from `fn` to the closing brace.
struct LongFunctions {
    allowed: usize,
    found: Vec<(usize, String, usize)>,
}

impl LongFunctions {
    fn measure(&mut self, signature: &syn::Signature, block: &syn::Block) {
        let first = signature.span().start().line;
        let lines = block.brace_token.span.close().end().line + 1 - first;
        if lines > self.allowed {
            self.found.push((first, signature.ident.to_string(), lines));
        }
    }
}

impl<'ast> Visit<'ast> for LongFunctions {
    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        self.measure(&function.sig, &function.block);
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        self.measure(&function.sig, &function.block);
        visit::visit_impl_item_fn(self, function);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast syn::TraitItemFn) {
        if let Some(block) = &function.default {
            self.measure(&function.sig, block);
        }
        visit::visit_trait_item_fn(self, function);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "//! What lies here.\n";

    fn messages(crate_name: &str, file: &str, text: &str) -> Vec<String> {
        let limit = CRATES.iter().find(|(name, _)| *name == crate_name).and_then(|(_, lines)| *lines);
        let findings = broken_in_source(crate_name, limit, Path::new(file), text).expect("Rust source");
        findings.iter().map(ToString::to_string).collect()
    }

    fn expect_one(crate_name: &str, file: &str, body: &str, words: &str) {
        let found = messages(crate_name, file, &format!("{HEADER}{body}"));
        assert!(found.len() == 1 && found[0].contains(words), "expected one `{words}`, found {found:?}");
    }

    fn expect_none(crate_name: &str, file: &str, body: &str) {
        assert_eq!(messages(crate_name, file, &format!("{HEADER}{body}")), Vec::<String>::new());
    }

    #[test]
    fn a_file_without_a_sentence_at_its_head_is_found() {
        assert_eq!(messages("core", "core/src/a.rs", "fn f() {}\n").len(), 1);
        assert_eq!(messages("core", "core/src/a.rs", "//! Cameras\nfn f() {}\n").len(), 1);
        expect_none("core", "core/src/a.rs", "fn f() {}\n");
    }

    #[test]
    fn a_function_may_have_its_limit_and_not_one_line_more() {
        let function =
            |lines: usize| format!("/// Doc.\n#[must_use]\nfn f() {{\n{}}}\n", "g();\n".repeat(lines - 2));
        expect_none("core", "core/src/a.rs", &function(60));
        expect_one(
            "core",
            "core/src/a.rs",
            &function(61),
            "core/src/a.rs:4: `f` has 61 lines, 60 are allowed",
        );
        expect_none("viewer", "viewer/src/a.rs", &function(80));
        expect_one("viewer", "viewer/src/a.rs", &function(81), "`f` has 81 lines");
    }

    #[test]
    fn a_long_file_is_found_in_core_and_not_in_the_viewer() {
        let text = "struct A;\n".repeat(400);
        expect_one("core", "core/src/a.rs", &text, "the file has 401 lines");
        expect_none("viewer", "viewer/src/a.rs", &text);
    }

    #[test]
    fn clocks_threads_and_networks_are_found_in_core() {
        expect_one("core", "core/src/a.rs", "use std::time::{Duration, Instant};", "std::time::Instant");
        expect_one("core", "core/src/a.rs", "fn f() { std::thread::spawn(g); }", "std::thread::spawn");
        expect_one("core", "core/src/a.rs", "use rerun::Image;", "rerun::Image");
        expect_none("core", "core/src/a.rs", "use std::time::Duration; fn f(rerun: u8) { g(rerun); }");
        expect_none("core", "core/src/a.rs", "mod rerun; fn f() { rerun::g(); }");
        expect_none("core", "core/benches/a.rs", "use std::time::Instant;");
    }

    #[test]
    fn server_and_viewer_never_see_each_other() {
        expect_one("viewer", "viewer/src/a.rs", "use sightline_server::Api;", "not for the viewer");
        expect_one("server", "server/src/a.rs", "fn f() { sightline_viewer::g(); }", "not for the server");
        expect_one("viewer", "viewer/src/a.rs", "use sightline_core::track;", "the facade");
    }

    #[test]
    fn colours_are_named_in_the_theme_only() {
        let red = "const RED: Color32 = egui::Color32::from_rgb(255, 0, 0);";
        expect_one("viewer", "viewer/src/a.rs", red, "outside viewer/src/theme");
        expect_none("viewer", "viewer/src/theme/palette.rs", red);
        expect_one("viewer", "viewer/src/a.rs", "fn f() { g(Color32::WHITE); }", "Color32::WHITE");
        expect_one(
            "viewer",
            "viewer/src/a.rs",
            "fn f() { g(Color32::from_gray(30)); }",
            "Color32::from_gray",
        );
        expect_none(
            "viewer",
            "viewer/src/a.rs",
            "fn f(v: u8) { g(Color32::from_gray(v), Color32::TRANSPARENT); }",
        );
    }

    #[test]
    fn a_task_without_an_issue_is_found() {
        let task = concat!("// TO", "DO");
        expect_one("viewer", "viewer/src/a.rs", &format!("{task}: later\n"), "needs the number of its issue");
        expect_none("viewer", "viewer/src/a.rs", &format!("{task}(#12): later\n"));
    }

    #[test]
    fn code_that_is_not_safe_is_found_inside_macros_too() {
        let body = concat!("fn f() { m!(un", "safe { g() }); }");
        expect_one("tests", "tests/src/a.rs", body, "use a safe crate");
    }

    #[test]
    fn the_workspace_follows_the_house_rules() {
        let findings = broken_rules(&crate::cmd::root()).expect("the workspace is read");
        let listed: Vec<String> = findings.iter().map(ToString::to_string).collect();
        assert!(findings.is_empty(), "mend these:\n{}", listed.join("\n"));
    }
}
