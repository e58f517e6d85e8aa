//! Output of the commands: results on the standard output, progress on the standard error.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use sightline_geometry::error::{Error, Result};
use sightline_recordings::files::{PartialFile, remove_left_overs_of};
use sightline_track::settings::{Changes, Settings};

/// The name of the standard output in messages.
pub(super) const STDOUT: &str = "the standard output";

/// Writes a line of results and flushes it, because a reader may be waiting for it.
pub fn line(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let written = writeln!(out, "{text}").and_then(|()| out.flush());
    written.map_err(|source| Error::Write { path: STDOUT.into(), source })
}

/// Writes a line to the standard error.
pub(super) fn error(text: &str) {
    // A failure cannot be reported anywhere.
    let _ = writeln!(std::io::stderr().lock(), "{}", crate::printable::printable(text));
}

/// Reports the given settings that have no effect in combination with the others.
pub(super) fn settings_without_effect(settings: &Settings, given: &Changes) {
    for (key, condition) in settings.without_effect(given) {
        error(&format!("{key} has no effect: it has one only if {condition}"));
    }
}

/// Creates a file that gets its name when complete; removes the remains of an interrupted command.
///
/// # Errors
/// A file of that name exists, or the folder cannot be written.
pub(super) fn new_file(path: &Path) -> Result<PartialFile> {
    if path.exists() {
        return Err(Error::format(path, "exists already; choose another name"));
    }
    remove_left_overs_of(path);
    PartialFile::create(path)
}

/// Interval of progress lines if the output is not a terminal.
const PERIOD: Duration = Duration::from_secs(5);

/// Reports progress of a long command: one line that overwrites itself, or occasional lines in a log.
pub struct Progress {
    what: String,
    start: Instant,
    last_report: Option<Instant>,
    is_terminal: bool,
}

impl Progress {
    /// Progress of `what`, for example `rendering stop`.
    pub fn new(what: impl Into<String>) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        Self { what: what.into(), start: Instant::now(), last_report: None, is_terminal }
    }

    /// Reports that `k` of `n` are done.
    pub fn tell(&mut self, k: usize, n: usize) {
        let is_due = self.last_report.is_none_or(|last_report| last_report.elapsed() >= PERIOD) || k == n;
        if !(self.is_terminal || is_due) {
            return;
        }
        self.last_report = Some(Instant::now());
        let elapsed_s = self.start.elapsed().as_secs_f64();
        let left = match k {
            0 => String::new(),
            k if k >= n => format!(" in {elapsed_s:.0} s"),
            k => format!(", {:.0} s left", elapsed_s / k as f64 * (n - k) as f64),
        };
        let text = format!("{} {k} of {n}{left}", self.what);
        let mut out = std::io::stderr().lock();
        // As for errors: a failure cannot be reported anywhere.
        let _ = match (self.is_terminal, k == n) {
            (true, false) => write!(out, "\r\x1b[K{text}"),
            (true, true) => writeln!(out, "\r\x1b[K{text}"),
            (false, _) => writeln!(out, "{text}"),
        };
    }
}
