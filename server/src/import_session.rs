//! Opens a simulated drive from a scenario that a page uploads, and a session from an exported `reproduce.json`.
//!
//! Uploads are untrusted: the scenario's ranges, the settings of every run, the numbers of targets and runs, labels,
//! breakpoints and notes pass the same checks as in the other routes. Drives are recorded in the database, so that their
//! sessions survive a restart.

use std::path::Path;
use std::sync::Arc;

use sightline_api::event::Event;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::{DrivenTraverse, IndexFormat, create_simulated_until};
use sightline_session::Session;
use sightline_session::breakpoints::BREAKPOINT_LIMIT;
use sightline_session::notes::Notes;
use sightline_session::reproduce::{ReproducedTraverse, Reproduction};
use sightline_session::view::{SavedRun, SavedSession};
use sightline_track::settings::Settings;
use sightline_world::Scenario;
use sightline_world::rover::driven::DrivenStop;

use crate::cancel::CancelFlag;
use crate::commanded_drive;
use crate::drives::{folder_name, scenario_of};
use crate::identity::{Identity, Relation};
use crate::imports;
use crate::limits::{Limit, Limits};
use crate::live_session::{LABEL_LIMIT, LiveSession};
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::routes::what_if;
use crate::state::AppState;

/// Opens the drive of a scenario; the flag is true if it was not open before.
///
/// # Errors
/// A problem that names the fault in the scenario; also when there are too many drives, or soon after `cancel` is set.
pub(crate) fn open_scenario(
    state: &AppState,
    text: &str,
    cancel: &CancelFlag,
) -> ApiResult<(Arc<OpenTraverse>, bool)> {
    let scenario = Scenario::from_toml(text, Path::new("scenario")).map_err(|error| {
        ApiError::invalid("field", error.to_string())
            .hint("`sightline scenarios` writes scenarios to begin with.")
    })?;
    let text = scenario.to_toml();
    let known = state.traverses();
    let same = |open: &&Arc<OpenTraverse>| {
        open.commanded.is_none() && scenario_of(&open.traverse).is_some_and(|own| own == scenario)
    };
    if let Some(open) = known.iter().find(same) {
        return Ok((Arc::clone(open), false));
    }
    let (count, limits) = (state.store().drives()?.len(), state.limits());
    if count >= limits.drives.count() {
        let detail = format!("There are {count} drives already that were opened from pages.");
        let way_out = "Remove one that is not needed: DELETE traverses/{id}.";
        return Err(ApiError::conflict(detail).hint(limits.drives.hint(way_out)));
    }
    let _lock = state.drive_folder_lock();
    let name = folder_name(&scenario);
    let folder = state.folders().traverses.join(&name);
    if folder.is_dir() && !folder.join(IndexFormat::default().file_name()).is_file() {
        // An interrupted removal left images without their index.
        remove_folder(&folder)?;
    }
    let traverse = create_simulated_until(&scenario, &folder, cancel.as_ref().into())?;
    if let Err(problem) = limits.check_drive(&traverse) {
        remove_folder(&folder)?;
        return Err(problem.into());
    }
    let identity = Identity::of(&traverse, None)?;
    let traverse = traverse.with_cache(state.cache());
    let open = Arc::new(OpenTraverse::new(identity, traverse, state.events().clone()));
    state.store().save_drive(&name, &text)?;
    Ok((state.add_traverse(open)?, true))
}

/// Removes a drive that was opened from a scenario, with its folder.
///
/// # Errors
/// A problem if the drive has sessions, or its folder cannot be removed.
pub(crate) fn remove_traverse(state: &AppState, open: &OpenTraverse) -> ApiResult<()> {
    let _lock = state.drive_folder_lock();
    state.close_traverse(open)?;
    if open.commanded.is_some() {
        remove_folder(open.traverse.folder())?;
    } else if imports::forget(state.folders(), open)? {
        // `forget` removes the folder, or only the reference to a folder outside the data folder.
    } else if let Some(scenario) = scenario_of(&open.traverse) {
        let name = folder_name(&scenario);
        state.store().remove_drive(&name)?;
        remove_folder(&state.folders().traverses.join(&name))?;
    }
    state.send_event(Event::TraverseRemoved { traverse: open.id.clone() });
    Ok(())
}

pub(crate) fn remove_folder(folder: &Path) -> Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::Write { path: folder.to_owned(), source })
        }
        _ => Ok(()),
    }
}

