//! `sightline export`: writes the same files as the server, with the same code, without a browser.
//!
//! The source is a session in the data folder, even while a server uses it, or targets on a traverse. Runs are computed
//! again from the saved session: the same input gives the same bits.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::Args;
use sightline_geometry::camera::CameraName;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_recordings::Traverse;
use sightline_session::Session;
use sightline_session::view::SavedSession;
use sightline_track::presets::preset;
use sightline_track::settings::{Changes, Settings, parse_assignment};
use sightline_track::target::Designation;

use super::terminal::Progress;
use super::track::pixel;
use super::{open, terminal};
use crate::access::Access;
use crate::commanded_drive;
use crate::exports::{ExportFormat, ExportedFile, SessionPart, Source, make};
use crate::folders::Folders;
use crate::hosts::Hosts;
use crate::identity::{Identity, Relation};
use crate::live_session::LiveSession;
use crate::naming::name_of;
use crate::problem::ApiError;
use crate::state::AppState;
use crate::store::{self, Store};

/// Polling interval while a run is computed.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Write a session as a file: a recording, tables, images, a report, or the input needed to reproduce it.
#[derive(Debug, Args)]
pub(super) struct Export {
    /// The file: recording.rrd, rows.csv, rows.jsonl, rows.parquet, steps.apng, steps.png, report.html or reproduce.json.
    #[arg(value_parser = kind)]
    kind: ExportFormat,
    /// The traverse: a folder, an index or a scenario; not needed for a session on a simulated traverse of the data folder.
    traverse: Option<PathBuf>,
    /// A session of the data folder.
    #[arg(long, value_name = "NAME", required_unless_present = "target", conflicts_with = "target")]
    session: Option<String>,
    /// Where sessions and simulated traverses are kept.
    #[arg(long, value_name = "FOLDER")]
    data_dir: Option<PathBuf>,
    /// One target of the session, or one of its runs, by numbers from 0: 0 or 0/1.
    #[arg(long, value_name = "TARGET[/RUN]", value_parser = part)]
    run: Option<SessionPart>,
    /// A target by its position in the left image, px, instead of a session; can be given more than once.
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true, requires = "traverse")]
    target: Vec<Pixel>,
    /// The stop in whose left image such targets are designated.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "target")]
    from_step: usize,
    /// The pair in which such targets are designated and tracked, by its name at that stop; by default the main pair.
    #[arg(long, value_name = "NAME", requires = "target")]
    camera: Option<CameraName>,
    /// A named configuration for such targets; --set changes it further.
    #[arg(long, value_name = "NAME", requires = "target")]
    preset: Option<String>,
    /// A setting of the tracker for such targets, for example ncc_min=0.6; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE", requires = "target")]
    set: Vec<String>,
    /// The file to write, which must not exist; by default a descriptive name in the current folder.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Export {
    /// Creates the file.
    ///
    /// # Errors
    /// A session, traverse, target or setting that does not exist, or a file that cannot be written.
    pub(super) fn run(self) -> Result<()> {
        if let Some(out) = self.out.as_ref().filter(|out| out.exists()) {
            return Err(Error::format(out, "exists already; choose another name"));
        }
        // Works on a copy of the session in a temporary folder, so that the server's data is untouched.
        let folder =
            tempfile::tempdir().map_err(|error| Error::Request(format!("cannot make a folder: {error}")))?;
        let live = match &self.session {
            Some(id) => self.session(id, folder.path())?,
            None => self.targets(folder.path())?,
        };
        let source = Source::of(&live);
        let part = self.run.unwrap_or_default();
        source.check(self.kind, part).map_err(refused)?;
        let part = source.resolve_part(self.kind, part);
        let out = self.out.unwrap_or_else(|| PathBuf::from(source.file_name(self.kind, part)));
        let mut progress = Progress::new("wrote stop");
        let mut tell = |k, n| {
            progress.tell(k, n);
            ControlFlow::Continue(())
        };
        let made = make(&source, self.kind, part, &AtomicBool::new(false), &mut tell).map_err(refused)?;
        write(&out, made)?;
        terminal::line(&out.display().to_string())
    }

    /// A session of the data folder, recomputed.
    fn session(&self, id: &str, folder: &Path) -> Result<Arc<LiveSession>> {
        let data = open::data_folder(self.data_dir.as_deref())?;
        let sessions = data.join("sessions");
        let found = store::read_only(&sessions)?;
        let missing = || {
            let known: Vec<&str> = found.sessions.iter().map(|saved| saved.id.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            Error::Request(format!("{} has no session {id}; there are: {known}", sessions.display()))
        };
        let saved = found.sessions.iter().find(|saved| saved.id == id).ok_or_else(missing)?;
        let of_commands = data.join("driven").join(&saved.traverse);
        let (traverses, saved) = if of_commands.is_dir() {
            let copied = Folders::in_one(folder).commanded_drives.join(&saved.traverse);
            commanded_drive::copy(&of_commands, &copied)?;
            let last_stop = Traverse::open(&copied)?.stop_count() - 1;
            // The rover of the copy does not drive on.
            let steering = saved.steering.as_ref().map(|steering| steering.staying(last_stop));
            (Vec::new(), SavedSession { steering, ..saved.clone() })
        } else {
            (vec![self.traverse_of(id, &saved.traverse, &data)?], saved.clone())
        };
        let notes =
            store::number_of(id).and_then(|number| found.notes.get(&number)).cloned().unwrap_or_default();
        let copy = Store::open(folder)?;
        copy.save(&saved)?;
        copy.save_notes(id, &notes)?;
        drop(copy);
        computed(traverses, folder, id)
    }

    /// The traverse of a session, which must be the one on which the session was created.
    fn traverse_of(&self, id: &str, theirs: &str, data: &Path) -> Result<Traverse> {
        let traverse = match &self.traverse {
            Some(path) => open::open(path, Some(data))?,
            None => find_traverse(data, theirs)?,
        };
        let own = Identity::of(&traverse, Some(&Folders::in_one(data).digests))?;
        match own.relation(theirs) {
            Relation::Same | Relation::SameIndex => Ok(traverse),
            Relation::OtherFiles => {
                let message = "was made on other images than the drive has now; put those back to export it";
                Err(Error::Request(format!("session {id} {message} ({theirs}, not {})", own.id())))
            }
            Relation::Other => {
                let own = own.id();
                Err(Error::Request(format!("session {id} is on the traverse {theirs}, not on {own}")))
            }
        }
    }

    /// Targets on a traverse, as a temporary session.
    fn targets(&self, folder: &Path) -> Result<Arc<LiveSession>> {
        let path = self.traverse.as_ref().ok_or_else(|| Error::Request("name a traverse".to_owned()))?;
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        let own = match &self.preset {
            Some(name) => preset(name)?.settings()?,
            None => Settings::default(),
        };
        let settings = own.with(&changes)?;
        terminal::settings_without_effect(&settings, &changes);
        let traverse = open::open(path, self.data_dir.as_deref())?;
        let id = Identity::of(&traverse, None)?.id();
        let mut session = Session::new("s1", id, traverse.stop_count());
        for pixel in &self.target {
            let designation = Designation { step: self.from_step, pixel: *pixel, camera: self.camera };
            let first = sightline_session::track::designate(&traverse, designation, &settings)?;
            session.add_target(None, settings.clone(), Arc::new(first));
        }
        session.cursor.target = Some(0);
        let saved: SavedSession = session.saved();
        let copy = Store::open(folder)?;
        copy.save(&saved)?;
        drop(copy);
        computed(vec![traverse], folder, "s1")
    }
}

