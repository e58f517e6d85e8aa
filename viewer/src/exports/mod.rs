//! Exports: the files of the session, and the options of figures.

pub(crate) mod window;
pub(crate) mod as_text;
pub(crate) mod figure_menu;
pub(crate) mod update;

use sightline_session::exports::ExportEntry;

use crate::figure::request::{FigureFormat, FigurePage, FigureRequest};
use crate::panels::pane::Pane;

/// A command about exports.
#[derive(Clone, Debug, PartialEq)]
pub enum ExportsCommand {
    /// Opens the window.
    Open,
    /// Closes the window.
    Close,
    /// Selects the part of the session to export.
    Scope(ExportScope),
    /// Downloads a file by its path below `/api/v1/`.
    Download(String),
    /// Saves a panel as a figure.
    Figure(FigureRequest),
    /// Chooses the file format of the window's figures.
    Format(FigureFormat),
    /// Chooses background and width of figures.
    Sheet(FigurePage),
    /// Whether figures have a caption above them.
    BurnIn(bool),
    /// Opens the plain page of the step.
    PlainPage,
}

/// The part of the session to export.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExportScope {
    /// The whole session.
    #[default]
    Session,
    /// The selected target.
    Target,
    /// The selected run.
    Run,
}

/// The state of the window of exports.
#[derive(Clone, Debug, Default)]
pub struct Exports {
    /// Whether the window is open.
    pub is_open: bool,
    /// The part to export.
    pub scope: ExportScope,
    /// The files; `None` until received.
    pub entries: Option<Vec<ExportEntry>>,
    /// The server's explanation, if it refused the list.
    pub refused: Option<String>,
    /// The panels on the screen.
    pub panes: Vec<Pane>,
    /// The file format of the window's figures.
    pub format: FigureFormat,
    /// Background and width of figures.
    pub sheet: FigurePage,
    /// Whether figures have a caption above them.
    pub burns_in: bool,
}
