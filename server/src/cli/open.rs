//! Opens the traverse argument of a command: a folder, an index, or a scenario (a file, or a name of the library), for which
//! a folder is created first.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use sightline_geometry::error::{Error, Result};
use sightline_recordings::import::recognise;
use sightline_recordings::{Traverse, create_simulated};
use sightline_world::{Scenario, library};

use super::terminal::{self, Progress};
use crate::drives;

/// The subfolder of the data folder with simulated traverses.
pub(super) const TRAVERSES: &str = "traverses";

/// Maximum size of a scenario file, bytes.
const SCENARIO_LIMIT: u64 = 1 << 20;

/// The data folder of the program.
///
/// # Errors
/// When neither the command line nor the environment specifies one.
pub(super) fn data_folder(given: Option<&Path>) -> Result<PathBuf> {
    let from = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let found = given
        .map(Path::to_owned)
        .or_else(|| from("SIGHTLINE_HOME"))
        .or_else(|| from("XDG_DATA_HOME").map(|data| data.join("sightline")))
        .or_else(|| from("HOME").map(|home| home.join(".local/share/sightline")));
    found.ok_or_else(|| Error::Request("there is no home folder; choose a folder with --data-dir".to_owned()))
}

/// Opens a traverse by its folder or index, or creates one from a scenario in the data folder.
///
/// # Errors
/// As [`Traverse::open`] and [`create_simulated`].
pub fn open(path: &Path, data: Option<&Path>) -> Result<Traverse> {
    if let Some(name) = library_name(path).filter(|_| !path.exists()) {
        return simulated(&library::scenario(name)?, &data_folder(data)?);
    }
    match read_scenario_or_index(path)? {
        Some(scenario) => simulated(&scenario, &data_folder(data)?),
        None => Traverse::open(path).map_err(|error| foreign(path).unwrap_or(error)),
    }
}

/// The error that explains how to open a foreign recording, if `path` is one.
fn foreign(path: &Path) -> Option<Error> {
    let format = recognise(path).ok()?.name();
    let shown = path.display();
    let problem = format!(
        "is a {format} recording, and not a drive yet; open it in the page after `sightline serve --recordings {shown}`, \
         or make a drive with `sightline import {shown} --out DRIVE`"
    );
    Some(Error::format(path, problem))
}

/// The traverse of a scenario. The folder depends only on the scenario, so that images are rendered once.
///
/// # Errors
/// As [`create_simulated`].
pub(super) fn simulated(scenario: &Scenario, data: &Path) -> Result<Traverse> {
    let folder = data.join(TRAVERSES).join(drives::folder_name(scenario));
    if !folder.exists() {
        terminal::error(&format!("making the simulated traverse {}", folder.display()));
    }
    create_simulated(scenario, &folder)
}

/// The scenario in a file, or the library scenario of this name.
///
/// # Errors
/// A file that cannot be read or is not a scenario, or a name that is neither a file nor in the library.
pub fn scenario(path: &Path) -> Result<Scenario> {
    // A folder of that name is not a scenario: a study stores its worlds in one.
    if let Some(name) = library_name(path).filter(|_| !path.is_file()) {
        return library::scenario(name);
    }
    if !path.exists() && path.extension().is_none() && path.components().count() == 1 {
        return library::scenario(&path.to_string_lossy());
    }
    Scenario::from_toml(&read(path)?, path)
}

/// The name of the library scenario that `path` is, if any.
fn library_name(path: &Path) -> Option<&'static str> {
    library::names().find(|name| path == Path::new(name))
}

/// Renders the missing images of a simulated traverse, including its further cameras, and reports progress; does nothing for
/// a recorded traverse.
///
/// # Errors
/// As [`Traverse::render_camera`].
pub fn render(traverse: &Traverse) -> Result<()> {
    let cameras = |step: usize| {
        let further = traverse.further_cameras(step).map(|camera| Some(camera.name));
        std::iter::once(None).chain(further).map(move |camera| (step, camera))
    };
    let all = (0..traverse.stop_count()).flat_map(cameras);
    let missing: Vec<_> = all.filter(|&(step, camera)| !traverse.is_rendered(step, camera)).collect();
    let mut progress = Progress::new("rendered pair");
    for (done, &(step, camera)) in missing.iter().enumerate() {
        progress.tell(done, missing.len());
        traverse.render_camera(step, camera, &AtomicBool::new(false))?;
    }
    if !missing.is_empty() {
        progress.tell(missing.len(), missing.len());
    }
    Ok(())
}

/// The scenario in `path`, if the file is one: an index always has stops, a scenario never.
fn read_scenario_or_index(path: &Path) -> Result<Option<Scenario>> {
    if path.is_dir() || path.extension().is_none_or(|ending| ending != "toml") {
        return Ok(None);
    }
    // An index may be larger than any scenario.
    if std::fs::metadata(path).is_ok_and(|about| about.len() > SCENARIO_LIMIT) {
        return Ok(None);
    }
    let text = read(path)?;
    let is_index = toml::from_str::<toml::Table>(&text)
        .is_ok_and(|table| table.contains_key("stops") || table.contains_key("format"));
    if is_index { Ok(None) } else { Scenario::from_toml(&text, path).map(Some) }
}

fn read(path: &Path) -> Result<String> {
    let unreadable = |source| Error::Read { path: path.to_owned(), source };
    if std::fs::metadata(path).map_err(unreadable)?.len() > SCENARIO_LIMIT {
        return Err(Error::format(path, "is too large for a scenario"));
    }
    std::fs::read_to_string(path).map_err(unreadable)
}
