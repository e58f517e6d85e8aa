//! A traverse: the stops of one drive, each with a pose estimate, a stereo pair and optionally the truth.
//!
//! Everything is opened through the native folder (`native.rs` documents the format): a simulated traverse is a
//! folder whose images are rendered on first use, and an importer converts a foreign recording to a folder
//! (`import/`, one file per format).

mod check;
mod driven;
pub mod files;
mod followed;
mod images;
pub mod import;
mod index_file;
mod native;
mod render_cache;
pub mod replayed;
mod simulated;
mod simulated_traverse;
mod stops;
mod truth_files;
mod with_odometry;

pub use driven::DrivenTraverse;
pub use followed::Followed;
pub use index_file::{Existing, IndexFormat};
pub use native::{Traverse, write};
pub use render_cache::RenderCache;
pub use simulated_traverse::{create_simulated, create_simulated_until};
