//! Passes the program's version to the compiler: the package version with `git describe`. Without a repository of its own,
//! as in a source archive, a digest of the sources replaces the commit.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use sightline_sources::{digest, emit, with_dependencies};

fn main() -> io::Result<()> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources = with_dependencies(package, &package.join("../core"))?;
    emit("SIGHTLINE_SOURCES", &sources)?;
    println!("cargo:rerun-if-changed=build.rs");
    let commit = match described(package) {
        Some(commit) => commit,
        None => format!("sources {}", &digest(&sources)?[..12]),
    };
    println!("cargo:rustc-env=SIGHTLINE_VERSION={} ({commit})", env!("CARGO_PKG_VERSION"));
    Ok(())
}

/// `git describe` of the commit, or `None` if the repository is not the program's own. Makes Cargo rerun the script when
/// HEAD, the branch or a tag changes.
fn described(package: &Path) -> Option<String> {
    let root = PathBuf::from(git(package, &["rev-parse", "--show-toplevel"])?).canonicalize().ok()?;
    if root != package.parent()?.canonicalize().ok()? {
        return None;
    }
    let branch = git(package, &["rev-parse", "--symbolic-full-name", "HEAD"]).unwrap_or_default();
    for name in ["HEAD", "packed-refs", "refs/tags", branch.as_str()] {
        let path = package.join(git(package, &["rev-parse", "--git-path", name])?);
        // Cargo runs the script each time when a watched file is missing.
        if path.exists() {
            println!("cargo:rerun-if-changed={}", path.display());
        }
    }
    git(package, &["describe", "--always", "--dirty", "--tags", "--abbrev=12"])
}

/// Output of a Git command, or `None` without Git or a repository.
fn git(folder: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").arg("-C").arg(folder).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned()).filter(|text| !text.is_empty())
}
