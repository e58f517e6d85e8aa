//! Identifies the drive in a folder: the same identity gives the same numbers.
//!
//! A simulated drive is determined by its index. A recorded drive is determined by its index and the contents of the files
//! that the index names (images and camera files): `name-IIIIII-FFFFFF` with the first digits of the SHA-256 of both.
//! Earlier versions named recorded drives by the index only (`name-IIIIII`); [`Identity::relation`] recognises such names.
//!
//! Hashing reads every image once. The server caches the digests by size, times and inode of each file, so that a later
//! start reads only changed files. `docs/benchmarks.md` reports the cost.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::Metadata;
use std::io::Read;
use std::path::Path;
use std::time::UNIX_EPOCH;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use sightline_geometry::error::Result;
use sightline_recordings::Traverse;
use sightline_recordings::files::write_atomically;
use sightline_vision::image::io::open_regular;
use sightline_world::traverse::{CameraSource, TraverseIndex};

use crate::naming::{digits, hash, name_of};

/// Bytes per read.
const CHUNK: usize = 1 << 20;

/// Hexadecimal digits of a digest that are used in a name.
const DIGITS: usize = 6;

/// The identity of a drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Identity {
    /// The part of the name derived from the index.
    index_name: String,
    /// SHA-256 of the files of a recorded drive; `None` for a simulated one.
    pub(crate) files_sha256: Option<String>,
}

/// How a stored name relates to a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Relation {
    /// The same drive.
    Same,
    /// The same index, in a name of an earlier version, which did not cover the files.
    SameIndex,
    /// A recorded drive with the same index and other files.
    OtherFiles,
    /// Another drive.
    Other,
}

impl Identity {
    /// Computes the identity of a traverse; `cache_folder` is the folder of cached digests, `None` to read every file.
    ///
    /// # Errors
    /// An index that cannot be serialised as JSON.
    pub(crate) fn of(traverse: &Traverse, cache_folder: Option<&Path>) -> Result<Self> {
        let is_recorded = traverse.index().scenario.is_none();
        let files_sha256 = is_recorded.then(|| files_digest(traverse, cache_folder));
        Ok(Self { index_name: name_of(traverse)?, files_sha256 })
    }

    /// The identity of a commanded drive, which grows: the name of its folder.
    pub(crate) fn of_commanded_drive(name: String) -> Self {
        Self { index_name: name, files_sha256: None }
    }

    /// The name in paths.
    pub(crate) fn id(&self) -> String {
        match &self.files_sha256 {
            Some(files) => format!("{}-{}", self.index_name, &files[..DIGITS]),
            None => self.index_name.clone(),
        }
    }

    /// How `name` relates to this drive.
    pub(crate) fn relation(&self, name: &str) -> Relation {
        if name == self.id() {
            return Relation::Same;
        }
        let Some(rest) = name.strip_prefix(&self.index_name).filter(|_| self.files_sha256.is_some()) else {
            return Relation::Other;
        };
        let is_digest = |text: &str| text.len() == DIGITS && text.bytes().all(|b| b.is_ascii_hexdigit());
        match rest.strip_prefix('-') {
            None if rest.is_empty() => Relation::SameIndex,
            Some(files) if is_digest(files) => Relation::OtherFiles,
            _ => Relation::Other,
        }
    }
}

/// File metadata that reveal a change without reading the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Stamp {
    bytes: u64,
    modified_ns: u128,
    /// Time of the last inode change (s, ns) and inode number; zero on systems without inodes.
    inode: (i64, i64, u64),
}

impl Stamp {
    fn of(about: &Metadata) -> Self {
        let modified = about.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        #[cfg(unix)]
        let inode = {
            use std::os::unix::fs::MetadataExt;
            (about.ctime(), about.ctime_nsec(), about.ino())
        };
        #[cfg(not(unix))]
        let inode = (0, 0, 0);
        Self { bytes: about.len(), modified_ns: modified.map_or(0, |since| since.as_nanos()), inode }
    }
}

/// The digest of a file with the metadata at that time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct FileDigest {
    stamp: Stamp,
    sha256: String,
}

/// Digests by file name in the index.
type Digests = BTreeMap<String, FileDigest>;

