//! Documents, studies, questions and opened drives: small values by name or number, each replaced as a whole.

use redb::{ReadableDatabase, ReadableTable, ReadableTableMetadata};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sightline_geometry::error::Result;
use sightline_session::counterfactual::wire::Question;
use sightline_session::documents::{DOCUMENT_LIMIT, Document};

use super::Store;
use super::disk::{Outcome, Write};
use super::record::{DOCUMENTS, DRIVES, Named, QUESTIONS, RecordKey, STUDIES, all_named, all_numbered};

/// Why a document could not be replaced.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Clash {
    /// The document was changed by another client; contains the current revision, or `None` if it does not exist.
    Changed(Option<u64>),
    /// The maximum number of documents is reached.
    Full,
}

impl Store {
    /// All documents, by name.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] if the database cannot be read.
    pub fn documents(&self) -> Result<Vec<Document>> {
        self.named(DOCUMENTS).map(|all| all.into_iter().map(|(_, document)| document).collect())
    }

    /// The values of a table with string keys, without unreadable ones.
    fn named<T: DeserializeOwned>(&self, table: Named) -> Result<Vec<(String, T)>> {
        let all = self.disk.read(|database| all_named(&database.begin_read()?, table))?;
        let read = |(name, json): (String, Vec<u8>)| Some((name, serde_json::from_slice(&json).ok()?));
        Ok(all.into_iter().filter_map(read).collect())
    }

    /// Replaces or adds a document; `revision` is the one the client has read, 0 for a new document.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the inner error after a change by another client.
    pub(crate) fn put_document(
        &self,
        name: &str,
        value: Value,
        revision: Option<u64>,
    ) -> Result<std::result::Result<Document, Clash>> {
        let mut outcome = Err(Clash::Full);
        let record_key = RecordKey::Document(name.to_owned());
        self.write(|write| {
            let known = document(write, &record_key)?.map(|document| document.revision);
            let count = write.transaction.open_table(DOCUMENTS)?.len()?;
            if revision.is_some_and(|read| read != known.unwrap_or(0)) {
                outcome = Err(Clash::Changed(known));
                return Ok(());
            }
            if known.is_none() && count >= DOCUMENT_LIMIT as u64 {
                return Ok(());
            }
            let document = Document { name: name.to_owned(), revision: known.unwrap_or(0) + 1, value };
            write.put(record_key, &document)?;
            outcome = Ok(document);
            Ok(())
        })?;
        Ok(outcome)
    }

    /// Removes a document; false if it does not exist.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the inner error after a change by another client.
    pub(crate) fn remove_document(
        &self,
        name: &str,
        revision: Option<u64>,
    ) -> Result<std::result::Result<bool, Clash>> {
        let mut outcome = Ok(false);
        let record_key = RecordKey::Document(name.to_owned());
        self.write(|write| {
            let known = document(write, &record_key)?.map(|document| document.revision);
            if known.is_some() && revision.is_some_and(|read| Some(read) != known) {
                outcome = Err(Clash::Changed(known));
                return Ok(());
            }
            outcome = Ok(write.remove_for_good(&record_key)?);
            Ok(())
        })?;
        Ok(outcome)
    }

    /// The scenarios of the drives opened from a page, as TOML, by folder name.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] if the database cannot be read.
    pub fn drives(&self) -> Result<Vec<(String, String)>> {
        self.named(DRIVES)
    }

    /// Records a drive that was opened from a page.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then unchanged.
    pub(crate) fn save_drive(&self, folder: &str, scenario: &str) -> Result<()> {
        self.write(|write| write.put(RecordKey::Drive(folder.to_owned()), &scenario).map(|_| ()))
    }

    /// Removes the record of a drive that was opened from a page.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then unchanged.
    pub(crate) fn remove_drive(&self, folder: &str) -> Result<()> {
        self.write(|write| write.remove_for_good(&RecordKey::Drive(folder.to_owned())).map(|_| ()))
    }

    /// The studies by number, without unreadable ones.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] if the database cannot be read.
    pub fn studies<T: DeserializeOwned>(&self) -> Result<Vec<(u64, T)>> {
        let all = self.disk.read(|database| all_numbered(&database.begin_read()?, STUDIES))?;
        let read = |(number, json): (u64, Vec<u8>)| Some((number, serde_json::from_slice(&json).ok()?));
        Ok(all.into_iter().filter_map(read).collect())
    }

    /// Removes a study from the list.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then unchanged.
    pub(crate) fn remove_study(&self, number: u64) -> Result<()> {
        self.deferred.forget(&RecordKey::Study(number));
        self.write(|write| write.remove_for_good(&RecordKey::Study(number)).map(|_| ()))
    }

    /// Writes the state of a study.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then unchanged.
    pub(crate) fn save_study(&self, number: u64, study: &impl Serialize) -> Result<()> {
        self.write(|write| write.put(RecordKey::Study(number), study).map(|_| ()))?;
        self.deferred.forget(&RecordKey::Study(number));
        Ok(())
    }

    /// Writes the state of a running study; if this fails, the write is deferred.
    pub(crate) fn save_or_defer_study(&self, number: u64, study: &impl Serialize) {
        if self.save_study(number, study).is_err() {
            self.deferred.set(RecordKey::Study(number), study);
        }
    }

    /// The questions, without unreadable ones.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] if the database cannot be read.
    pub(crate) fn questions(&self) -> Result<Vec<Question>> {
        self.named(QUESTIONS).map(|all| all.into_iter().map(|(_, question)| question).collect())
    }

    /// Writes a question.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then unchanged.
    pub(crate) fn save_question(&self, question: &Question) -> Result<()> {
        let record_key = question_key(question);
        self.write(|write| write.put(record_key.clone(), question).map(|_| ()))?;
        self.deferred.forget(&record_key);
        Ok(())
    }

    /// Writes the answer of a question; if this fails, the write is deferred.
    pub(crate) fn save_or_defer_question(&self, question: &Question) {
        if self.save_question(question).is_err() {
            self.deferred.set(question_key(question), question);
        }
    }

    /// Removes a question.
    pub(crate) fn forget_question(&self, question: &Question) {
        let record_key = question_key(question);
        self.deferred.forget(&record_key);
        // After a failure, the question would only be answered again.
        let _ = self.write(|write| write.remove_for_good(&record_key).map(|_| ()));
    }
}

fn question_key(question: &Question) -> RecordKey {
    let Question { session, target, run, step, .. } = question;
    RecordKey::Question(format!("{session}/{target}/{run}/{step}"))
}

fn document(write: &Write, record_key: &RecordKey) -> Outcome<Option<Document>> {
    Ok(write.get(record_key)?.and_then(|json| serde_json::from_slice(&json).ok()))
}

/// Removes the questions whose names start with `prefix`.
pub(super) fn forget_questions(write: &Write, prefix: &str) -> Outcome<()> {
    let names: Vec<String> = {
        let table = write.transaction.open_table(QUESTIONS)?;
        let names: std::result::Result<Vec<String>, redb::StorageError> =
            table.range(prefix..)?.map(|entry| entry.map(|(key, _)| key.value().to_owned())).collect();
        names?.into_iter().take_while(|name| name.starts_with(prefix)).collect()
    };
    names.into_iter().try_for_each(|name| write.remove(&RecordKey::Question(name)).map(|_| ()))
}
