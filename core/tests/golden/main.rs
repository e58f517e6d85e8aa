//! Golden test: compares the values of every tracking stage with the lists recorded in `lists/`.
//!
//! Runs with `cargo xtask golden` and with the test suite; `cargo xtask golden --update` records the lists again. Each list
//! covers one pair of drive and configuration. `extract*.rs` produce a list, `compare.rs` defines when two are equal.
//! Units are suffixes of the names (`_m`, `_px`, `_rad`); `position_rover` is in m, in the rover frame of the stop.

mod arrays;
mod cases;
mod compare;
mod cpu;
mod drives;
mod extract;
mod extract_features;
mod extract_shape;
mod extract_template;
mod sheet;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::cases::{CASES, Case};
use crate::compare::{Difference, differences};
use crate::drives::{Drive, DriveName};
use crate::sheet::List;

/// Maximum number of differences printed per list.
const SHOWN: usize = 20;

/// The result of one case.
enum Outcome {
    /// The list is unchanged.
    Equal,
    /// The list was recorded.
    Written,
    /// The list differs; contains the report.
    Different(String),
}

#[test]
fn golden_lists_are_unchanged() {
    let is_update = std::env::var("SIGHTLINE_GOLDEN").is_ok_and(|value| value == "update");
    let cpu = cpu::description();
    let root = tempfile::tempdir().expect("a folder for the drives");
    let (mut compared, mut left_out, mut different) = (0, 0, Vec::new());
    for name in DriveName::ALL {
        let cases: Vec<&Case> = CASES.iter().filter(|case| case.drive == name).collect();
        let drive = match name.open(root.path()) {
            Ok(drive) => drive,
            Err(missing) => {
                for case in cases {
                    let data = missing.display();
                    say(&format!("golden: left out: {} needs {data} (set SIGHTLINE_DATA)", case.name));
                    left_out += 1;
                }
                continue;
            }
        };
        let outcomes: Vec<_> =
            cases.par_iter().map(|case| (case.name, outcome(case, &drive, &cpu, is_update))).collect();
        for (case, outcome) in outcomes {
            match outcome {
                Outcome::Equal => compared += 1,
                Outcome::Written => say(&format!("golden: written: {case}")),
                Outcome::Different(report) => different.push(report),
            }
        }
    }
    say(&format!("golden: {compared} lists equal, {} different, {left_out} left out", different.len()));
    assert!(
        different.is_empty(),
        "\n{}\nIf these changes are intended, run `cargo xtask golden --update` and commit core/tests/golden/lists.",
        different.join("\n")
    );
}

/// Prints a line that the test harness does not capture.
fn say(line: &str) {
    writeln!(std::io::stdout(), "{line}").expect("standard output is open");
}

fn outcome(case: &Case, drive: &Drive, cpu: &str, is_update: bool) -> Outcome {
    let actual = case.compute(drive).finish(cpu);
    let path = path(case);
    if is_update {
        fs::create_dir_all(lists()).expect("the folder of the lists");
        fs::write(&path, actual.to_text(&case.title())).expect("a golden list that can be written");
        return Outcome::Written;
    }
    let Ok(text) = fs::read_to_string(&path) else {
        return Outcome::Different(format!("{}: there is no {}", case.name, path.display()));
    };
    let expected = match List::from_text(&text) {
        Ok(expected) => expected,
        Err(problem) => return Outcome::Different(format!("{}: {problem}", path.display())),
    };
    let found = differences(&expected, &actual);
    if found.is_empty() { Outcome::Equal } else { Outcome::Different(report(case, &expected, cpu, &found)) }
}

fn report(case: &Case, expected: &List, cpu: &str, found: &[Difference]) -> String {
    let how = if expected.cpu == cpu {
        "compared bit for bit".to_owned()
    } else {
        format!("compared within 1e-5: recorded on {}, this is {cpu}", expected.cpu)
    };
    let mut text = format!("{}: {} lines differ ({how})\n", case.name, found.len());
    for difference in found.iter().take(SHOWN) {
        let shown = |value: &Option<String>| value.clone().unwrap_or_else(|| "(no such line)".into());
        let (expected, actual) = (shown(&difference.expected), shown(&difference.actual));
        text += &format!("  {}\n    expected {expected}\n    actual   {actual}\n", difference.name);
    }
    if let Some(more @ 1..) = found.len().checked_sub(SHOWN) {
        text += &format!("  and {more} more\n");
    }
    text
}

fn lists() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/lists")
}

fn path(case: &Case) -> PathBuf {
    lists().join(format!("{}.txt", case.name))
}

#[test]
fn every_list_belongs_to_a_case() {
    for entry in fs::read_dir(lists()).expect("the folder of the lists") {
        let path = entry.expect("an entry of the folder").path();
        assert!(CASES.iter().any(|case| self::path(case) == path), "{} belongs to no case", path.display());
    }
}
