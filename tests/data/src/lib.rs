//! Finds the recorded data sets, which are not in the repository, for the tests of every crate.
//!
//! `$SIGHTLINE_DATA` is their folder; by default `../shared/data` beside the workspace. A test whose data are missing
//! returns early. It is recorded in the file `$SIGHTLINE_LEFT_OUT`, one line per test, from which `cargo xtask test` lists
//! the skipped tests and subtracts them from those that passed.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Environment variable: the folder of the data sets.
const FOLDER: &str = "SIGHTLINE_DATA";

/// Environment variable: the file that receives the names of the tests without data.
const LEFT_OUT: &str = "SIGHTLINE_LEFT_OUT";

/// Returns the file or folder `name` of the data sets, or `None` if it is missing.
///
/// `None` records the calling test as skipped; `purpose` names the comparison that was left out, for the test's output.
pub fn recorded(name: &str, purpose: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = std::env::var_os(FOLDER).map_or_else(beside, PathBuf::from).join(name);
    if path.exists() {
        return Some(path);
    }
    println!("left out: {purpose} needs {} (set {FOLDER} to the folder of the data sets)", path.display());
    if let Some(file) = std::env::var_os(LEFT_OUT) {
        note(Path::new(&file), &test_name(purpose));
    }
    None
}

/// The crate and the path of the running test, such as `sightline-core::sift::tests::repeats`.
///
/// The test harness names each test's thread after the test, except when it runs all tests on the main thread.
fn test_name(purpose: &str) -> String {
    let package = std::env::var("CARGO_PKG_NAME").unwrap_or_default();
    let thread = std::thread::current();
    let test = thread.name().filter(|name| *name != "main").unwrap_or(purpose);
    format!("{package}::{test}")
}

/// Appends one line in one write, so that lines of concurrent tests do not mix.
///
/// # Panics
/// If the file cannot be written: the test would count as passed.
fn note(file: &Path, test: &str) {
    let appended = OpenOptions::new()
        .create(true)
        .append(true)
        .open(file)
        .and_then(|mut file| file.write_all(format!("{test}\n").as_bytes()));
    if let Err(error) = appended {
        panic!("{} cannot be written: {error}", file.display());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_is_noted_by_crate_and_path() {
        assert_eq!(test_name("nothing"), "sightline-testdata::tests::a_test_is_noted_by_crate_and_path");
    }

    #[test]
    fn notes_are_appended_one_per_line() {
        let file = std::env::temp_dir().join(format!("sightline-left-out-{}", std::process::id()));
        note(&file, "a::b");
        note(&file, "c::d");
        let noted = std::fs::read_to_string(&file);
        std::fs::remove_file(&file).unwrap_or_default();
        assert_eq!(noted.ok().as_deref(), Some("a::b\nc::d\n"));
    }
}
