//! The keys of items that can be loaded.

pub(crate) use sightline_api::location::AtStep as StepKey;
use sightline_geometry::camera::CameraName;
use sightline_track::trace::ArrayName;

/// One of the two images of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImageSide {
    /// The left (or first) image.
    Left,
    /// The right (or second) image.
    Right,
}

impl ImageSide {
    /// The word in paths and titles.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// The key of an item that can be loaded.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Key {
    /// An image of a stop.
    Image {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
        /// The left or the right image.
        side: ImageSide,
        /// A further camera of the stop; `None`: the main pair.
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
        /// The parts of the command and of the driver on which the map depends.
        rules: String,
    },
    /// The record of a step.
    Trace(StepKey),
    /// An array of a step.
    Array(StepKey, ArrayName),
    /// All arrays that a step produced.
    Arrays(StepKey),
    /// The comparison of a step's view with the earlier templates of its run.
    EarlierTemplates(StepKey),
    /// The times of a step's stages.
    Times(StepKey),
}
