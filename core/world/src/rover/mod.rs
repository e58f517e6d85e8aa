//! The rover: its true and its estimated poses.
//!
//! In reading order: how it settles on the ground (`suspension`), slip (`slip`), where it can be placed (`scene`), how it
//! drives (`approach`, `course`), the scenario's drive (`plan`, `drive`), pose estimates and pointing errors (`odometry`,
//! `mast_error`), its body (`body`) and its tracks (`tracks`).

pub(crate) mod suspension;
pub(crate) mod slip;
pub(crate) mod scene;
pub(crate) mod approach;
pub(crate) mod course;
pub(crate) mod plan;
pub(crate) mod drive;
pub mod driven;
pub mod odometry;
pub(crate) mod mast_error;
pub(crate) mod body;
mod touch;
pub(crate) mod tracks;
