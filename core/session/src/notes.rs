//! Notes of a session: texts about steps of the drive, in an order that a person can change.
//!
//! A note is pinned to a step of the drive, and optionally to a run, a stage and a pixel of the left image. New notes are
//! appended, so that the list is in order of creation until a person moves one. Every change increases a note's revision; a
//! request to change a note names the revision that it read, so that concurrent edits are not lost. The last removed notes
//! can be restored.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Session;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::records::stages_of;
use sightline_track::settings::TrackerKind;

/// Maximum number of notes of a session.
pub(crate) const NOTE_LIMIT: usize = 500;
/// Maximum number of characters of a note.
pub const TEXT_LIMIT: usize = 4000;
/// Maximum length of a time, bytes.
const TIME_LIMIT: usize = 40;
/// Number of removed notes that can be restored.
const REMOVED_KEPT: usize = 50;

/// A note.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Note {
    /// Its number in paths; not used again.
    pub id: u64,
    /// Increased by every change; the value for `If-Match`.
    pub revision: u64,
    /// Where it is pinned.
    #[serde(flatten)]
    pub pin: Pin,
    /// Its text, in Markdown.
    pub text: String,
    /// When it was created: RFC 3339, UTC.
    pub made: String,
    /// When it was last changed: RFC 3339, UTC.
    pub changed: String,
}

/// Where a note is pinned.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Pin {
    /// The target's number; null if the note is about the stop alone.
    #[serde(default)]
    pub target: Option<usize>,
    /// The run's number within the target.
    #[serde(default)]
    pub run: usize,
    /// The stop, from 0.
    pub step: usize,
    /// The name of the stage or of the step of `locate`.
    #[serde(default)]
    pub stage: Option<String>,
    /// A position in the left image, px.
    #[serde(default)]
    pub pixel: Option<Pixel>,
}

/// Pins a note.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewNote {
    /// Where to pin it.
    #[serde(flatten)]
    pub pin: Pin,
    /// Its text, in Markdown.
    pub text: String,
}

/// Changes a note; fields that are left out stay unchanged.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct EditNote {
    /// Its text, in Markdown.
    #[serde(default)]
    pub text: Option<String>,
    /// Its index in the list, from 0; a larger index means the end.
    #[serde(default)]
    pub place: Option<usize>,
}

/// Why a note could not be changed.
#[derive(Clone, Debug, PartialEq)]
pub enum Refused {
    /// There is no note with this number.
    Missing,
    /// The note was changed since the revision that was read; contains its current state.
    Changed(Box<Note>),
    /// The change is invalid.
    Bad(String),
}

/// The notes of a session.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Notes {
    /// The largest number used so far, also by removed notes.
    pub last_id: u64,
    /// The notes, in their order.
    pub list: Vec<Note>,
    /// Removed notes with their indices, in order of removal.
    #[serde(default)]
    pub removed: Vec<(usize, Note)>,
}

impl Notes {
    /// The notes of an imported session, renumbered in their order; the targets to which they are pinned may have been
    /// removed.
    ///
    /// # Errors
    /// [`Error::Request`] if there are too many notes, or a note names a step or stage that does not exist, or its text is
    /// blank or too long.
    pub fn brought(list: Vec<Note>, session: &Session) -> Result<Self> {
        let mut notes = Self::default();
        for (place, note) in list.into_iter().enumerate() {
            let wrong = |why: String| Error::Request(format!("notes[{place}]: {why}"));
            let anywhere = Pin { target: None, ..note.pin.clone() };
            check_pin(&anywhere, session).map_err(|error| wrong(error.to_string()))?;
            if note.pin.target.is_some_and(|target| target >= session.targets.len()) {
                return Err(wrong("target: there is none of that number".to_owned()));
            }
            if [&note.made, &note.changed].iter().any(|time| time.len() > TIME_LIMIT) {
                return Err(wrong("made, changed: must be times as RFC 3339 has them".to_owned()));
            }
            if place >= NOTE_LIMIT {
                return Err(Error::Request(format!("a session may have at most {NOTE_LIMIT} notes")));
            }
            let text = checked(&note.text).map_err(wrong)?;
            notes.last_id += 1;
            notes.list.push(Note { id: notes.last_id, revision: 1, text, ..note });
        }
        Ok(notes)
    }

    /// Adds a note at the end; `now` is RFC 3339, UTC.
    ///
    /// # Errors
    /// [`Error::Request`] if its pin names something that does not exist, its text is blank or too long, or there are too
    /// many notes.
    pub fn add(&mut self, new: NewNote, session: &Session, now: &str) -> Result<Note> {
        if self.list.len() >= NOTE_LIMIT {
            return Err(Error::Request(format!("a session may have at most {NOTE_LIMIT} notes")));
        }
        check_pin(&new.pin, session)?;
        let text = checked(&new.text).map_err(Error::Request)?;
        self.last_id += 1;
        let (made, changed) = (now.to_owned(), now.to_owned());
        let note = Note { id: self.last_id, revision: 1, pin: new.pin, text, made, changed };
        self.list.push(note.clone());
        Ok(note)
    }

