//! The DOM elements of the mirror: created, changed and removed to match the outline.
//!
//! They are invisible elements above the canvas and do not intercept the pointer. The status element is a live region: a
//! screen reader speaks its text whenever it changes.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};

use egui::accesskit::{Action, ActionData, ActionRequest, NodeId, TreeId};
use egui::{Event, Key, Modifiers};
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;
use web_sys::{Document, Element, HtmlElement, HtmlInputElement, HtmlTextAreaElement, KeyboardEvent};

use crate::access::outline::{Entry, Tag};

/// Id of the element that contains the mirror.
const ROOT: &str = "sightline-mirror";
/// Id of the live region whose text is spoken when it changes.
const STATUS: &str = "sightline-status";
/// The attribute with the node id of AccessKit.
const NUMBER: &str = "data-node";

thread_local! {
    static DOM: RefCell<Option<Dom>> = const { RefCell::new(None) };
    /// User actions on the elements since the last frame.
    static REQUESTED: RefCell<Vec<Event>> = const { RefCell::new(Vec::new()) };
}

/// Queues a user action on an element; the caller wakes the page.
fn request(event: Event) {
    REQUESTED.with_borrow_mut(|events| events.push(event));
}

/// Removes and returns the user actions on the elements since the last frame.
pub(crate) fn take_requests() -> Vec<Event> {
    REQUESTED.take()
}

/// Creates the mirror; if the document refuses it, the page works without one.
pub(crate) fn begin(context: &egui::Context) {
    DOM.with_borrow_mut(|dom| *dom = Dom::begin(context).ok());
}

/// Updates the elements to match `entries`; `focus` is the id of the focused node.
pub(crate) fn show(entries: &[Entry], focus: u64) {
    DOM.with_borrow_mut(|dom| {
        if let Some(dom) = dom {
            // An element that the browser refuses is missing for the screen reader; the canvas is unaffected.
            dom.show(entries).unwrap_or_default();
            dom.point_at(focus).unwrap_or_default();
        }
    });
}

/// Makes a screen reader speak a sentence once.
pub(crate) fn speak(sentence: &str) {
    DOM.with_borrow(|dom| {
        if let Some(dom) = dom {
            dom.status.set_text_content(Some(sentence));
        }
    });
}

struct ShownEntry {
    element: Element,
    entry: Entry,
}

struct Dom {
    document: Document,
    root: Element,
    status: Element,
    shown: HashMap<u64, ShownEntry>,
    /// The children of each element in order; under `None`, those of the root.
    orders: HashMap<Option<u64>, Vec<u64>>,
}

impl Dom {
    fn begin(context: &egui::Context) -> Result<Self, JsValue> {
        let document = web_sys::window().and_then(|window| window.document());
        let document = document.ok_or("no document")?;
        let body = document.body().ok_or("no body")?;
        let root = document.create_element("div")?;
        root.set_id(ROOT);
        root.set_attribute("role", "group")?;
        root.set_attribute("aria-label", "Sightline")?;
        let status = document.create_element("div")?;
        status.set_id(STATUS);
        status.set_attribute("role", "status")?;
        body.append_child(&root)?;
        body.append_child(&status)?;
        listen(&root, "click", context, |event| acted_on(&event, Action::Click))?;
        listen(&root, "focusin", context, |event| acted_on(&event, Action::Focus))?;
        listen(&root, "input", context, |event| typed(&event))?;
        listen(&root, "keydown", context, |event| pressed(&event))?;
        Ok(Self { document, root, status, shown: HashMap::new(), orders: HashMap::new() })
    }

    fn show(&mut self, entries: &[Entry]) -> Result<(), JsValue> {
        let present: HashSet<u64> = entries.iter().map(|entry| entry.id).collect();
        self.shown.retain(|id, shown| {
            let stays = present.contains(id);
            if !stays {
                shown.element.remove();
            }
            stays
        });
        let mut orders: HashMap<Option<u64>, Vec<u64>> = HashMap::new();
        for entry in entries {
            self.show_one(entry)?;
            orders.entry(entry.parent).or_default().push(entry.id);
        }
        for (parent, order) in &orders {
            if self.orders.get(parent) == Some(order) {
                continue;
            }
            let box_of = parent.and_then(|id| self.shown.get(&id)).map_or(&self.root, |shown| &shown.element);
            for child in order.iter().filter_map(|id| self.shown.get(id)) {
                box_of.append_child(&child.element)?;
            }
        }
        self.orders = orders;
        Ok(())
    }

    fn show_one(&mut self, entry: &Entry) -> Result<(), JsValue> {
        let old = self.shown.get(&entry.id).filter(|shown| entry.fits_element_of(&shown.entry));
        if old.is_some_and(|shown| shown.entry == *entry) {
            return Ok(());
        }
        let is_new = old.is_none();
        let element = match old {
            Some(shown) => shown.element.clone(),
            None => make(&self.document, entry)?,
        };
        let before = self.shown.get(&entry.id).map(|shown| &shown.entry).filter(|_| !is_new);
        write(&element, entry, before)?;
        if is_new {
            // Remove an old element with the same id.
            if let Some(shown) = self.shown.remove(&entry.id) {
                shown.element.remove();
            }
            self.orders.remove(&entry.parent);
            // The children were removed with that element and are appended again.
            self.orders.remove(&Some(entry.id));
        }
        self.shown.insert(entry.id, ShownEntry { element, entry: entry.clone() });
        Ok(())
    }

