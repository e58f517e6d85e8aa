//! The plugin of egui that hands the tree of each frame to the document, and the document's requests to egui.

use std::cell::RefCell;

use egui::{Context, Event, FullOutput, Plugin, RawInput};

use super::{dom, outline};

thread_local! {
    /// What was done to elements since the last frame.
    static REQUESTED: RefCell<Vec<Event>> = const { RefCell::new(Vec::new()) };
}

/// Passes on what was done to an element; the caller wakes the page.
pub(super) fn request(event: Event) {
    REQUESTED.with_borrow_mut(|events| events.push(event));
}

/// Keeps the document's elements in step with what egui shows.
#[derive(Default)]
pub(crate) struct Mirror;

impl Plugin for Mirror {
    fn debug_name(&self) -> &'static str {
        "accessibility mirror"
    }

    fn setup(&mut self, context: &Context) {
        context.enable_accesskit();
        dom::begin(context);
    }

    fn input_hook(&mut self, _context: &Context, input: &mut RawInput) {
        REQUESTED.with_borrow_mut(|events| input.events.append(events));
    }

    fn output_hook(&mut self, context: &Context, output: &mut FullOutput) {
        if let Some(update) = &output.platform_output.accesskit_update {
            dom::show(&outline::outline(update, context.zoom_factor()), update.focus.0);
        }
    }
}
