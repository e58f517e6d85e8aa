//! Which picture is meant: the camera of the pair, the part of its picture, the seed of its noise.

use sightline_geometry::camera::Camera;

/// Which camera of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Eye {
    /// The left camera.
    Left,
    /// The right camera.
    Right,
}

impl Eye {
    /// The number that stands for it in seeds.
    pub(crate) fn number(self) -> u64 {
        match self {
            Self::Left => 1,
            Self::Right => 2,
        }
    }
}

/// Whose noise it is: two pictures with the same seed have the same noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NoiseSeed {
    /// The stop, or any other number that tells one exposure from the next.
    pub step: u32,
    /// The camera, which has its own pixel response.
    pub eye: Eye,
}

/// A rectangle of a picture, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Region {
    /// The whole picture of a camera.
    pub fn whole(camera: &Camera) -> Self {
        Self { x: 0, y: 0, width: camera.width(), height: camera.height() }
    }
}
