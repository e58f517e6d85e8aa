//! All tests that cross crates.
