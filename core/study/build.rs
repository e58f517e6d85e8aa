//! Passes the digest of the sources that determine a study's rows to the compiler.

use std::io;
use std::path::Path;

use sightline_sources::{emit, with_dependencies};

fn main() -> io::Result<()> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    emit("SIGHTLINE_STUDY_SOURCES", &with_dependencies(package, &package.join(".."))?)
}
