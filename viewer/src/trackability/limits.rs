//! The form for the limits of trackability. It keeps the text of every field until the limits are applied.

use std::collections::BTreeMap;

use serde_json::Value;
use sightline_rover::trackability::TrackabilityLimits;
use sightline_track::settings::Changes;

/// A command about the limits.
#[derive(Clone, Debug, PartialEq)]
pub enum LimitsCommand {
    /// Opens the window of the limits.
    Open,
    /// Closes the window and discards unapplied text.
    Close,
    /// Changes the text of a limit's field.
    Type {
        /// Name of the limit.
        key: String,
        /// The text.
        text: String,
    },
    /// Applies the limits and recomputes the map.
    Use,
    /// Resets the fields to the defaults.
    Defaults,
}

/// The form of the limits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LimitsForm {
    /// The text of each field, by name of the limit.
    pub texts: BTreeMap<String, String>,
    /// Why the limits cannot be applied, as one sentence.
    pub refused: Option<String>,
}

impl LimitsForm {
    /// The form for these limits.
    pub(super) fn of(limits: &Changes) -> Self {
        let text = |info: sightline_track::limits::SettingInfo| {
            let value = limits.get(&info.key).unwrap_or(&info.default).to_string();
            (info.key, value)
        };
        Self { texts: TrackabilityLimits::table().into_iter().map(text).collect(), refused: None }
    }

    /// The limits that differ from the defaults.
    pub(super) fn changes(&self) -> Result<Changes, String> {
        let value = |text: &String| {
            let text = text.trim().replace(',', ".");
            serde_json::from_str(&text).unwrap_or(Value::String(text))
        };
        let typed = self.texts.iter().map(|(key, text)| (key.clone(), value(text))).collect();
        let limits = TrackabilityLimits::default().with(&typed).map_err(|error| error.to_string())?;
        Ok(limits.changes())
    }
}
