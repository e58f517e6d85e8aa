//! The folders of the server.

use std::path::PathBuf;

/// Where the server keeps what it makes.
#[derive(Clone, Debug)]
pub(crate) struct Folders {
    /// Sessions.
    pub sessions: PathBuf,
    /// Studies, with their worlds.
    pub studies: PathBuf,
    /// Simulated traverses.
    pub traverses: PathBuf,
}
