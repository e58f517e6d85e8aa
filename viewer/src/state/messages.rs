//! Messages to the user, newest last. The latest problem is also shown as a card until it is closed.

use sightline_api::wire::Problem;

/// Importance of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// An action succeeded.
    Note,
    /// An action was refused or failed.
    Problem,
}

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Unique number of the message.
    pub id: u64,
    /// Its importance.
    pub weight: Weight,
    /// One sentence.
    pub text: String,
    /// How to resolve the problem.
    pub hint: Option<String>,
    /// URL of a related page.
    pub link: Option<String>,
    /// Number of consecutive occurrences.
    pub count: u32,
    /// Details of a problem.
    pub about: Option<Box<About>>,
    /// Number of the change that the message offers to undo while it is the last one.
    pub change: Option<u64>,
    /// Whether it is about a target or a run of the open session.
    pub is_of_session: bool,
    /// Whether it applies only while a run is computed.
    pub is_of_running: bool,
    /// Whether it no longer applies: the list keeps it, the status line does not show it.
    pub is_past: bool,
}

/// Details of a problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct About {
    /// Stable code of the problem.
    pub code: String,
    /// Names and values: the refused request, the field, the request id, the time and the status.
    pub details: Vec<(&'static str, String)>,
}

impl Message {
    /// The message with all details, as text to copy.
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

/// Maximum number of stored messages.
const KEPT: usize = 50;

impl Messages {
    /// Adds a note: an action succeeded.
    pub fn note(&mut self, text: impl Into<String>) {
        self.add(Weight::Note, text.into(), None, None);
    }

    /// Adds a note about a target or a run of the open session.
    pub(crate) fn note_of_session(&mut self, text: impl Into<String>) {
        self.note(text);
        if let Some(last) = self.list.last_mut() {
            last.is_of_session = true;
        }
    }

    /// Adds a note that applies only while a run is being computed.
    pub(crate) fn note_while_running(&mut self, text: impl Into<String>) {
        self.note_of_session(text);
        if let Some(last) = self.list.last_mut() {
            last.is_of_running = true;
        }
    }

    /// Marks the notes about running computations as past.
    pub(crate) fn runs_ended(&mut self) {
        self.list.iter_mut().filter(|message| message.is_of_running).for_each(|m| m.is_past = true);
    }

    /// Removes the notes about targets and runs: another session is open.
    pub(crate) fn forget_session(&mut self) {
        self.list.retain(|message| !message.is_of_session);
    }

    /// Adds a note with a link to a related page.
    pub(crate) fn note_with_link(&mut self, text: impl Into<String>, link: impl Into<String>) {
        self.add(Weight::Note, text.into(), None, Some(link.into()));
    }

    /// Adds a problem: an action was refused or failed.
    pub fn problem(&mut self, text: impl Into<String>, hint: Option<String>) {
        self.add(Weight::Problem, text.into(), hint, None);
    }

    /// Adds a note that offers to undo a change.
    pub(crate) fn note_with_undo(&mut self, text: impl Into<String>, change: u64) {
        self.add(Weight::Note, text.into(), None, None);
        if let Some(last) = self.list.last_mut() {
            last.change = Some(change);
        }
    }

    /// The server refused `request`; `has_card`: also show it as a card above the panels.
    pub fn refused(&mut self, problem: &Problem, request: String, has_card: bool) {
        let mut details = vec![("asked", request)];
        details.extend(problem.field().map(|field| ("field", field.to_owned())));
        if let Some(received) = &problem.received {
            details.push(("request", received.request_id.clone()));
            details.push(("time", received.time.clone()));
        }
        details.push(("status", problem.status.to_string()));
        self.about(problem.detail.clone(), problem.hint.clone(), problem.code.clone(), details, has_card);
    }

    /// A file cannot be opened; the sentence names it and says how to resolve the problem.
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
            // For a repeated problem, keep the details of the newest request.
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

    /// Closes the card; the message remains in the list.
    pub(crate) fn close_card(&mut self) {
        self.card = None;
    }

    /// Removes a message.
    pub(crate) fn dismiss(&mut self, id: u64) {
        self.list.retain(|message| message.id != id);
    }

    /// All messages, newest last.
    pub fn all(&self) -> &[Message] {
        &self.list
    }

    /// The newest message, unless it is past.
    pub fn newest(&self) -> Option<&Message> {
        self.list.last().filter(|message| !message.is_past)
    }

    /// Marks the problems of a request as past and closes their card: the request succeeded or is retried.
    pub(crate) fn mark_resolved(&mut self, request: &str) {
        let is_of = |message: &Message| {
            let details = message.about.iter().flat_map(|about| &about.details);
            details.into_iter().any(|(name, value)| *name == "asked" && value == request)
        };
        for message in self.list.iter_mut().filter(|message| is_of(message)) {
            message.is_past = true;
            self.card = self.card.filter(|card| *card != message.id);
        }
    }

    /// Marks notes and refusals as past: another session was opened.
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
        let (id, about, change) = (self.next, None, None);
        self.list.push(Message {
            id,
            weight,
            text,
            hint,
            link,
            count: 1,
            about,
            change,
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
        messages.mark_resolved("post /sessions");
        assert!(messages.newest().is_some() && messages.card().is_some());
        messages.mark_resolved("post /studies/jobs");
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
