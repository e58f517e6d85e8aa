//! What there is to see: the ground, its rocks, and how their surfaces look.

mod value_noise;
pub mod texture;
mod relief;
pub mod terrain;
mod terrain_cast;
mod far;
pub mod rocks;
mod shape;
pub mod rock_law;
pub mod around;
pub mod rock_field;
pub mod footing;
mod details;
pub mod surface;
pub mod imprint;
