//! What was said to the person, newest last. The problem that was met last also has a card, until it is closed.

use sightline_api::wire::Problem;

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Something happened as asked.
    Note,
    /// Something was refused or failed.
    Problem,
}

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// What tells it from the others.
    pub id: u64,
    /// How much it matters.
    pub weight: Weight,
    /// One sentence.
    pub text: String,
    /// How to mend it.
    pub hint: Option<String>,
    /// A page that belongs to it.
    pub link: Option<String>,
    /// How often it was said in a row.
    pub count: u32,
    /// What else is known of a problem.
    pub about: Option<Box<About>>,
    /// The deed that it tells of, which can be taken back while it is the last one.
    pub deed: Option<u64>,
    /// Whether it is about a target or a run of the open session.
    pub is_of_session: bool,
    /// Whether it applies only while a run is computed.
    pub is_of_running: bool,
    /// Whether it no longer applies: the list keeps it, the status line does not show it.
    pub is_past: bool,
}

/// What else is known of a problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct About {
    /// Its stable name.
    pub code: String,
    /// Names and values: what was asked, field, request and time.
    pub details: Vec<(&'static str, String)>,
}

impl Message {
    /// All that is known of it, as text to copy.
    pub fn words(&self) -> String {
        let mut words = self.text.clone();
        let hint = self.hint.iter().map(|hint| ("what to do", hint.clone()));
        let about = self.about.iter().flat_map(|about| {
            let code = ("code", about.code.clone());
            std::iter::once(code).chain(about.details.iter().cloned())
        });
        for (name, value) in hint.chain(about) {
            words += &format!("\n{name}: {value}");
        }
        words
    }
}

/// The list of messages.
#[derive(Default)]
pub struct Messages {
    list: Vec<Message>,
    next: u64,
    /// The message whose card is open.
    card: Option<u64>,
}

/// How many messages are kept.
const KEPT: usize = 50;

impl Messages {
    /// Something happened as asked.
    pub fn note(&mut self, text: impl Into<String>) {
        self.add(Weight::Note, text.into(), None, None);
    }

    /// Something happened to a target or a run of the open session.
    pub(crate) fn note_of_session(&mut self, text: impl Into<String>) {
        self.note(text);
        if let Some(last) = self.list.last_mut() {
            last.is_of_session = true;
        }
    }

    /// Something was begun that ends with the run that is being computed.
    pub(crate) fn note_while_running(&mut self, text: impl Into<String>) {
        self.note_of_session(text);
        if let Some(last) = self.list.last_mut() {
            last.is_of_running = true;
        }
    }

    /// No run is being computed any more.
    pub(crate) fn runs_ended(&mut self) {
        self.list.iter_mut().filter(|message| message.is_of_running).for_each(|m| m.is_past = true);
    }

    /// Forgets the notes about targets and runs: another session is open.
    pub(crate) fn forget_session(&mut self) {
        self.list.retain(|message| !message.is_of_session);
    }

    /// Something happened as asked, and there is a page to it.
    pub(crate) fn note_with_link(&mut self, text: impl Into<String>, link: impl Into<String>) {
        self.add(Weight::Note, text.into(), None, Some(link.into()));
    }

    /// Something was refused or failed.
    pub fn problem(&mut self, text: impl Into<String>, hint: Option<String>) {
        self.add(Weight::Problem, text.into(), hint, None);
    }

    /// Something was done that can be taken back as long as no other deed follows.
    pub fn deed(&mut self, text: impl Into<String>, deed: u64) {
        self.add(Weight::Note, text.into(), None, None);
        if let Some(last) = self.list.last_mut() {
            last.deed = Some(deed);
        }
    }

    /// The server refused `asked`; `has_card` says whether that is shown above the panels.
    pub fn refused(&mut self, problem: &Problem, asked: String, has_card: bool) {
        let mut details = vec![("asked", asked)];
        details.extend(problem.field().map(|field| ("field", field.to_owned())));
        if let Some(received) = &problem.received {
            details.push(("request", received.request_id.clone()));
            details.push(("time", received.time.clone()));
        }
        details.push(("status", problem.status.to_string()));
        self.about(problem.detail.clone(), problem.hint.clone(), problem.code.clone(), details, has_card);
    }

    /// A file cannot be opened; the sentence names it and says what to do.
    pub(crate) fn refused_file(&mut self, sentence: impl Into<String>) {
        self.about(sentence.into(), None, "file".to_owned(), Vec::new(), true);
    }

