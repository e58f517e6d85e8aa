//! Recognises the type of a file that was dropped on the page or chosen.
//!
//! Three checks, cheapest first: the number of files, name and size before a byte is read, and the contents. A file that
//! cannot be opened gets one sentence that names the file and gives a remedy.

use std::path::Path;

use serde_json::{Map, Value};
use sightline_api::program::FILE_BYTES;
use sightline_session::breakpoints::BREAKPOINT_LIMIT;
use sightline_session::expression::Expression;
use sightline_session::reproduce::Opened;
use sightline_track::presets::PRESETS;
use sightline_track::settings::{Changes, Settings};
use sightline_world::Scenario;
use sightline_world::toml_text;

/// The largest JSON file that is read, bytes: the largest session that the server accepts by default.
pub(crate) const JSON_LIMIT: u64 = FILE_BYTES as u64;
/// The largest other file that is read, bytes; scenarios and configurations have a few thousand.
pub(crate) const TEXT_LIMIT: u64 = 512 << 10;
/// Maximum number of characters of a file name that are shown.
const NAME_SHOWN: usize = 60;

/// How to open a folder, as the end of a sentence.
const OPEN_FOLDER: &str = "press Open (Ctrl+O) and choose its folder there; for a folder on the server's machine, start \
                           the server with `sightline serve --recordings FOLDER`";
/// The text files of a KITTI recording.
const KITTI_FILES: [&str; 3] = ["calib.txt", "poses.txt", "times.txt"];

/// The file types that can be opened, each with the effect of opening it.
pub(crate) const OPENABLE: [(&str, &str); 4] = [
    ("a scenario (.toml)", "opens the simulated drive that it describes"),
    ("reproduce.json of an export", "begins that session again: drive, targets, runs, breakpoints, notes"),
    ("a tracker configuration (.toml, .json)", "goes into the settings; R runs with it"),
    ("a list of breakpoints (.json)", "is added to the breakpoints of this session"),
];

/// The contents of a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Document {
    /// A simulated drive; the scenario as TOML.
    Drive(String),
    /// An exported session.
    Session(Box<Opened>),
    /// A tracker configuration: the changes from the defaults.
    Settings(Changes),
    /// Conditions, each with whether it is enabled.
    Breakpoints(Vec<(String, bool)>),
}

/// A file's name for display: shortened, and without control characters.
pub(crate) fn shown(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let count = plain.chars().count();
    if count <= NAME_SHOWN {
        return format!("“{plain}”");
    }
    let tail: String = plain.chars().skip(count - NAME_SHOWN / 2).collect();
    let head: String = plain.chars().take(NAME_SHOWN / 2 - 1).collect();
    format!("“{head}…{tail}”")
}

/// Refuses more than one file.
///
/// # Errors
/// The message to the user.
pub(crate) fn only_one(names: &[String]) -> Result<(), String> {
    match names {
        [_] | [] => Ok(()),
        [first, second, ..] => {
            let (count, first, second) = (names.len(), shown(first), shown(second));
            Err(format!("{count} files were dropped ({first}, {second} …): drop one at a time."))
        }
    }
}

/// Checks a file's name and size, before it is read.
///
/// # Errors
/// The message to the user.
pub(crate) fn before_reading(name: &str, size_bytes: u64, is_folder: bool) -> Result<(), String> {
    let (file, ending) = (shown(name), ending(name));
    if is_folder {
        return Err(folder(name));
    }
    if let Some(why) = other_kind(name, &ending) {
        return Err(format!("{file} {why}"));
    }
    if size_bytes == 0 && ending.is_empty() {
        return Err(format!("{file} is empty, or a folder: {OPEN_FOLDER}."));
    }
    if size_bytes == 0 {
        return Err(format!("{file} is empty: save or export it again."));
    }
    let limit = if ending == "json" { JSON_LIMIT } else { TEXT_LIMIT };
    if size_bytes > limit {
        let (size, limit) = (megabytes(size_bytes), megabytes(limit));
        return Err(format!(
            "{file} has {size} MB, more than the {limit} MB of any file that can be opened here: drop a scenario, a configuration or a reproduce.json."
        ));
    }
    Ok(())
}

