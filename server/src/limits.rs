//! The limits of the server: every configurable bound, in one table.
//!
//! `sightline serve --limit NAME=VALUE` sets one; `--limit help` prints the table. A problem caused by a limit names it and
//! the option that raises it. Text lengths and the ranges of settings are part of the formats and therefore constants next
//! to their types.
//!
//! The server's memory is bounded by `cache_bytes` + `step_bytes` + `answer_bytes`, and by `maps`, `grounds` and
//! `odometry_tables` (their sizes are in the table). Work in progress needs additional memory; its amount is limited, too.

use std::sync::Arc;
use std::time::Duration;

use sightline_api::program::FILE_BYTES;
use sightline_geometry::error::{Error, Result};

/// The largest value of a limit: above any useful one, and small enough to avoid overflow.
const LARGEST: u64 = 1 << 40;

/// One limit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Limit {
    /// The name in the option `--limit`.
    pub(crate) name: &'static str,
    /// Its unit.
    unit: &'static str,
    /// The default value.
    default: u64,
    /// The smallest value; 0 if 0 means unlimited.
    least: u64,
    /// The bounded quantity.
    meaning: &'static str,
    value: u64,
}

impl Limit {
    /// The value as a count or a number of bytes.
    pub(crate) fn count(&self) -> usize {
        usize::try_from(self.value).unwrap_or(usize::MAX)
    }

    /// The value as a duration; `None` if unlimited.
    pub(crate) fn time(&self) -> Option<Duration> {
        (self.value > 0).then(|| Duration::from_secs(self.value))
    }

    /// A sentence that explains how to raise it.
    pub(crate) fn raise(&self) -> String {
        let Self { name, unit, value, .. } = self;
        format!(
            "The limit {name} is {value} {unit}; start the server with --limit {name}={} to raise it.",
            value.saturating_mul(2)
        )
    }

    /// `way_out` followed by the text of `raise`, as a problem's hint.
    pub(crate) fn hint(&self, way_out: &str) -> String {
        format!("{way_out} {}", self.raise())
    }
}

