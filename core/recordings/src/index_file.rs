//! Reading and writing the index of a traverse, as TOML or JSON.
//!
//! Numbers are written with all their digits, so that reading gives the same bits. Errors name the file, the line and
//! the field (`traverse.toml: line 12: stops[3].left.camera: …`).

use std::path::{Path, PathBuf};

use super::files::{read_text, write_atomically};
use sightline_geometry::error::{Error, Result};
use sightline_world::toml_text;
use sightline_world::traverse::TraverseIndex;

/// The largest index that is read, bytes.
const SIZE_LIMIT: u64 = 64 << 20;

/// The form of an index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IndexFormat {
    /// `traverse.toml`, written by hand.
    #[default]
    Toml,
    /// `traverse.json`, written by programs.
    Json,
}

impl IndexFormat {
    /// The name of the index in its folder.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Toml => "traverse.toml",
            Self::Json => "traverse.json",
        }
    }
}

/// The treatment of an existing index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// Keep it and return an error.
    #[default]
    Refuse,
    /// Replace it.
    Replace,
}

/// Returns the path of the index of `path`, which may be the folder or the index itself.
///
/// # Errors
/// No such path, no index in the folder, or two of them.
pub(super) fn find(path: &Path) -> Result<(PathBuf, IndexFormat)> {
    if path.is_dir() {
        let present = [IndexFormat::Toml, IndexFormat::Json].map(|format| path.join(format.file_name()));
        return match present.each_ref().map(|path| path.is_file()) {
            [true, true] => {
                Err(Error::format(path, "holds traverse.toml and traverse.json; name one of them"))
            }
            [true, false] => Ok((path.join(IndexFormat::Toml.file_name()), IndexFormat::Toml)),
            [false, true] => Ok((path.join(IndexFormat::Json.file_name()), IndexFormat::Json)),
            [false, false] => Err(Error::format(
                path,
                "contains neither traverse.toml nor traverse.json; import a foreign recording first: `sightline import FOLDER --out DRIVE`",
            )),
        };
    }
    let format = match path.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => IndexFormat::Toml,
        Some("json") => IndexFormat::Json,
        _ => {
            return Err(Error::format(
                path,
                "is neither a folder nor an index with the ending .toml or .json",
            ));
        }
    };
    Ok((path.to_owned(), format))
}

/// Reads an index; only the form of its content is checked.
///
/// # Errors
/// A file that cannot be read, or without the form of an index; the sentence names line and field.
pub(super) fn read(path: &Path, format: IndexFormat) -> Result<TraverseIndex> {
    let unreadable = |source| Error::Read { path: path.to_owned(), source };
    if std::fs::metadata(path).map_err(unreadable)?.len() > SIZE_LIMIT {
        let limit = SIZE_LIMIT >> 20;
        return Err(Error::format(path, format!("is larger than {limit} MiB, the most an index may have")));
    }
    let text = read_text(path).map_err(unreadable)?;
    parse(&text, format).map_err(|problem| Error::format(path, problem))
}

pub(super) fn parse(text: &str, format: IndexFormat) -> Result<TraverseIndex, String> {
    match format {
        IndexFormat::Toml => toml_text::read(text),
        IndexFormat::Json => {
            let mut json = serde_json::Deserializer::from_str(text);
            let index: TraverseIndex = serde_path_to_error::deserialize(&mut json).map_err(|error| {
                let (line, field) = (error.inner().line(), toml_text::field(&error.path().to_string()));
                let message = error.inner().to_string();
                // serde_json puts the position behind the message; here it comes first, as for TOML.
                let message = message.split(" at line ").next().unwrap_or_default();
                format!("line {line}: {field}{message}")
            })?;
            json.end().map_err(|error| format!("line {}: text after the end", error.line()))?;
            Ok(index)
        }
    }
}

/// Writes an index into `folder`, which is created if missing.
///
/// # Errors
/// An index that exists and may not be replaced, or a folder that cannot be written.
pub(super) fn write(
    index: &TraverseIndex,
    folder: &Path,
    format: IndexFormat,
    existing: Existing,
) -> Result<()> {
    let path = folder.join(format.file_name());
    let either = [IndexFormat::Toml, IndexFormat::Json].map(|format| folder.join(format.file_name()));
    for there in either.iter().filter(|path| path.exists()) {
        if existing == Existing::Refuse || *there != path {
            return Err(Error::format(there, "is already there; choose another folder or remove it first"));
        }
    }
    let unwritable = |problem: String| Error::format(&path, format!("cannot be written ({problem})"));
    let text = match format {
        IndexFormat::Toml => toml::to_string(index).map_err(|error| unwritable(error.to_string()))?,
        IndexFormat::Json => {
            serde_json::to_string_pretty(index).map_err(|error| unwritable(error.to_string()))?
        }
    };
    write_atomically(&path, text.as_bytes())
}
