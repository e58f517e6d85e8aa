//! Reads TOML with one-line errors that name line and field; the errors of the `toml` crate span several lines.

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

/// Reads a value.
///
/// Unlike the `toml` crate, rejects an array that has more values than its field takes.
///
/// # Errors
/// A message with the line and, if known, the path of the field, such as `line 2: sun.reflectance: …`.
pub fn read<T: DeserializeOwned + Serialize>(text: &str) -> Result<T, String> {
    let toml = toml::Deserializer::parse(text).map_err(|error| sentence(text, &error, ""))?;
    let read: T = serde_path_to_error::deserialize(toml)
        .map_err(|error| sentence(text, error.inner(), &error.path().to_string()))?;
    let given = text.parse::<Table>().map_err(|error| sentence(text, &error, ""))?;
    let taken = Table::try_from(&read).map_err(|error| error.to_string())?;
    longer_array(&Value::Table(given), &Value::Table(taken), "").map_or(Ok(read), Err)
}

/// Describes the first array of `given` that is longer than the same array of `taken`.
fn longer_array(given: &Value, taken: &Value, path: &str) -> Option<String> {
    match (given, taken) {
        (Value::Table(given), Value::Table(taken)) => given.iter().find_map(|(key, value)| {
            let separator = if path.is_empty() { "" } else { "." };
            longer_array(value, taken.get(key)?, &format!("{path}{separator}{key}"))
        }),
        (Value::Array(given), Value::Array(taken)) if given.len() > taken.len() => {
            Some(format!("{path}: has {} values, but takes {}", given.len(), taken.len()))
        }
        (Value::Array(given), Value::Array(taken)) => given
            .iter()
            .zip(taken)
            .enumerate()
            .find_map(|(index, (given, taken))| longer_array(given, taken, &format!("{path}[{index}]"))),
        _ => None,
    }
}

fn sentence(text: &str, error: &toml::de::Error, path: &str) -> String {
    let place = error.span().and_then(|span| text.get(..span.start));
    let line = place.map(|before| format!("line {}: ", before.matches('\n').count() + 1));
    let message = error.message().replace('\n', ", ");
    format!("{}{}{message}", line.unwrap_or_default(), field(path))
}

/// The field's path followed by a colon; empty if the path is unknown.
pub fn field(path: &str) -> String {
    if matches!(path, "" | "." | "?") { String::new() } else { format!("{path}: ") }
}
