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
use super::record::{DOCUMENTS, DRIVES, Named, Place, QUESTIONS, STUDIES, all_named, all_numbered};

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
        self.named(DOCUMENTS).map(|all| all.into_iter().map(|(_, document)| document).collect())
    }

    /// The values of a table with names; what cannot be read is left out.
    fn named<T: DeserializeOwned>(&self, table: Named) -> Result<Vec<(String, T)>> {
        let all = self.disk.read(|database| all_named(&database.begin_read()?, table))?;
        let read = |(name, json): (String, Vec<u8>)| Some((name, serde_json::from_slice(&json).ok()?));
        Ok(all.into_iter().filter_map(read).collect())
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
        let place = Place::Document(name.to_owned());
        self.write(|write| {
            let known = document(write, &place)?.map(|document| document.revision);
            let count = write.transaction.open_table(DOCUMENTS)?.len()?;
            if revision.is_some_and(|read| read != known.unwrap_or(0)) {
                outcome = Err(Clash::Changed(known));
                return Ok(());
            }
            if known.is_none() && count >= DOCUMENT_LIMIT as u64 {
                return Ok(());
            }
            let document = Document { name: name.to_owned(), revision: known.unwrap_or(0) + 1, value };
            write.put(place, &document)?;
            outcome = Ok(document);
            Ok(())
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
        let place = Place::Document(name.to_owned());
        self.write(|write| {
            let known = document(write, &place)?.map(|document| document.revision);
            if known.is_some() && revision.is_some_and(|read| Some(read) != known) {
                outcome = Err(Clash::Changed(known));
                return Ok(());
            }
            outcome = Ok(write.remove_for_good(&place)?);
            Ok(())
        })?;
        Ok(outcome)
    }

    /// The scenarios of the drives that were opened from a page, as TOML, by the names of their folders.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] when the database cannot be read.
    pub fn drives(&self) -> Result<Vec<(String, String)>> {
        self.named(DRIVES)
    }

    /// Remembers a drive that was opened from a page.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn save_drive(&self, folder: &str, scenario: &str) -> Result<()> {
        self.write(|write| write.put(Place::Drive(folder.to_owned()), &scenario).map(|_| ()))
    }

    /// Forgets a drive that was opened from a page.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn remove_drive(&self, folder: &str) -> Result<()> {
        self.write(|write| write.remove_for_good(&Place::Drive(folder.to_owned())).map(|_| ()))
    }

    /// The studies that were started, by number; what cannot be read is left out.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] when the database cannot be read.
    pub fn studies<T: DeserializeOwned>(&self) -> Result<Vec<(u64, T)>> {
        let all = self.disk.read(|database| all_numbered(&database.begin_read()?, STUDIES))?;
        let read = |(number, json): (u64, Vec<u8>)| Some((number, serde_json::from_slice(&json).ok()?));
        Ok(all.into_iter().filter_map(read).collect())
    }

    /// Takes a study out of the list.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn remove_study(&self, number: u64) -> Result<()> {
        self.waiting.forget(&Place::Study(number));
        self.write(|write| write.remove_for_good(&Place::Study(number)).map(|_| ()))
    }

    /// Writes how a study stands.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn save_study(&self, number: u64, study: &impl Serialize) -> Result<()> {
        self.write(|write| write.put(Place::Study(number), study).map(|_| ()))?;
        self.waiting.forget(&Place::Study(number));
        Ok(())
    }

    /// Writes how a study stands, which nobody waits for: where that fails, it is written later.
    pub(crate) fn keep_study(&self, number: u64, study: &impl Serialize) {
        if self.save_study(number, study).is_err() {
            self.waiting.set(Place::Study(number), study);
        }
    }

    /// The questions that were asked; what cannot be read is left out.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Read`] when the database cannot be read.
    pub(crate) fn questions(&self) -> Result<Vec<Question>> {
        self.named(QUESTIONS).map(|all| all.into_iter().map(|(_, question)| question).collect())
    }

    /// Writes a question.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Write`]; the database is then as it was.
    pub(crate) fn save_question(&self, question: &Question) -> Result<()> {
        let place = question_place(question);
        self.write(|write| write.put(place.clone(), question).map(|_| ()))?;
        self.waiting.forget(&place);
        Ok(())
    }

    /// Writes the answer of a question, which nobody waits for: where that fails, it is written later.
    pub(crate) fn keep_question(&self, question: &Question) {
        if self.save_question(question).is_err() {
            self.waiting.set(question_place(question), question);
        }
    }

    /// Forgets a question.
    pub(crate) fn forget_question(&self, question: &Question) {
        let place = question_place(question);
        self.waiting.forget(&place);
        // One that stays is only answered again.
        let _ = self.write(|write| write.remove_for_good(&place).map(|_| ()));
    }
}

fn question_place(question: &Question) -> Place {
    let Question { session, target, run, step, .. } = question;
    Place::Question(format!("{session}/{target}/{run}/{step}"))
}

fn document(write: &Write, place: &Place) -> Outcome<Option<Document>> {
    Ok(write.get(place)?.and_then(|json| serde_json::from_slice(&json).ok()))
}

/// Removes the questions whose names begin so.
pub(super) fn forget_questions(write: &Write, prefix: &str) -> Outcome<()> {
    let names: Vec<String> = {
        let table = write.transaction.open_table(QUESTIONS)?;
        let names: std::result::Result<Vec<String>, redb::StorageError> =
            table.range(prefix..)?.map(|entry| entry.map(|(key, _)| key.value().to_owned())).collect();
        names?.into_iter().take_while(|name| name.starts_with(prefix)).collect()
    };
    names.into_iter().try_for_each(|name| write.remove(&Place::Question(name)).map(|_| ()))
}
