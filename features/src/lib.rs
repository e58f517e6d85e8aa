//! One set of features for the dependencies that the server shares with the page and the tests.
//!
//! Cargo compiles a crate once per set of features. `cargo xtask serve` builds the server alone, `cargo xtask test`
//! the whole workspace: without this crate, the second would enable features of `serde`, `ahash` and others, and
//! compile everything above them again.
