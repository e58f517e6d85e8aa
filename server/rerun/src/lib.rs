//! The part of the crate `rerun` that recordings need: the SDK, its types and the encoding of files.
//!
//! The crate `rerun` also contains a catalogue client, a chunk store, a query engine and analytics, which no feature
//! disables. This crate exports the same paths from the crates below it, which saves 43 crates.

pub use re_sdk::*;
pub use re_sdk_types::archetypes::*;
pub use re_sdk_types::components::{Color, ImageFormat, Radius, TextLogLevel};
pub use re_sdk_types::datatypes::{ChannelDatatype, ColorModel, Quaternion};
pub use re_sdk_types::{AnyValues, archetypes, components, datatypes};

/// Crates below the SDK.
pub mod external {
    pub use re_build_info;
    pub use re_sdk::external::*;
    pub use re_sdk_types;
}