/// The session `id` in `folder` with all its runs, computed by the server's code.
fn computed(traverses: Vec<Traverse>, folder: &Path, id: &str) -> Result<Arc<LiveSession>> {
    let runtime = super::runtime()?;
    let _inside = runtime.enter();
    let state = AppState::new(traverses, folder, Access::without_token(Hosts::new(0, &[])))?;
    let live = state.session(id).map_err(refused)?;
    let count = |session: &Session| {
        let live = session.targets.iter().filter(|target| !target.removed);
        let runs = live.flat_map(|target| target.runs.iter().map(move |run| (target, run)));
        runs.fold((0, 0), |(k, n), (target, run)| {
            let end = run.stop_after.map_or(session.stop_count, |stop| session.stop_count.min(stop + 1));
            (k + run.steps.len(), n + end.saturating_sub(target.designation.step))
        })
    };
    let mut progress = Progress::new("tracked step");
    while live.is_restoring() {
        let (k, n) = live.with(|session| count(session));
        if k < n {
            progress.tell(k, n);
        }
        std::thread::sleep(POLL_INTERVAL);
    }
    let (k, n) = live.with(|session| count(session));
    if k == n && n > 0 {
        progress.tell(k, n);
    }
    // A run that stopped early does not prevent the export, but is reported.
    for (target, run, why) in live.with(|session| stopped(session)) {
        terminal::error(&format!("run {run} of target {target} stopped before the last stop: {why}"));
    }
    Ok(live)
}

