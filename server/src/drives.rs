//! The simulated drives opened so far: their folders, their scenarios, and reopening them after a restart.

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use sightline_api::event::Event;
use sightline_geometry::error::Result;
use sightline_recordings::{Traverse, create_simulated};
use sightline_track::locate::store::Cache;
use sightline_world::{Scenario, library};
use tokio::sync::broadcast;

use crate::folders::Folders;
use crate::identity::Identity;
use crate::naming::{hash, slug};
use crate::rendering::OpenTraverse;
use crate::store::Store;

/// The folder name of a scenario's drive. It depends only on the scenario, so that images are rendered once.
pub(crate) fn folder_name(scenario: &Scenario) -> String {
    format!("{}-{}", slug(&scenario.name), &hash(scenario.to_toml().as_bytes())[..12])
}

/// The scenario of a simulated traverse.
pub(crate) fn scenario_of(traverse: &Traverse) -> Option<Scenario> {
    let path = traverse.folder().join(traverse.index().scenario.as_ref()?);
    let text = std::fs::read_to_string(&path).ok()?;
    Scenario::from_toml(&text, &path).ok()
}

/// The name of an identical scenario in the library.
pub(crate) fn library_name(scenario: &Scenario) -> Option<&'static str> {
    let text = scenario.to_toml();
    library::names().find(|name| library::scenario(name).is_ok_and(|known| known.to_toml() == text))
}

/// The command-line argument that opens the traverse on this machine: a library name, or the folder.
pub(crate) fn argument(traverse: &Traverse) -> String {
    let named = scenario_of(traverse).as_ref().and_then(library_name);
    let folder = traverse.folder();
    let folder = || std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    named.map_or_else(|| folder().display().to_string(), str::to_owned)
}

/// The drives passed to the server without duplicates, and a notice for each duplicate.
///
/// # Errors
/// An index that cannot be serialised for its name.
pub(crate) fn open_initial(
    traverses: Vec<Traverse>,
    folders: &Folders,
    events: &broadcast::Sender<Event>,
) -> Result<(Vec<Arc<OpenTraverse>>, Vec<String>)> {
    let (mut open, mut notices) = (Vec::<Arc<OpenTraverse>>::new(), Vec::new());
    for traverse in traverses {
        let identity = Identity::of(&traverse, Some(&folders.digests))?;
        let id = identity.id();
        match open.iter().find(|other| other.id == id) {
            Some(other) => {
                let [this, other] = [traverse.folder(), other.traverse.folder()].map(Path::display);
                notices.push(format!(
                    "{this} and {other} are the same drive, {id}: index and images are equal; it is listed once"
                ));
            }
            None => open.push(Arc::new(OpenTraverse::new(identity, traverse, events.clone()))),
        }
    }
    Ok((open, notices))
}

/// Reopens the drives that were opened from pages; returns one sentence for each that cannot be opened.
///
/// # Errors
/// A database that cannot be read, or an index that cannot be serialised for its name.
pub(crate) fn reopen(
    store: &Store,
    folders: &Folders,
    cache: &Arc<Cache>,
    open: &mut Vec<Arc<OpenTraverse>>,
    events: &broadcast::Sender<Event>,
) -> Result<Vec<String>> {
    let make = |(name, text): (String, String)| {
        let made = Scenario::from_toml(&text, Path::new("scenario")).and_then(|scenario| {
            create_simulated(&scenario, &folders.traverses.join(folder_name(&scenario)))
        });
        (name, made)
    };
    // Reading a long index takes almost a second, so the indexes are read in parallel.
    let all: Vec<_> = store.drives()?.into_par_iter().map(make).collect();
    let mut lost = Vec::new();
    for (name, made) in all {
        match made {
            Ok(traverse) => {
                let identity = Identity::of(&traverse, None)?;
                let id = identity.id();
                // Not an error: the drive was also given on the command line.
                if open.iter().all(|other| other.id != id) {
                    let traverse = traverse.with_cache(cache);
                    open.push(Arc::new(OpenTraverse::new(identity, traverse, events.clone())));
                }
            }
            Err(error) => lost.push(format!("the drive {name} cannot be opened again: {error}")),
        }
    }
    Ok(lost)
}
