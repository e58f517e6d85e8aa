//! All tests that cross crates.

mod zncc_reference;
