//! Documents, studies and opened drives: small values by name or number, each replaced as a whole.

use redb::{ReadableDatabase, ReadableTable, ReadableTableMetadata};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sightline_geometry::error::Result;
use sightline_session::documents::{DOCUMENT_LIMIT, Document};

use super::open::failed;
use super::{DOCUMENTS, DRIVES, STUDIES, Store, put};

/// Why a document could not be replaced.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Clash {
    /// Somebody changed it meanwhile; its revision now, none where it is not there.
    Changed(Option<u64>),
    /// There are too many.
    Full,
}

impl Store {
    /// All documents, by name.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] when the database cannot be read.
    pub fn documents(&self) -> Result<Vec<Document>> {
        let read = || {
            let table = self.disk.database.begin_read()?.open_table(DOCUMENTS)?;
            let mut all = Vec::new();
            for entry in table.iter()? {
                let (_, value) = entry?;
                all.extend(serde_json::from_slice::<Document>(value.value()));
            }
            Ok::<_, redb::Error>(all)
        };
        read().map_err(|error| failed(&self.disk.path, &error.to_string()))
    }

    /// Replaces or adds a document; `revision` is the one that was read, 0 for a new one.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the inner error when somebody was quicker.
    pub(crate) fn put_document(
        &self,
        name: &str,
        value: Value,
        revision: Option<u64>,
    ) -> Result<std::result::Result<Document, Clash>> {
        let mut outcome = Err(Clash::Full);
        self.disk.write(|transaction| {
            let (known, count) = {
                let table = transaction.open_table(DOCUMENTS)?;
                let known = table.get(name)?.and_then(|v| serde_json::from_slice::<Document>(v.value()).ok());
                (known.map(|document| document.revision), table.len()?)
            };
            if revision.is_some_and(|read| read != known.unwrap_or(0)) {
                outcome = Err(Clash::Changed(known));
                return Ok(false);
            }
            if known.is_none() && count >= DOCUMENT_LIMIT as u64 {
                return Ok(false);
            }
            let document = Document { name: name.to_owned(), revision: known.unwrap_or(0) + 1, value };
            put(transaction, DOCUMENTS, name, &document)?;
            outcome = Ok(document);
            Ok(true)
        })?;
        Ok(outcome)
    }

    /// Removes a document; false where there is none.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the inner error when somebody changed it meanwhile.
    pub(crate) fn remove_document(
        &self,
        name: &str,
        revision: Option<u64>,
    ) -> Result<std::result::Result<bool, Clash>> {
        let mut outcome = Ok(false);
        self.disk.write(|transaction| {
            let mut table = transaction.open_table(DOCUMENTS)?;
            let known = table.get(name)?.and_then(|v| serde_json::from_slice::<Document>(v.value()).ok());
            let known = known.map(|document| document.revision);
            if known.is_some() && revision.is_some_and(|read| Some(read) != known) {
                outcome = Err(Clash::Changed(known));
                return Ok(false);
            }
            let was_there = table.remove(name)?.is_some();
            outcome = Ok(was_there);
            Ok(was_there)
        })?;
        Ok(outcome)
    }

    /// The scenarios of the drives that were opened from a page, as TOML, by the names of their folders.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] when the database cannot be read.
    pub fn drives(&self) -> Result<Vec<(String, String)>> {
        let read = || {
            let table = self.disk.database.begin_read()?.open_table(DRIVES)?;
            let mut all = Vec::new();
            for entry in table.iter()? {
                let (key, value) = entry?;
                let scenario = serde_json::from_slice::<String>(value.value());
                all.extend(scenario.map(|scenario| (key.value().to_owned(), scenario)));
            }
            Ok::<_, redb::Error>(all)
        };
        read().map_err(|error| failed(&self.disk.path, &error.to_string()))
    }

    /// Remembers a drive that was opened from a page.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn save_drive(&self, folder: &str, scenario: &str) -> Result<()> {
        self.disk.write(|transaction| put(transaction, DRIVES, folder, &scenario))
    }

    /// Forgets a drive that was opened from a page.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn remove_drive(&self, folder: &str) -> Result<()> {
        self.disk.write(|transaction| Ok(transaction.open_table(DRIVES)?.remove(folder)?.is_some()))
    }

    /// The studies that were started, by number; what cannot be read is left out.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] when the database cannot be read.
    pub fn studies<T: DeserializeOwned>(&self) -> Result<Vec<(u64, T)>> {
        let read = || {
            let table = self.disk.database.begin_read()?.open_table(STUDIES)?;
            let mut all = Vec::new();
            for entry in table.iter()? {
                let (key, value) = entry?;
                all.extend(serde_json::from_slice(value.value()).map(|study| (key.value(), study)));
            }
            Ok::<_, redb::Error>(all)
        };
        read().map_err(|error| failed(&self.disk.path, &error.to_string()))
    }

    /// Takes a study out of the list.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn remove_study(&self, number: u64) -> Result<()> {
        self.disk.write(|transaction| Ok(transaction.open_table(STUDIES)?.remove(number)?.is_some()))
    }

    /// Writes how a study stands.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn save_study(&self, number: u64, study: &impl Serialize) -> Result<()> {
        self.disk.write(|transaction| put(transaction, STUDIES, number, study))
    }
}