/// Declares the limits: name, default, least value, unit, meaning.
macro_rules! limits {
    ($($name:ident = $default:expr, $least:literal, $unit:literal, $meaning:literal;)*) => {
        /// The limits of a server.
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub struct Limits {
            $(#[doc = $meaning] pub(crate) $name: Limit,)*
        }

        impl Default for Limits {
            fn default() -> Self {
                Self {
                    $($name: Limit {
                        name: stringify!($name),
                        unit: $unit,
                        default: $default,
                        least: $least,
                        meaning: $meaning,
                        value: $default,
                    },)*
                }
            }
        }

        impl Limits {
            /// All limits, in the order of the table.
            fn all(&self) -> Vec<&Limit> {
                vec![$(&self.$name),*]
            }

            fn named(&mut self, name: &str) -> Option<&mut Limit> {
                match name {
                    $(stringify!($name) => Some(&mut self.$name),)*
                    _ => None,
                }
            }
        }
    };
}

limits! {
    connections = 512, 1, "connections", "open connections; beyond it, the one that has waited for a request longest is closed";
    header_s = 30, 1, "s", "time for the head of a request, and between two requests of a connection";
    body_s = 30, 1, "s", "time for the body of a request";
    send_s = 60, 1, "s", "time in which a client must accept part of a response";
    body_bytes = 1 << 20, 1, "bytes", "body of a request";
    file_bytes = FILE_BYTES as u64, 1, "bytes", "body of a request with an exported session";
    listeners = 64, 1, "WebSockets", "pages that receive events";
    sessions = 1000, 1, "sessions", "sessions on open drives";
    targets = 256, 1, "targets", "targets of a session at a time";
    target_numbers = 4096, 1, "targets", "targets of a session, the removed ones included";
    runs = 256, 1, "runs", "runs of a target";
    drives = 64, 1, "drives", "drives that are opened from pages";
    imports = 64, 1, "imports", "imports of recordings in the list";
    imports_waiting = 16, 1, "imports", "imports that wait; one is carried out at a time";
    recordings = 200, 1, "recordings", "recordings that are listed below the folders named at start";
    uploads = 4, 1, "uploads", "recordings that pages have sent and not imported yet";
    upload_bytes = 4 << 30, 1, "bytes", "a recording that a page sends, and the unpacked contents of its archive";
    upload_files = 50_000, 1, "files", "files of a recording that a page sends";
    stops = 20_000, 1, "stops", "stops of a drive";
    image_pixels = 64_000_000, 1, "pixels", "pixels of an image";
    studies = 64, 1, "studies", "studies in the list";
    studies_waiting = 16, 1, "studies", "studies that wait; one is carried out at a time";
    questions = 256, 1, "questions", "stored answers to “What would have saved this step?”";
    step_s = 300, 0, "s", "time for one step of a run, a designation or a what-if; 0: no limit";
    runs_at_a_time = 2, 1, "runs", "runs that are computed at a time; each uses all processors where it can";
    runs_waiting = 256, 1, "runs", "runs in the queue; the same number of counterfactual questions";
    designations_at_a_time = 2, 1, "requests", "designations and scenarios that are computed at a time; the same number of what-ifs";
    designations_waiting = 16, 1, "requests", "designations and scenarios in the queue; the same number of what-ifs";
    images_at_a_time = 8, 1, "requests", "images that are read or rendered for pages at a time";
    images_waiting = 256, 1, "requests", "requests for images that wait";
    queries_at_a_time = 2, 1, "requests", "expressions that are evaluated over all steps at a time";
    queries_waiting = 64, 1, "requests", "expressions that wait";
    exports_at_a_time = 1, 1, "requests", "exports that are written at a time";
    exports_waiting = 8, 1, "requests", "exports that wait";
    maps_waiting = 8, 1, "maps", "trackability maps that wait; one is made at a time";
    maps = 64, 1, "maps", "trackability maps in memory, half a megabyte each";
    grounds = 2, 1, "stops", "surfaces behind trackability maps in memory, 24 bytes for each pixel";
    odometry_tables = 64, 1, "stops", "corners of visual odometry in memory, 20 kilobytes a stop";
    cache_bytes = 512 << 20, 0, "bytes", "images, features, surfaces and transforms in memory, of all drives; least recently used are dropped first";
    step_bytes = 4 << 30, 1, "bytes", "steps of runs in memory, of all sessions; those of idle sessions are dropped first and computed again on request";
    rest_s = 60, 0, "s", "time without a request after which a session is idle and its steps may be dropped";
    answers = 1000, 1, "answers", "answers to requests with an Idempotency-Key";
    answer_bytes = 64 << 20, 1, "bytes", "those answers in memory";
}

impl Limits {
    /// Sets a limit with `NAME=VALUE`; values in bytes may end in KiB, MiB or GiB.
    ///
    /// # Errors
    /// An unknown name, or a value that is not a number or is too small.
    pub fn set(&mut self, text: &str) -> Result<()> {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let limit = self.named(name).ok_or_else(|| {
            Error::Request(format!("there is no limit “{name}”; --limit help lists all of them"))
        })?;
        let Limit { unit, least, .. } = *limit;
        let number = number(value, unit).filter(|number| (least..=LARGEST).contains(number));
        limit.value = number.ok_or_else(|| {
            Error::Request(format!(
                "--limit {name}: must be a whole number from {least} to {LARGEST} ({unit}), not “{value}”"
            ))
        })?;
        Ok(())
    }

    /// The table as text.
    pub fn table(&self) -> String {
        let line = |limit: &&Limit| {
            let Limit { name, unit, default, meaning, .. } = limit;
            format!("  {name:<22} {default:>10} {unit:<11}  {meaning}\n")
        };
        let lines: String = self.all().iter().map(line).collect();
        format!("Limits of the server (--limit NAME=VALUE), with their defaults:\n{lines}")
    }

    /// Rejects a drive that is too large.
    ///
    /// # Errors
    /// A sentence that names the limit.
    pub(crate) fn check_drive(&self, traverse: &sightline_recordings::Traverse) -> Result<()> {
        let folder = traverse.folder().display();
        let stops = traverse.stop_count();
        if stops > self.stops.count() {
            let raise = self.stops.raise();
            return Err(Error::Request(format!("{folder} has {stops} stops. {raise}")));
        }
        for step in 0..stops {
            let further = traverse
                .further_cameras(step)
                .flat_map(|camera| std::iter::once(camera.left).chain(camera.right));
            for camera in [traverse.left_camera(step), traverse.right_camera(step)].into_iter().chain(further)
            {
                let [width, height] = camera.size;
                if u64::from(width) * u64::from(height) > self.image_pixels.value {
                    let raise = self.image_pixels.raise();
                    return Err(Error::Request(format!(
                        "{folder}: the images of stop {step} have {width} × {height} pixels. {raise}"
                    )));
                }
            }
        }
        Ok(())
    }
}

/// Parses a number; with a suffix KiB, MiB or GiB if the unit is bytes.
fn number(text: &str, unit: &str) -> Option<u64> {
    let suffixes = [("KiB", 10), ("MiB", 20), ("GiB", 30)];
    let found = suffixes.iter().find_map(|(suffix, shift)| Some((text.strip_suffix(suffix)?, *shift)));
    match found.filter(|_| unit == "bytes") {
        Some((digits, shift)) => digits.parse::<u64>().ok()?.checked_mul(1 << shift),
        None => text.parse().ok(),
    }
}

/// The limits, shared by all parts of the server.
pub(crate) type SharedLimits = Arc<Limits>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_moved_by_name() {
        let mut limits = Limits::default();
        limits.set("sessions=3").unwrap();
        limits.set("cache_bytes=5MiB").unwrap();
        limits.set("step_s=0").unwrap();
        assert_eq!((limits.sessions.count(), limits.cache_bytes.count()), (3, 5 << 20));
        assert_eq!(limits.step_s.time(), None);
        assert!(limits.sessions.raise().contains("--limit sessions=6"), "{}", limits.sessions.raise());
        let refuse = |text: &str| Limits::default().set(text).unwrap_err().to_string();
        assert!(refuse("sesions=3").contains("sesions") && refuse("sesions=3").contains("help"));
        for wrong in ["sessions", "sessions=", "sessions=0", "sessions=-1", "sessions=1.5", "sessions=5MiB"] {
            assert!(refuse(wrong).contains("from 1 to"), "{wrong}");
        }
        assert!(refuse("cache_bytes=99999999999GiB").contains("cache_bytes"));
    }

    #[test]
    fn the_document_lists_every_limit_with_its_default() {
        let document = include_str!("../../docs/limits.md");
        for Limit { name, unit, default, meaning, .. } in Limits::default().all() {
            let row = format!("| `{name}` | {default} | {unit} | {meaning} |");
            assert!(document.contains(&row), "docs/limits.md: {row}");
        }
    }

    #[test]
    fn the_table_has_every_limit_once() {
        let limits = Limits::default();
        let table = limits.table();
        for limit in limits.all() {
            assert!(limit.value == limit.default && limit.least <= limit.default, "{limit:?}");
            let rows = table.lines().filter(|row| row.split_whitespace().next() == Some(limit.name));
            assert_eq!(rows.count(), 1, "{}", limit.name);
        }
    }
}
