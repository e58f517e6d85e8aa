//! What was said to the person, newest last.

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
}

/// The list of messages.
#[derive(Default)]
pub struct Messages {
    list: Vec<Message>,
    next: u64,
}

/// How many messages are kept.
const KEPT: usize = 50;

impl Messages {
    /// Something happened as asked.
    pub fn note(&mut self, text: impl Into<String>) {
        self.add(Weight::Note, text.into(), None, None);
    }

    /// Something happened as asked, and there is a page to it.
    pub fn note_with_link(&mut self, text: impl Into<String>, link: impl Into<String>) {
        self.add(Weight::Note, text.into(), None, Some(link.into()));
    }

    /// Something was refused or failed.
    pub fn problem(&mut self, text: impl Into<String>, hint: Option<String>) {
        self.add(Weight::Problem, text.into(), hint, None);
    }

    /// Takes a message away.
    pub fn dismiss(&mut self, id: u64) {
        self.list.retain(|message| message.id != id);
    }

    /// All of them, the newest last.
    pub fn all(&self) -> &[Message] {
        &self.list
    }

    /// The newest.
    pub fn newest(&self) -> Option<&Message> {
        self.list.last()
    }

    fn add(&mut self, weight: Weight, text: String, hint: Option<String>, link: Option<String>) {
        if let Some(last) = self.list.last_mut().filter(|last| last.text == text && last.weight == weight) {
            last.count += 1;
            last.link = link.or(last.link.take());
            return;
        }
        self.list.push(Message { id: self.next, weight, text, hint, link, count: 1 });
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
    fn the_list_stays_short() {
        let mut messages = Messages::default();
        for i in 0..200 {
            messages.note(format!("{i}"));
        }
        assert_eq!(messages.all().len(), KEPT);
        assert_eq!(messages.newest().unwrap().text, "199");
    }
}