/// The SHA-256 over the names and contents of the files in the index, in the order of names.
fn files_digest(traverse: &Traverse, cache_folder: Option<&Path>) -> String {
    let folder = traverse.folder();
    let list = cache_folder.map(|cache_folder| {
        let real = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        cache_folder.join(format!("{}.json", hash(real.as_os_str().as_encoded_bytes())))
    });
    let text = list.as_ref().and_then(|list| std::fs::read(list).ok());
    let known: Digests = text.and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default();
    let names: Vec<&str> = files_of(traverse.index()).into_iter().collect();
    let found: Vec<Option<FileDigest>> =
        names.par_iter().map(|name| digest_of(&folder.join(name), known.get(*name))).collect();
    let mut whole = Sha256::new();
    for (name, found) in names.iter().zip(&found) {
        let sha256 = found.as_ref().map_or("missing", |found| &found.sha256);
        whole.update(format!("{name}\0{sha256}\n"));
    }
    let found = names.into_iter().zip(found);
    let found: Digests = found.filter_map(|(name, one)| Some((name.to_owned(), one?))).collect();
    if found != known
        && let Some(list) = list
        && let Ok(text) = serde_json::to_vec(&found)
        && let Err(error) = write_atomically(&list, &text)
    {
        // Then the digests are computed again at the next start.
        tracing::debug!("digests are not kept: {error}");
    }
    digits(&whole.finalize())
}

/// The distinct names of images and camera files.
fn files_of(index: &TraverseIndex) -> BTreeSet<&str> {
    let views = index.stops.iter().flat_map(|stop| [&stop.left, &stop.right]);
    let files = views.flat_map(|view| {
        let camera = match &view.camera {
            CameraSource::File { file } => Some(file.as_str()),
            CameraSource::Inline(_) => None,
        };
        [Some(view.image.as_str()), camera]
    });
    files.flatten().collect()
}

/// The digest of a file; `None` if it cannot be read.
fn digest_of(path: &Path, known: Option<&FileDigest>) -> Option<FileDigest> {
    let stamp = Stamp::of(&std::fs::metadata(path).ok()?);
    if let Some(known) = known.filter(|known| known.stamp == stamp) {
        return Some(known.clone());
    }
    let mut file = open_regular(path).ok()?;
    let (mut sum, mut chunk) = (Sha256::new(), vec![0; CHUNK]);
    loop {
        match file.read(&mut chunk) {
            Ok(0) => break,
            Ok(count) => sum.update(&chunk[..count]),
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(_) => return None,
        }
    }
    Some(FileDigest { stamp, sha256: digits(&sum.finalize()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity(files: Option<&str>) -> Identity {
        Identity { index_name: "drive-0a1b2c".to_owned(), files_sha256: files.map(str::to_owned) }
    }

    #[test]
    fn a_recorded_drive_is_named_by_index_and_files() {
        let drive = identity(Some("ffeeddccbbaa"));
        assert_eq!(drive.id(), "drive-0a1b2c-ffeedd");
        assert_eq!(drive.relation("drive-0a1b2c-ffeedd"), Relation::Same);
        assert_eq!(drive.relation("drive-0a1b2c"), Relation::SameIndex);
        assert_eq!(drive.relation("drive-0a1b2c-012345"), Relation::OtherFiles);
        for other in ["drive-0a1b2d", "drive-0a1b2c-two", "drive-0a1b2c0", "drive"] {
            assert_eq!(drive.relation(other), Relation::Other, "{other}");
        }
    }

    #[test]
    fn a_simulated_drive_is_named_by_its_index() {
        let drive = identity(None);
        assert_eq!((drive.id().as_str(), drive.relation("drive-0a1b2c")), ("drive-0a1b2c", Relation::Same));
        assert_eq!(drive.relation("drive-0a1b2c-012345"), Relation::Other);
    }

    #[test]
    fn a_cached_digest_is_used_until_the_file_changes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("left.png");
        std::fs::write(&path, b"one").unwrap();
        let first = digest_of(&path, None).unwrap();
        let marked = FileDigest { sha256: "marked".to_owned(), ..first.clone() };
        assert_eq!(digest_of(&path, Some(&marked)).unwrap(), marked);
        let exchanged = folder.path().join("other.png");
        std::fs::write(&exchanged, b"two").unwrap();
        std::fs::rename(&exchanged, &path).unwrap();
        let second = digest_of(&path, Some(&marked)).unwrap();
        assert_eq!(second.sha256, hash(b"two"));
        assert_eq!(digest_of(&folder.path().join("missing.png"), None), None);
    }
}
