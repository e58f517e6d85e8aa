//! What there is to see: the ground, its rocks, and how their surfaces look.

pub mod texture;
pub mod terrain;
mod terrain_cast;
pub mod rocks;
pub mod rock_field;
pub mod surface;
pub mod imprint;
