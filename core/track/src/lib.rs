//! The trackers: stages 1 to 6 of a stop, from the last target and the pose change to the next target.
//!
//! ```text
//!             ┌──────────────────────── target, as the last stop left it ───────────────────────┐
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
//! No type of a crate that knows the ground truth can be named here. The same line compiles in `sightline_world`:
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
