//! The folders of the server.

use std::path::{Path, PathBuf};

/// Where the server keeps what it makes.
#[derive(Clone, Debug)]
pub(crate) struct Folders {
    /// Sessions.
    pub sessions: PathBuf,
    /// Studies, with their worlds.
    pub studies: PathBuf,
    /// Simulated traverses.
    pub traverses: PathBuf,
    /// Digests of the files of recorded traverses, from which nothing but time is lost when it is removed.
    pub digests: PathBuf,
}

impl Folders {
    /// Sessions in `folder` itself, the rest in folders below it.
    pub(crate) fn in_one(folder: &Path) -> Self {
        let [studies, traverses, digests] = ["studies", "traverses", "digests"].map(|name| folder.join(name));
        Self { sessions: folder.to_owned(), studies, traverses, digests }
    }
}
