//! The named configurations, and the lookup of the one that a run uses.

use sightline_track::presets::{PRESETS, Preset};
use sightline_track::settings::Settings;

/// The named configurations with their settings.
pub struct Configurations(Vec<(&'static Preset, Settings)>);

impl Default for Configurations {
    /// All of [`PRESETS`].
    fn default() -> Self {
        Self(PRESETS.iter().filter_map(|preset| Some((preset, preset.settings().ok()?))).collect())
    }
}

impl Configurations {
    /// All named configurations, in the order of the list.
    pub fn all(&self) -> impl Iterator<Item = &'static Preset> {
        self.0.iter().map(|(preset, _)| *preset)
    }

    /// The configuration with exactly these settings.
    pub fn named(&self, settings: &Settings) -> Option<&'static Preset> {
        self.0.iter().find(|(_, of_preset)| of_preset == settings).map(|(preset, _)| *preset)
    }

    pub(super) fn settings(&self, name: &str) -> Option<&Settings> {
        self.0.iter().find(|(preset, _)| preset.name == name).map(|(_, settings)| settings)
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
