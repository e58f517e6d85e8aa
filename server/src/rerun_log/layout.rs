//! A layout of views in containers, and its rows in a rerun blueprint.
//!
//! Rerun's own builder is not used: it leaks a stream with its threads at every `Blueprint::send`, and it does not support
//! view properties such as the corner of a legend. The rows have the same form as its own:
//!
//! | path | archetype |
//! |---|---|
//! | `/viewport` | `ViewportBlueprint`: the root container |
//! | `/container/{id}` | `ContainerBlueprint`: kind, paths of the children, shares |
//! | `/view/{id}` | `ViewBlueprint`: class, name, origin |
//! | `/view/{id}/ViewContents` | `ViewContents`: the visible entities |
//! | `/view/{id}/{property}` | a property of the view |
//!
//! An id is a UUID with the index of the part in the layout; the name of the store is random.

use rerun::blueprint::components::{
    AutoLayout, AutoViews, ColumnShare, ContainerKind, GridColumns, IncludedContent, QueryExpression,
    RootContainer, RowShare, ViewClass,
};
use rerun::components::Name;
use rerun::datatypes::{Bool, Float32, UInt32, Uuid};
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    ContainerBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

use super::Logged;
use super::memory::MemoryStream;

/// The timeline of blueprints; all rows are at its time 0.
const TIMELINE: &str = "blueprint";

/// A container or a view.
pub(super) enum LayoutNode {
    Container(Container),
    View(View),
}

/// Parts arranged horizontally, vertically, in a grid or in tabs.
pub(super) struct Container {
    kind: ContainerKind,
    parts: Vec<LayoutNode>,
    name: Option<String>,
    shares: Vec<f32>,
    columns: Option<u32>,
}

/// A view of some entities.
pub(super) struct View {
    class: &'static str,
    name: String,
    origin: String,
    contents: Vec<String>,
    properties: Vec<(&'static str, Box<dyn AsComponents>)>,
}

impl From<Container> for LayoutNode {
    fn from(container: Container) -> Self {
        Self::Container(container)
    }
}

impl From<View> for LayoutNode {
    fn from(view: View) -> Self {
        Self::View(view)
    }
}

impl Container {
    /// A container of that kind.
    pub(super) fn new(kind: ContainerKind, parts: impl IntoIterator<Item = LayoutNode>) -> Self {
        let parts = parts.into_iter().collect();
        Self { kind, parts, name: None, shares: Vec::new(), columns: None }
    }

    /// Sets the name on its tab.
    pub(super) fn with_name(mut self, name: &str) -> Self {
        self.name = Some(name.to_owned());
        self
    }

    /// Sets the relative widths of horizontal parts, or heights of vertical ones.
    pub(super) fn with_shares(mut self, shares: impl Into<Vec<f32>>) -> Self {
        self.shares = shares.into();
        self
    }

    /// Sets the number of columns of a grid.
    pub(super) const fn with_columns(mut self, columns: u32) -> Self {
        self.columns = Some(columns);
        self
    }
}

impl View {
    /// A view of rerun's class `class`, such as `2D`.
    pub(super) fn new(
        class: &'static str,
        name: impl Into<String>,
        contents: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        let contents = contents.into_iter().map(Into::into).collect();
        Self { class, name: name.into(), origin: "/".to_owned(), contents, properties: Vec::new() }
    }

    /// Sets the entity whose space is shown; `$origin` in the contents.
    pub(super) fn with_origin(mut self, origin: impl Into<String>) -> Self {
        self.origin = origin.into();
        self
    }

