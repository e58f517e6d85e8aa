//! Applies the rules of `deny.toml` to every dependency: licences, banned packages and sources.
//!
//! The file has the format of [cargo-deny](https://embarkstudios.github.io/cargo-deny/), which gives the same verdict but
//! takes longer to compile than all of these commands. Keys and values that this module does not implement are errors, so
//! that no rule is silently ignored. Advisories are not checked, because their database requires the network.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt;

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use spdx::{Expression, LicenseReq, Licensee, ParseMode};

use crate::cmd;
use crate::packages::{Package, Packages};

/// The file with the rules.
const FILE: &str = "deny.toml";

/// The rules.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rules {
    graph: Graph,
    licenses: Licences,
    bans: Bans,
    sources: Sources,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Graph {
    targets: Vec<String>,
    #[serde(default)]
    all_features: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Licences {
    allow: Vec<LicenceName>,
    unused_allowed_license: Deny,
    #[serde(default)]
    exceptions: Vec<Exception>,
}

/// Additional licences allowed for one package.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Exception {
    #[serde(rename = "crate")]
    name: String,
    allow: Vec<LicenceName>,
}

/// An SPDX identifier with an optional exception.
#[derive(Deserialize)]
#[serde(try_from = "String")]
struct LicenceName(Licensee);

impl TryFrom<String> for LicenceName {
    type Error = spdx::ParseError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        Licensee::parse(&text).map(Self)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Bans {
    multiple_versions: Allow,
    wildcards: Deny,
    allow_wildcard_paths: bool,
    deny: Vec<Ban>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Ban {
    #[serde(rename = "crate")]
    name: String,
    reason: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Sources {
    unknown_registry: Deny,
    unknown_git: Deny,
    allow_registry: Vec<String>,
    allow_git: Vec<String>,
}

/// The only supported level of an active rule.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Deny {
    Deny,
}

/// The only supported level of an inactive rule.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Allow {
    Allow,
}

/// A package that breaks a rule, or a rule without effect.
#[derive(Debug, PartialEq)]
struct Finding(String);

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{FILE}: {}", self.0)
    }
}

/// Fails if a dependency breaks a rule.
pub(crate) fn check() -> Result<()> {
    let rules = read(&text()?)?;
    let packages = rules.graph.packages()?;
    let findings = rules.findings(&packages);
    for finding in &findings {
        cmd::print_line(finding);
    }
    if !findings.is_empty() {
        bail!(
            "{} rules for dependencies are broken: replace the package, or allow it in {FILE}",
            findings.len()
        );
    }
    cmd::print_line(format!(
        "Licences, bans and sources of {} packages are as {FILE} allows.",
        packages.len()
    ));
    Ok(())
}

fn text() -> Result<String> {
    std::fs::read_to_string(cmd::root().join(FILE)).with_context(|| format!("{FILE} cannot be read"))
}

fn read(text: &str) -> Result<Rules> {
    toml::from_str(text).with_context(|| format!("{FILE} has a rule that is not applied here"))
}

impl Graph {
    fn packages(&self) -> Result<Vec<Package>> {
        let features: &[&str] = if self.all_features { &["--all-features"] } else { &[] };
        Ok(Packages::for_targets(&self.targets, features)?.all)
    }
}

impl Rules {
    fn findings(&self, packages: &[Package]) -> Vec<Finding> {
        let mut findings = self.licenses.findings(packages);
        for package in packages {
            let Package { name, version, .. } = package;
            let reasons = self.bans.broken_by(package).into_iter().chain(self.sources.broken_by(package));
            findings.extend(reasons.map(|reason| Finding(format!("{name} {version} {reason}"))));
        }
        findings
    }
}

