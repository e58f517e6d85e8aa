//! The packages of the workspace and of its dependencies, as `cargo metadata` and `cargo tree` list them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use serde::Deserialize;

use crate::{cmd, wasm_target};

/// Advice if Cargo cannot list the packages.
const MEND: &str = "mend what Cargo reports; if Cargo.lock is out of date, run `cargo metadata` once";

/// Name and version of a package, such as `("serde", "1.0.229")`.
pub(crate) type Name = (String, String);

/// A package, with the manifest fields needed for licences and sources.
#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct Package {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) version: String,
    /// SPDX expression.
    pub(crate) license: Option<String>,
    /// Registry or repository; `None` for the workspace's own packages.
    pub(crate) source: Option<String>,
    pub(crate) authors: Vec<String>,
    pub(crate) description: Option<String>,
    pub(crate) repository: Option<String>,
    pub(crate) manifest_path: PathBuf,
    pub(crate) dependencies: Vec<Requirement>,
}

impl Package {
    /// Name and version.
    pub(crate) fn key(&self) -> Name {
        (self.name.clone(), self.version.clone())
    }
}

/// A dependency in a manifest.
#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct Requirement {
    pub(crate) name: String,
    /// The accepted versions, such as `^1.2`.
    pub(crate) req: String,
    /// The folder of a package of this workspace.
    pub(crate) path: Option<PathBuf>,
}

/// All packages, and their runtime dependencies.
pub(crate) struct Packages {
    pub(crate) all: Vec<Package>,
    needs: BTreeMap<Name, BTreeSet<Name>>,
    checksums: BTreeMap<Name, String>,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
}

#[derive(Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Deserialize)]
struct Node {
    id: String,
    deps: Vec<Edge>,
}

#[derive(Deserialize)]
struct Edge {
    pkg: String,
    dep_kinds: Vec<EdgeKind>,
}

#[derive(Deserialize)]
struct EdgeKind {
    /// `None` for a runtime dependency, else `dev` or `build`.
    kind: Option<String>,
}

#[derive(Deserialize)]
struct Lock {
    package: Vec<Locked>,
}

#[derive(Deserialize)]
struct Locked {
    name: String,
    version: String,
    checksum: Option<String>,
}

impl Packages {
    /// The packages for these compilation targets; `features`, such as `--all-features`, adds optional ones.
    pub(crate) fn for_targets(targets: &[String], features: &[&str]) -> Result<Self> {
        let mut metadata = cmd::cargo(&["metadata", "--quiet", "--locked", "--format-version", "1"]);
        metadata.args(features);
        for target in targets {
            metadata.args(["--filter-platform", target]);
        }
        let Metadata { packages: all, resolve } =
            serde_json::from_str(&cmd::output(&mut metadata, MEND)?).context("`cargo metadata` changed")?;
        let keys: BTreeMap<&str, Name> =
            all.iter().map(|package| (package.id.as_str(), package.key())).collect();
        let needs = resolve.nodes.iter().filter_map(|node| {
            let at_run_time = node.deps.iter().filter(|edge| edge.dep_kinds.iter().any(|k| k.kind.is_none()));
            let needed = at_run_time.filter_map(|edge| keys.get(edge.pkg.as_str()).cloned()).collect();
            Some((keys.get(node.id.as_str())?.clone(), needed))
        });
        let needs = needs.collect();
        let lock: Lock = toml::from_str(&std::fs::read_to_string(cmd::root().join("Cargo.lock"))?)
            .context("Cargo.lock cannot be read")?;
        let checksums = lock
            .package
            .into_iter()
            .filter_map(|package| Some(((package.name, package.version), package.checksum?)))
            .collect();
        Ok(Self { all, needs, checksums })
    }

    /// The package with this name and version.
    pub(crate) fn get(&self, name: &Name) -> Result<&Package> {
        let found = self.all.iter().find(|package| package.name == name.0 && package.version == name.1);
        found.with_context(|| format!("`cargo metadata` does not list {} {}", name.0, name.1))
    }

    /// The runtime dependencies of a package.
    pub(crate) fn needs(&self, name: &Name) -> impl Iterator<Item = &Name> {
        self.needs.get(name).into_iter().flatten()
    }

    /// SHA-256 of the package's archive, hexadecimal; `None` for the workspace's own packages.
    pub(crate) fn checksum(&self, name: &Name) -> Option<&str> {
        self.checksums.get(name).map(String::as_str)
    }
}

/// The packages linked into the native program.
pub(crate) fn inside_program(target: &str) -> Result<BTreeSet<Name>> {
    linked("sightline-server", target)
}

/// The packages linked into the page's WASM.
pub(crate) fn inside_page() -> Result<BTreeSet<Name>> {
    linked("sightline-viewer", wasm_target::TARGET)
}

/// The compilation target of this machine.
pub(crate) fn host() -> Result<String> {
    let version_text = cmd::output(cmd::rustc().arg("-vV"), "install Rust with rustup")?;
    let host = version_text.lines().find_map(|line| line.strip_prefix("host: ")).map(str::to_owned);
    host.context("`rustc -vV` names no host")
}

/// The packages that a build of `package` links, without macros and build scripts, which run only during the build.
fn linked(package: &str, target: &str) -> Result<BTreeSet<Name>> {
    let mut tree = cmd::cargo(&["tree", "--quiet", "--locked", "--package", package, "--target", target]);
    tree.args(["--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"]);
    let listed = cmd::output(&mut tree, MEND)?;
    let names: BTreeSet<Name> = listed.lines().filter_map(name_and_version).collect();
    if names.is_empty() {
        bail!("`cargo tree` lists no package of {package}");
    }
    Ok(names)
}

/// Parses `serde v1.0.229` and `sightline-api v0.1.0 (/path)`.
fn name_and_version(line: &str) -> Option<Name> {
    let mut words = line.split_whitespace();
    Some((words.next()?.to_owned(), words.next()?.strip_prefix('v')?.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_cargo_tree_give_name_and_version() {
        let name = |name: &str, version: &str| Some((name.to_owned(), version.to_owned()));
        assert_eq!(name_and_version("serde v1.0.229 (*)"), name("serde", "1.0.229"));
        assert_eq!(name_and_version("sightline-api v0.1.0 (/a/b)"), name("sightline-api", "0.1.0"));
        assert_eq!(name_and_version(""), None);
    }

    #[test]
    fn program_and_page_contain_their_own_crates() {
        let host = host().expect("a compiler");
        let [program, page] = [inside_program(&host), inside_page()].map(|names| names.expect("packages"));
        let has = |names: &BTreeSet<Name>, name: &str| names.iter().any(|(known, _)| known == name);
        assert!(has(&program, "axum") && !has(&program, "egui") && !has(&program, "serde_derive"));
        assert!(has(&page, "egui") && !has(&page, "axum"));
    }
}