/// The message for a file that the browser or the system cannot read.
pub(crate) fn unreadable(name: &str) -> String {
    format!("{} cannot be read: if it is a folder, {OPEN_FOLDER}; else check who may read it.", shown(name))
}

fn folder(name: &str) -> String {
    format!("{} is a folder: {OPEN_FOLDER}.", shown(name))
}

fn ending(name: &str) -> String {
    Path::new(name).extension().map_or_else(String::new, |ending| ending.to_string_lossy().to_lowercase())
}

fn megabytes(bytes: u64) -> String {
    let megabytes = bytes as f64 / 1e6;
    if megabytes < 10.0 { format!("{megabytes:.1}") } else { format!("{megabytes:.0}") }
}

/// The description of a file of another type, as the end of a sentence; `None` if its contents must be read.
fn other_kind(name: &str, ending: &str) -> Option<String> {
    let session = "drop the reproduce.json of the same session to open that";
    Some(match ending {
        "rrd" => "is a Rerun recording: open it with `rerun FILE` (Rerun 0.36), or press “Open in Rerun” for this session.".to_owned(),
        "png" | "jpg" | "jpeg" | "apng" | "gif" | "webp" | "bmp" | "tif" | "tiff" => {
            format!("is a single image: {OPEN_FOLDER}.")
        }
        "csv" | "jsonl" | "parquet" => format!("is a table of results: {session}."),
        "html" | "htm" => format!("is a report for reading in a browser tab: {session}."),
        "img" | "lbl" | "vic" | "mcap" | "bag" | "db3" | "zip" | "tar" | "gz" | "tgz" | "7z" => {
            format!("is recorded data: unpack it if it is packed, and {OPEN_FOLDER}.")
        }
        "redb" => "is the server's own database: start the server with its folder, `sightline serve --data-dir FOLDER`.".to_owned(),
        _ if name.eq_ignore_ascii_case("traverse.toml") => index(),
        "txt" if KITTI_FILES.iter().any(|known| name.eq_ignore_ascii_case(known)) => {
            format!("is one file of a KITTI recording: {OPEN_FOLDER}.")
        }
        _ => return None,
    })
}

fn index() -> String {
    format!("is the index of a drive whose images are beside it: {OPEN_FOLDER}.")
}

/// Recognises and parses the contents.
///
/// # Errors
/// One sentence that names the file and gives a remedy.
pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Document, String> {
    let file = shown(name);
    let no_text =
        || format!("{file} is no text: drop a scenario or configuration (.toml), or a reproduce.json.");
    let text = std::str::from_utf8(bytes).map_err(|_| no_text())?;
    let text = text.trim_start_matches('\u{feff}');
    if text.contains('\0') {
        return Err(no_text());
    }
    if text.trim().is_empty() {
        return Err(format!("{file} is empty: save or export it again."));
    }
    let is_json =
        ending(name) == "json" || text.trim_start().starts_with(['{', '[']) && ending(name) != "toml";
    let read = if is_json { of_json(text) } else { of_toml(text, &ending(name)) };
    read.map_err(|why| format!("{file} {why}"))
}

fn of_json(text: &str) -> Result<Document, String> {
    let value: Value = serde_json::from_str(text)
        .map_err(|wrong| format!("is no JSON: {wrong}; mend that place, or export it again."))?;
    if Opened::is_one(&value) {
        let opened =
            Opened::read(&value).map_err(|why| format!("is no reproduce.json that can be opened: {why}."))?;
        let size = serde_json::to_vec(&opened.reproduction).map_or(usize::MAX, |bytes| bytes.len());
        if size > FILE_BYTES {
            return Err("has more runs and notes than one request may have: remove runs that are not needed, and export it again.".to_owned());
        }
        return Ok(Document::Session(Box::new(opened)));
    }
    let list = value.as_array().or_else(|| value["breakpoints"].as_array());
    if let Some(list) = list {
        return breakpoints(list);
    }
    match value {
        Value::Object(map) if has_setting(&map) => settings(&map),
        _ => Err("is JSON, but neither a reproduce.json, nor a tracker configuration, nor a list of breakpoints: drop one of these.".to_owned()),
    }
}

