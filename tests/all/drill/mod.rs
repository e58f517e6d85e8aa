//! Drills: the program itself under load and in trouble, measured from outside.
//!
//! The tests run each drill on a small scale. `cargo xtask drill` runs them on the whole scale, one after the other, and
//! shows the lines of its table, which begin with [`MARK`].

mod clock;
mod load;
mod ending;
mod kills;
mod trouble;

use std::sync::Mutex;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sightline_tests::server::PIXEL;

use crate::keeping::Killable;

/// What a line of the table begins with.
const MARK: &str = "drill |";

/// Idle threads have ended after this.
const IDLE: Duration = Duration::from_secs(20);

/// Drills measure the same machine: one at a time.
static ONE: Mutex<()> = Mutex::new(());

/// Whether this is the drill itself, and not the slice of it that the tests contain: only the drill judges times and memory.
pub(crate) fn is_whole() -> bool {
    std::env::var_os("SIGHTLINE_DRILL").is_some()
}

/// The number for the whole scale, or the one for the tests.
pub(crate) fn scale<T>(whole: T, small: T) -> T {
    if is_whole() { whole } else { small }
}

/// Prints a line of the table.
pub(crate) fn tell(drill: &str, outcome: &str) {
    println!("{MARK} {drill:<44} | {outcome}");
}

/// What a process holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Held {
    threads: u64,
    resident_mib: u64,
    descriptors: u64,
}

impl Held {
    /// Reads it from the system; zeros where it has no `/proc`.
    fn by(process: u32) -> Self {
        let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
        let number = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0)
        };
        let descriptors =
            std::fs::read_dir(format!("/proc/{process}/fd")).map_or(0, |open| open.count() as u64);
        Self { threads: number("Threads:"), resident_mib: number("VmRSS:") / 1024, descriptors }
    }

    fn most(self, other: Self) -> Self {
        Self {
            threads: self.threads.max(other.threads),
            resident_mib: self.resident_mib.max(other.resident_mib),
            descriptors: self.descriptors.max(other.descriptors),
        }
    }
}

/// What may be left of so many threads or descriptors.
const fn most(before: u64) -> u64 {
    before + before / 5 + 2
}

/// What a process holds before, at most during, and after some work.
pub(crate) struct Watched<T> {
    value: T,
    before: Held,
    peak: Held,
    after: Held,
}

impl<T> Watched<T> {
    /// Does some work. Threads, memory and descriptors are read `rest` after it, and again until idle threads have ended.
    fn of(server: &Killable, rest: Duration, work: impl FnOnce() -> T) -> Self {
        let process = server.id();
        let before = Held::by(process);
        let (value, peak) = std::thread::scope(|scope| {
            // The sender is dropped when the work ends, also by a panic.
            let (working, is_over) = std::sync::mpsc::channel::<()>();
            let watching = scope.spawn(move || {
                let mut peak = before;
                while is_over.recv_timeout(Duration::from_millis(50)) == Err(RecvTimeoutError::Timeout) {
                    peak = peak.most(Held::by(process));
                }
                peak
            });
            let value = work();
            drop(working);
            (value, watching.join().unwrap())
        });
        std::thread::sleep(rest);
        let begun = Instant::now();
        let mut after = Held::by(process);
        // Idle threads end after ten seconds.
        while after.threads > most(before.threads) && begun.elapsed() < IDLE {
            std::thread::sleep(Duration::from_millis(200));
            after = Held::by(process);
        }
        Self { value, before, peak, after }
    }

    /// Before → peak → after.
    fn tell(&self, drill: &str, outcome: &str) {
        let three = |part: fn(&Held) -> u64| {
            format!("{} → {} → {}", part(&self.before), part(&self.peak), part(&self.after))
        };
        let [threads, memory, files] =
            [three(|held| held.threads), three(|held| held.resident_mib), three(|held| held.descriptors)];
        tell(drill, &format!("{outcome}; threads {threads}, MiB {memory}, descriptors {files}"));
    }

    /// Asserts that nothing of the work is left: its threads and connections are gone.
    fn assert_given_back(&self) {
        assert!(self.after.threads <= most(self.before.threads), "threads: {} after", self.after.threads);
        let [before, after] = [self.before.descriptors, self.after.descriptors];
        assert!(after <= most(before), "descriptors: {before} before, {after} after");
        // On a small scale, what is made once and kept is most of the memory.
        let [before, after] = [self.before.resident_mib, self.after.resident_mib];
        assert!(!is_whole() || after <= before + before / 5, "MiB: {before} before, {after} after");
    }
}

/// Begins a session with a target at the rock, seen from a step; its name.
pub(crate) fn begin(server: &Killable, step: usize) -> String {
    let traverse = server.get("traverses")[0]["id"].clone();
    let session = server.json("POST", "sessions", &json!({ "traverse": traverse }));
    let name = session["id"].as_str().unwrap().to_owned();
    let [x, y] = PIXEL;
    let target = json!({ "step": step, "pixel": { "x": x, "y": y } });
    server.json("POST", &format!("sessions/{name}/targets"), &target);
    name
}

/// Waits until a value at a path is as wanted; returns the whole answer.
pub(crate) fn until(server: &Killable, path: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let begun = std::time::Instant::now();
    loop {
        let answer = server.get(path);
        if is_so(&answer) {
            return answer;
        }
        assert!(begun.elapsed() < Duration::from_secs(180), "{path} stays {answer}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Whether a run has ended.
pub(crate) fn has_ended(run: &Value) -> bool {
    run["complete"] == json!(true) || run["stopped"] != json!(null)
}

/// The 95th percentile, ms.
pub(crate) fn p95_ms(times: &mut [Duration]) -> f64 {
    times.sort();
    let place = (times.len().saturating_sub(1) as f64 * 0.95).round() as usize;
    times.get(place).map_or(f64::NAN, |time| time.as_secs_f64() * 1e3)
}
