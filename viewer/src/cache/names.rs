//! The names of what can be loaded.

pub(crate) use sightline_api::location::AtStep as StepKey;
use sightline_geometry::camera::CameraName;
use sightline_track::trace::ArrayName;

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
        /// The camera beside the main pair; `None`: the main pair.
        camera: Option<CameraName>,
    },
    /// A stop with its cameras.
    Stop {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
    },
    /// The odometry of a stop with its corners.
    Odometry {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
    },
    /// The goodness map of a stop of a drive.
    Hazards {
        /// The session.
        session: String,
        /// The stop.
        step: usize,
        /// What of the command and of who drives has an influence on it.
        rules: String,
    },
    /// What a step saw and decided.
    Trace(StepKey),
    /// An array of a step.
    Array(StepKey, ArrayName),
    /// All arrays to which a step came.
    Arrays(StepKey),
    /// The view of a step against the earlier templates of its run.
    EarlierTemplates(StepKey),
    /// What the stages of a step take.
    Times(StepKey),
}
