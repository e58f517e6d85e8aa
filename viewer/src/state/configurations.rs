//! Named configurations: which one a run is, and what must change so that a run becomes one.

use sightline_core::presets::{PRESETS, Preset};
use sightline_core::settings::{Changes, Settings};

use super::State;

/// The named configurations with the settings that they stand for.
pub struct Configurations(Vec<(&'static Preset, Settings)>);

impl Default for Configurations {
    /// All of [`PRESETS`].
    fn default() -> Self {
        Self(PRESETS.iter().filter_map(|preset| Some((preset, preset.settings().ok()?))).collect())
    }
}

impl Configurations {
    /// Every named configuration, in the order in which they are listed.
    pub fn all(&self) -> impl Iterator<Item = &'static Preset> {
        self.0.iter().map(|(preset, _)| *preset)
    }

    /// The one whose settings these are.
    pub fn named(&self, settings: &Settings) -> Option<&'static Preset> {
        self.0.iter().find(|(_, of_preset)| of_preset == settings).map(|(preset, _)| *preset)
    }

    fn settings(&self, name: &str) -> Option<&Settings> {
        self.0.iter().find(|(preset, _)| preset.name == name).map(|(_, settings)| settings)
    }
}

impl State {
    /// The settings with which the next run would go: those of the run looked at, with the draft's changes.
    pub fn pending(&self) -> Option<Settings> {
        let settings = &self.run()?.settings;
        if self.draft.is_empty() { Some(settings.clone()) } else { settings.with(&self.draft).ok() }
    }

    /// The changes that take the run looked at to a named configuration.
    pub(super) fn changes_to(&self, name: &str) -> Option<Changes> {
        self.changes_to_settings(self.configurations.settings(name)?)
    }

    /// The changes that take the run looked at to these settings.
    pub(super) fn changes_to_settings(&self, wanted: &Settings) -> Option<Changes> {
        Some(wanted.changes_from(&self.run()?.settings))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_named_by_their_preset_and_one_change_makes_them_nameless() {
        let configurations = Configurations::default();
        assert_eq!(configurations.all().count(), PRESETS.len());
        for preset in PRESETS {
            let named = configurations.named(&preset.settings().unwrap());
            assert_eq!(named.map(|found| found.name), Some(preset.name));
        }
        let changes = [("ncc_min".to_owned(), serde_json::json!(0.61))].into();
        assert!(configurations.named(&Settings::default().with(&changes).unwrap()).is_none());
    }
}
