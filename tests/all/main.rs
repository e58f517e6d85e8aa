//! All tests that cross crates.

mod imports;
mod recorded_cameras;
mod zncc_reference;
