//! Bad input: a file, a setting, a request. A lost target is data, never an error.

use std::path::PathBuf;

/// What was wrong with the input, as one sentence that names the culprit and the fix.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be opened or read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file was read but does not make sense.
    #[error("{path}: {problem}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong and how to mend it.
        problem: String,
    },
    /// A setting does not exist or its value is out of range.
    #[error("setting {key}: {problem}")]
    Setting {
        /// The setting's name as the user wrote it.
        key: String,
        /// What is wrong and how to mend it.
        problem: String,
    },
    /// A target cannot be designated so.
    #[error("target: {0}")]
    Target(String),
    /// A command names something that does not exist, or asks for what cannot be done.
    #[error("{0}")]
    Request(String),
    /// The work was cancelled by the person who asked for it.
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// A file that was read but does not make sense.
    pub fn format(path: impl Into<PathBuf>, problem: impl Into<String>) -> Self {
        Self::Format { path: path.into(), problem: problem.into() }
    }

    /// A setting that does not exist or has a bad value.
    pub fn setting(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Setting { key: key.into(), problem: problem.into() }
    }
}

/// The result of anything that reads input.
pub type Result<T, E = Error> = std::result::Result<T, E>;
