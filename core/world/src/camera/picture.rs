//! Identifies an image: the camera of the pair, the region, the seed of its noise.

use sightline_geometry::camera::Camera;

/// A camera of a stereo pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Eye {
    /// The left camera.
    Left,
    /// The right camera.
    Right,
}

impl Eye {
    /// The camera's number in seeds.
    pub(crate) fn number(self) -> u64 {
        match self {
            Self::Left => 1,
            Self::Right => 2,
        }
    }
}

/// Seed of the noise: two images with the same seed have the same noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NoiseSeed {
    /// The stop, or any other number that distinguishes exposures.
    pub step: u32,
    /// The camera, which has its own pixel response.
    pub eye: Eye,
}

/// A rectangle of an image, px.
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
    /// The whole image of a camera.
    pub fn whole(camera: &Camera) -> Self {
        Self { x: 0, y: 0, width: camera.width(), height: camera.height() }
    }
}
