//! Sessions on disk: one JSON file for each, written whole or not at all, so that a killed server loses nothing.
//!
//! A file that cannot be read back is moved aside under a name that says so, never removed.

use std::path::{Path, PathBuf};

use sightline_core::error::{Error, Result};
use sightline_core::session::view::SavedSession;
use sightline_core::traverse::files::write_atomically;

/// The folder that holds the sessions.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// What was found in the folder.
#[derive(Debug, Default)]
pub struct Found {
    /// The sessions that can be read.
    pub sessions: Vec<SavedSession>,
    /// One sentence for each file that could not.
    pub messages: Vec<String>,
    /// The largest number that a session ever had here.
    pub last_number: u64,
}

impl Store {
    /// The sessions in `folder`, which is made where it is missing.
    ///
    /// # Errors
    /// [`Error::Write`] when it cannot be made.
    pub fn open(folder: &Path) -> Result<Self> {
        let folder = folder.to_owned();
        std::fs::create_dir_all(&folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
        Ok(Self { folder })
    }

    /// Writes a session.
    ///
    /// # Errors
    /// [`Error::Write`]; the file is then as it was.
    pub fn save(&self, session: &SavedSession) -> Result<()> {
        let text = serde_json::to_vec_pretty(session).map_err(|error| Error::Request(error.to_string()))?;
        write_atomically(&self.folder.join(format!("{}.json", session.id)), &text)
    }

    /// Reads all sessions and moves aside what is damaged.
    ///
    /// # Errors
    /// [`Error::Read`] when the folder cannot be read.
    pub fn load(&self) -> Result<Found> {
        let unreadable = |source| Error::Read { path: self.folder.clone(), source };
        let mut found = Found::default();
        let entries: std::io::Result<Vec<_>> = std::fs::read_dir(&self.folder).map_err(unreadable)?.collect();
        let mut paths: Vec<_> = entries.map_err(unreadable)?.iter().map(std::fs::DirEntry::path).collect();
        paths.sort();
        for path in paths {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let Some(number) = number_of(name.split('.').next().unwrap_or_default()) else { continue };
            found.last_number = found.last_number.max(number);
            if name != format!("{}.json", id_of(number)) {
                continue;
            }
            match read(&path, &id_of(number)) {
                Ok(session) => found.sessions.push(session),
                Err(why) => found.messages.push(self.move_aside(&path, &why)),
            }
        }
        Ok(found)
    }

    /// Moves a session aside that fits no traverse any more; says what happened.
    pub fn set_aside(&self, id: &str, why: &str) -> String {
        self.move_aside(&self.folder.join(format!("{id}.json")), why)
    }

    fn move_aside(&self, path: &Path, why: &str) -> String {
        let aside = |number: u32| {
            let ending = if number == 1 { "damaged".to_owned() } else { format!("damaged-{number}") };
            path.with_extension(ending)
        };
        let free = (1..1000).map(aside).find(|aside| !aside.exists()).unwrap_or_else(|| aside(1000));
        let (from, to) = (path.display(), free.display());
        match std::fs::rename(path, &free) {
            Ok(()) => format!("{from} cannot be read ({why}); it was moved to {to}"),
            Err(error) => format!("{from} cannot be read ({why}) and not be moved aside ({error})"),
        }
    }
}

/// The name of the session with this number.
pub fn id_of(number: u64) -> String {
    format!("s{number}")
}

/// The number of a session's name.
pub fn number_of(id: &str) -> Option<u64> {
    let number = id.strip_prefix('s')?.parse().ok()?;
    (id == id_of(number)).then_some(number)
}

fn read(path: &Path, id: &str) -> Result<SavedSession, String> {
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    let saved: SavedSession = serde_json::from_slice(&bytes).map_err(|error| error.to_string())?;
    if saved.id == id { Ok(saved) } else { Err(format!("it holds session {}", crate::plain(&saved.id))) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_core::session::Session;

    #[test]
    fn a_session_comes_back_and_a_damaged_one_is_moved_aside() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let saved = Session::new("s2", "t", 3).saved();
        store.save(&saved).unwrap();
        std::fs::write(folder.path().join("s7.json"), b"{\"format\": 1, \"id\"").unwrap();
        std::fs::write(folder.path().join("notes.txt"), b"mine").unwrap();
        let found = store.load().unwrap();
        assert_eq!((found.sessions, found.last_number), (vec![saved], 7));
        assert!(found.messages[0].contains("s7.json") && found.messages[0].contains("s7.damaged"));
        assert_eq!(std::fs::read(folder.path().join("s7.damaged")).unwrap(), b"{\"format\": 1, \"id\"");
        let again = store.load().unwrap();
        assert_eq!((again.messages.len(), again.last_number), (0, 7));
    }

    #[test]
    fn only_the_very_form_of_a_name_is_one() {
        assert_eq!(number_of("s12"), Some(12));
        for id in ["", "s", "s01", "s+1", "s-1", "S1", "s1/", "../s1"] {
            assert_eq!(number_of(id), None, "{id}");
        }
    }
}
