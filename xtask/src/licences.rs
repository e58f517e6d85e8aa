//! `LICENSES.txt`: the licence of each part of the program and its page, and each text once.
//!
//! The texts come from the packages. A package without a licence text gets the standard text of one of its licences with its
//! authors.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};
use spdx::Licensee;

use crate::components::{Component, compiled_files};
use crate::{cmd, deny};

/// Words in the names of files that contain licences.
const WORDS: [&str; 6] = ["license", "licence", "copying", "copyright", "notice", "patents"];

/// File extensions that are not licence texts, even if the name contains such a word.
const NO_TEXTS: [&str; 9] = ["rs", "toml", "json", "js", "py", "sh", "yml", "yaml", "h"];

/// Distinct texts in the order of their first use, numbered from 1.
#[derive(Default)]
struct Texts {
    /// Keyed by the words of the text, because line breaks differ between packages.
    numbers: BTreeMap<String, usize>,
    texts: Vec<String>,
}

impl Texts {
    fn number(&mut self, text: &str) -> usize {
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        *self.numbers.entry(words).or_insert_with(|| {
            self.texts.push(text.replace("\r\n", "\n").trim_matches('\n').to_owned());
            self.texts.len()
        })
    }
}

/// The file's content; `version` is the version of the program, `library` that of the standard library.
pub(crate) fn listing(components: &[Component<'_>], version: &str, library: &str) -> Result<String> {
    let standard = Standard::read(&cmd::root())?;
    let mut texts = Texts::default();
    let mut list = format!(
        "Licences of {version} and of its parts\n\nEach line: part, version, place, licence (SPDX), numbers of the texts below.\n\n"
    );
    let own = [texts.number(&standard.mit), texts.number(&standard.apache)];
    writeln!(list, "sightline and its crates | program and page | MIT OR Apache-2.0 | {}", shown(&own))?;
    let number = texts.number(&standard.apache);
    writeln!(
        list,
        "Rust standard library {library} | program and page | MIT OR Apache-2.0 | {}",
        shown(&[number])
    )?;
    for component in components.iter().filter(|component| component.package.source.is_some()) {
        let package = component.package;
        let numbers: Vec<_> = texts_of(component, &standard)?.iter().map(|text| texts.number(text)).collect();
        let licence = canonical(package.license.as_deref().unwrap_or_default());
        let (name, version, place) = (&package.name, &package.version, component.location());
        writeln!(list, "{name} {version} | {place} | {licence} | {}", shown(&numbers))?;
        for embedded in &component.embedded {
            let numbers = match embedded.text {
                Some(file) => vec![texts.number(&read(&component.folder().join(file))?)],
                None => numbers.clone(),
            };
            let more = if embedded.has_unknown_components {
                "; its own parts are listed by its project"
            } else {
                ""
            };
            let (file, licence) = (embedded.file, embedded.licence);
            writeln!(list, "{name} {version}, {file} | {place} | {licence}{more} | {}", shown(&numbers))?;
        }
    }
    for (index, text) in texts.texts.iter().enumerate() {
        write!(list, "\n{}\n[{}]\n\n{text}\n", "=".repeat(80), index + 1)?;
    }
    Ok(list)
}

fn shown(numbers: &[usize]) -> String {
    numbers.iter().map(|number| format!("[{number}]")).collect::<Vec<_>>().join(" ")
}

/// The canonical SPDX expression; older manifests use `/` for OR.
pub(crate) fn canonical(licence: &str) -> String {
    spdx::Expression::canonicalize(licence).ok().flatten().unwrap_or_else(|| licence.to_owned())
}

/// The standard texts in this repository.
struct Standard {
    mit: String,
    apache: String,
}

impl Standard {
    fn read(root: &Path) -> Result<Self> {
        Ok(Self { mit: read(&root.join("LICENSE-MIT"))?, apache: read(&root.join("LICENSE-APACHE"))? })
    }

    /// The text for a package without one: Apache-2.0 if allowed by its licence, else MIT.
    fn text(&self, component: &Component<'_>) -> Result<String> {
        let package = component.package;
        let declared = package.license.as_deref().unwrap_or_default();
        let expression =
            deny::expression(declared).with_context(|| format!("{declared} is no SPDX expression"))?;
        let files = component.embedded.iter().map(|embedded| embedded.licence);
        let satisfied_with = |own: &'static str| {
            let given: Vec<_> =
                files.clone().chain([own]).flat_map(|text| Licensee::parse(text).ok()).collect();
            expression.evaluate(|wanted| given.iter().any(|licence| licence.satisfies(wanted)))
        };
        if satisfied_with("Apache-2.0") {
            return Ok(self.apache.clone());
        }
        if !satisfied_with("MIT") {
            bail!("{} {} has the licence {declared} and no text of it", package.name, package.version);
        }
        let (_, terms) = self.mit.split_once("\n\nPermission").context("LICENSE-MIT has other words")?;
        let authors = if package.authors.is_empty() {
            format!("the authors of {}", package.name)
        } else {
            package.authors.join(", ")
        };
        Ok(format!("MIT License\n\nCopyright (c) {authors}\n\nPermission{terms}"))
    }
}

