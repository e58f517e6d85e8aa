//! AccessKit's tree as a flat list of elements with ARIA roles, in reading order.
//!
//! Most nodes of egui's tree are unnamed containers that only group. They are omitted, and their contents belong to the
//! nearest container with a meaning. A text becomes an element without a role whose content is the text.

use std::collections::HashMap;

use egui::accesskit::{Action, Node, NodeId, Role, Toggled, TreeUpdate};

/// Maximum length of a text, characters; longer texts are cut.
const LONGEST: usize = 2_000;

/// The HTML element of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tag {
    /// A container, or a control that the page draws itself.
    Plain,
    /// A single-line text field.
    TextField,
    /// A multi-line text field.
    TextArea,
    /// A number field.
    NumberField,
    /// A slider.
    Range,
}

impl Tag {
    /// The element's name, and its input type if it is an `input`.
    #[cfg(target_arch = "wasm32")]
    pub(crate) const fn element(self) -> (&'static str, Option<&'static str>) {
        match self {
            Self::Plain => ("div", None),
            Self::TextField | Self::NumberField => ("input", Some("text")),
            Self::TextArea => ("textarea", None),
            Self::Range => ("input", Some("range")),
        }
    }
}

/// An element of the mirror.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    /// AccessKit's id of the node.
    pub id: u64,
    /// The entry that contains it; `None` at the top level of the page.
    pub parent: Option<u64>,
    /// The HTML element.
    pub tag: Tag,
    /// The ARIA role; empty for a text.
    pub role: &'static str,
    /// The accessible name.
    pub name: String,
    /// The content of a text, or the value of a field.
    pub value: String,
    /// Rectangle on the page: left, top, width, height, CSS px.
    pub rect: [f32; 4],
    /// States and limits as ARIA and HTML attributes: name and value.
    pub attributes: Vec<(&'static str, String)>,
    /// Whether a user can act on it.
    pub is_control: bool,
}

impl Entry {
    /// Whether the element of `before`, an entry with the same id, can be reused for this one.
    ///
    /// egui derives widget ids from their order, so that a label may get the id of a button. A role or a name that this
    /// entry lacks would remain on the element.
    pub(crate) fn fits_element_of(&self, before: &Self) -> bool {
        let kind = |entry: &Self| (entry.tag, entry.role, entry.name.is_empty());
        kind(self) == kind(before)
    }
}

/// The entries of a tree, every parent before its children; `zoom` is CSS px per point.
pub(crate) fn outline(update: &TreeUpdate, zoom: f32) -> Vec<Entry> {
    let nodes: HashMap<NodeId, &Node> = update.nodes.iter().map(|(id, node)| (*id, node)).collect();
    let mut entries = Vec::new();
    if let Some(tree) = &update.tree {
        let walk = Walk { nodes: &nodes, zoom };
        let root = nodes.get(&tree.root).map(|root| root.children().to_vec()).unwrap_or_default();
        for child in root {
            walk.visit(child, None, &mut entries);
        }
    }
    entries
}

struct Walk<'a> {
    nodes: &'a HashMap<NodeId, &'a Node>,
    zoom: f32,
}