/// Creates a session from a file that was exported elsewhere.
///
/// # Errors
/// A problem that names the fault; no session is created then.
pub(crate) fn import_session(
    state: &AppState,
    new: Reproduction,
    cancel: &CancelFlag,
) -> ApiResult<Arc<LiveSession>> {
    let Reproduction { traverse, mut session, notes } = new;
    check(&session, state.limits())?;
    let open = match (&traverse.driven, &traverse.scenario_toml) {
        (Some(stops), Some(text)) => open_commanded_drive(state, text, stops, cancel)?,
        _ => {
            // Without a commanded drive, the stops are fixed and nothing steers.
            session.steering = None;
            find_or_open(state, &traverse, cancel)?
        }
    };
    let stops = open.traverse.stop_count();
    let name = open.id.clone();
    let live = state.enter_session(open, false, |id| {
        let session = SavedSession { id, traverse: name, ..session };
        let session = Session::restored(&session, stops)?;
        let notes = Notes::brought(notes, &session)?;
        Ok((session, notes))
    })?;
    // Loading the session starts its runs.
    state.session(&live.id)
}

/// The commanded drive of a file, in a new world with the recorded state.
fn open_commanded_drive(
    state: &AppState,
    text: &str,
    stops: &[DrivenStop],
    cancel: &CancelFlag,
) -> ApiResult<Arc<OpenTraverse>> {
    let wrong = |error: Error| ApiError::invalid("field", error.to_string());
    let scenario = Scenario::from_toml(text, Path::new("scenario")).map_err(wrong)?;
    let limit = state.limits().stops.count();
    if stops.len() > limit {
        let detail = format!("traverse.driven: may have at most {limit} stops");
        return Err(ApiError::invalid("field", detail).hint(state.limits().stops.raise()));
    }
    let folder = commanded_drive::new_folder(state.folders(), &scenario.name)?;
    let made = DrivenTraverse::begin_at(&scenario, stops.to_vec(), &folder, cancel.as_ref().into());
    let opened = made.and_then(|world| {
        state.limits().check_drive(world.traverse())?;
        state.add_traverse(Arc::new(commanded_drive::open(world, state.cache(), state.events())?))
    });
    opened.map_err(|error| {
        let _ = remove_folder(&folder);
        wrong(error)
    })
}

/// The traverse of a file: an open one, or one opened from its scenario.
fn find_or_open(
    state: &AppState,
    traverse: &ReproducedTraverse,
    cancel: &CancelFlag,
) -> ApiResult<Arc<OpenTraverse>> {
    let known = state.traverses();
    let find = |wanted: Relation| known.iter().find(|open| open.identity.relation(&traverse.id) == wanted);
    if let Some(open) = find(Relation::Same).or_else(|| find(Relation::SameIndex)) {
        return Ok(Arc::clone(open));
    }
    match &traverse.scenario_toml {
        Some(text) => Ok(open_scenario(state, text, cancel)?.0),
        None => {
            let name: String = crate::printable::printable(&traverse.name).chars().take(100).collect();
            if find(Relation::OtherFiles).is_some() {
                let detail =
                    format!("The drive “{name}” that is open here has other images than that of the file.");
                return Err(ApiError::invalid("traverse", detail).hint(
                    "Start the server with the folder of the very recording that the file was made of.",
                ));
            }
            let detail = format!("The file belongs to the recorded drive “{name}”, which is not open here.");
            Err(ApiError::invalid("traverse", detail)
                .hint("Start the server with that drive's folder, `sightline serve FOLDER`, and open the file again."))
        }
    }
}

/// Applies the checks of the other routes.
fn check(session: &SavedSession, limits: &Limits) -> ApiResult<()> {
    let wrong = |what: String| Err(ApiError::invalid("field", what));
    let live = session.targets.iter().filter(|target| !target.removed).count();
    let too_many = |what: String, limit: &Limit| {
        let detail = format!("{what}: may be at most {}", limit.count());
        Err(ApiError::invalid("field", detail).hint(limit.raise()))
    };
    if live > limits.targets.count() {
        return too_many("session.targets".to_owned(), &limits.targets);
    }
    if session.targets.len() > limits.target_numbers.count() {
        return too_many("session.targets with the removed ones".to_owned(), &limits.target_numbers);
    }
    if session.breakpoints.len() > BREAKPOINT_LIMIT {
        return wrong(format!("session.breakpoints: may be at most {BREAKPOINT_LIMIT}"));
    }
    for (number, target) in session.targets.iter().enumerate() {
        let field = format!("session.targets[{number}]");
        if target.label.chars().count() > LABEL_LIMIT {
            return wrong(format!("{field}.label: may have at most {LABEL_LIMIT} characters"));
        }
        if target.runs.len() > limits.runs.count() {
            return too_many(format!("{field}.runs"), &limits.runs);
        }
        for (run, saved) in target.runs.iter().enumerate() {
            check_run(saved)
                .map_err(|error| ApiError::invalid("field", format!("{field}.runs[{run}]: {error}")))?;
            what_if::check_pixel(saved.fork.and_then(|fork| fork.prediction_px))?;
        }
    }
    Ok(())
}

/// Accepts only settings that a user could have chosen.
fn check_run(saved: &SavedRun) -> Result<()> {
    let again = Settings::default().with(&saved.settings.changes())?;
    if again == saved.settings {
        Ok(())
    } else {
        Err(Error::Request("its settings are none that can be chosen".to_owned()))
    }
}
