//! What the browser keeps of the page across reloads: the arrangement of the panels, the looks, the stretch of the images, and
//! which keys act.

use egui::Context;

use crate::drawing::stretch::Stretch;
use crate::state::State;
use crate::theme::Looks;

/// Under which name the arrangement is kept.
const LAYOUT: &str = "sightline.layout";
/// Under which name the looks are kept.
const LOOKS: &str = "sightline.looks";
/// Under which name is kept whether keys that write a character act: `on` or `off`.
const KEYS: &str = "sightline.keys";
/// Under which name the stretch of the images is kept.
const STRETCH: &str = "sightline.stretch";
/// How long the page waits before it writes a change, s: dragging a border changes the arrangement in every frame.
const PAUSE_S: f64 = 0.5;

/// What is kept, as it was read or written last.
#[derive(Default)]
pub(crate) struct Kept {
    layout: Option<String>,
    looks: Option<Looks>,
    stretch: Option<Stretch>,
    single_keys: bool,
    write_at: Option<f64>,
}

impl Kept {
    /// What the browser kept; outside a browser nothing is.
    pub(crate) fn read() -> Self {
        let looks = kept(LOOKS).as_deref().and_then(Looks::of_word);
        Self {
            layout: kept(LAYOUT),
            looks,
            stretch: kept(STRETCH).as_deref().and_then(Stretch::of_kept),
            single_keys: kept(KEYS).as_deref() != Some("off"),
            write_at: None,
        }
    }

    /// The arrangement, as it was written.
    pub(crate) fn layout(&self) -> Option<&str> {
        self.layout.as_deref()
    }

    /// The looks.
    pub(crate) fn looks(&self) -> Option<Looks> {
        self.looks
    }

    /// The stretch of the images.
    pub(crate) fn stretch(&self) -> Option<Stretch> {
        self.stretch
    }

    /// Whether keys that write a character act.
    pub(crate) fn single_keys(&self) -> bool {
        self.single_keys
    }

    /// Writes what changed, once the person has let go of it.
    pub(crate) fn write(&mut self, context: &Context, state: &State, layout: impl FnOnce() -> String) {
        let (looks, single_keys) = (state.looks, state.single_keys);
        if self.single_keys != single_keys {
            self.single_keys = single_keys;
            keep(KEYS, if single_keys { "on" } else { "off" });
        }
        if self.looks != Some(looks) {
            self.looks = Some(looks);
            keep(LOOKS, looks.word());
        }
        if self.stretch != Some(state.stretch) && !context.input(|input| input.pointer.any_down()) {
            self.stretch = Some(state.stretch);
            keep(STRETCH, &state.stretch.kept());
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
    crate::page::web::kept(name)
}

#[cfg(target_arch = "wasm32")]
fn keep(name: &str, text: &str) {
    crate::page::web::keep(name, text);
}

#[cfg(not(target_arch = "wasm32"))]
fn kept(_name: &str) -> Option<String> {
    None
}

#[cfg(not(target_arch = "wasm32"))]
fn keep(_name: &str, _text: &str) {}
