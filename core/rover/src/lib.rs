//! The loop over the stops of a drive: it obtains images and poses from a drive and calls the stages of `sightline_track`.
//!
//! [`pipeline`] contains one step on one page. [`designate`] resolves the three ways to specify a target, [`trackability`]
//! rates each pixel of an image as a target before one is designated.
//!
//! No type of a crate with ground truth can be named here. The same line compiles in `sightline_world`:
//!
//! ```compile_fail
//! use sightline_world::target_truth::TruthSource;
//! ```

mod begun;
mod sight;
pub mod pipeline;
pub mod pair;
pub mod designate;
pub mod trackability;
pub mod driving;
pub mod hazards;
pub mod navigation;
pub mod visual_odometry;
pub mod version;
