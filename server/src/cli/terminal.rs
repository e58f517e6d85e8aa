//! What the commands say: results on the standard output, progress on the standard error.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use sightline_geometry::error::{Error, Result};
use sightline_recordings::files::{PartialFile, remove_left_overs_of};
use sightline_track::settings::{Changes, Settings};

/// What messages call the standard output.
pub(super) const STDOUT: &str = "the standard output";

/// Writes a line of results and hands it on at once, since somebody may be waiting for it.
pub fn line(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let written = writeln!(out, "{text}").and_then(|()| out.flush());
    written.map_err(|source| Error::Write { path: STDOUT.into(), source })
}

/// Writes a line to the standard error.
pub(super) fn error(text: &str) {
    // There is nobody left to tell when this fails.
    let _ = writeln!(std::io::stderr().lock(), "{}", crate::printable::printable(text));
}

/// Says which of the settings that were given have no effect beside the others.
pub(super) fn settings_without_effect(settings: &Settings, given: &Changes) {
    for (key, condition) in settings.without_effect(given) {
        error(&format!("{key} has no effect: it has one only if {condition}"));
    }
}

/// A new file, which gets its name when it is complete; what a killed command left of it is removed.
///
/// # Errors
/// A file of that name, or a folder that cannot be written.
pub(super) fn new_file(path: &Path) -> Result<PartialFile> {
    if path.exists() {
        return Err(Error::format(path, "exists already; choose another name"));
    }
    remove_left_overs_of(path);
    PartialFile::create(path)
}

/// How often progress is told where it cannot overwrite itself.
const PERIOD: Duration = Duration::from_secs(5);

/// Tells how much of a long command is done: one line that overwrites itself, or now and then a line in a log.
pub struct Progress {
    what: String,
    begun: Instant,
    told: Option<Instant>,
    is_terminal: bool,
}

impl Progress {
    /// Progress of `what`, for example `rendering stop`.
    pub fn new(what: impl Into<String>) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        Self { what: what.into(), begun: Instant::now(), told: None, is_terminal }
    }

    /// Tells that `k` of `n` are done.
    pub fn tell(&mut self, k: usize, n: usize) {
        let is_due = self.told.is_none_or(|told| told.elapsed() >= PERIOD) || k == n;
        if !(self.is_terminal || is_due) {
            return;
        }
        self.told = Some(Instant::now());
        let elapsed_s = self.begun.elapsed().as_secs_f64();
        let left = match k {
            0 => String::new(),
            k if k >= n => format!(" in {elapsed_s:.0} s"),
            k => format!(", {:.0} s left", elapsed_s / k as f64 * (n - k) as f64),
        };
        let text = format!("{} {k} of {n}{left}", self.what);
        let mut out = std::io::stderr().lock();
        // As for errors: there is nobody left to tell.
        let _ = match (self.is_terminal, k == n) {
            (true, false) => write!(out, "\r\x1b[K{text}"),
            (true, true) => writeln!(out, "\r\x1b[K{text}"),
            (false, _) => writeln!(out, "{text}"),
        };
    }
}
