//! The simulated drives that were opened: their folders, their scenarios, and opening them again after a restart.

use std::path::Path;
use std::sync::Arc;

use sightline_api::wire::Event;
use sightline_geometry::error::Result;
use sightline_recordings::{Traverse, create_simulated};
use sightline_world::{Scenario, library};
use tokio::sync::broadcast;

use crate::folders::Folders;
use crate::naming::{hash, name_of, slug};
use crate::rendering::OpenTraverse;
use crate::store::Store;

/// The name of the folder of a scenario's drive: the same scenario always has the same, so that images are rendered once.
pub(crate) fn folder_name(scenario: &Scenario) -> String {
    format!("{}-{}", slug(&scenario.name), &hash(scenario.to_toml().as_bytes())[..12])
}

/// The scenario of a simulated traverse.
pub(crate) fn scenario_of(traverse: &Traverse) -> Option<Scenario> {
    let path = traverse.folder().join(traverse.index().scenario.as_ref()?);
    let text = std::fs::read_to_string(&path).ok()?;
    Scenario::from_toml(&text, &path).ok()
}

/// The name in the library of this very scenario.
pub(crate) fn library_name(scenario: &Scenario) -> Option<&'static str> {
    let text = scenario.to_toml();
    library::names().find(|name| library::scenario(name).is_ok_and(|known| known.to_toml() == text))
}

/// What opens the traverse on this machine's command line: a name of the library, or its folder.
pub(crate) fn argument(traverse: &Traverse) -> String {
    let named = scenario_of(traverse).as_ref().and_then(library_name);
    let folder = traverse.folder();
    let folder = || std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    named.map_or_else(|| folder().display().to_string(), str::to_owned)
}

/// Opens the drives that were opened from pages before; what cannot be opened is said in one sentence each.
///
/// # Errors
/// A database that cannot be read, or an index that cannot be named.
pub(crate) fn open_again(
    store: &Store,
    folders: &Folders,
    open: &mut Vec<Arc<OpenTraverse>>,
    events: &broadcast::Sender<Event>,
) -> Result<Vec<String>> {
    let mut lost = Vec::new();
    for (name, text) in store.drives()? {
        let made = Scenario::from_toml(&text, Path::new("scenario")).and_then(|scenario| {
            create_simulated(&scenario, &folders.traverses.join(folder_name(&scenario)))
        });
        match made {
            Ok(traverse) => {
                let id = name_of(&traverse)?;
                if open.iter().all(|other| other.id != id) {
                    open.push(Arc::new(OpenTraverse::new(id, traverse, events.clone())));
                }
            }
            Err(error) => lost.push(format!("the drive {name} cannot be opened again: {error}")),
        }
    }
    Ok(lost)
}
