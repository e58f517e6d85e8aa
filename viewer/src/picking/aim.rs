//! Choosing a place in the left image: by pointer, or by keys that nudge an aim.

use egui::Key;
use sightline_geometry::frames::Pixel;

/// How far an arrow key moves the aim, px; with Shift.
const NUDGE_PX: [f64; 2] = [0.1, 1.0];

/// What a person asks of the place that is being chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// Moves it, px; the first time it begins at the refused pixel, or in the middle of what is shown.
    Nudge {
        /// To the right.
        dx: f64,
        /// Downwards.
        dy: f64,
    },
    /// Designates the aim; without one, what a refusal offers.
    Accept,
    /// Designates the nearest good pixel that a refusal offers.
    TakeNearest,
    /// Designates the place that was refused as a bad one all the same.
    Insist,
    /// Puts the aim on a pixel.
    Put(Pixel),
}

impl Aim {
    /// What a key asks for while a place is being chosen.
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
