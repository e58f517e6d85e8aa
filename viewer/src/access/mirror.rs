//! The egui plugin that passes the tree of each frame to the document, and the document's requests to egui.

use egui::{Context, FullOutput, Plugin, RawInput};

use crate::access::{dom, outline};

/// Synchronises the document's elements with egui's widgets.
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
        input.events.extend(dom::take_requests());
    }

    fn output_hook(&mut self, context: &Context, output: &mut FullOutput) {
        if let Some(update) = &output.platform_output.accesskit_update {
            dom::show(&outline::outline(update, context.zoom_factor()), update.focus.0);
        }
    }
}
