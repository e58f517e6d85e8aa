//! The rover that carries them: where it truly stands, and where it believes to stand.

pub mod drive;
