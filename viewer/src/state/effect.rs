//! Effects: the input and output that a change of state requires. The page carries them out; the state does none itself.

use crate::figure::request::FigureRequest;
use crate::layout::command::LayoutCommand;
use crate::net::request::Request;
use crate::panels::pane::Pane;
use crate::theme::ColourTheme;

/// An action that the page carries out for the state.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Sends a request to the server.
    Send(Request),
    /// Opens a page in a new tab.
    OpenUrl(String),
    /// Copies the link to the current view.
    CopyLink,
    /// Changes the layout of the panels.
    Layout(LayoutCommand),
    /// Sets the colours of the page.
    UseColourTheme(ColourTheme),
    /// Lets the user choose a file.
    ChooseFile,
    /// Lets the user choose a recording.
    ChooseRecording {
        /// Whether it is an archive file rather than a folder.
        is_archive: bool,
    },
    /// Sends the recording chosen last to the upload with this name.
    SendRecording(String),
    /// Stops sending the recording.
    StopSending,
    /// Reads the file at a path.
    ReadFile(String),
    /// Saves a panel as a figure.
    SaveFigure(FigureRequest),
}

impl Effect {
    /// Brings a panel to the front.
    pub const fn reveal(pane: Pane) -> Self {
        Self::Layout(LayoutCommand::Show(pane))
    }
}

/// Pending effects, oldest first.
#[derive(Debug, Default)]
pub(crate) struct Outbox(Vec<Effect>);

impl Outbox {
    /// Adds a request.
    pub(crate) fn push(&mut self, request: Request) {
        self.0.push(Effect::Send(request));
    }

    /// Adds any effect.
    pub(crate) fn add(&mut self, effect: Effect) {
        self.0.push(effect);
    }

    /// Removes and returns all effects.
    pub(crate) fn take(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.0)
    }

    /// Removes and returns the requests; the other effects remain.
    #[cfg(test)]
    pub(crate) fn take_requests(&mut self) -> Vec<Request> {
        let (mut requests, mut others) = (Vec::new(), Vec::new());
        for effect in self.take() {
            match effect {
                Effect::Send(request) => requests.push(request),
                other => others.push(other),
            }
        }
        self.0 = others;
        requests
    }
}