    /// The note with this number.
    pub fn get(&self, id: u64) -> Option<&Note> {
        self.list.iter().find(|note| note.id == id)
    }

    /// Changes a note; `revision` is the one that was read, `None` skips the check.
    ///
    /// # Errors
    /// [`Refused`]; the notes stay unchanged.
    pub fn edit(
        &mut self,
        id: u64,
        revision: Option<u64>,
        edit: EditNote,
        now: &str,
    ) -> Result<Note, Refused> {
        let at = self.place_of(id, revision)?;
        let text = edit.text.as_deref().map(checked).transpose().map_err(Refused::Bad)?;
        let mut note = self.list.remove(at);
        if let Some(text) = text {
            note.text = text;
        }
        note.revision += 1;
        now.clone_into(&mut note.changed);
        let place = edit.place.unwrap_or(at).min(self.list.len());
        self.list.insert(place, note.clone());
        Ok(note)
    }

    /// Removes a note; [`Self::restore`] restores it.
    ///
    /// # Errors
    /// [`Refused`]; the notes stay unchanged.
    pub fn remove(&mut self, id: u64, revision: Option<u64>) -> Result<(), Refused> {
        let at = self.place_of(id, revision)?;
        let note = self.list.remove(at);
        self.removed.push((at, note));
        let surplus = self.removed.len().saturating_sub(REMOVED_KEPT);
        self.removed.drain(..surplus);
        Ok(())
    }

    /// Restores a removed note at its previous index.
    ///
    /// # Errors
    /// [`Refused::Missing`] if it was not removed, or too long ago; [`Refused::Bad`] if there are too many notes.
    pub fn restore(&mut self, id: u64) -> Result<Note, Refused> {
        let at = self.removed.iter().position(|(_, note)| note.id == id).ok_or(Refused::Missing)?;
        if self.list.len() >= NOTE_LIMIT {
            return Err(Refused::Bad(format!("a session may have at most {NOTE_LIMIT} notes")));
        }
        let (place, mut note) = self.removed.remove(at);
        note.revision += 1;
        self.list.insert(place.min(self.list.len()), note.clone());
        Ok(note)
    }

    fn place_of(&self, id: u64, revision: Option<u64>) -> Result<usize, Refused> {
        let at = self.list.iter().position(|note| note.id == id).ok_or(Refused::Missing)?;
        let note = &self.list[at];
        match revision {
            Some(read) if read != note.revision => Err(Refused::Changed(Box::new(note.clone()))),
            _ => Ok(at),
        }
    }
}

fn checked(text: &str) -> Result<String, String> {
    let count = text.chars().count();
    if text.trim().is_empty() {
        return Err("text: a note must say something".to_owned());
    }
    if count > TEXT_LIMIT {
        return Err(format!("text: may have at most {TEXT_LIMIT} characters, not {count}"));
    }
    Ok(text.to_owned())
}

/// The names of the stages to which a note can be pinned: the stages of all trackers, then those of a commanded drive.
fn stages() -> impl Iterator<Item = &'static str> {
    let is_of =
        |name: &&str| TrackerKind::ALL.iter().any(|tracker| stages_of(*tracker).any(|of| of == *name));
    let of_trackers =
        crate::records::stages().iter().map(|stage| stage.schema().stage.as_ref()).filter(is_of);
    let of_drive = CycleStage::ALL.into_iter().filter(|stage| *stage > CycleStage::Update);
    of_trackers.chain(of_drive.map(CycleStage::word))
}

