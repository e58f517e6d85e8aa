//! `cargo xtask test` and `cargo xtask screenshot`: everything built, then tested, in a browser too.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::SystemTime;

use anyhow::{Context, Result, bail};

use crate::{chromium, cmd, serve, web};

/// Builds everything and runs the tests whose names contain `filter`, or all of them.
pub(crate) fn test(filter: Option<&str>) -> Result<()> {
    let browser = prepare()?;
    let mut workspace = cmd::cargo(&["test", "--workspace", "--exclude", "xtask"]);
    name_programs(&mut workspace, &browser);
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
    cmd::say(format!("{} tests passed, {} ignored.", count.passed, count.ignored));
    Ok(())
}

/// Runs the test that takes the README's picture.
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
    cmd::say(format!("The picture is {}.", picture.display()));
    Ok(())
}

/// Builds the page and the programs, and finds the browser.
fn prepare() -> Result<chromium::Browser> {
    let browser = chromium::ensure()?;
    web::web()?;
    serve::build_programs()?;
    Ok(browser)
}

/// Tells the tests where the programs are.
fn name_programs(command: &mut Command, browser: &chromium::Browser) {
    command
        .env("SIGHTLINE_CHROMIUM", &browser.chromium)
        .env("SIGHTLINE_CHROMEDRIVER", &browser.chromedriver)
        .env("SIGHTLINE_BIN", cmd::sightline_binary());
}

/// How many tests ended in which way.
#[derive(Default, Debug, PartialEq)]
struct Count {
    passed: u64,
    ignored: u64,
}

impl Count {
    fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.ignored += other.ignored;
    }

    /// Reads a summary line such as `test result: ok. 3 passed; 0 failed; 1 ignored; …`.
    fn from_summary(line: &str) -> Option<Self> {
        let rest = line.strip_prefix("test result: ")?;
        let number_of = |word: &str| {
            let before = rest.split(word).next()?.trim_end();
            before.rsplit(|letter: char| !letter.is_ascii_digit()).next()?.parse().ok()
        };
        Some(Self { passed: number_of("passed")?, ignored: number_of("ignored")? })
    }
}

/// Runs `cargo test`, showing its output as it comes, and counts what ran.
///
/// A filter that matches nothing ends well for Cargo; counting is what keeps a misspelt one from passing.
fn run_and_count(command: &mut Command) -> Result<Count> {
    let mend = "mend the tests reported above";
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("cargo cannot start; {mend}"))?;
    let mut count = Count::default();
    let output = child.stdout.take().context("cargo's output cannot be read; run the command again")?;
    for line in BufReader::new(output).split(b'\n') {
        let line = line.context("cargo's output cannot be read; run the command again")?;
        let line = String::from_utf8_lossy(&line);
        cmd::say(&line);
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
    fn a_summary_line_gives_its_numbers() {
        let line =
            "test result: ok. 12 passed; 0 failed; 3 ignored; 0 measured; 5 filtered out; finished in 0.00s";
        assert_eq!(Count::from_summary(line), Some(Count { passed: 12, ignored: 3 }));
        assert_eq!(Count::from_summary("test some::name ... ok"), None);
    }
}
