//! Effects: what a change of the state asks of the page around it. The state itself does no input or output.

use crate::figure::wish::Wish;
use crate::layout::command::LayoutCommand;
use crate::net::request::Request;
use crate::panels::pane::Pane;
use crate::theme::Looks;

/// Something that the page does for the state.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Sends a request to the server.
    Send(Request),
    /// Opens a page in a new tab.
    OpenUrl(String),
    /// Copies the link to what is shown.
    CopyLink,
    /// Changes the arrangement of the panels.
    Layout(LayoutCommand),
    /// Sets the colours of the page.
    UseLooks(Looks),
    /// Lets the user choose a file.
    ChooseFile,
    /// Lets the user choose the folder of a recording, or an archive of one.
    ChooseRecording {
        /// Whether it is an archive.
        is_archive: bool,
    },
    /// Sends the recording that was chosen last to an upload of this name.
    SendRecording(String),
    /// Sends no more of it.
    StopSending,
    /// Reads the file at a path.
    ReadFile(String),
    /// Saves a panel as a figure.
    SaveFigure(Wish),
}

impl Effect {
    /// Brings a panel to the front.
    pub const fn reveal(pane: Pane) -> Self {
        Self::Layout(LayoutCommand::Show(pane))
    }
}

/// Effects that wait to be carried out, oldest first.
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

    /// Takes all effects out.
    pub(crate) fn take(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.0)
    }

    /// Takes the requests out and leaves the other effects.
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
