//! The validation experiments: grid in, table and figure out; and the truth they are measured against.

pub mod scenery;
pub mod picture;
pub mod truth;
pub mod calibration;
pub mod approach;
pub mod skip;
pub mod realism;
pub mod exposure;
