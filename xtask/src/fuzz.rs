//! `cargo xtask fuzz`: searches for inputs that make a parser fail, with libFuzzer on the stable compiler.
//!
//! The engine needs to know which branches an input reaches. The compiler inserts counters into the workspace's own crates;
//! the dependencies are compiled as for everything else. Cargo compiles the workspace's crates through this program
//! ([`as_compiler`]), which adds the options.

use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::Mutex;

use anyhow::{Context, Result, bail};

use crate::{apt, cmd};

/// Environment variable that makes this program act as the compiler.
const AS_COMPILER: &str = "SIGHTLINE_FUZZ_COMPILER";

/// Compiler options that insert counters of branches, and calls that report comparisons to the engine.
const INSTRUMENTS: [&str; 6] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Ccodegen-units=1",
];

/// Crates that run during the build, when there is no engine to link with.
const BUILD_CRATES: [&str; 2] = ["build_script_build", "sightline_sources"];

/// Maximum time for one input, s.
const INPUT_SECONDS_MAX: u32 = 5;
/// Maximum memory of a parser, MiB.
const MEMORY_MIB_MAX: u32 = 2048;
/// Maximum length of an input, bytes.
const INPUT_BYTES_MAX: u32 = 1 << 16;

/// Compiles a crate of the workspace with counters, if Cargo runs this program as its compiler.
pub(crate) fn as_compiler() -> Option<ExitCode> {
    std::env::var_os(AS_COMPILER)?;
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let (compiler, arguments) = arguments.split_first()?;
    let mut command = Command::new(compiler);
    command.args(arguments);
    let has = |text: &str| arguments.iter().any(|argument| argument == text);
    if !has("proc-macro") && has("--crate-name") && !BUILD_CRATES.iter().any(|name| has(name)) {
        command.args(INSTRUMENTS);
    }
    let is_compiled = command.status().is_ok_and(|status| status.success());
    Some(if is_compiled { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The outcome of the search in one parser.
struct Outcome {
    target: String,
    executions: String,
    branches: String,
    inputs: usize,
    peak_mib: String,
    slowest_s: String,
    /// The input that made the parser fail; `None` if none was found.
    found: Option<PathBuf>,
}

/// Searches for `minutes` in the parser of this name, or in all parsers, as many at a time as there are processors.
///
/// The interesting inputs stay in `target/fuzz` for the next search.
pub(crate) fn fuzz(target: Option<&str>, minutes: f64) -> Result<()> {
    let all = targets()?;
    let chosen: Vec<String> = match target {
        None => all,
        Some(name) if all.iter().any(|known| known == name) => vec![name.to_owned()],
        Some(name) => bail!("there is no parser {name}; choose one of {}", all.join(", ")),
    };
    let program = build()?;
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let queue = Mutex::new(chosen.into_iter());
    let work = || -> Result<Vec<Outcome>> {
        let next = || queue.lock().ok()?.next();
        std::iter::from_fn(next).map(|name| search(&program, &name, minutes)).collect()
    };
    let outcomes = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..processors).map(|_| scope.spawn(work)).collect();
        let ends =
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| bail!("a search panicked")));
        ends.collect::<Result<Vec<_>>>()
    })?;
    report(outcomes.into_iter().flatten().collect())
}

