//! The limits of trackability as a person types them: kept as text until they are used, so that nothing typed is lost.

use std::collections::BTreeMap;

use serde_json::Value;
use sightline_rover::trackability::TrackabilityLimits;
use sightline_track::settings::Changes;

/// What a person asks of the limits.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Opens their window.
    Open,
    /// Closes it; what was typed and not used is given up.
    Close,
    /// Types a limit.
    Type {
        /// Its name.
        key: String,
        /// What stands in its field.
        text: String,
    },
    /// Makes the map by what was typed.
    Use,
    /// Puts the defaults into the fields.
    Defaults,
}

/// The limits as they are typed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Form {
    /// What stands in the fields, by name.
    pub texts: BTreeMap<String, String>,
    /// Why it cannot be used, as one sentence.
    pub refused: Option<String>,
}

impl Form {
    /// The fields of these limits.
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
