//! The rover that carries them: where it truly stands, and where it believes to stand.
//!
//! In the order in which to read: how it stands (`suspension`), what its wheels lose (`slip`), where it can be
//! placed (`scene`), how it drives (`course`), the scenario's drive (`drive`), what it knows of it (`odometry`,
//! `mast_error`), what it looks like (`body`) and what it leaves behind (`tracks`).

pub mod suspension;
pub mod slip;
pub mod scene;
pub mod course;
pub mod drive;
pub mod odometry;
pub mod mast_error;
pub mod body;
pub mod tracks;
