//! Frames, poses, cameras and estimation, in `f64` only: the geometry of the tracker.
//!
//! From calibrations, pixels and points this crate computes projections, rays, poses, triangulated positions and their
//! covariances, for every other crate. It contains no images and no settings of a tracker.
//!
//! Read [`frames`] first: it defines the frames and the naming of transforms. Then [`camera`] (CAHV, CAHVOR, CAHVORE, the
//! mast) and [`estimate`] (triangulation, rigid motion, RANSAC, uncertainty).

pub mod frames;
pub mod error;
pub mod cancel;
pub mod camera;
pub mod stereo_geometry;
pub mod odometry_error;
pub mod estimate;