/// The runs that stopped before the last stop: target, run, reason.
fn stopped(session: &Session) -> Vec<(usize, usize, String)> {
    let targets = session.targets.iter().enumerate().filter(|(_, target)| !target.removed);
    let of_target = targets.flat_map(|(number, target)| {
        target.runs.iter().enumerate().map(move |(run, found)| (number, run, found.why_stopped()))
    });
    of_target.filter_map(|(target, run, why)| why.map(|why| (target, run, why))).collect()
}

/// The simulated traverse named `id` in the data folder.
fn find_traverse(data: &Path, id: &str) -> Result<Traverse> {
    let entries = std::fs::read_dir(data.join("traverses")).into_iter().flatten().flatten();
    let opened = entries.filter_map(|entry| Traverse::open(&entry.path()).ok());
    let found = opened.into_iter().find(|traverse| name_of(traverse).is_ok_and(|name| name == id));
    found.ok_or_else(|| {
        Error::Request(format!(
            "the session is on the traverse {id}; name its folder: sightline export KIND FOLDER …"
        ))
    })
}

/// Writes the complete file or none.
fn write(path: &Path, made: ExportedFile) -> Result<()> {
    let mut file = terminal::new_file(path)?;
    match made {
        ExportedFile::Bytes(bytes) => file.write_all(&bytes),
        ExportedFile::File(mut source, _folder) => std::io::copy(&mut source, &mut file).map(|_| ()),
    }
    .map_err(|source| Error::Write { path: path.to_owned(), source })?;
    file.complete_new()
}

/// Converts a problem of the server to an error of the command line.
#[allow(clippy::needless_pass_by_value)]
fn refused(problem: ApiError) -> Error {
    let details = problem.problem();
    let hint = details.hint.as_ref().map_or_else(String::new, |hint| format!(" {hint}"));
    Error::Request(format!("{}{hint}", details.detail))
}

fn kind(text: &str) -> Result<ExportFormat, String> {
    let names = || ExportFormat::ALL.map(ExportFormat::name).join(", ");
    ExportFormat::from_name(text).ok_or_else(|| format!("is none of {}", names()))
}

fn part(text: &str) -> Result<SessionPart, String> {
    let number = |text: &str| text.parse::<usize>().map_err(|_| "write it as 0 or 0/1".to_owned());
    match text.split_once('/') {
        Some((target, run)) => Ok(SessionPart { target: Some(number(target)?), run: Some(number(run)?) }),
        None => Ok(SessionPart { target: Some(number(text)?), run: None }),
    }
}