    /// Adds a property by the name of its archetype.
    pub(super) fn with_property(mut self, name: &'static str, property: impl AsComponents + 'static) -> Self {
        self.properties.push((name, Box::new(property)));
        self
    }
}

/// Sends a layout to a recording and activates it; `panels` are further rows by their paths.
pub(super) fn send(
    root: Container,
    panels: &[(&str, &dyn AsComponents)],
    stream: &RecordingStream,
) -> Logged {
    let Some(info) = stream.store_info() else { return Ok(()) };
    let store = RecordingStreamBuilder::new(info.application_id().clone()).blueprint();
    let memory = MemoryStream::open(store.send_properties(false).enabled(true))?;
    let rows = memory.stream();
    rows.set_log_time_enabled(false);
    rows.set_time_sequence(TIMELINE, 0);
    let mut writer = Writer { rows, parts: 0 };
    let (_, id) = writer.part(&root.into())?;
    let viewport = ViewportBlueprint::new()
        .with_root_container(RootContainer(id))
        .with_auto_layout(AutoLayout(Bool(false)))
        .with_auto_views(AutoViews(Bool(false)));
    rows.log("viewport", &viewport)?;
    for (path, panel) in panels {
        rows.log(*path, *panel)?;
    }
    let messages = memory.take();
    let Some(blueprint_id) = messages.first().map(|message| message.store_id().clone()) else {
        return Ok(());
    };
    // The activation command must be last, because the viewer would take an incomplete layout for the whole.
    let show = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
    stream.send_blueprint(messages, show);
    Ok(())
}

/// Writes parts as rows and counts them.
struct Writer<'a> {
    rows: &'a RecordingStream,
    parts: u64,
}

impl Writer<'_> {
    /// Writes a part and its children; returns its path and id.
    fn part(&mut self, part: &LayoutNode) -> RecordingStreamResult<(String, Uuid)> {
        self.parts += 1;
        let (text, id) = id(self.parts);
        let path = match part {
            LayoutNode::Container(container) => {
                let path = format!("container/{text}");
                self.container(&path, container)?;
                path
            }
            LayoutNode::View(view) => {
                let path = format!("view/{text}");
                self.view(&path, view)?;
                path
            }
        };
        Ok((path, id))
    }

    fn container(&mut self, path: &str, container: &Container) -> Logged {
        let mut contents = Vec::new();
        for part in &container.parts {
            let (path, _) = self.part(part)?;
            contents.push(IncludedContent(path.into()));
        }
        let mut row = ContainerBlueprint::new(container.kind).with_contents(contents);
        if let Some(name) = &container.name {
            row = row.with_display_name(Name(name.clone().into()));
        }
        let shares = container.shares.iter().map(|share| Float32(*share));
        match container.kind {
            _ if container.shares.is_empty() => {}
            ContainerKind::Vertical => row = row.with_row_shares(shares.map(RowShare)),
            _ => row = row.with_col_shares(shares.map(ColumnShare)),
        }
        if let Some(columns) = container.columns {
            row = row.with_grid_columns(GridColumns(UInt32(columns)));
        }
        self.rows.log(path, &row)
    }

    fn view(&self, path: &str, view: &View) -> Logged {
        let contents = view.contents.iter().map(|query| QueryExpression(query.clone().into()));
        self.rows.log(format!("{path}/ViewContents"), &ViewContents::new(contents))?;
        let row = ViewBlueprint::new(ViewClass(view.class.into()))
            .with_display_name(Name(view.name.clone().into()))
            .with_space_origin(view.origin.clone());
        self.rows.log(path, &row)?;
        view.properties
            .iter()
            .try_for_each(|(name, property)| self.rows.log(format!("{path}/{name}"), property.as_ref()))
    }
}

/// The UUID of a number, as text and as bytes; version 4 and variant 1, as parsers require.
fn id(number: u64) -> (String, Uuid) {
    let bytes = ((0x4000_u128 << 64) | (0x8000_u128 << 48) | u128::from(number)).to_be_bytes();
    let text = format!("00000000-0000-4000-8000-{number:012x}");
    (text, Uuid { bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_bytes_of_an_id_agree() {
        let (text, id) = id(0x1234);
        let hexadecimal: String = id.bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(text.replace('-', ""), hexadecimal);
    }
}
