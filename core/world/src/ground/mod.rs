//! The ground, its rocks, and the appearance of their surfaces.

mod value_noise;
pub(crate) mod level;
pub mod texture;
mod relief;
pub(crate) mod terrain;
mod block_walk;
mod terrain_cast;
pub(crate) mod packet_cast;
mod far;
pub mod rocks;
mod shape;
pub mod rock_law;
pub(crate) mod around;
mod clear_path;
pub(crate) mod rock_field;
pub(crate) mod footing;
mod details;
pub(crate) mod surface;
pub(crate) mod imprint;
