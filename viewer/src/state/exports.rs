//! Exports: what the session can be had as, and what a person asked for.

use sightline_core::session::exports::ExportEntry;

use super::State;
use crate::figure::take::{Kind, Wish};
use crate::layout::Pane;
use crate::net::Request;

/// What a person asks of exports.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Opens the window.
    Open,
    /// Closes it.
    Close,
    /// Looks at another part of the session.
    Of(Part),
    /// Downloads a file by its path below `/api/v1/`.
    Download(String),
    /// Saves a panel as a figure.
    Figure(Wish),
    /// Chooses what the figures of the window are saved as.
    Kind(Kind),
    /// Puts a line above figures that says of what they are, or does not.
    BurnIn(bool),
    /// Opens the plain page of the step.
    PlainPage,
}

/// Which part of the session is exported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    #[default]
    Session,
    /// The target that is looked at.
    Target,
    /// The run that is looked at.
    Run,
}

/// What is known of exports.
#[derive(Clone, Debug, Default)]
pub struct Exports {
    /// Whether the window is open.
    pub is_open: bool,
    /// What it shows.
    pub part: Part,
    /// The files; none before the server has said.
    pub entries: Option<Vec<ExportEntry>>,
    /// Why there are none.
    pub refused: Option<String>,
    /// The panels on the screen.
    pub panes: Vec<Pane>,
    /// A figure that is to be saved.
    pub figure_of: Option<Wish>,
    /// What the figures of the window are saved as.
    pub kind: Kind,
    /// Whether a line above a figure says of what it is.
    pub burns_in: bool,
}

impl State {
    /// Carries out what was asked of exports.
    pub(super) fn ask_of_exports(&mut self, ask: Ask) {
        match ask {
            Ask::Open => {
                self.exports.is_open = true;
                self.want_exports();
            }
            Ask::Close => self.exports.is_open = false,
            Ask::Of(part) => {
                self.exports.part = part;
                self.want_exports();
            }
            Ask::Download(path) => self.open_url = Some(format!("{}/api/v1/{path}", self.origin)),
            Ask::Figure(wish) => self.exports.figure_of = Some(wish),
            Ask::Kind(kind) => self.exports.kind = kind,
            Ask::BurnIn(is_on) => self.exports.burns_in = is_on,
            Ask::PlainPage => self.open_url = Some(format!("{}/api/v1/{}", self.origin, self.plain_page())),
        }
    }

    /// Where the plain page of what is looked at is, below `/api/v1/`.
    pub fn plain_page(&self) -> String {
        match (&self.session, self.step_key(self.cursor.step).filter(|_| self.row().is_some())) {
            (_, Some(key)) => format!(
                "sessions/{}/targets/{}/runs/{}/steps/{}/page",
                key.session, key.target, key.run, key.step
            ),
            (Some(session), None) => format!("sessions/{}/page", session.id),
            (None, None) => "page".to_owned(),
        }
    }

    fn want_exports(&mut self) {
        (self.exports.entries, self.exports.refused) = (None, None);
        let (target, run) = match self.exports.part {
            Part::Session => (None, None),
            Part::Target => (self.cursor.target, None),
            Part::Run => (self.cursor.target, self.cursor.target.map(|_| self.cursor.run)),
        };
        self.ask(|session| Request::Exports { session, target, run });
    }
}
