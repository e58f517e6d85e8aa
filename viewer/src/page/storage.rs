//! The browser's storage of page settings across reloads: the arrangement of the panels, the colour theme, the stretch of
//! the images, and single-key shortcuts.

use egui::Context;

use crate::drawing::stretch::Stretch;
use crate::state::State;
use crate::theme::ColourTheme;

/// Storage key of the arrangement.
const LAYOUT: &str = "sightline.layout";
/// Storage key of the colour theme.
const COLOUR_THEME: &str = "sightline.looks";
/// Storage key of single-key shortcuts: `on` or `off`.
const KEYS: &str = "sightline.keys";
/// Storage key of the stretch of the images.
const STRETCH: &str = "sightline.stretch";
/// Delay before a change is written, s: dragging a border changes the arrangement in every frame.
const PAUSE_S: f64 = 0.5;

/// The stored values, as last read or written.
#[derive(Default)]
pub(crate) struct StoredSettings {
    layout: Option<String>,
    colour_theme: Option<ColourTheme>,
    stretch: Option<Stretch>,
    single_keys: bool,
    write_at: Option<f64>,
}

impl StoredSettings {
    /// Reads the stored values; outside a browser there are none.
    pub(crate) fn read() -> Self {
        let colour_theme = read_item(COLOUR_THEME).as_deref().and_then(ColourTheme::of_word);
        Self {
            layout: read_item(LAYOUT),
            colour_theme,
            stretch: read_item(STRETCH).as_deref().and_then(Stretch::from_stored),
            single_keys: read_item(KEYS).as_deref() != Some("off"),
            write_at: None,
        }
    }

    /// The arrangement, as stored.
    pub(crate) fn layout(&self) -> Option<&str> {
        self.layout.as_deref()
    }

    /// The colour theme.
    pub(crate) fn colour_theme(&self) -> Option<ColourTheme> {
        self.colour_theme
    }

    /// The stretch of the images.
    pub(crate) fn stretch(&self) -> Option<Stretch> {
        self.stretch
    }

    /// Whether single-key shortcuts are enabled.
    pub(crate) fn single_keys(&self) -> bool {
        self.single_keys
    }

    /// Writes changed values, once no pointer button is pressed.
    pub(crate) fn write(&mut self, context: &Context, state: &State, layout: impl FnOnce() -> String) {
        let (colour_theme, single_keys) = (state.colour_theme, state.single_keys);
        if self.single_keys != single_keys {
            self.single_keys = single_keys;
            write_item(KEYS, if single_keys { "on" } else { "off" });
        }
        if self.colour_theme != Some(colour_theme) {
            self.colour_theme = Some(colour_theme);
            write_item(COLOUR_THEME, colour_theme.word());
        }
        if self.stretch != Some(state.stretch) && !context.input(|input| input.pointer.any_down()) {
            self.stretch = Some(state.stretch);
            write_item(STRETCH, &state.stretch.to_stored());
        }
        let now = context.input(|input| input.time);
        let is_busy = context.input(|input| input.pointer.any_down());
        let due = *self.write_at.get_or_insert(now + PAUSE_S);
        if now < due || is_busy {
            // Repaint later, so that the last change is also written.
            context.request_repaint_after(std::time::Duration::from_secs_f64((due - now).max(0.1)));
            return;
        }
        self.write_at = None;
        let layout = layout();
        if self.layout.as_ref() != Some(&layout) {
            write_item(LAYOUT, &layout);
            self.layout = Some(layout);
        }
    }
}

#[cfg(target_arch = "wasm32")]
fn read_item(name: &str) -> Option<String> {
    crate::page::web::stored_item(name)
}

#[cfg(target_arch = "wasm32")]
fn write_item(name: &str, text: &str) {
    crate::page::web::store_item(name, text);
}

#[cfg(not(target_arch = "wasm32"))]
fn read_item(_name: &str) -> Option<String> {
    None
}

#[cfg(not(target_arch = "wasm32"))]
fn write_item(_name: &str, _text: &str) {}
