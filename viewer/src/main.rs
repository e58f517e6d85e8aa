//! The native viewer.
fn main() {}