impl Walk<'_> {
    fn visit(&self, id: NodeId, parent: Option<u64>, out: &mut Vec<Entry>) {
        let Some(node) = self.nodes.get(&id).filter(|node| !node.is_hidden()) else { return };
        let entry = self.entry(id, node, parent);
        // The text of a label is repeated in text runs below it.
        if node.role() == Role::Label {
            out.extend(entry);
            return;
        }
        // HTML fields have no children: a list that opens below a field becomes its next sibling.
        let inner = entry.as_ref().filter(|entry| entry.tag == Tag::Plain).map(|entry| entry.id).or(parent);
        out.extend(entry);
        for child in node.children() {
            self.visit(*child, inner, out);
        }
    }

    /// The entry of a node; `None` for a container without a meaning and for an empty text.
    fn entry(&self, id: NodeId, node: &Node, parent: Option<u64>) -> Option<Entry> {
        // The content of a text is its value; a name would be spoken instead.
        let name = if node.role() == Role::Label { String::new() } else { self.name(node) };
        let is_control = node.supports_action(Action::Click) || node.supports_action(Action::SetValue);
        let (tag, role) = element(node.role(), !name.is_empty(), is_control)?;
        let value = cut(&value(node, tag));
        if role.is_empty() && value.trim().is_empty() {
            return None;
        }
        let rect = node.bounds().map_or([0.0; 4], |rect| {
            [rect.x0, rect.y0, rect.x1 - rect.x0, rect.y1 - rect.y0].map(|v| (v as f32 * self.zoom).round())
        });
        let attributes = attributes(node, role);
        Some(Entry { id: id.0, parent, tag, role, name, value, rect, attributes, is_control })
    }

    /// The accessible name: the label, otherwise the text of the labelling nodes, otherwise the placeholder or description.
    fn name(&self, node: &Node) -> String {
        if let Some(label) = node.label() {
            return cut(label);
        }
        let words = node.labelled_by().iter().filter_map(|id| self.nodes.get(id));
        let words: Vec<&str> = words.filter_map(|label| label.value().or(label.label())).collect();
        let named = words.join(" ");
        let described = || node.placeholder().or(node.description()).unwrap_or_default().to_owned();
        cut(&if named.is_empty() { described() } else { named })
    }
}

/// The element and role of a node; `None` for a container that only groups.
fn element(role: Role, is_named: bool, is_control: bool) -> Option<(Tag, &'static str)> {
    let plain = |role| Some((Tag::Plain, role));
    match role {
        Role::Label | Role::Paragraph => plain(""),
        Role::Button | Role::DefaultButton | Role::ColorWell | Role::DisclosureTriangle => plain("button"),
        Role::CheckBox => plain("checkbox"),
        Role::Switch => plain("switch"),
        Role::RadioButton => plain("radio"),
        Role::Link => plain("link"),
        Role::ComboBox | Role::EditableComboBox => plain("combobox"),
        Role::Tab => plain("tab"),
        Role::TabList => plain("tablist"),
        Role::TabPanel => plain("tabpanel"),
        Role::ListBoxOption | Role::MenuListOption => plain("option"),
        Role::MenuItem => plain("menuitem"),
        Role::Menu if is_named => plain("menu"),
        Role::List => plain("list"),
        Role::ListItem => plain("listitem"),
        Role::Table => plain("table"),
        Role::Row => plain("row"),
        Role::Cell => plain("cell"),
        Role::ColumnHeader => plain("columnheader"),
        Role::Heading => plain("heading"),
        Role::Image | Role::Figure | Role::Canvas => plain("img"),
        Role::ProgressIndicator => plain("progressbar"),
        Role::Meter => plain("meter"),
        Role::Region | Role::Pane if is_named => plain("region"),
        Role::Dialog | Role::Window if is_named => plain("dialog"),
        Role::AlertDialog => plain("alertdialog"),
        Role::Alert => plain("alert"),
        Role::Status => plain("status"),
        Role::Toolbar => plain("toolbar"),
        Role::Navigation => plain("navigation"),
        Role::Tooltip => plain("tooltip"),
        Role::Splitter => plain("separator"),
        Role::Slider => Some((Tag::Range, "slider")),
        Role::SpinButton | Role::NumberInput => Some((Tag::NumberField, "spinbutton")),
        Role::TextInput | Role::SearchInput => Some((Tag::TextField, "textbox")),
        Role::MultilineTextInput => Some((Tag::TextArea, "textbox")),
        Role::TextRun => None,
        // A named node that can be clicked is a button.
        _ if is_named && is_control => plain("button"),
        _ if is_named => plain("group"),
        _ => None,
    }
}

