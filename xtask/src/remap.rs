//! Makes builds independent of their folders and of the time.
//!
//! Messages of panics and logs contain the paths of sources. The compilers replace the folders of this machine with fixed
//! names:
//!
//! | folder | name |
//! |---|---|
//! | the workspace | `/sightline` |
//! | Cargo's home, with the sources of the dependencies | `/cargo` |
//! | the target folder, with the sources that build scripts write | `/target` |
//! | the sources of the standard library, if installed | `/rustc/COMMIT` |

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::cmd;

/// A folder, and the name that replaces it.
type Renamed = (PathBuf, String);

/// Options that fix the compilation time in C sources that contain it (mimalloc's).
const WITHOUT_TIME: [&str; 3] =
    ["-Wno-builtin-macro-redefined", "-D__DATE__=\"none\"", "-D__TIME__=\"none\""];

/// Configures a Cargo command that builds into `target_dir` to omit this machine's folders from its results.
///
/// The options replace those of `RUSTFLAGS` and of Cargo's configuration.
pub(crate) fn apply(cargo: &mut Command, target_dir: &Path) -> Result<()> {
    let renamed = folders(target_dir)?;
    let options: Vec<_> = renamed.iter().map(|pair| option("--remap-path-prefix", pair)).collect();
    cargo.env("CARGO_ENCODED_RUSTFLAGS", options.join("\u{1f}"));
    // `CFLAGS` is separated by spaces.
    let of_c = renamed.iter().map(|pair| option("-ffile-prefix-map", pair));
    let of_c = of_c.filter(|option| !option.contains(' ')).chain(WITHOUT_TIME.map(str::to_owned));
    cargo.env("CFLAGS", of_c.collect::<Vec<_>>().join(" "));
    Ok(())
}

fn option(name: &str, (folder, named): &Renamed) -> String {
    format!("{name}={}={named}", folder.display())
}

/// The folders; the compiler uses the last one that contains a path.
fn folders(target_dir: &Path) -> Result<Vec<Renamed>> {
    let mend = "install Rust with rustup";
    let sysroot = cmd::output(cmd::rustc().args(["--print", "sysroot"]), mend)?;
    let version_text = cmd::output(cmd::rustc().arg("-vV"), mend)?;
    let commit =
        version_text.lines().find_map(|line| line.strip_prefix("commit-hash: ")).unwrap_or("unknown");
    Ok(vec![
        (cmd::root(), "/sightline".to_owned()),
        (cargo_home()?, "/cargo".to_owned()),
        (target_dir.to_owned(), "/target".to_owned()),
        (Path::new(sysroot.trim()).join("lib/rustlib/src/rust"), format!("/rustc/{commit}")),
    ])
}

fn cargo_home() -> Result<PathBuf> {
    let named = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = named.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    home.context("Cargo's home cannot be found: set CARGO_HOME")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_folder_has_a_name_of_its_own() {
        let mut cargo = Command::new("cargo");
        apply(&mut cargo, Path::new("/a b/target")).expect("folders");
        let value = |name: &str| {
            let found = cargo.get_envs().find(|(key, _)| *key == name)?.1?;
            Some(found.to_string_lossy().into_owned())
        };
        let options = value("CARGO_ENCODED_RUSTFLAGS").expect("options");
        let options: Vec<_> = options.split('\u{1f}').collect();
        let workspace = format!("--remap-path-prefix={}=/sightline", cmd::root().display());
        assert_eq!((options.len(), options[0]), (4, workspace.as_str()));
        assert_eq!(options[2], "--remap-path-prefix=/a b/target=/target");
        assert!(options[3].contains("=/rustc/") && !options[3].ends_with("unknown"));
        let of_c = value("CFLAGS").expect("options");
        assert!(!of_c.contains("/a b") && of_c.ends_with("-D__TIME__=\"none\""), "{of_c}");
    }
}
