//! The facade of the core crates, for programs that want all of them; server and viewer depend on the single crates.
//!
//! | crate | contents |
//! |---|---|
//! | [`geometry`] | frames, poses, cameras, estimation |
//! | [`vision`] | images, correlation, SIFT, dense stereo, registration of surfaces |
//! | [`track`] | stages 1 to 6, the trackers, settings, presets |
//! | [`rover`] | the loop over the stops, designation, trackability |
//! | [`world`] | simulated Mars and its ground truth |
//! | [`recordings`] | the native format, importers, image caches |
//! | [`session`] | targets, runs, comparisons, explanations, expressions |
//! | [`study`] | validation experiments |
//! | [`api`] | the types that server and viewer exchange |
//!
//! A crate depends only on crates above it in this table. No crate with stages (`track`, `rover`) can name a type of `world`.

pub use sightline_api as api;
pub use sightline_geometry as geometry;
pub use sightline_recordings as recordings;
pub use sightline_rover as rover;
pub use sightline_session as session;
pub use sightline_study as study;
pub use sightline_track as track;
pub use sightline_vision as vision;
pub use sightline_world as world;
