//! The names of what can be loaded.

use sightline_core::trace::ArrayName;

/// One of the two images of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Eye {
    /// The left (or first) image.
    Left,
    /// The right (or second) image.
    Right,
}

impl Eye {
    /// The word in paths and titles.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// A step of a run of a target of a session.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StepKey {
    /// The session.
    pub session: String,
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The stop.
    pub step: usize,
}

/// The name of something that can be loaded.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Key {
    /// An image of a stop.
    Image {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
        /// Which of the two.
        eye: Eye,
    },
    /// A stop with its cameras.
    Stop {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
    },
    /// What a step saw and decided.
    Trace(StepKey),
    /// An array of a step.
    Array(StepKey, ArrayName),
    /// All arrays to which a step came.
    Arrays(StepKey),
}
