//! Exports: what the session can be had as, and what a person asked for.

pub(crate) mod window;
pub(crate) mod as_text;
pub(crate) mod figure_menu;
pub(crate) mod update;

use sightline_session::exports::ExportEntry;

use crate::figure::wish::{Kind, Sheet, Wish};
use crate::panels::pane::Pane;

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
    /// Chooses ground and width of figures.
    Sheet(Sheet),
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
    /// What the figures of the window are saved as.
    pub kind: Kind,
    /// Ground and width of figures.
    pub sheet: Sheet,
    /// Whether a line above a figure says of what it is.
    pub burns_in: bool,
}
