//! Everything needed to reproduce the same rows, bit for bit: settings, seed, versions, hashes and commands, as JSON.

use serde_json::{Value, json};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_rover::version::tracker_version;
use sightline_session::reproduce::{FORMAT, FORMAT_VERSION};
use sightline_session::shell;
use sightline_world::Scenario;

use super::kind::SessionPart;
use super::rows;
use super::source::{NamedRun, Source};
use crate::drives;
use crate::naming::hash;
use crate::version::VERSION;

/// The bundle as JSON text.
///
/// # Errors
/// [`Error::Cancelled`](sightline_geometry::error::Error::Cancelled).
pub(crate) fn json(source: &Source, part: SessionPart, cancel: Cancel<'_>) -> Result<String> {
    let traverse = &source.open.traverse;
    let index = traverse.index();
    let scenario = scenario(source);
    let runs = source.runs(part).into_iter().map(|run| of_run(source, run, cancel));
    let runs = runs.collect::<Result<Vec<Value>>>()?;
    let bundle = json!({
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "program": {
            "name": "sightline",
            "version": VERSION,
            "tracker": tracker_version(),
            "same_bits": "on the same build and kind of processor, whatever the number of threads; across processors within 1e-5",
        },
        "traverse": {
            "id": source.open.id,
            "name": index.name,
            "description": index.description,
            "stops": index.stops.len(),
            "index_sha256": hash(&serde_json::to_vec(index).unwrap_or_default()),
            "files_sha256": source.open.identity.files_sha256,
            "seed": scenario.as_ref().map(|scenario| scenario.seed),
            "scenario_sha256": scenario.as_ref().map(|scenario| hash(scenario.to_toml().as_bytes())),
            "scenario_toml": scenario.as_ref().map(Scenario::to_toml),
            "driven": source.open.commanded.as_ref().map(|drive| {
                drive.with(|world| world.state().iter().take(index.stops.len()).cloned().collect::<Vec<_>>())
            }),
        },
        "session": source.session.saved(),
        "notes": source.notes.list,
        "runs": runs,
    });
    Ok(format!("{bundle:#}\n"))
}

fn of_run(source: &Source, run: NamedRun<'_>, cancel: Cancel<'_>) -> Result<Value> {
    let only = SessionPart { target: Some(run.target), run: Some(run.number) };
    let settings = serde_json::to_vec(run.run.settings.as_ref()).unwrap_or_default();
    Ok(json!({
        "target": run.target,
        "label": run.record.label,
        "run": run.number,
        "designation": run.record.designation,
        "fork": run.run.fork,
        "settings_changed": run.run.settings.changes(),
        "settings_sha256": hash(&settings),
        "steps": run.run.steps.len(),
        "rows_sha256": hash(rows::jsonl(source, only, cancel)?.as_bytes()),
        "command": command(source, run),
    }))
}

/// The command line that recomputes a run; `None` for a run forked after its first step, and in a commanded drive.
pub(crate) fn command(source: &Source, run: NamedRun<'_>) -> Option<String> {
    let designation = run.record.designation;
    if run.run.fork.is_some_and(|fork| fork.from_step > designation.step) || source.open.commanded.is_some() {
        return None;
    }
    Some(shell::track(&place_of_traverse(source), designation, &run.run.settings.changes()))
}

/// The command-line argument for the traverse: the library name of its scenario, or a placeholder. The path of the folder on
/// this machine is not disclosed.
fn place_of_traverse(source: &Source) -> String {
    let own = scenario(source);
    match (own.as_ref().and_then(drives::library_name), own) {
        (Some(name), _) => name.to_owned(),
        (None, Some(_)) => "scenario.toml".to_owned(),
        (None, None) => "FOLDER".to_owned(),
    }
}

/// The scenario of a simulated traverse.
pub(crate) fn scenario(source: &Source) -> Option<Scenario> {
    drives::scenario_of(&source.open.traverse)
}