impl Licences {
    fn findings(&self, packages: &[Package]) -> Vec<Finding> {
        let Self { allow, unused_allowed_license: Deny::Deny, exceptions } = self;
        let used = RefCell::new(BTreeSet::new());
        let is_allowed = |package: &Package, wanted: &LicenseReq| {
            let own = exceptions.iter().filter(|exception| exception.name == package.name);
            let general = allow.iter().chain(own.flat_map(|exception| &exception.allow));
            let satisfying: Vec<_> = general.filter(|licence| licence.0.satisfies(wanted)).collect();
            used.borrow_mut().extend(satisfying.iter().map(|licence| licence.0.to_string()));
            !satisfying.is_empty()
        };
        let mut findings = Vec::new();
        for package in packages {
            let Package { name, version, license, .. } = package;
            let refused = match license.as_deref().map(|text| (text, expression(text))) {
                None => Some("declares no licence".to_owned()),
                Some((text, Err(_))) => Some(format!("has the licence {text}, which is no SPDX expression")),
                Some((text, Ok(expression))) => (!expression.evaluate(|wanted| is_allowed(package, wanted)))
                    .then(|| format!("has the licence {text}, which is not allowed")),
            };
            findings.extend(refused.map(|reason| Finding(format!("{name} {version} {reason}"))));
        }
        let listed = allow.iter().chain(exceptions.iter().flat_map(|exception| &exception.allow));
        let used = used.into_inner();
        let unused = listed.map(|licence| licence.0.to_string()).filter(|licence| !used.contains(licence));
        findings.extend(unused.map(|licence| Finding(format!("no package needs {licence}"))));
        findings
    }
}

/// Parses an SPDX expression; older manifests use `/` for OR.
pub(crate) fn expression(text: &str) -> Result<Expression, spdx::ParseError> {
    Expression::parse_mode(text, ParseMode::LAX)
}

impl Bans {
    fn broken_by(&self, package: &Package) -> Vec<String> {
        let Self { multiple_versions: Allow::Allow, wildcards: Deny::Deny, allow_wildcard_paths, deny } =
            self;
        let banned = deny.iter().filter(|ban| ban.name == package.name);
        let mut reasons: Vec<_> = banned.map(|ban| format!("is banned: {}", ban.reason)).collect();
        let any_version = package.dependencies.iter().filter(|dependency| dependency.req == "*");
        let any_version = any_version.filter(|needed| !(needed.path.is_some() && *allow_wildcard_paths));
        reasons.extend(any_version.map(|dependency| format!("takes any version of {}", dependency.name)));
        reasons
    }
}