/// The parsers; each has a folder of inputs.
fn targets() -> Result<Vec<String>> {
    let folder = corpus();
    let entries =
        std::fs::read_dir(&folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut names: Vec<_> =
        entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    Ok(names)
}

/// The folder of inputs in the repository.
fn corpus() -> PathBuf {
    cmd::root().join("tests/fuzz/corpus")
}

/// Finds a C++ compiler for the engine; on Debian, installs it if missing.
fn ensure_cxx() -> Result<()> {
    let is_there =
        || std::env::var_os("CXX").is_some() || cmd::find_in_path(&["c++", "g++", "clang++"]).is_some();
    if is_there() || apt::install("The engine of the search is written in C++", &["g++"])? && is_there() {
        return Ok(());
    }
    bail!("the engine of the search needs a C++ compiler: install g++ or clang, or set CXX")
}

/// Builds the search program; returns its path.
fn build() -> Result<PathBuf> {
    ensure_cxx()?;
    let mut cargo = cmd::cargo(&["build", "--package", "sightline-fuzz", "--features", "libfuzzer"]);
    cargo.env("RUSTC_WORKSPACE_WRAPPER", std::env::current_exe()?).env(AS_COMPILER, "1");
    // Incremental builds do not detect the changed options.
    cargo.env("CARGO_INCREMENTAL", "0");
    cmd::run(&mut cargo, "mend what the compiler reports above")?;
    let program =
        cmd::target_dir().join("debug").join(format!("sightline-fuzz{}", std::env::consts::EXE_SUFFIX));
    Ok(program)
}

fn search(program: &Path, target: &str, minutes: f64) -> Result<Outcome> {
    let folder = cmd::target_dir().join("fuzz").join(target);
    let learned = folder.join("inputs");
    let found = folder.join("found");
    for folder in [&learned, &found] {
        std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    }
    let log = folder.join("log.txt");
    cmd::print_line(format!("{target}: {minutes} min, log {}", log.display()));
    let written = File::create(&log).with_context(|| format!("{} cannot be written", log.display()))?;
    let began = std::time::SystemTime::now();
    let status = cmd::program(program)
        .arg(format!("-max_total_time={}", (minutes * 60.0).ceil()))
        .arg(format!("-timeout={INPUT_SECONDS_MAX}"))
        .arg(format!("-rss_limit_mb={MEMORY_MIB_MAX}"))
        .arg(format!("-max_len={INPUT_BYTES_MAX}"))
        .arg(format!("-artifact_prefix={}/", found.display()))
        .args(["-print_final_stats=1", "-use_value_profile=1"])
        .args([&learned, &corpus().join(target)])
        .env("SIGHTLINE_FUZZ_TARGET", target)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(written)
        .status()
        .with_context(|| format!("{} cannot be started", program.display()))?;
    let text = String::from_utf8_lossy(&std::fs::read(&log)?).into_owned();
    let stat = |name: &str| stat(&text, name);
    Ok(Outcome {
        target: target.to_owned(),
        executions: stat("number_of_executed_units"),
        branches: branches(&text),
        inputs: std::fs::read_dir(&learned)?.count(),
        peak_mib: stat("peak_rss_mb"),
        slowest_s: stat("slowest_unit_time_sec"),
        found: if status.success() { None } else { Some(newest(&found, began).unwrap_or(log)) },
    })
}

/// A number from the summary at the end of a log.
fn stat(log: &str, name: &str) -> String {
    let line = log.lines().rev().find_map(|line| line.strip_prefix("stat::")?.strip_prefix(name));
    line.map_or_else(|| "–".to_owned(), |rest| rest.trim_start_matches(':').trim().to_owned())
}

/// The last number of branches in a log: `#1024 NEW cov: 345 ft: 1200 …`.
fn branches(log: &str) -> String {
    let number = |line: &str| line.split_once(" cov: ")?.1.split_whitespace().next().map(str::to_owned);
    log.lines().rev().find_map(number).unwrap_or_else(|| "–".to_owned())
}

/// The newest file of a folder modified after `since`.
fn newest(folder: &Path, since: std::time::SystemTime) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let dated = entries.filter_map(|entry| Some((entry.metadata().ok()?.modified().ok()?, entry.path())));
    dated.filter(|(time, _)| *time >= since).max().map(|(_, path)| path)
}

/// Prints the table; fails if an input made a parser fail.
fn report(mut outcomes: Vec<Outcome>) -> Result<()> {
    outcomes.sort_by(|a, b| a.target.cmp(&b.target));
    cmd::print_line(format!(
        "\n{:<20} {:>12} {:>9} {:>7} {:>9} {:>11}  outcome",
        "parser", "executions", "branches", "inputs", "peak MiB", "slowest, s"
    ));
    for outcome in &outcomes {
        let end =
            outcome.found.as_ref().map_or_else(|| "no failure".to_owned(), |path| path.display().to_string());
        let Outcome { target, executions, branches, inputs, peak_mib, slowest_s, .. } = outcome;
        cmd::print_line(format!(
            "{target:<20} {executions:>12} {branches:>9} {inputs:>7} {peak_mib:>9} {slowest_s:>11}  {end}"
        ));
    }
    let broken = outcomes.iter().filter(|outcome| outcome.found.is_some()).count();
    if broken > 0 {
        bail!(
            "{broken} parsers failed: mend them, and copy the inputs to tests/fuzz/corpus/PARSER, which the tests replay"
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_from_a_log() {
        let log = "#2\tINITED cov: 12 ft: 13\n#9\tNEW    cov: 345 ft: 400 corp: 3/9b\nDone 9 runs\n\
                   stat::number_of_executed_units: 9\nstat::peak_rss_mb:              61\n";
        assert_eq!(branches(log), "345");
        assert_eq!(
            (stat(log, "number_of_executed_units"), stat(log, "peak_rss_mb")),
            ("9".into(), "61".into())
        );
        assert_eq!((branches(""), stat("", "peak_rss_mb")), ("–".into(), "–".into()));
    }

    #[test]
    fn an_unknown_parser_is_refused_with_the_known_ones() {
        let refused = fuzz(Some("no such parser"), 1.0).expect_err("refused").to_string();
        assert!(refused.contains("no such parser") && refused.contains("pds3, png"), "{refused}");
    }
}
