//! Drills: the program under load and with faults, measured from outside.
//!
//! The tests run each drill at a small scale. `cargo xtask drill` runs them at full scale, one after the other, and prints
//! the lines of the table, which begin with [`MARK`].

mod clock;
mod load;
mod shutdown;
mod kills;
mod storage_faults;

use std::sync::Mutex;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sightline_tests::server::PIXEL;

use crate::persistence::ServerProcess;

/// Prefix of a line of the table.
const MARK: &str = "drill |";

/// Time within which idle threads end.
const IDLE: Duration = Duration::from_secs(20);

/// Drills measure the same machine, so only one runs at a time.
static EXCLUSIVE: Mutex<()> = Mutex::new(());

/// Whether this is the full drill instead of its short form in the tests; only the full drill checks times and memory.
pub(crate) fn is_full_scale() -> bool {
    std::env::var_os("SIGHTLINE_DRILL").is_some()
}

/// Returns the number for full scale or the one for the tests.
pub(crate) fn scale<T>(whole: T, small: T) -> T {
    if is_full_scale() { whole } else { small }
}

/// Prints a line of the table.
pub(crate) fn print_row(drill: &str, outcome: &str) {
    println!("{MARK} {drill:<44} | {outcome}");
}

/// Resources in use by a process.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Resources {
    threads: u64,
    resident_mib: u64,
    descriptors: u64,
}

impl Resources {
    /// Reads them from `/proc`; zeros where there is none.
    fn of(process: u32) -> Self {
        let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
        let number = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0)
        };
        let descriptors =
            std::fs::read_dir(format!("/proc/{process}/fd")).map_or(0, |open| open.count() as u64);
        Self { threads: number("Threads:"), resident_mib: number("VmRSS:") / 1024, descriptors }
    }

    fn max(self, other: Self) -> Self {
        Self {
            threads: self.threads.max(other.threads),
            resident_mib: self.resident_mib.max(other.resident_mib),
            descriptors: self.descriptors.max(other.descriptors),
        }
    }
}

/// The number of threads or descriptors that is accepted after the work.
const fn accepted_after(before: u64) -> u64 {
    before + before / 5 + 2
}

/// Resources of a process before, at most during, and after some work.
pub(crate) struct Watched<T> {
    value: T,
    before: Resources,
    peak: Resources,
    after: Resources,
}

impl<T> Watched<T> {
    /// Runs `work`. The resources are read `rest` after it, and again until idle threads have ended.
    fn of(server: &ServerProcess, rest: Duration, work: impl FnOnce() -> T) -> Self {
        let process = server.id();
        let before = Resources::of(process);
        let (value, peak) = std::thread::scope(|scope| {
            // The sender is dropped when the work ends, also in a panic.
            let (working, is_over) = std::sync::mpsc::channel::<()>();
            let watching = scope.spawn(move || {
                let mut peak = before;
                while is_over.recv_timeout(Duration::from_millis(50)) == Err(RecvTimeoutError::Timeout) {
                    peak = peak.max(Resources::of(process));
                }
                peak
            });
            let value = work();
            drop(working);
            (value, watching.join().unwrap())
        });
        std::thread::sleep(rest);
        let begun = Instant::now();
        let mut after = Resources::of(process);
        // Idle threads end after ten seconds.
        while after.threads > accepted_after(before.threads) && begun.elapsed() < IDLE {
            std::thread::sleep(Duration::from_millis(200));
            after = Resources::of(process);
        }
        Self { value, before, peak, after }
    }

    /// Prints before → peak → after.
    fn print_row(&self, drill: &str, outcome: &str) {
        let three = |part: fn(&Resources) -> u64| {
            format!("{} → {} → {}", part(&self.before), part(&self.peak), part(&self.after))
        };
        let [threads, memory, files] = [
            three(|resources| resources.threads),
            three(|resources| resources.resident_mib),
            three(|resources| resources.descriptors),
        ];
        print_row(drill, &format!("{outcome}; threads {threads}, MiB {memory}, descriptors {files}"));
    }

    /// Asserts that threads, connections and memory of the work are released.
    fn assert_released(&self) {
        assert!(
            self.after.threads <= accepted_after(self.before.threads),
            "threads: {} after",
            self.after.threads
        );
        let [before, after] = [self.before.descriptors, self.after.descriptors];
        assert!(after <= accepted_after(before), "descriptors: {before} before, {after} after");
        // At a small scale, allocations that are made once dominate the memory.
        let [before, after] = [self.before.resident_mib, self.after.resident_mib];
        assert!(!is_full_scale() || after <= before + before / 5, "MiB: {before} before, {after} after");
    }
}

/// Begins a session with a target on the rock, designated at `step`; returns its name.
pub(crate) fn begin(server: &ServerProcess, step: usize) -> String {
    let traverse = server.get("traverses")[0]["id"].clone();
    let session = server.json("POST", "sessions", &json!({ "traverse": traverse }));
    let name = session["id"].as_str().unwrap().to_owned();
    let [x, y] = PIXEL;
    let target = json!({ "step": step, "pixel": { "x": x, "y": y } });
    server.json("POST", &format!("sessions/{name}/targets"), &target);
    name
}

/// Polls a path until `is_so` is true; returns the whole response.
pub(crate) fn until(server: &ServerProcess, path: &str, is_so: impl Fn(&Value) -> bool) -> Value {
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
