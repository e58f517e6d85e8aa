//! The visual target tracker of Sightline: no network, no window, no clock. It compiles to WASM.
//!
//! A rover drives towards a rock that a scientist picked, stops every metre or so, and must find that very
//! point again each time. One stop is one pass through six stages:
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
//! The order in which to read: [`frames`] (the conventions), [`pipeline`] (the loop on one page), [`trace`]
//! (what each stage saw and decided), [`stages`] and [`locate`] (the steps), then [`camera`], [`correlate`], [`sift`],
//! [`estimate`] and [`stereo`] (the machinery), [`traverse`] and [`sim`] (where images come from), [`session`] (a person's work)
//! and [`study`] (the proof).
//!
//! Invariants: stages are pure; geometry is in `f64`, pixels in `f32`; the same input gives the same bits on any
//! number of threads; a lost target is data and never an [`error::Error`].

pub mod frames;
pub mod error;
pub mod toml_text;
pub mod limits;
pub mod settings;
pub mod presets;
pub mod camera;
pub mod image;
pub mod correlate;
pub mod sift;
pub mod estimate;
pub mod stereo;
pub mod target;
pub mod stages;
pub mod locate;
pub mod trace;
pub mod pipeline;
pub mod designate;
pub mod trackability;
pub mod traverse;
pub mod sim;
pub mod session;
pub mod study;
#[cfg(test)]
mod testing;
