//! Runs several Cargo builds concurrently, with one line for their progress and the remaining time.
//!
//! The total is the number of packages that `cargo tree` lists; Cargo's JSON messages report each finished crate.
//! The remaining time is the cost of the missing crates divided by the rate so far, with measured costs for the largest
//! crates (`costs.rs`) because these come last. The initial rate is one second of processor time per second and core. The
//! rate covers the time until the last finished crate, so that waiting for another build does not lower it. All builds share
//! one pool of jobs, one job per core.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, IsTerminal, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use jobserver::Client;

use crate::{cmd, costs};

/// One Cargo build.
pub(crate) struct Build {
    /// Name of the build, as shown to the user.
    pub(crate) name: &'static str,
    /// The Cargo command; [`run`] adds the options for messages.
    pub(crate) command: Command,
    /// Arguments of `cargo tree` that select the packages of the build.
    pub(crate) tree: Vec<&'static str>,
    /// Runs after a successful build, while the other builds continue.
    pub(crate) then: fn() -> Result<()>,
}

/// Runs the builds concurrently and returns the first error.
pub(crate) fn run(builds: Vec<Build>) -> Result<()> {
    let mut progress = Progress::new(&builds)?;
    // Every Cargo process owns one job in addition to those of the pool.
    let cores = std::thread::available_parallelism().map_or(2, usize::from);
    let pool = Client::new(cores.saturating_sub(builds.len())).context("no pool of jobs can be made")?;
    let (sender, finished) = mpsc::channel();
    std::thread::scope(|scope| {
        let running: Vec<_> = (builds.into_iter().enumerate())
            .map(|(index, build)| {
                let (sender, pool) = (sender.clone(), &pool);
                scope.spawn(move || {
                    let done = one(index, build, pool, &sender);
                    // Returns the job of this build to the pool.
                    pool.release_raw().unwrap_or_default();
                    done
                })
            })
            .collect();
        drop(sender);
        progress.follow(&finished);
        running.into_iter().try_for_each(|build| build.join().unwrap_or_else(|_| bail!("a build panicked")))
    })
}

/// Runs one build and sends its finished crates.
fn one(index: usize, mut build: Build, pool: &Client, sender: &Sender<(usize, Unit)>) -> Result<()> {
    let mend = "mend what the compiler reports above";
    build.command.args(["--quiet", "--message-format=json-render-diagnostics"]);
    pool.configure(&mut build.command);
    let mut child: Child = (build.command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn())
        .with_context(|| format!("cargo cannot start; {mend}"))?;
    let output = child.stdout.take().context("cargo's output cannot be read; run the command again")?;
    for line in BufReader::new(output).lines() {
        let line = line.context("cargo's output cannot be read; run the command again")?;
        if let Some(unit) = Unit::from_message(&line) {
            // The receiver outlives this thread.
            sender.send((index, unit)).unwrap_or_default();
        }
    }
    let status = child.wait().context("cargo cannot be waited for; run the command again")?;
    if !status.success() {
        bail!("building the {} failed ({status}); {mend}", build.name);
    }
    (build.then)()
}

/// A finished crate.
#[derive(Debug, PartialEq)]
struct Unit {
    /// Name and version, such as `serde 1.0.229`.
    package: String,
    /// Whether it was compiled by an earlier build.
    is_fresh: bool,
}

impl Unit {
    /// Reads one line of Cargo's messages; `None` if it reports no finished crate.
    fn from_message(line: &str) -> Option<Self> {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        let is_script = message["target"]["kind"][0] == "custom-build";
        if message["reason"] != "compiler-artifact" || is_script {
            return None;
        }
        let package = package_of_id(message["package_id"].as_str()?)?;
        Some(Self { package, is_fresh: message["fresh"] == true })
    }
}

/// `serde 1.0.229` of `registry+https://…#serde@1.0.229`, `xtask 0.1.0` of `path+file:///…/xtask#0.1.0`.
fn package_of_id(id: &str) -> Option<String> {
    let (source, name) = id.rsplit_once('#')?;
    let (name, version) = match name.split_once('@') {
        Some(both) => both,
        None => (source.rsplit('/').next()?, name),
    };
    Some(format!("{name} {version}"))
}