fn of_toml(text: &str, ending: &str) -> Result<Document, String> {
    let table: toml::Table = toml_text::read(text).map_err(|said| {
        if ending == "toml" {
            format!("is no TOML: {said}; mend that line.")
        } else {
            "is neither a scenario nor a tracker configuration: `sightline scenarios` and `sightline presets` show what they have.".to_owned()
        }
    })?;
    if table.contains_key("stops") || table.contains_key("format") {
        return Err(index());
    }
    let map: Map<String, Value> =
        serde_json::to_value(&table).ok().and_then(|value| value.as_object().cloned()).unwrap_or_default();
    let of_scenario = of_scenario(&map);
    if has_setting(&map) && !of_scenario {
        return settings(&map);
    }
    if !of_scenario {
        let first = map.keys().next().cloned().unwrap_or_default();
        return Err(format!(
            "is neither a scenario nor a tracker configuration, neither of which has `{}`: `sightline scenarios` and `sightline presets` show what they have.",
            first.chars().take(40).collect::<String>()
        ));
    }
    match Scenario::from_toml(text, Path::new("")) {
        Ok(_) => Ok(Document::Drive(text.to_owned())),
        Err(wrong) => {
            let said = wrong.to_string();
            let said = said.trim_start_matches(": ");
            Err(format!("is no scenario that can be simulated: {said}; mend that field."))
        }
    }
}

/// Whether a file has a field of a scenario.
fn of_scenario(map: &Map<String, Value>) -> bool {
    let known = serde_json::to_value(Scenario::demo()).unwrap_or_default();
    map.keys().any(|key| known.get(key).is_some())
}

/// Whether a file has a field of a configuration: a setting, a group of settings, or a preset.
fn has_setting(map: &Map<String, Value>) -> bool {
    let table = Settings::table();
    map.keys().any(|key| key == "preset" || table.iter().any(|info| info.key == *key || info.group == *key))
}

/// Parses a configuration: settings by name, or grouped as in a run's record; with a preset, the changes from it.
fn settings(map: &Map<String, Value>) -> Result<Document, String> {
    let table = Settings::table();
    let mut changes = Changes::new();
    for (key, value) in map {
        match value {
            Value::String(name) if key == "preset" => {
                let preset = PRESETS.iter().find(|preset| preset.name == name.as_str()).ok_or_else(|| {
                    let known = PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", ");
                    let name: String = name.chars().take(40).collect();
                    format!("names the preset `{name}`, which does not exist: use one of {known}.")
                })?;
                let own = preset
                    .settings()
                    .map_err(|wrong| format!("names a preset that cannot be used: {wrong}."))?;
                // Settings in the file override those of the preset.
                own.changes().into_iter().for_each(|(key, value)| {
                    changes.entry(key).or_insert(value);
                });
            }
            Value::Object(group) if table.iter().any(|info| info.group == *key) => {
                changes.extend(group.iter().map(|(key, value)| (key.clone(), value.clone())));
            }
            _ => {
                changes.insert(key.clone(), value.clone());
            }
        }
    }
    let checked = Settings::default().with(&changes);
    let whole = checked.map_err(|wrong| {
        format!("is no tracker configuration that can be used: {wrong}; mend that field.")
    })?;
    Ok(Document::Settings(whole.changes()))
}

/// Parses conditions, as objects in the format of the API or as plain strings.
fn breakpoints(list: &[Value]) -> Result<Document, String> {
    if list.is_empty() {
        return Err("lists no breakpoint: drop a list with at least one `expression`.".to_owned());
    }
    if list.len() > BREAKPOINT_LIMIT {
        return Err(format!(
            "lists {} breakpoints, and a session may have {BREAKPOINT_LIMIT}: take some out.",
            list.len()
        ));
    }
    let read = list.iter().enumerate().map(|(place, entry)| {
        let text = entry.as_str().or_else(|| entry["expression"].as_str());
        let text = text.ok_or_else(|| {
            format!("is a list whose entry {} is no breakpoint: each must have an `expression`.", place + 1)
        })?;
        Expression::condition(text).map_err(|wrong| {
            format!("has a breakpoint {} that cannot be read, {wrong}: mend its `expression`.", place + 1)
        })?;
        Ok((text.trim().to_owned(), entry["on"].as_bool().unwrap_or(true)))
    });
    read.collect::<Result<_, String>>().map(Document::Breakpoints)
}
