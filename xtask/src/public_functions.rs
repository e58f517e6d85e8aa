//! Finds public functions that no other crate of the workspace uses: `pub` without an external caller hides dead code from
//! the compiler.
//!
//! A function counts as used if any identifier in another crate's sources equals its name, so functions with common names
//! pass. `public_functions.txt` lists the exceptions that precede this rule, as `package name`; entries may only be removed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

use crate::house_rules::{Finding, files, read};

/// The list of functions that precede the rule.
const KNOWN: &str = "xtask/public_functions.txt";

/// Folders with packages to which the rule applies.
const HELD: [&str; 4] = ["core", "experiments", "server", "viewer"];

/// Folders whose sources count as users.
const NAMING: [&str; 7] = ["core", "experiments", "features", "server", "viewer", "tests", "xtask"];

/// The declaration of a public function.
struct Declared {
    package: PathBuf,
    name: String,
    file: PathBuf,
    line: usize,
}

/// Public functions without an external caller that are not listed, and listed ones that do not exist.
///
/// # Errors
/// A source that cannot be read or parsed.
pub(crate) fn findings(root: &Path) -> Result<Vec<Finding>> {
    let text = std::fs::read_to_string(root.join(KNOWN)).with_context(|| format!("{KNOWN} is missing"))?;
    let known: BTreeSet<&str> = text.lines().collect();
    let mut gone = known.clone();
    let mut findings = Vec::new();
    for unnamed in unnamed(root)? {
        let entry = format!("{} {}", unnamed.package.display(), unnamed.name);
        if gone.remove(entry.as_str()) || known.contains(entry.as_str()) {
            continue;
        }
        let message =
            format!("no other crate names the public function `{}`: make it pub(crate)", unnamed.name);
        findings.push(Finding::new(unnamed.file, unnamed.line, message));
    }
    let line = |entry: &str| 1 + text.lines().position(|line| line == entry).unwrap_or_default();
    findings.extend(gone.into_iter().map(|entry| {
        let message = format!("`{entry}` is no longer such a function: remove the line");
        Finding::new(KNOWN.into(), line(entry), message)
    }));
    Ok(findings)
}

/// All public functions that no other crate uses.
fn unnamed(root: &Path) -> Result<Vec<Declared>> {
    let mut declared = Vec::new();
    let mut names: BTreeMap<PathBuf, BTreeSet<String>> = BTreeMap::new();
    for folder in NAMING {
        for file in files(root, Path::new(folder), "rs")? {
            let package = package_of(root, &file);
            let text = read(root, &file)?;
            let fault = || format!("{} is no Rust source", file.display());
            let tokens: TokenStream = text.parse().ok().with_context(fault)?;
            let unit = if is_of_library(&package, &file) { package.clone() } else { file.clone() };
            identifiers(tokens, names.entry(unit).or_default());
            if HELD.contains(&folder) && is_of_library(&package, &file) {
                let mut visitor = PublicFunctions { package: &package, file: &file, found: &mut declared };
                visitor.visit_file(&syn::parse_file(&text).with_context(fault)?);
            }
        }
    }
    let is_named = |function: &Declared| {
        names.iter().any(|(unit, names)| *unit != function.package && names.contains(&function.name))
    };
    declared.retain(|function| !is_named(function));
    Ok(declared)
}

/// The nearest parent folder of a file with a manifest.
fn package_of(root: &Path, file: &Path) -> PathBuf {
    let above = file.ancestors().skip(1).find(|folder| root.join(folder).join("Cargo.toml").is_file());
    above.unwrap_or(Path::new("")).to_owned()
}

/// True for a file of the package's library; false for its program, tests, benchmarks and build script.
fn is_of_library(package: &Path, file: &Path) -> bool {
    let source = package.join("src");
    let is_test = file.components().any(|part| part.as_os_str() == "tests")
        || file.file_stem().is_some_and(|name| name.to_string_lossy().ends_with("tests"));
    file.starts_with(&source) && *file != source.join("main.rs") && !is_test
}

/// Adds all identifiers of some tokens.
fn identifiers(tokens: TokenStream, names: &mut BTreeSet<String>) {
    for token in tokens {
        match token {
            TokenTree::Ident(name) => {
                names.insert(name.to_string());
            }
            TokenTree::Group(group) => identifiers(group.stream(), names),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

/// Collects `pub` functions and methods, except those of tests.
struct PublicFunctions<'a> {
    package: &'a Path,
    file: &'a Path,
    found: &'a mut Vec<Declared>,
}

impl PublicFunctions<'_> {
    fn add(&mut self, visibility: &syn::Visibility, name: &syn::Ident) {
        if matches!(visibility, syn::Visibility::Public(_)) {
            self.found.push(Declared {
                package: self.package.to_owned(),
                name: name.to_string(),
                file: self.file.to_owned(),
                line: name.span().start().line,
            });
        }
    }
}

impl<'a> Visit<'a> for PublicFunctions<'_> {
    fn visit_item_fn(&mut self, function: &'a syn::ItemFn) {
        self.add(&function.vis, &function.sig.ident);
    }

    fn visit_impl_item_fn(&mut self, function: &'a syn::ImplItemFn) {
        self.add(&function.vis, &function.sig.ident);
    }

    fn visit_item_mod(&mut self, module: &'a syn::ItemMod) {
        if module.ident != "tests" {
            visit::visit_item_mod(self, module);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn workspace(known: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in NAMING {
            std::fs::create_dir_all(folder.path().join(name).join("src")).unwrap();
            std::fs::write(folder.path().join(name).join("Cargo.toml"), "").unwrap();
        }
        let source = "pub fn used() { own(); }\npub fn own() {}\npub(crate) fn inner() {}\n\
                      impl A { pub fn method(&self) {} }\n#[cfg(test)] mod tests { pub fn helper() {} }\n";
        std::fs::write(folder.path().join("core/src/lib.rs"), source).unwrap();
        std::fs::write(folder.path().join("server/src/lib.rs"), "fn f() { x!(core::used()) }").unwrap();
        std::fs::write(folder.path().join(KNOWN), known).unwrap();
        folder
    }

    fn messages(known: &str) -> Vec<String> {
        findings(workspace(known).path()).unwrap().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_function_without_a_caller_outside_is_reported() {
        let found = messages("");
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("core/src/lib.rs:2: ") && found[0].contains("`own`"), "{found:?}");
        assert!(found[1].contains("`method`"), "{found:?}");
    }

    #[test]
    fn the_list_of_known_functions_only_becomes_shorter() {
        assert!(messages("core method\ncore own\n").is_empty());
        let found = messages("core gone\ncore method\ncore own\n");
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with("xtask/public_functions.txt:1: "), "{found:?}");
    }

    #[test]
    fn a_program_of_the_same_package_counts_as_outside() {
        let folder = workspace("core method\n");
        std::fs::write(folder.path().join("core/src/main.rs"), "fn main() { own(); }").unwrap();
        assert!(findings(folder.path()).unwrap().is_empty());
    }
}