fn check_pin(pin: &Pin, session: &Session) -> Result<()> {
    let wrong = |why: String| Err(Error::Request(why));
    if let Some(target) = pin.target {
        session.run(target, pin.run)?;
    }
    if pin.step >= session.stop_count {
        return wrong(format!("step: must be below {}, not {}", session.stop_count, pin.step));
    }
    if let Some(stage) = pin.stage.as_deref().filter(|stage| !stages().any(|known| known == *stage)) {
        let shown: String = stage.chars().take(40).collect();
        return wrong(format!("stage: {shown:?} is none of {}", stages().collect::<Vec<_>>().join(", ")));
    }
    match pin.pixel {
        Some(pixel) if !(pixel.x.is_finite() && pixel.y.is_finite()) => {
            wrong("pixel: must have two finite numbers".to_owned())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: &str = "2026-11-22T12:00:00Z";

    fn note(text: &str) -> NewNote {
        pinned(Pin::default(), text)
    }

    fn pinned(pin: Pin, text: &str) -> NewNote {
        NewNote { pin: Pin { step: pin.step.max(1), ..pin }, text: text.to_owned() }
    }

    fn three() -> Notes {
        let (mut notes, session) = (Notes::default(), Session::new("s1", "t", 3));
        for text in ["a", "b", "c"] {
            notes.add(note(text), &session, NOW).unwrap();
        }
        notes
    }

    fn texts(notes: &Notes) -> String {
        notes.list.iter().map(|note| note.text.as_str()).collect()
    }

    #[test]
    fn notes_stand_in_the_order_of_time_until_one_is_moved() {
        let mut notes = three();
        assert_eq!(texts(&notes), "abc");
        notes.edit(3, Some(1), EditNote { place: Some(0), text: None }, NOW).unwrap();
        assert_eq!(texts(&notes), "cab");
        notes.edit(3, None, EditNote { place: Some(99), text: None }, NOW).unwrap();
        assert_eq!(texts(&notes), "abc");
    }

    #[test]
    fn words_that_somebody_else_changed_are_not_overwritten() {
        let mut notes = three();
        let edit = |text: &str| EditNote { text: Some(text.to_owned()), place: None };
        assert_eq!(notes.edit(2, Some(1), edit("B"), NOW).unwrap().revision, 2);
        let Err(Refused::Changed(now)) = notes.edit(2, Some(1), edit("x"), NOW) else {
            panic!("a stale edit")
        };
        assert_eq!((now.text.as_str(), texts(&notes).as_str()), ("B", "aBc"));
        assert!(matches!(notes.remove(2, Some(1)), Err(Refused::Changed(_))));
        assert_eq!(notes.edit(9, None, edit("x"), NOW), Err(Refused::Missing));
        assert!(
            matches!(notes.edit(1, Some(1), edit("  "), NOW), Err(Refused::Bad(why)) if why.contains("text"))
        );
    }

    #[test]
    fn a_removed_note_comes_back_to_its_place_and_its_number_is_not_used_again() {
        let mut notes = three();
        notes.remove(2, Some(1)).unwrap();
        let session = Session::new("s1", "t", 3);
        assert_eq!(notes.add(note("d"), &session, NOW).unwrap().id, 4);
        assert_eq!(texts(&notes), "acd");
        notes.restore(2).unwrap();
        assert_eq!(texts(&notes), "abcd");
        assert_eq!(notes.restore(2), Err(Refused::Missing));
    }

    #[test]
    fn a_note_is_pinned_only_to_what_exists() {
        let (mut notes, session) = (Notes::default(), Session::new("s1", "t", 3));
        let mut refuse = |new: NewNote| notes.add(new, &session, NOW).unwrap_err().to_string();
        assert!(refuse(pinned(Pin { step: 3, ..Pin::default() }, "x")).contains("step"));
        assert!(refuse(pinned(Pin { target: Some(0), ..Pin::default() }, "x")).contains("target 0"));
        let guess = Pin { stage: Some("guess".to_owned()), ..Pin::default() };
        assert!(refuse(pinned(guess, "x")).contains("stage"));
        assert!(refuse(note(&"x".repeat(TEXT_LIMIT + 1))).contains("4000"));
        let nowhere = Pixel::new(f64::NAN, 0.0);
        assert!(refuse(pinned(Pin { pixel: Some(nowhere), ..Pin::default() }, "x")).contains("pixel"));
    }

    #[test]
    fn a_new_note_is_one_flat_record_and_refuses_what_it_does_not_know() {
        let read = |text: &str| serde_json::from_str::<NewNote>(text);
        let new = read(r#"{"target": 2, "step": 1, "stage": "judge", "text": "a"}"#).unwrap();
        assert_eq!((new.pin.target, new.pin.step, new.text.as_str()), (Some(2), 1, "a"));
        assert_eq!(serde_json::to_value(&new).unwrap()["step"], 1, "flat again when it is written");
        let refused = read(r#"{"step": 1, "text": "a", "colour": "red"}"#).unwrap_err().to_string();
        assert!(refused.contains("colour"), "{refused}");
        assert!(read(r#"{"text": "a"}"#).unwrap_err().to_string().contains("step"));
    }

    #[test]
    fn notes_from_elsewhere_are_numbered_anew_and_checked_like_new_ones() {
        let (list, session) = (three().list, Session::new("s1", "t", 3));
        let mut brought = list.clone();
        brought[0].id = 77;
        let notes = Notes::brought(brought, &session).unwrap();
        assert_eq!((texts(&notes).as_str(), notes.last_id, notes.list[0].id), ("abc", 3, 1));
        let refused = |change: fn(&mut Note)| {
            let mut list = list.clone();
            change(&mut list[1]);
            Notes::brought(list, &session).unwrap_err().to_string()
        };
        assert!(refused(|note| note.pin.step = 3).starts_with("notes[1]: step"));
        assert!(refused(|note| note.pin.target = Some(0)).contains("target"));
        assert!(refused(|note| note.text.clear()).contains("text"));
        assert!(refused(|note| note.made = "x".repeat(41)).contains("made"));
    }
}
