//! `sightline simulate`: renders a simulated traverse into a folder.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Args;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::{Traverse, create_simulated};
use sightline_world::Scenario;

use super::terminal::{self, Progress};
use super::{open, sheet};

/// Render a simulated traverse into a folder.
#[derive(Debug, Args)]
pub(super) struct Simulate {
    /// The scenario: a file, or a name from `sightline scenarios`; by default the demonstration.
    #[arg(value_name = "SCENARIO")]
    scenario: Option<PathBuf>,
    /// The folder to create.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Another seed than the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// A setting of the scenario, for example sun.elevation_deg=20; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Also write a contact sheet of the drive, a PNG.
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// Also write the ground truth of every image: ranges, surfaces, normals and shadows as .npy files in the folder
    /// `truth`, 42 MiB a stop of 1024 × 1024 px.
    #[arg(long)]
    truth: bool,
}

impl Simulate {
    /// Creates the folder and renders every stop.
    ///
    /// # Errors
    /// A bad scenario or setting, or a folder that cannot be written or contains another traverse.
    pub(super) fn run(self) -> Result<()> {
        let mut scenario = self.scenario.as_deref().map_or_else(|| Ok(Scenario::demo()), open::scenario)?;
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        let scenario = with(&scenario, "--set", &self.set)?;
        let traverse = create_simulated(&scenario, &self.out)?;
        open::render(&traverse)?;
        if self.truth {
            write_truth(&traverse)?;
        }
        if let Some(path) = &self.sheet {
            sheet::write(&traverse, path)?;
        }
        let (stops, folder) = (traverse.stop_count(), self.out.display());
        terminal::line(&format!("{folder}: {stops} stops"))
    }
}

/// Writes the ground truth of every stop and reports progress.
fn write_truth(traverse: &Traverse) -> Result<()> {
    let stops = traverse.stop_count();
    let mut progress = Progress::new("wrote the truth of stop");
    for step in 0..stops {
        progress.tell(step, stops);
        traverse.write_truth(step, &AtomicBool::new(false))?;
    }
    progress.tell(stops, stops);
    Ok(())
}

/// The scenario with settings changed by name; errors mention `option`.
pub(super) fn with(scenario: &Scenario, option: &str, changes: &[String]) -> Result<Scenario> {
    let mut document: toml::Table =
        toml::from_str(&scenario.to_toml()).map_err(|error| Error::Request(error.to_string()))?;
    for change in changes {
        let (key, value) = change.split_once('=').ok_or_else(|| {
            Error::setting(change, "write it as key=value, for example sun.elevation_deg=20")
        })?;
        set(&mut document, key.trim(), value.trim())?;
    }
    Scenario::from_toml(&document.to_string(), Path::new(option))
}

/// Sets a value; an integer is accepted for a fraction.
///
/// Optional settings that are absent from the document are checked by parsing the changed document.
fn set(document: &mut toml::Table, key: &str, value: &str) -> Result<()> {
    let unknown = || Error::setting(key, "the scenario has no such setting");
    let (sections, name) =
        key.rsplit_once('.').map_or((None, key), |(sections, name)| (Some(sections), name));
    let mut section = &mut *document;
    for part in sections.into_iter().flat_map(|sections| sections.split('.')) {
        section = section.get_mut(part).and_then(toml::Value::as_table_mut).ok_or_else(unknown)?;
    }
    let old = section.get(name);
    if old.is_some_and(toml::Value::is_table) {
        return Err(unknown());
    }
    let is_new = old.is_none();
    let written: Option<toml::Value> = toml::from_str::<toml::Table>(&format!("value = {value}"))
        .ok()
        .and_then(|mut table| table.remove("value"));
    let new = match (old.is_some_and(toml::Value::is_float), written) {
        (true, Some(toml::Value::Integer(whole))) => toml::Value::Float(whole as f64),
        (_, Some(written)) => written,
        (_, None) => toml::Value::String(value.to_owned()),
    };
    section.insert(name.to_owned(), new);
    match toml::from_str::<Scenario>(&document.to_string()) {
        Err(problem) if is_new && problem.message().contains("unknown field") => Err(unknown()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use sightline_world::scenario::CameraRig;

    use super::*;

    #[test]
    fn settings_of_a_scenario_change_by_name() {
        let changes = ["sun.elevation_deg=20".to_owned(), "name = two words".to_owned()];
        let changed = with(&Scenario::demo(), "--set", &changes).unwrap();
        assert_eq!((changed.sun.elevation_deg, changed.name.as_str()), (20.0, "two words"));
        assert_eq!(changed.rocks, Scenario::demo().rocks);
        // The demonstration has no hand-off, so its document does not contain the setting.
        let handed_over =
            with(&Scenario::demo(), "--set", &["camera.hand_over=mer_front_hazcam".to_owned()]).unwrap();
        assert_eq!(handed_over.camera.hand_over, Some(CameraRig::MerFrontHazcam));
    }

    #[test]
    fn unknown_scenario_settings_are_rejected_by_name() {
        for (change, named) in
            [("sun.height=3", "sun.height"), ("sun=3", "sun"), ("a.b=1", "a.b"), ("seed", "key=value")]
        {
            let message = with(&Scenario::demo(), "--set", &[change.to_owned()]).unwrap_err().to_string();
            assert!(message.contains(named), "{message}");
        }
        let message =
            with(&Scenario::demo(), "--set", &["sun.elevation_deg=-3".to_owned()]).unwrap_err().to_string();
        assert!(message.contains("sun.elevation_deg"), "{message}");
    }
}
