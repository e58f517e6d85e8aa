//! Actions on a listed target: rename it, hide its marks, designate it again at another stop.

use egui::Color32;
use sightline_api::endpoint::Call;
use sightline_api::endpoints::RenameTarget;
use sightline_api::location::AtTarget;
use sightline_api::wire::TargetLabel;
use sightline_session::view::TargetView;
use sightline_track::settings::Changes;

use crate::command::Mode;
use crate::state::State;
use crate::state::undoable::UndoableChange;
use crate::theme;

/// A command about the name of a target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Rename {
    /// Opens the field for a target's name.
    Begin(usize),
    /// Changes the text of the open field.
    Type(String),
    /// Renames the target and closes the field.
    Save,
    /// Closes the field.
    Cancel,
}

/// The open field for a target's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Renaming {
    /// The target's number.
    pub target: usize,
    /// The text entered so far.
    pub text: String,
}

impl State {
    /// Applies a command about a name.
    pub(crate) fn rename(&mut self, rename: Rename) {
        match rename {
            Rename::Begin(target) => {
                let text = self.label_of(target);
                self.renaming = text.map(|text| Renaming { target, text });
            }
            Rename::Type(text) => {
                if let Some(renaming) = &mut self.renaming {
                    renaming.text = text;
                }
            }
            Rename::Save => {
                let Some(Renaming { target, text }) = self.renaming.take() else { return };
                let Some(before) = self.label_of(target).filter(|before| *before != text.trim()) else {
                    return;
                };
                self.rename_target(target, text, Some(before));
            }
            Rename::Cancel => self.renaming = None,
        }
    }

    fn target_numbered(&self, target: usize) -> Option<&TargetView> {
        self.session.as_ref()?.targets.iter().find(|known| known.number == target)
    }

    pub(crate) fn label_of(&self, target: usize) -> Option<String> {
        self.target_numbered(target).map(|known| known.label.clone())
    }

    /// Whether the marks of the cursor's target are shown in the images.
    pub(crate) fn shows_target(&self) -> bool {
        self.cursor.target.is_none_or(|target| !self.hidden_targets.contains(&target))
    }

    pub(super) fn toggle_target(&mut self, target: usize) {
        if !self.hidden_targets.remove(&target) {
            self.hidden_targets.insert(target);
        }
    }

    pub(super) fn colour_target(&mut self, target: usize, colour: Option<usize>) {
        match colour {
            Some(colour) => self.target_colours.insert(target, colour),
            None => self.target_colours.remove(&target),
        };
    }

    /// The colour of the marks of an unselected target: grey unless the user chose another.
    pub(crate) fn colour_of(&self, target: usize) -> Color32 {
        self.target_colours.get(&target).map_or_else(theme::weak, |colour| theme::run(*colour))
    }

    pub(super) fn repick(&mut self, target: usize) {
        self.set_mode(Mode::Pick);
        self.repicks = self.target_numbered(target).map(|target| target.number);
    }

    /// Label and settings of the target that is designated again at a stop; the settings are those of its newest run.
    pub(super) fn repicked(&self, step: usize) -> Option<(String, Changes)> {
        let target = self.target_numbered(self.repicks?)?;
        let settings = target.runs.last().map(|run| run.changes.clone()).unwrap_or_default();
        Some((format!("{}, from stop {step}", target.label), settings))
    }

    /// Renames a target; with its former name, the change can be undone.
    pub(super) fn rename_target(&mut self, target: usize, label: String, before: Option<String>) {
        let Some(session) = self.session_id() else { return };
        let call = Call::with_body::<RenameTarget>(&AtTarget { session, target }, &TargetLabel { label });
        self.call::<RenameTarget>(call, move |state, view| {
            if state.session.as_ref().is_none_or(|open| open.id != view.id) {
                // Another session was opened meanwhile.
                return;
            }
            state.adopt(view, true);
            if let Some(before) = before
                && let Some(after) = state.label_of(target)
            {
                state.record_change(UndoableChange::Renamed { target, before, after });
            }
        });
    }
}