/// `serde 1.0.229` of a line `serde v1.0.229 (proc-macro)` of `cargo tree`.
fn package_of_tree(line: &str) -> Option<String> {
    let mut words = line.split_whitespace();
    Some(format!("{} {}", words.next()?, words.next()?.strip_prefix('v')?))
}

/// Weight of the assumed rate in the estimate, s of processor time.
const ASSUMED_S: f64 = 60.0;

/// The progress of all builds: missing crates, and the rate of compilation.
struct Progress {
    names: Vec<&'static str>,
    /// Cost of each missing crate by build and package, s of processor time.
    missing: HashMap<(usize, String), f64>,
    total: usize,
    /// Total cost of the compiled crates, s of processor time.
    compiled_s: f64,
    started: Instant,
    /// Time from the start to the first reported crate.
    waited: Option<Duration>,
    /// Time from the start to the last compiled crate.
    last_finish: Duration,
    cores: f64,
    terminal: bool,
}

impl Progress {
    fn new(builds: &[Build]) -> Result<Self> {
        let mut missing = HashMap::new();
        for (index, build) in builds.iter().enumerate() {
            let mut tree = cmd::cargo(&["tree", "--quiet", "--prefix", "none", "--format", "{p}"]);
            let listed = cmd::output(tree.args(&build.tree), "mend what `cargo tree` reports")?;
            let packages = listed.lines().filter_map(package_of_tree);
            missing.extend(packages.map(|package| {
                let cost = costs::of(package.split(' ').next().unwrap_or_default());
                ((index, package), cost)
            }));
        }
        let total = missing.len();
        let names = builds.iter().map(|build| build.name).collect();
        let cores = std::thread::available_parallelism().map_or(2.0, |cores| cores.get() as f64);
        Ok(Self {
            names,
            missing,
            total,
            compiled_s: 0.0,
            started: Instant::now(),
            waited: None,
            last_finish: Duration::ZERO,
            cores,
            terminal: std::io::stderr().is_terminal(),
        })
    }

