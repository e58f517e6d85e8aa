//! Import of a session from the file `reproduce.json` of an export.
//!
//! [`Opened::read`] extracts the drive, the saved session and the notes, which are sent to the server; other contents of the
//! file (hashes, commands, versions) are not needed. The file contains no steps: they are recomputed, since the same input
//! gives the same bits.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use super::notes::Note;
use super::view::SavedSession;
use sightline_rover::version::tracker_version;
use sightline_world::rover::driven::DrivenStop;

/// The value of the file's field `format`.
pub const FORMAT: &str = "sightline-reproduce";
/// The version of the file that this code reads and writes.
pub const FORMAT_VERSION: u32 = 1;

/// Begins a session from an export. Other fields of the exported file (hashes, commands, versions) are ignored, so that it
/// can be sent unchanged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Reproduction {
    /// The drive.
    pub traverse: ReproducedTraverse,
    /// The saved session: targets, runs with their complete configurations, breakpoints and cursor.
    #[schema(value_type = Object)]
    pub session: SavedSession,
    /// The notes.
    #[serde(default)]
    pub notes: Vec<Note>,
}

/// The drive of an imported session; other fields of the file are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReproducedTraverse {
    /// Its name in paths; it differs if the index of the drive differs.
    pub id: String,
    /// Its display name.
    pub name: String,
    /// The scenario of a simulated drive, as TOML; a recorded one must be open already.
    #[serde(default)]
    pub scenario_toml: Option<String>,
    /// The state of the world at each stop of a drive on commands; null for other drives.
    #[serde(default)]
    #[schema(value_type = Option<Vec<Object>>)]
    pub driven: Option<Vec<DrivenStop>>,
}

/// A parsed file.
#[derive(Clone, Debug, PartialEq)]
pub struct Opened {
    /// The session to begin.
    pub reproduction: Reproduction,
    /// The version of the tracker that wrote the file, if it is not this one: its numbers may differ.
    pub other_tracker: Option<String>,
}

impl Opened {
    /// Whether a JSON value is such a file, by its field `format`.
    pub fn is_one(value: &Value) -> bool {
        value["format"] == FORMAT
    }

    /// Reads the file's JSON value.
    ///
    /// # Errors
    /// The error with the name of the field, as the end of a sentence.
    pub fn read(value: &Value) -> Result<Self, String> {
        let version = &value["format_version"];
        if *version != FORMAT_VERSION {
            return Err(format!(
                "it has version {version} of its form and this program reads version {FORMAT_VERSION}; export it again"
            ));
        }
        let traverse = &value["traverse"];
        let traverse = ReproducedTraverse {
            id: part(&traverse["id"], "traverse.id")?,
            name: part(&traverse["name"], "traverse.name")?,
            scenario_toml: part(&traverse["scenario_toml"], "traverse.scenario_toml")?,
            driven: part(&traverse["driven"], "traverse.driven")?,
        };
        let session = part(&value["session"], "session")?;
        let notes = part(&value["notes"], "notes")?;
        let made_by = value["program"]["tracker"].as_str().filter(|made_by| *made_by != tracker_version());
        let other_tracker = made_by.map(|made_by| made_by.chars().take(40).collect());
        Ok(Self { reproduction: Reproduction { traverse, session, notes }, other_tracker })
    }
}

fn part<T: DeserializeOwned>(value: &Value, name: &str) -> Result<T, String> {
    serde_path_to_error::deserialize(value).map_err(|wrong| {
        let path = wrong.path().to_string();
        let field = if matches!(path.as_str(), "." | "?") { String::new() } else { format!(".{path}") };
        format!("{name}{field}: {}", wrong.inner())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Session;
    use serde_json::json;

    fn file() -> Value {
        json!({
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "program": { "name": "sightline", "tracker": tracker_version() },
            "traverse": { "id": "drive-1", "name": "drive", "stops": 3, "scenario_toml": null },
            "session": Session::new("s1", "drive-1", 3).saved(),
            "notes": [],
            "runs": [],
        })
    }

    #[test]
    fn the_parts_that_are_needed_are_taken_out_of_the_file() {
        assert!(Opened::is_one(&file()) && !Opened::is_one(&json!([1])));
        let opened = Opened::read(&file()).unwrap();
        assert_eq!(opened.reproduction.traverse.id, "drive-1");
        assert_eq!((opened.reproduction.session.id.as_str(), opened.other_tracker), ("s1", None));
        let mut other = file();
        other["program"]["tracker"] = json!("0.0.1");
        assert_eq!(Opened::read(&other).unwrap().other_tracker.as_deref(), Some("0.0.1"));
    }

    #[test]
    fn what_is_wrong_is_named_by_its_field() {
        let refused = |change: &dyn Fn(&mut Value)| {
            let mut file = file();
            change(&mut file);
            Opened::read(&file).unwrap_err()
        };
        assert!(refused(&|file| file["format_version"] = json!(9)).contains("version 9"));
        assert!(refused(&|file| file["traverse"]["id"] = json!(3)).starts_with("traverse.id: "));
        let colour = refused(&|file| file["session"]["cursor"]["step"] = json!("two"));
        assert!(colour.starts_with("session.cursor.step: "), "{colour}");
        assert!(refused(&|file| file["session"]["colour"] = json!("red")).contains("colour"));
    }
}
