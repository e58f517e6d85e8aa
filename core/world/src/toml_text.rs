//! Reading TOML so that what is wrong is one sentence with line and field: the reader's own words draw several lines.

use serde::de::DeserializeOwned;

/// Reads a value.
///
/// # Errors
/// A sentence with the line and, where there is one, the path of the field, such as `line 2: sun.reflectance: …`.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let toml = toml::Deserializer::parse(text).map_err(|error| sentence(text, &error, ""))?;
    serde_path_to_error::deserialize(toml)
        .map_err(|error| sentence(text, error.inner(), &error.path().to_string()))
}

fn sentence(text: &str, error: &toml::de::Error, path: &str) -> String {
    let place = error.span().and_then(|span| text.get(..span.start));
    let line = place.map(|before| format!("line {}: ", before.matches('\n').count() + 1));
    let message = error.message().replace('\n', ", ");
    format!("{}{}{message}", line.unwrap_or_default(), field(path))
}

/// The field's path with a colon, where there is one.
pub fn field(path: &str) -> String {
    if matches!(path, "" | "." | "?") { String::new() } else { format!("{path}: ") }
}
