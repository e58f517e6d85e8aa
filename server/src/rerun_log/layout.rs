//! A layout together with the properties of its views (where a legend stands, whence a map is seen), for which
//! rerun's own builder has no words in this version.
//!
//! A property is a row of the layout's store below its view's path. The builder makes that store with a name
//! of its own, so the rows are added where the finished layout passes on its way into the recording.

use rerun::blueprint::{Blueprint, BlueprintActivation, ContainerLike};
use rerun::log::LogMsg;
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, StoreKind};

use super::Logged;
use super::memory::MemoryStream;

/// The timeline of layouts, at whose zero rerun's builder puts its rows.
const TIMELINE: &str = "blueprint";

/// The properties of a layout's views.
#[derive(Default)]
pub(super) struct Layout {
    properties: Vec<(String, Box<dyn AsComponents>)>,
}

impl Layout {
    /// The view, with a property of that name, which is its archetype's.
    pub(super) fn view(
        &mut self,
        view: impl Into<ContainerLike>,
        name: &str,
        property: impl AsComponents + 'static,
    ) -> ContainerLike {
        let view = view.into();
        if let ContainerLike::View(inner) = &view {
            self.properties.push((format!("{}/{name}", inner.blueprint_path()), Box::new(property)));
        }
        view
    }

    /// Sends the layout whose views these are, and makes it the one that is shown.
    pub(super) fn send(self, blueprint: &Blueprint, stream: &RecordingStream) -> Logged {
        let Some(info) = stream.store_info() else { return Ok(()) };
        let aside =
            MemoryStream::open(RecordingStreamBuilder::new(info.application_id().clone()).enabled(true))?;
        blueprint.send(aside.stream(), BlueprintActivation::default())?;
        let messages =
            aside.take().into_iter().filter(|message| message.store_id().kind() == StoreKind::Blueprint);
        let (last, rows): (Vec<_>, Vec<_>) =
            messages.partition(|message| matches!(message, LogMsg::BlueprintActivationCommand(_)));
        let own = rows.first().map(|row| self.rows(row)).transpose()?.unwrap_or_default();
        // The command that shows the layout comes last, because a half loaded one would be mistaken for whole.
        rows.into_iter().chain(own).chain(last).for_each(|message| stream.record_msg(message));
        Ok(())
    }

    /// The properties as rows of the store to which `sibling` belongs.
    fn rows(&self, sibling: &LogMsg) -> rerun::RecordingStreamResult<Vec<LogMsg>> {
        let store =
            RecordingStreamBuilder::from_store_id(sibling.store_id()).send_properties(false).enabled(true);
        let memory = MemoryStream::open(store)?;
        let stream = memory.stream();
        stream.set_log_time_enabled(false);
        stream.set_time_sequence(TIMELINE, 0);
        for (path, property) in &self.properties {
            stream.log(path.as_str(), property.as_ref())?;
        }
        Ok(memory.take().into_iter().filter(|message| matches!(message, LogMsg::ArrowMsg(..))).collect())
    }
}
