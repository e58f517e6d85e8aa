//! Images, correlation, SIFT, dense stereo and the registration of surfaces: the computer vision of the tracker.
//!
//! From grey images (`f32`) and camera models this crate computes patches, score maps, features, disparities, meshes and
//! rigid transforms, for the trackers and for the studies that compare it with independent references.
//!
//! Every algorithm gives the same bits for the same input on any number of threads.

pub mod image;
pub mod correlate;
pub mod corners;
pub mod sift;
pub mod stereo;
pub mod registration;
#[cfg(test)]
mod testing;
