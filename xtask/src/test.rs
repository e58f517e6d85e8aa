//! `cargo xtask test` and `cargo xtask screenshot`: builds everything, then runs the tests, including those in a browser.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::SystemTime;

use anyhow::{Context, Result, bail};

use crate::build::{self, Build};
use crate::{chromium, cmd, serve};

/// Builds everything and runs the tests whose names contain `filter`, or all of them.
pub(crate) fn test(filter: Option<&str>) -> Result<()> {
    let browser = prepare()?;
    build::run(vec![test_programs()])?;
    let left_out = cmd::target_dir().join("left-out-tests");
    std::fs::write(&left_out, "").with_context(|| format!("{} cannot be written", left_out.display()))?;
    let mut workspace = cmd::cargo(&["test", "--workspace", "--exclude", "xtask"]);
    name_programs(&mut workspace, &browser);
    workspace.env("SIGHTLINE_LEFT_OUT", &left_out);
    let mut own = cmd::cargo(&["test", "--package", "xtask"]);
    let mut count = Count::default();
    for command in [&mut workspace, &mut own] {
        command.args(filter);
        count.add(run_and_count(command)?);
    }
    if count.passed == 0 {
        bail!(
            "no test ran: no test's name contains {:?}; leave the filter out to run all",
            filter.unwrap_or("")
        );
    }
    let left_out = read_left_out(&left_out)?;
    for line in closing_lines(&count, &left_out) {
        cmd::print_line(line);
    }
    Ok(())
}

/// The build of all test programs.
fn test_programs() -> Build {
    Build {
        name: "tests",
        command: cmd::cargo(&["test", "--no-run", "--workspace", "--exclude", "xtask"]),
        tree: vec!["--workspace", "--exclude", "xtask", "--edges", "normal,build,dev"],
        then: || Ok(()),
    }
}

/// The tests that returned early because their data are missing; `sightline-testdata` writes one line per test.
fn read_left_out(file: &Path) -> Result<BTreeSet<String>> {
    let noted =
        std::fs::read_to_string(file).with_context(|| format!("{} cannot be read", file.display()))?;
    Ok(noted.lines().map(str::to_owned).collect())
}

/// The closing lines: tests without data, which the test harness counts as passed, and the totals.
fn closing_lines(count: &Count, left_out: &BTreeSet<String>) -> Vec<String> {
    let number = left_out.len() as u64;
    let mut lines = Vec::new();
    if number > 0 {
        lines.push(format!("Left out, data missing: {number} tests (set SIGHTLINE_DATA to the data sets):"));
        lines.extend(left_out.iter().map(|test| format!("  {test}")));
    }
    let passed = count.passed.saturating_sub(number);
    let missing = if number > 0 { format!(", {number} left out") } else { String::new() };
    lines.push(format!("{passed} tests passed, {} ignored{missing}.", count.ignored));
    lines
}

/// Runs the test that takes the screenshot for the README.
pub(crate) fn screenshot() -> Result<()> {
    let browser = prepare()?;
    let picture = cmd::root().join("docs").join("sightline.png");
    std::fs::create_dir_all(cmd::root().join("docs")).context("the folder docs cannot be made")?;
    let mut command =
        cmd::cargo(&["test", "--workspace", "--exclude", "xtask", "--test", "all", "screenshot"]);
    name_programs(&mut command, &browser);
    command.env("SIGHTLINE_SCREENSHOT", &picture);
    let start = SystemTime::now();
    run_and_count(&mut command)?;
    let taken = std::fs::metadata(&picture).and_then(|file| file.modified());
    if !taken.is_ok_and(|taken| taken >= start) {
        bail!(
            "no picture was taken: a test in tests/all named `…screenshot…` must write SIGHTLINE_SCREENSHOT's file"
        );
    }
    cmd::print_line(format!("The picture is {}.", picture.display()));
    Ok(())
}

/// Builds the page and the programs, and finds the browser.
fn prepare() -> Result<chromium::Browser> {
    let browser = chromium::ensure()?;
    serve::build_all()?;
    Ok(browser)
}

/// Sets the paths of the programs for the tests.
fn name_programs(command: &mut Command, browser: &chromium::Browser) {
    command
        .env("SIGHTLINE_CHROMIUM", &browser.chromium)
        .env("SIGHTLINE_CHROMEDRIVER", &browser.chromedriver)
        .env("SIGHTLINE_BIN", cmd::sightline_binary());
}

/// Numbers of passed and ignored tests.
#[derive(Default, Debug, PartialEq)]
pub(crate) struct Count {
    passed: u64,
    ignored: u64,
}

impl Count {
    fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.ignored += other.ignored;
    }

    /// The numbers as text.
    pub(crate) fn shown(&self) -> String {
        format!("{} tests passed, {} ignored.", self.passed, self.ignored)
    }

    /// Parses a summary line such as `test result: ok. 3 passed; 0 failed; 1 ignored; …`.
    fn from_summary(line: &str) -> Option<Self> {
        let rest = line.strip_prefix("test result: ")?;
        let number_of = |word: &str| {
            let before = rest.split(word).next()?.trim_end();
            before.rsplit(|letter: char| !letter.is_ascii_digit()).next()?.parse().ok()
        };
        Some(Self { passed: number_of("passed")?, ignored: number_of("ignored")? })
    }
}

/// Runs `cargo test`, forwards its output, and counts the tests.
///
/// Cargo succeeds if a filter matches no test; the count reveals a misspelt one.
pub(crate) fn run_and_count(command: &mut Command) -> Result<Count> {
    run_and_read(command, |_| ())
}

/// The same, calling `read` for each line.
pub(crate) fn run_and_read(command: &mut Command, mut read: impl FnMut(&str)) -> Result<Count> {
    let mend = "mend the tests reported above";
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("cargo cannot start; {mend}"))?;
    let mut count = Count::default();
    let output = child.stdout.take().context("cargo's output cannot be read; run the command again")?;
    for line in BufReader::new(output).split(b'\n') {
        let line = line.context("cargo's output cannot be read; run the command again")?;
        let line = String::from_utf8_lossy(&line);
        cmd::print_line(&line);
        read(&line);
        if let Some(summary) = Count::from_summary(&line) {
            count.add(summary);
        }
    }
    let status = child.wait().context("cargo cannot be waited for; run the command again")?;
    if !status.success() {
        bail!("`cargo test` failed ({status}); {mend}");
    }
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_without_data_do_not_count_as_passed() {
        let count = Count { passed: 12, ignored: 3 };
        assert_eq!(closing_lines(&count, &BTreeSet::new()), ["12 tests passed, 3 ignored."]);
        let left_out = ["a::b".to_owned(), "c::d".to_owned()].into();
        let lines = closing_lines(&count, &left_out);
        assert_eq!(lines[1..], ["  a::b", "  c::d", "10 tests passed, 3 ignored, 2 left out."]);
    }

    #[test]
    fn a_summary_line_gives_its_numbers() {
        let line =
            "test result: ok. 12 passed; 0 failed; 3 ignored; 0 measured; 5 filtered out; finished in 0.00s";
        assert_eq!(Count::from_summary(line), Some(Count { passed: 12, ignored: 3 }));
        assert_eq!(Count::from_summary("test some::name ... ok"), None);
    }
}