/// The content of a text, or the value of a field.
fn value(node: &Node, tag: Tag) -> String {
    let number = || node.numeric_value().map(|value| format!("{value}"));
    match tag {
        Tag::Range | Tag::NumberField => {
            number().or_else(|| node.value().map(str::to_owned)).unwrap_or_default()
        }
        _ => node.value().map(str::to_owned).or_else(number).unwrap_or_default(),
    }
}

/// The states and limits of a node.
fn attributes(node: &Node, role: &str) -> Vec<(&'static str, String)> {
    let mut all = Vec::new();
    if let Some(toggled) = node.toggled() {
        let word = match toggled {
            Toggled::True => "true",
            Toggled::False => "false",
            Toggled::Mixed => "mixed",
        };
        let state = match role {
            "checkbox" | "radio" | "switch" => "aria-checked",
            "tab" | "option" => "aria-selected",
            _ => "aria-pressed",
        };
        all.push((state, word.to_owned()));
    }
    if node.is_disabled() {
        all.push(("aria-disabled", "true".to_owned()));
    }
    if let Some(expanded) = node.is_expanded() {
        all.push(("aria-expanded", expanded.to_string()));
    }
    if node.is_modal() {
        all.push(("aria-modal", "true".to_owned()));
    }
    let described = node.description().or(node.tooltip());
    all.extend(described.map(|words| ("aria-description", cut(words))));
    let numbers = [
        ("min", "aria-valuemin", node.min_numeric_value()),
        ("max", "aria-valuemax", node.max_numeric_value()),
        ("step", "", node.numeric_value_step().filter(|step| *step > 0.0)),
        ("", "aria-valuenow", node.numeric_value()),
    ];
    let is_range = role == "slider";
    for (html, aria, number) in numbers {
        let Some(number) = number.filter(|number| number.is_finite()) else { continue };
        if is_range && !html.is_empty() {
            all.push((html, number.to_string()));
        } else if !is_range && !aria.is_empty() && matches!(role, "spinbutton" | "progressbar" | "meter") {
            all.push((aria, number.to_string()));
        }
    }
    // HTML rounds a slider's value to multiples of 1 unless a step is given.
    if is_range && !all.iter().any(|(name, _)| *name == "step") {
        all.push(("step", "any".to_owned()));
    }
    all
}

