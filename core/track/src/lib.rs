//! The trackers: stages 1 to 6 of a stop, from the last target and the pose change to the next target.
//!
//! ```text
//!             ┌──────────────────────── target, updated at the last stop ───────────────────────┐
//!             ▼                                                                                 │
//! pose ──► predict ──► point_mast ──► capture ──► locate ─────────────► judge ──► update ───────┘
//!                                                  │ template: scale_roll → match_template
//!                                                  │           → point_stereo → triangulate
//!                                                  ▼
//!                                               evidence
//! ```
//!
//! Stages are pure: no clock, file or hidden state. Geometry is in `f64`, pixels in `f32`. A lost target is data, never an
//! error. No type of this crate contains ground truth about the world.
//!
//! This crate does not depend on any crate with ground truth. This line compiles in `sightline_world`, but not here:
//!
//! ```compile_fail
//! use sightline_world::target_truth::TruthSource;
//! ```

pub mod limits;
pub mod settings;
pub mod presets;
pub mod gate;
pub mod verdict;
pub mod target;
mod array_name;
pub mod cycle_stage;
pub mod stages;
pub mod locate;
pub mod trace;
pub mod records;
#[cfg(test)]
mod testing;
