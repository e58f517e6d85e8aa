//! Bad input: a file, a setting, a request. A lost target is data, never an error.

use std::path::PathBuf;

/// An input error, as one sentence that names its cause and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be opened or read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A file was read but its content is invalid.
    #[error("{path}: {problem}")]
    Format {
        /// The file.
        path: PathBuf,
        /// The problem and its remedy.
        problem: String,
    },
    /// A setting does not exist or its value is out of range.
    #[error("setting {key}: {problem}")]
    Setting {
        /// The setting's name as the user wrote it.
        key: String,
        /// The problem and its remedy.
        problem: String,
    },
    /// A target cannot be designated as requested.
    #[error("target: {0}")]
    Target(String),
    /// A command names something that does not exist, or requests something impossible.
    #[error("{0}")]
    Request(String),
    /// The user cancelled the work.
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// A file with invalid content.
    pub fn format(path: impl Into<PathBuf>, problem: impl Into<String>) -> Self {
        Self::Format { path: path.into(), problem: problem.into() }
    }

    /// A setting that does not exist or has an invalid value.
    pub fn setting(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Setting { key: key.into(), problem: problem.into() }
    }
}

/// The result of an operation that reads input.
pub type Result<T, E = Error> = std::result::Result<T, E>;