/// The texts of a package, except those of its embedded files.
fn texts_of(component: &Component<'_>, standard: &Standard) -> Result<Vec<String>> {
    let of_embedded: Vec<_> = component
        .embedded
        .iter()
        .filter_map(|embedded| Some(component.folder().join(embedded.text?)))
        .collect();
    let mut texts = Vec::new();
    for file in compiled_files(component.folder())? {
        if is_licence(&file) && !of_embedded.contains(&file) {
            texts.push(read(&file)?);
        }
    }
    if texts.is_empty() {
        texts.push(standard.text(component)?);
    }
    Ok(texts)
}

fn is_licence(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let is_text = file.extension().is_none_or(|end| !NO_TEXTS.iter().any(|known| end == *known));
    is_text && WORDS.iter().any(|word| name.contains(word))
}

fn read(file: &Path) -> Result<String> {
    let bytes = std::fs::read(file).with_context(|| format!("{} cannot be read", file.display()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packages::Package;

    /// The listing of one package with this licence, these authors and these files.
    fn listed(licence: &str, authors: &[&str], files: &[(&str, &str)]) -> Result<String> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files {
            let file = folder.path().join(name);
            std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
            std::fs::write(file, text).expect("a file");
        }
        let package = Package {
            name: "one".to_owned(),
            version: "1.0.0".to_owned(),
            license: Some(licence.to_owned()),
            source: Some("registry+https://example".to_owned()),
            authors: authors.iter().map(|&author| author.to_owned()).collect(),
            manifest_path: folder.path().join("Cargo.toml"),
            ..Package::default()
        };
        let component = Component {
            package: &package,
            checksum: None,
            is_in_program: true,
            is_in_page: false,
            needs: Vec::new(),
            embedded: Vec::new(),
        };
        listing(&[component], "sightline 0", "1.0.0")
    }

    #[test]
    fn texts_of_packages_are_listed_once() {
        let files = [
            ("LICENSE-A", "terms\r\nof A"),
            ("c/LICENSE", "terms of A\n"),
            ("NOTICE", "thanks"),
            ("tests/LICENSE", "no"),
        ];
        let list = listed("MIT/Apache-2.0", &[], &files).expect("a list");
        assert!(list.contains("\none 1.0.0 | program | MIT OR Apache-2.0 | [3] [4] [3]\n"), "{list}");
        assert_eq!(list.matches("\nterms\nof A\n").count(), 1, "{list}");
    }

    #[test]
    fn every_part_of_the_program_has_a_text() {
        let host = crate::packages::host().expect("a compiler");
        let packages = crate::components::packages(&host).expect("packages");
        let components = crate::components::components(&packages, &host).expect("parts");
        let list = listing(&components, "sightline 0", "1.0.0").expect("texts");
        for component in &components {
            let line = format!("\n{} {} | ", component.package.name, component.package.version);
            assert_eq!(list.contains(&line), component.package.source.is_some(), "{line}");
        }
        for words in [
            "SIL OPEN FONT LICENSE Version 1.1",
            "UBUNTU FONT LICENCE Version 1.0",
            "Bitstream Vera",
            "BoringSSL",
        ] {
            assert!(list.contains(words), "no text of {words}");
        }
    }

    #[test]
    fn a_package_without_a_text_gets_a_standard_one() {
        let list = listed("Apache-2.0 OR MIT", &["A. Author"], &[("src/license.rs", "no")]).expect("a list");
        assert!(list.contains("\none 1.0.0 | program | Apache-2.0 OR MIT | [2]\n"), "{list}");
        let list = listed("MIT", &["A. Author"], &[("a.txt", "")]).expect("a list");
        assert!(list.contains("Copyright (c) A. Author\n\nPermission is hereby granted"), "{list}");
        let refused = listed("ISC", &[], &[("a.txt", "")]).expect_err("no text").to_string();
        assert_eq!(refused, "one 1.0.0 has the licence ISC and no text of it");
    }
}
