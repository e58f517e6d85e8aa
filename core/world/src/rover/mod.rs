//! The rover that carries them: where it truly stands, and where it believes to stand.
//!
//! In the order in which to read: how it stands (`suspension`), what its wheels lose (`slip`), where it can be
//! placed (`scene`), how it drives (`approach`, `course`), the scenario's drive (`plan`, `drive`), what it knows of
//! it (`odometry`, `mast_error`), what it looks like (`body`) and what it leaves behind (`tracks`).

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
