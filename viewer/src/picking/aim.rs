//! The aim: a position in the left image, chosen by pointer or nudged by keys.

use egui::Key;
use sightline_geometry::frames::Pixel;

/// Displacement of the aim per arrow key, px: without and with Shift.
const NUDGE_PX: [f64; 2] = [0.1, 1.0];

/// A command about the aim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// Moves the aim, px. Without an aim, starts at the refused pixel, otherwise at the centre of the view.
    Nudge {
        /// To the right.
        dx: f64,
        /// Downwards.
        dy: f64,
    },
    /// Designates the aim; without one, accepts the alternative that a refusal offers.
    Accept,
    /// Designates the nearest good pixel that a refusal offers.
    TakeNearest,
    /// Designates the position despite the advice against it.
    Insist,
    /// Sets the aim to a pixel.
    Put(Pixel),
}

impl Aim {
    /// The command of a key while a target is being picked.
    pub(crate) fn of_key(key: Key, shift: bool) -> Option<Self> {
        let by = NUDGE_PX[usize::from(shift)];
        Some(match key {
            Key::ArrowLeft => Self::Nudge { dx: -by, dy: 0.0 },
            Key::ArrowRight => Self::Nudge { dx: by, dy: 0.0 },
            Key::ArrowUp => Self::Nudge { dx: 0.0, dy: -by },
            Key::ArrowDown => Self::Nudge { dx: 0.0, dy: by },
            Key::Enter => Self::Accept,
            _ => return None,
        })
    }
}
