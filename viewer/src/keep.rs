//! What the browser keeps of the page across reloads: the arrangement of the panels and the looks.

use egui::Context;

use crate::theme::Looks;

/// Under which name the arrangement is kept.
const LAYOUT: &str = "sightline.layout";
/// Under which name the looks are kept.
const LOOKS: &str = "sightline.looks";
/// How long the page waits before it writes a change, s: dragging a border changes the arrangement in every frame.
const PAUSE_S: f64 = 0.5;

/// What is kept, as it was read or written last.
#[derive(Default)]
pub struct Kept {
    layout: Option<String>,
    looks: Option<Looks>,
    write_at: Option<f64>,
}

impl Kept {
    /// What the browser kept; outside a browser nothing is.
    pub fn read() -> Self {
        Self { layout: kept(LAYOUT), looks: kept(LOOKS).as_deref().and_then(Looks::of_word), write_at: None }
    }

    /// The arrangement, as it was written.
    pub fn layout(&self) -> Option<&str> {
        self.layout.as_deref()
    }

    /// The looks.
    pub fn looks(&self) -> Option<Looks> {
        self.looks
    }

    /// Writes what changed, once the person has let go of it.
    pub fn write(&mut self, context: &Context, looks: Looks, layout: impl FnOnce() -> String) {
        if self.looks != Some(looks) {
            self.looks = Some(looks);
            keep(LOOKS, looks.word());
        }
        let now = context.input(|input| input.time);
        let is_busy = context.input(|input| input.pointer.any_down());
        let due = *self.write_at.get_or_insert(now + PAUSE_S);
        if now < due || is_busy {
            // One frame more after whatever happened: what changed last is written, too.
            context.request_repaint_after(std::time::Duration::from_secs_f64((due - now).max(0.1)));
            return;
        }
        self.write_at = None;
        let layout = layout();
        if self.layout.as_ref() != Some(&layout) {
            keep(LAYOUT, &layout);
            self.layout = Some(layout);
        }
    }
}

#[cfg(target_arch = "wasm32")]
fn kept(name: &str) -> Option<String> {
    crate::web::kept(name)
}

#[cfg(target_arch = "wasm32")]
fn keep(name: &str, text: &str) {
    crate::web::keep(name, text);
}

#[cfg(not(target_arch = "wasm32"))]
fn kept(_name: &str) -> Option<String> {
    None
}

#[cfg(not(target_arch = "wasm32"))]
fn keep(_name: &str, _text: &str) {}
