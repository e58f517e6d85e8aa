//! What the draft would make of the run that is looked at, and what must change so that it becomes another configuration.

use sightline_track::settings::{Changes, Settings};

use crate::state::State;

impl State {
    /// The settings with which the next run would go: those of the run looked at, with the draft's changes.
    pub fn pending(&self) -> Option<Settings> {
        let settings = &self.run()?.settings;
        if self.draft.is_empty() { Some(settings.clone()) } else { settings.with(&self.draft).ok() }
    }

    /// The changes that take the run looked at to a named configuration.
    pub(crate) fn changes_to(&self, name: &str) -> Option<Changes> {
        self.changes_to_settings(self.configurations.settings(name)?)
    }

    /// The changes that take the run looked at to these settings.
    pub(crate) fn changes_to_settings(&self, wanted: &Settings) -> Option<Changes> {
        Some(wanted.changes_from(&self.run()?.settings))
    }
}
