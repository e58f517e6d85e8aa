//! The settings that result from the draft, and the changes that lead from the selected run to another configuration.

use sightline_track::settings::{Changes, Settings};

use crate::state::State;

impl State {
    /// The settings of the next run: those of the selected run with the draft's changes.
    pub fn pending(&self) -> Option<Settings> {
        let settings = &self.run()?.settings;
        if self.draft.is_empty() { Some(settings.clone()) } else { settings.with(&self.draft).ok() }
    }

    /// The changes from the selected run to a named configuration.
    pub(crate) fn changes_to(&self, name: &str) -> Option<Changes> {
        self.changes_to_settings(self.configurations.settings(name)?)
    }

    /// The changes from the selected run to these settings.
    pub(crate) fn changes_to_settings(&self, wanted: &Settings) -> Option<Changes> {
        Some(wanted.changes_from(&self.run()?.settings))
    }
}