    fn about(
        &mut self,
        text: String,
        hint: Option<String>,
        code: String,
        details: Vec<(&'static str, String)>,
        has_card: bool,
    ) {
        self.add(Weight::Problem, text, hint, None);
        if let Some(last) = self.list.last_mut() {
            // Of the same problem twice the newest request is the one to look for.
            last.about = Some(Box::new(About { code, details }));
            if has_card {
                self.card = Some(last.id);
            }
        }
    }

    /// The message whose card is open.
    pub fn card(&self) -> Option<&Message> {
        self.list.iter().find(|message| Some(message.id) == self.card)
    }

    /// Closes the card; the message stays.
    pub(crate) fn close_card(&mut self) {
        self.card = None;
    }

    /// Takes a message away.
    pub(crate) fn dismiss(&mut self, id: u64) {
        self.list.retain(|message| message.id != id);
    }

    /// All of them, the newest last.
    pub fn all(&self) -> &[Message] {
        &self.list
    }

    /// The newest, unless it no longer applies.
    pub fn newest(&self) -> Option<&Message> {
        self.list.last().filter(|message| !message.is_past)
    }

    /// A request succeeded or is tried again: problems of the same request no longer apply, and a card of one is closed.
    pub(crate) fn mended(&mut self, asked: &str) {
        let is_of = |message: &Message| {
            let details = message.about.iter().flat_map(|about| &about.details);
            details.into_iter().any(|(name, value)| *name == "asked" && value == asked)
        };
        for message in self.list.iter_mut().filter(|message| is_of(message)) {
            message.is_past = true;
            self.card = self.card.filter(|card| *card != message.id);
        }
    }

    /// Another session was opened: notes about the earlier one, and what was refused there, no longer apply.
    pub(crate) fn leave_session(&mut self) {
        let is_refused = |message: &Message| {
            let details = message.about.iter().flat_map(|about| &about.details);
            details.into_iter().any(|(name, _)| *name == "asked")
        };
        for message in &mut self.list {
            message.is_past |= message.weight == Weight::Note || is_refused(message);
        }
    }

    fn add(&mut self, weight: Weight, text: String, hint: Option<String>, link: Option<String>) {
        if let Some(last) = self.list.last_mut().filter(|last| last.text == text && last.weight == weight) {
            last.count += 1;
            last.is_past = false;
            last.link = link.or(last.link.take());
            return;
        }
        let (id, about, deed) = (self.next, None, None);
        self.list.push(Message {
            id,
            weight,
            text,
            hint,
            link,
            count: 1,
            about,
            deed,
            is_of_session: false,
            is_of_running: false,
            is_past: false,
        });
        self.next += 1;
        if self.list.len() > KEPT {
            self.list.remove(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_message_twice_is_one_with_a_count() {
        let mut messages = Messages::default();
        messages.problem("no", None);
        messages.problem("no", None);
        messages.note("yes");
        assert_eq!(messages.all().len(), 2);
        assert_eq!(messages.all()[0].count, 2);
        let id = messages.all()[0].id;
        messages.dismiss(id);
        assert_eq!(messages.newest().unwrap().text, "yes");
    }

    #[test]
    fn a_problem_leaves_the_status_line_once_its_request_succeeds() {
        let problem = Problem {
            code: "grid".to_owned(),
            title: String::new(),
            status: 422,
            detail: "grid: 99 is too large".to_owned(),
            hint: None,
            nearest_pixel: None,
            received: None,
        };
        let mut messages = Messages::default();
        messages.refused(&problem, "post /studies/jobs".to_owned(), true);
        messages.mended("post /sessions");
        assert!(messages.newest().is_some() && messages.card().is_some());
        messages.mended("post /studies/jobs");
        assert!(messages.newest().is_none() && messages.card().is_none());
        assert_eq!(messages.all().len(), 1, "the list keeps it");
        messages.refused(&problem, "post /studies/jobs".to_owned(), true);
        assert!(messages.newest().is_some() && messages.card().is_some(), "it happened again");
    }

    #[test]
    fn notes_of_an_earlier_session_leave_the_status_line() {
        let mut messages = Messages::default();
        messages.note("target 1 is picked");
        messages.leave_session();
        assert!(messages.newest().is_none());
        messages.problem("no", None);
        messages.leave_session();
        assert!(messages.newest().is_some(), "problems stay");
        let refusal = Problem::new(422, "setting", "", "grid: -2 is too small.");
        messages.refused(&refusal, "post /studies/jobs".to_owned(), false);
        messages.leave_session();
        assert!(messages.newest().is_none(), "what was refused there is past");
    }

    #[test]
    fn the_list_stays_short() {
        let mut messages = Messages::default();
        for i in 0..200 {
            messages.note(format!("{i}"));
        }
        assert_eq!(messages.all().len(), KEPT);
        assert_eq!(messages.newest().unwrap().text, "199");
    }
}
