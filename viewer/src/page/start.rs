//! The entry point in the browser: `start` runs the application on a canvas, and a panic becomes a sentence on the page.

use std::sync::Once;

use eframe::{WebOptions, WebRunner};
use wasm_bindgen::prelude::*;

use crate::access::mirror::Mirror;
use crate::app::{Link, SightlineApp};
use crate::page::link::Fragment;
use crate::page::web;

/// The event that reports a panic to the page; its detail is the panic's message.
const PANIC_EVENT: &str = "sightline-panic";

/// Starts the application on the canvas with this id.
///
/// # Errors
/// If the page has no such canvas, or the browser provides no WebGL context.
#[wasm_bindgen]
pub async fn start(canvas_id: String) -> Result<(), JsValue> {
    static HOOK: Once = Once::new();
    HOOK.call_once(report_panics_to_the_page);
    let canvas = web_sys::window()
        .and_then(|window| window.document())
        .and_then(|document| document.get_element_by_id(&canvas_id))
        .and_then(|element| element.dyn_into::<web_sys::HtmlCanvasElement>().ok())
        .ok_or_else(|| JsValue::from_str(&format!("the page has no canvas with the id `{canvas_id}`")))?;
    web::keep_canvas(canvas_id);
    let link = link();
    WebRunner::new()
        .start(
            canvas,
            WebOptions::default(),
            Box::new(|context| {
                context.egui_ctx.add_plugin(Mirror);
                watch_address(&context.egui_ctx);
                Ok(Box::new(SightlineApp::new(&context.egui_ctx, link)))
            }),
        )
        .await
}

/// The address of the server, and the contents of the fragment. Behind a reverse proxy the page may be in a folder, which
/// is part of the server's address.
fn link() -> Link {
    let location = web_sys::window().map(|window| window.location());
    let origin = location.as_ref().and_then(|location| location.origin().ok()).unwrap_or_default();
    let path = location.as_ref().and_then(|location| location.pathname().ok()).unwrap_or_default();
    let origin = format!("{origin}{}", path.rsplit_once('/').map_or("", |(folder, _)| folder));
    Link { origin, fragment: Fragment::parse(&web::hash()) }
}

/// Repaints the page when its address changes, by Back or by editing.
fn watch_address(context: &egui::Context) {
    let context = context.clone();
    let changed = Closure::<dyn FnMut()>::new(move || context.request_repaint());
    if let Some(window) = web_sys::window() {
        for event in ["popstate", "hashchange"] {
            window
                .add_event_listener_with_callback(event, changed.as_ref().unchecked_ref())
                .unwrap_or_default();
        }
    }
    changed.forget();
}

/// Sends every panic to the page as an event; eframe's own hook, installed later, logs it and then calls this one.
fn report_panics_to_the_page() {
    std::panic::set_hook(Box::new(|panic| {
        let details = web_sys::CustomEventInit::new();
        details.set_detail(&JsValue::from_str(&panic.to_string()));
        let event = web_sys::CustomEvent::new_with_event_init_dict(PANIC_EVENT, &details);
        if let (Some(window), Ok(event)) = (web_sys::window(), event) {
            // If the event cannot be dispatched, there is no other way to report.
            window.dispatch_event(&event).unwrap_or_default();
        }
    }));
}