impl Sources {
    fn broken_by(&self, package: &Package) -> Option<String> {
        let Self { unknown_registry: Deny::Deny, unknown_git: Deny::Deny, allow_registry, allow_git } = self;
        // The workspace's own packages have no source.
        let source = package.source.as_deref()?;
        let is_known = match source.split_once('+') {
            Some(("registry" | "sparse", url)) => allow_registry.iter().any(|known| known == url),
            Some(("git", url)) => {
                let url = url.split(['?', '#']).next().unwrap_or_default();
                allow_git.iter().any(|known| known == url)
            }
            _ => false,
        };
        (!is_known).then(|| format!("comes from {source}, which is not allowed"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packages::Requirement;

    const RULES: &str = r#"
        [graph]
        targets = ["x86_64-unknown-linux-gnu"]
        [licenses]
        allow = ["MIT", "Apache-2.0 WITH LLVM-exception"]
        unused-allowed-license = "deny"
        exceptions = [{ crate = "driver", allow = ["MPL-2.0"] }]
        [bans]
        multiple-versions = "allow"
        wildcards = "deny"
        allow-wildcard-paths = true
        deny = [{ crate = "spy", reason = "it reports" }]
        [sources]
        unknown-registry = "deny"
        unknown-git = "deny"
        allow-registry = ["https://good.example/index"]
        allow-git = ["https://good.example/code"]
    "#;

    fn package(name: &str, license: &str) -> Package {
        Package {
            name: name.to_owned(),
            version: "1.0.0".to_owned(),
            license: Some(license.to_owned()),
            source: Some("registry+https://good.example/index".to_owned()),
            ..Package::default()
        }
    }

    /// The findings for `added` and packages that use every licence of the list.
    fn findings(added: Package) -> Vec<String> {
        let all = [
            package("a", "MIT/GPL-2.0-only"),
            package("b", "Apache-2.0 WITH LLVM-exception"),
            package("driver", "MPL-2.0"),
            added,
        ];
        let found = read(RULES).expect("rules").findings(&all);
        found.iter().map(ToString::to_string).collect()
    }

    fn expect_one(added: Package, words: &str) {
        let found = findings(added);
        assert!(found.len() == 1 && found[0].contains(words), "expected one `{words}`, found {found:?}");
    }

    #[test]
    fn licences_outside_the_list_are_found() {
        assert_eq!(findings(package("c", "GPL-3.0-only OR MIT")), Vec::<String>::new());
        expect_one(package("c", "GPL-3.0-only"), "c 1.0.0 has the licence GPL-3.0-only");
        expect_one(package("c", "MIT AND GPL-3.0-only"), "not allowed");
        expect_one(package("c", "Apache-2.0"), "not allowed");
        expect_one(package("c", "MPL-2.0"), "not allowed");
        expect_one(package("c", "as it pleases"), "no SPDX expression");
        expect_one(Package { license: None, ..package("c", "") }, "declares no licence");
    }

    #[test]
    fn a_licence_that_no_package_needs_is_found() {
        let found = read(RULES).expect("rules").findings(&[package("a", "MIT")]);
        let found: Vec<_> = found.iter().map(ToString::to_string).collect();
        let words = "deny.toml: no package needs";
        assert_eq!(found, [format!("{words} Apache-2.0 WITH LLVM-exception"), format!("{words} MPL-2.0")]);
    }

    #[test]
    fn banned_packages_and_wildcards_are_found() {
        expect_one(package("spy", "MIT"), "spy 1.0.0 is banned: it reports");
        let any = |path: Option<&str>| Package {
            dependencies: vec![Requirement {
                name: "x".to_owned(),
                req: "*".to_owned(),
                path: path.map(Into::into),
            }],
            ..package("c", "MIT")
        };
        expect_one(any(None), "takes any version of x");
        assert_eq!(findings(any(Some("/x"))), Vec::<String>::new());
    }

    #[test]
    fn unknown_registries_and_repositories_are_found() {
        let from = |source: &str| Package { source: Some(source.to_owned()), ..package("c", "MIT") };
        assert_eq!(findings(from("git+https://good.example/code?rev=1#1")), Vec::<String>::new());
        for source in
            ["registry+https://bad.example", "sparse+https://bad.example", "git+https://bad.example/code"]
        {
            expect_one(from(source), "which is not allowed");
        }
        assert_eq!(findings(Package { source: None, ..package("c", "MIT") }), Vec::<String>::new());
    }

    #[test]
    fn each_rule_of_the_repository_has_an_effect() {
        let text = text().expect("rules");
        let rules = read(&text).expect("rules");
        let packages = rules.graph.packages().expect("packages");
        assert_eq!(rules.findings(&packages), []);
        for (rule, other) in [
            ("\"Unicode-3.0\",", ""),
            ("\"Zlib\",", "\"Zlib\", \"EUPL-1.2\","),
            ("crate = \"webdriver\"", "crate = \"axum\""),
            ("crate = \"cmake\"", "crate = \"serde\""),
            ("rust-lang/crates.io-index", "other/index"),
            ("allow-wildcard-paths = true", "allow-wildcard-paths = false"),
        ] {
            assert!(text.contains(rule), "no rule {rule}");
            let changed = read(&text.replace(rule, other)).expect("rules");
            assert_ne!(changed.findings(&packages), [], "{other} in place of {rule}");
        }
    }

    #[test]
    fn a_rule_that_is_not_applied_is_refused() {
        let other_level = RULES.replace("wildcards = \"deny\"", "wildcards = \"warn\"");
        let other_key = RULES.replace("[sources]", "[sources]\nprivate = []");
        for rules in [other_level, other_key] {
            assert!(read(&rules).is_err(), "{rules}");
        }
    }
}
