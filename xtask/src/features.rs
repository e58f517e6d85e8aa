//! Compares the features of the server's dependencies when compiled alone and in the whole workspace.

use std::collections::BTreeSet;

use anyhow::{Result, bail};

use crate::cmd;

/// Fails if `cargo test` would compile a dependency of the server with other features than `cargo xtask serve`.
pub(crate) fn check() -> Result<()> {
    // Cargo compiles dependencies of build scripts and macros separately, with their own features.
    let server = tree(&["--package", "sightline-server", "--edges", "normal,no-proc-macro"])?;
    let workspace = tree(&["--workspace", "--exclude", "xtask", "--edges", "normal,dev,no-proc-macro"])?;
    let differing: Vec<_> = missing(&server, &workspace);
    if !differing.is_empty() {
        bail!(
            "`cargo test` compiles dependencies of the server again, with other features: give these in \
             features/Cargo.toml the features that `cargo tree --workspace -e features` shows:\n{}",
            differing.join("\n")
        );
    }
    cmd::print_line("The server and the tests share their compiled dependencies.");
    Ok(())
}

/// The packages and features that `cargo tree` lists.
fn tree(selection: &[&str]) -> Result<BTreeSet<String>> {
    let mut tree = cmd::cargo(&["tree", "--quiet", "--prefix", "none", "--format", "{p} [{f}]"]);
    let listed = cmd::output(tree.args(selection), "mend what `cargo tree` reports")?;
    Ok(listed.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect())
}

/// The lines of `part` that are missing in `whole`.
fn missing(part: &BTreeSet<String>, whole: &BTreeSet<String>) -> Vec<String> {
    part.difference(whole).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_with_other_features_differs() {
        let set = |lines: &[&str]| lines.iter().map(|&line| line.to_owned()).collect::<BTreeSet<_>>();
        let whole = set(&["ahash v0.8.12 [serde,std]", "log v0.4.35 []", "png v0.18.1 []"]);
        let part = set(&["ahash v0.8.12 [std]", "log v0.4.35 []"]);
        assert_eq!(missing(&part, &whole), ["ahash v0.8.12 [std]"]);
    }
}