fn cut(text: &str) -> String {
    text.chars().take(LONGEST).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::accesskit::{Rect, TreeId, TreeInfo};

    fn tree(nodes: Vec<(u64, Node)>) -> TreeUpdate {
        TreeUpdate {
            nodes: nodes.into_iter().map(|(id, node)| (NodeId(id), node)).collect(),
            tree: Some(TreeInfo::new(NodeId(0))),
            tree_id: TreeId::ROOT,
            focus: NodeId(0),
        }
    }

    fn node(role: Role, children: &[u64]) -> Node {
        let mut node = Node::new(role);
        node.set_children(children.iter().map(|id| NodeId(*id)).collect::<Vec<_>>());
        node
    }

    #[test]
    fn boxes_without_a_name_are_left_out_and_their_contents_are_not() {
        let mut region = node(Role::Region, &[2]);
        region.set_label("Gates");
        let mut button = node(Role::Button, &[]);
        button.set_label("Pick");
        button.add_action(Action::Click);
        button.set_bounds(Rect { x0: 10.0, y0: 20.0, x1: 40.0, y1: 30.0 });
        let all = outline(
            &tree(vec![
                (0, node(Role::Window, &[1])),
                (1, region),
                (2, node(Role::GenericContainer, &[3])),
                (3, button),
            ]),
            2.0,
        );
        let found: Vec<_> = all.iter().map(|e| (e.id, e.parent, e.role, e.name.as_str())).collect();
        assert_eq!(found, [(1, None, "region", "Gates"), (3, Some(1), "button", "Pick")]);
        assert_eq!(all[1].rect, [20.0, 40.0, 60.0, 20.0]);
        assert!(all[1].is_control && !all[0].is_control);
    }

    #[test]
    fn a_field_is_named_by_its_label_and_keeps_its_limits() {
        let mut label = node(Role::Label, &[]);
        label.set_value("least score");
        let mut slider = node(Role::Slider, &[]);
        slider.set_labelled_by(vec![NodeId(1)]);
        slider.set_numeric_value(0.8);
        slider.set_min_numeric_value(-1.0);
        slider.set_max_numeric_value(1.0);
        let all = outline(&tree(vec![(0, node(Role::Window, &[1, 2])), (1, label), (2, slider)]), 1.0);
        assert_eq!((all[0].role, all[0].value.as_str()), ("", "least score"));
        let field = &all[1];
        assert_eq!((field.role, field.name.as_str(), field.value.as_str()), ("slider", "least score", "0.8"));
        let of =
            |name| field.attributes.iter().find(|(key, _)| *key == name).map(|(_, value)| value.as_str());
        assert_eq!((of("min"), of("max"), of("step")), (Some("-1"), Some("1"), Some("any")));
    }

    #[test]
    fn suggestions_follow_their_field() {
        let mut region = node(Role::Region, &[2]);
        region.set_label("Breakpoints");
        let mut field = node(Role::TextInput, &[3, 4]);
        field.set_label("expression");
        let mut words = node(Role::TextRun, &[]);
        words.set_value("nc");
        let mut suggestion = node(Role::Button, &[]);
        suggestion.set_label("ncc");
        let nodes = vec![(0, node(Role::Window, &[1])), (1, region), (2, field), (3, words), (4, suggestion)];
        let all = outline(&tree(nodes), 1.0);
        let found: Vec<_> = all.iter().map(|e| (e.parent, e.role, e.name.as_str())).collect();
        let expected =
            [(None, "region", "Breakpoints"), (Some(1), "textbox", "expression"), (Some(1), "button", "ncc")];
        assert_eq!(found, expected);
    }

    #[test]
    fn toggled_controls_have_the_aria_state_of_their_role() {
        for (role, state) in
            [(Role::Button, "aria-pressed"), (Role::CheckBox, "aria-checked"), (Role::Tab, "aria-selected")]
        {
            let mut control = node(role, &[]);
            control.set_label("control");
            control.set_toggled(Toggled::True);
            let all = outline(&tree(vec![(0, node(Role::Window, &[1])), (1, control)]), 1.0);
            assert_eq!(all[0].attributes, [(state, "true".to_owned())], "{role:?}");
        }
    }

    #[test]
    fn a_text_takes_no_role_or_name_from_an_earlier_control() {
        let entry = |role: Role, label: &str, value: &str| {
            let mut node = node(role, &[]);
            node.add_action(Action::Click);
            if !label.is_empty() {
                node.set_label(label);
            }
            if !value.is_empty() {
                node.set_value(value);
            }
            outline(&tree(vec![(0, self::node(Role::Window, &[1])), (1, node)]), 1.0).remove(0)
        };
        let cancel = entry(Role::Button, "Cancel", "");
        let count = entry(Role::Label, "", "4 of 4 runs");
        assert!(!count.fits_element_of(&cancel), "a text would be a button “Cancel”");
        assert!(!cancel.fits_element_of(&count), "a button would contain “4 of 4 runs”");
        let option = entry(Role::ListBoxOption, "Layout Stereo", "");
        assert!(!entry(Role::Label, "", "Nothing is called that.").fits_element_of(&option));
        assert!(!entry(Role::Button, "", "").fits_element_of(&cancel), "the name “Cancel” would stay");
        assert!(entry(Role::Button, "Resume", "").fits_element_of(&cancel));
        assert!(entry(Role::Label, "", "5 of 5 runs").fits_element_of(&count));
    }

    #[test]
    fn a_long_text_is_cut() {
        let mut label = node(Role::Label, &[]);
        label.set_value("x".repeat(5_000));
        let all = outline(&tree(vec![(0, node(Role::Window, &[1])), (1, label)]), 1.0);
        assert_eq!(all[0].value.len(), LONGEST);
    }
}
