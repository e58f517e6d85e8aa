//! Passes the digest of the tracker's sources to the compiler.

use std::io;
use std::path::Path;

use sightline_sources::{emit, with_dependencies};

fn main() -> io::Result<()> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    emit("SIGHTLINE_TRACKER_SOURCES", &with_dependencies(package, &package.join(".."))?)
}