    /// Sets `aria-activedescendant` of the document's active element to the focused node.
    fn point_at(&self, focus: u64) -> Result<(), JsValue> {
        let Some(active) = self.document.active_element() else { return Ok(()) };
        if self.root.contains(Some(&active)) {
            return Ok(());
        }
        match self.shown.get(&focus) {
            Some(shown) => active.set_attribute("aria-activedescendant", &shown.element.id()),
            None => active.remove_attribute("aria-activedescendant"),
        }
    }
}

fn make(document: &Document, entry: &Entry) -> Result<Element, JsValue> {
    let (name, kind) = entry.tag.element();
    let element = document.create_element(name)?;
    element.set_id(&format!("node-{}", entry.id));
    element.set_attribute(NUMBER, &entry.id.to_string())?;
    // Tab is handled by egui, which has the focus order; screen readers reach the elements without it.
    element.set_attribute("tabindex", "-1")?;
    if let Some(kind) = kind {
        element.set_attribute("type", kind)?;
    }
    Ok(element)
}

/// Writes the properties that differ from `before`.
fn write(element: &Element, entry: &Entry, before: Option<&Entry>) -> Result<(), JsValue> {
    let is_native = matches!(entry.tag, Tag::TextField | Tag::TextArea | Tag::Range);
    if before.is_none_or(|before| before.role != entry.role) && !entry.role.is_empty() && !is_native {
        element.set_attribute("role", entry.role)?;
    }
    if before.is_none_or(|before| before.name != entry.name) && !entry.name.is_empty() {
        element.set_attribute("aria-label", &entry.name)?;
    }
    if before.is_none_or(|before| before.rect != entry.rect) {
        place(element, entry.rect)?;
    }
    if before.is_none_or(|before| before.attributes != entry.attributes) {
        for (name, _) in before.into_iter().flat_map(|before| &before.attributes) {
            if entry.attributes.iter().all(|(other, _)| other != name) {
                element.remove_attribute(name)?;
            }
        }
        for (name, value) in &entry.attributes {
            element.set_attribute(name, value)?;
        }
    }
    if before.is_none_or(|before| before.value != entry.value) {
        write_value(element, entry)?;
    }
    Ok(())
}

/// Places an element over the widget that it mirrors. Properties are set one by one, because the page's security policy
/// forbids `style` attributes.
fn place(element: &Element, rect: [f32; 4]) -> Result<(), JsValue> {
    let Some(element) = element.dyn_ref::<HtmlElement>() else { return Ok(()) };
    for (name, value) in ["left", "top", "width", "height"].into_iter().zip(rect) {
        element.style().set_property(name, &format!("{value}px"))?;
    }
    Ok(())
}

fn write_value(element: &Element, entry: &Entry) -> Result<(), JsValue> {
    if let Some(field) = element.dyn_ref::<HtmlInputElement>() {
        field.set_value(&entry.value);
    } else if let Some(field) = element.dyn_ref::<HtmlTextAreaElement>() {
        field.set_value(&entry.value);
    } else if entry.role.is_empty() {
        element.set_text_content(Some(&entry.value));
    } else if !entry.value.is_empty() {
        element.set_attribute("aria-valuetext", &entry.value)?;
    }
    Ok(())
}

/// Registers a listener on the root for the events of all elements; every event wakes the page.
fn listen(
    root: &Element,
    kind: &str,
    context: &egui::Context,
    act: fn(web_sys::Event),
) -> Result<(), JsValue> {
    let context = context.clone();
    let closure = Closure::<dyn FnMut(web_sys::Event)>::new(move |event| {
        act(event);
        context.request_repaint();
    });
    root.add_event_listener_with_callback(kind, closure.as_ref().unchecked_ref())?;
    // The listener lives as long as the page.
    closure.forget();
    Ok(())
}

/// The node of an event's element.
fn node_of(event: &web_sys::Event) -> Option<(NodeId, Element)> {
    let element: Element = event.target()?.dyn_into().ok()?;
    let element = element.closest(&format!("[{NUMBER}]")).ok()??;
    let number = element.get_attribute(NUMBER)?.parse().ok()?;
    Some((NodeId(number), element))
}

fn ask(node: NodeId, action: Action, data: Option<ActionData>) {
    request(Event::AccessKitActionRequest(ActionRequest {
        action,
        target_tree: TreeId::ROOT,
        target_node: node,
        data,
    }));
}

fn acted_on(event: &web_sys::Event, action: Action) {
    if let Some((node, _)) = node_of(event) {
        ask(node, action, None);
    }
}

fn typed(event: &web_sys::Event) {
    let Some((node, element)) = node_of(event) else { return };
    let text = match (element.dyn_ref::<HtmlInputElement>(), element.dyn_ref::<HtmlTextAreaElement>()) {
        (Some(field), _) => field.value(),
        (_, Some(field)) => field.value(),
        _ => return,
    };
    let is_number = element.get_attribute("type").as_deref() == Some("range")
        || element.get_attribute("role").as_deref() == Some("spinbutton");
    let data = match text.trim().parse::<f64>() {
        Ok(number) if is_number => ActionData::NumericValue(number),
        // An incomplete number is ignored until it parses.
        Err(_) if is_number => return,
        _ => ActionData::Value(text.into_boxed_str()),
    };
    ask(node, Action::SetValue, Some(data));
}

/// Passes keys that end text entry to egui, which handles them.
fn pressed(event: &web_sys::Event) {
    let Some(pressed) = event.dyn_ref::<KeyboardEvent>() else { return };
    let key = match pressed.key().as_str() {
        "Enter" => Key::Enter,
        "Escape" => Key::Escape,
        _ => return,
    };
    for down in [true, false] {
        request(Event::Key {
            key,
            physical_key: None,
            pressed: down,
            repeat: false,
            modifiers: Modifiers::NONE,
        });
    }
}