    /// Shows the progress until all builds have ended: once a second on a terminal, else a line every 10 s.
    fn follow(&mut self, finished: &mpsc::Receiver<(usize, Unit)>) {
        let period = Duration::from_secs(if self.terminal { 1 } else { 10 });
        let mut next = self.started + period;
        let mut shown = false;
        loop {
            match finished.recv_timeout(next.saturating_duration_since(Instant::now())) {
                Ok((build, unit)) => self.finish(build, unit, self.started.elapsed()),
                Err(RecvTimeoutError::Timeout) => {
                    self.show();
                    shown = true;
                    next = Instant::now() + period;
                }
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        if shown && self.terminal {
            write_error("\r\x1b[K");
        }
    }

    /// Removes a crate from the missing ones; if a package has several targets, the first one counts.
    fn finish(&mut self, build: usize, unit: Unit, elapsed: Duration) {
        self.waited.get_or_insert(elapsed);
        let Some(cost) = self.missing.remove(&(build, unit.package)) else { return };
        if !unit.is_fresh {
            self.compiled_s += cost;
            self.last_finish = elapsed;
        }
    }

    /// Estimated time until the last crate is compiled, s; 0 if it takes longer than estimated.
    fn left_s(&self, elapsed: Duration) -> f64 {
        let waited = self.waited.unwrap_or(elapsed);
        let busy_s = self.last_finish.saturating_sub(waited).as_secs_f64();
        let s_per_cost = (busy_s + ASSUMED_S / self.cores) / (self.compiled_s + ASSUMED_S);
        let since_s = elapsed.saturating_sub(self.last_finish.max(waited)).as_secs_f64();
        (self.missing.values().sum::<f64>() * s_per_cost - since_s).max(0.0)
    }

    fn show(&self) {
        let line = self.line(self.started.elapsed());
        write_error(&if self.terminal { format!("\r\x1b[K{line}") } else { format!("{line}\n") });
    }

    /// A progress line, such as `building server and page: 312 of 640 crates, about 4 min left`.
    fn line(&self, elapsed: Duration) -> String {
        let open = |index: &usize| self.missing.keys().any(|(build, _)| build == index);
        let names: Vec<_> = (0..self.names.len()).filter(open).map(|index| self.names[index]).collect();
        let done = self.total - self.missing.len();
        let left = match self.left_s(elapsed) {
            _ if self.missing.is_empty() => "linking".to_owned(),
            _ if self.waited.is_none() => "waiting for Cargo's first crate".to_owned(),
            left_s if left_s < 10.0 => "a few seconds left".to_owned(),
            left_s if left_s < 90.0 => format!("about {left_s:.0} s left"),
            left_s => format!("about {:.0} min left", left_s / 60.0),
        };
        let names = if names.is_empty() { self.names.join(" and ") } else { names.join(" and ") };
        format!("building {names}: {done} of {} crates, {left}", self.total)
    }
}

/// Writes to standard error; a closed stream does not stop the build.
fn write_error(text: &str) {
    let mut error = std::io::stderr().lock();
    error.write_all(text.as_bytes()).and_then(|()| error.flush()).unwrap_or_default();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn progress(packages: &[(&str, f64)]) -> Progress {
        let missing: HashMap<_, _> =
            packages.iter().map(|&(package, cost)| ((0, package.to_owned()), cost)).collect();
        let total = missing.len();
        Progress {
            names: vec!["server"],
            missing,
            total,
            compiled_s: 0.0,
            started: Instant::now(),
            waited: None,
            last_finish: Duration::ZERO,
            cores: 2.0,
            terminal: false,
        }
    }

    #[test]
    fn both_spellings_of_a_package_are_equal() {
        let listed = "serde v1.0.229 (proc-macro)";
        let id = "registry+https://github.com/rust-lang/crates.io-index#serde@1.0.229";
        assert_eq!(package_of_tree(listed), package_of_id(id));
        let listed = "xtask v0.1.0 (/work/xtask)";
        assert_eq!(package_of_tree(listed), package_of_id("path+file:///work/xtask#0.1.0"));
    }

    /// A build of a crate without dependencies.
    fn small_build(package: &'static str) -> Build {
        Build {
            name: "small crate",
            command: cmd::cargo(&["check", "--package", package]),
            tree: vec!["--package", package, "--edges", "normal,build"],
            then: || Ok(()),
        }
    }

    #[test]
    fn builds_share_a_pool_that_one_job_per_core_may_leave_empty() {
        run(vec![small_build("sightline-testdata"), small_build("sightline-testdata")])
            .expect("both builds end");
    }

    #[test]
    fn the_error_of_a_later_build_is_returned() {
        let mut failing = small_build("sightline-testdata");
        failing.then = || bail!("no page");
        let error =
            run(vec![small_build("sightline-testdata"), failing]).expect_err("the second build fails");
        assert_eq!(error.to_string(), "no page");
    }

    #[test]
    fn a_build_script_is_no_finished_crate() {
        let message = |kind: &str| {
            format!(
                r#"{{"reason":"compiler-artifact","package_id":"r#ring@0.17.14","fresh":false,"target":{{"kind":["{kind}"]}}}}"#
            )
        };
        let ring = Unit { package: "ring 0.17.14".to_owned(), is_fresh: false };
        assert_eq!(Unit::from_message(&message("lib")), Some(ring));
        assert_eq!(Unit::from_message(&message("custom-build")), None);
        assert_eq!(Unit::from_message("Compiling"), None);
    }

    #[test]
    fn the_remaining_time_follows_the_costs() {
        let mut progress = progress(&[("a 1", 10.0), ("b 1", 30.0), ("c 1", 500.0), ("d 1", 110.0)]);
        let second = Duration::from_secs;
        let unit = |package: &str, is_fresh| Unit { package: package.to_owned(), is_fresh };
        assert_eq!(
            progress.line(second(500)),
            "building server: 0 of 4 crates, waiting for Cargo's first crate"
        );
        progress.finish(0, unit("c 1", true), second(500));
        // Nothing is compiled yet: 150 s of processor time on two cores.
        assert_eq!(progress.line(second(500)), "building server: 1 of 4 crates, about 75 s left");
        progress.finish(0, unit("b 1", false), second(590));
        progress.finish(0, unit("b 1", false), second(591));
        // 30 s of processor time took 90 s, the assumed 60 s took 30 s; 120 s are missing.
        assert_eq!(progress.line(second(590)), "building server: 2 of 4 crates, about 3 min left");
        // A long crate shortens the rest and does not lower the rate.
        assert_eq!(progress.line(second(680)), "building server: 2 of 4 crates, about 70 s left");
        assert_eq!(progress.line(second(900)), "building server: 2 of 4 crates, a few seconds left");
    }
}
