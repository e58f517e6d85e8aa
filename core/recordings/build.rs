//! Passes the digest of the renderer's sources to the compiler.

use std::io;
use std::path::Path;

use sightline_sources::emit;

/// The sources that determine the radiance of a rendered image, beside its scenario.
const RENDERER: [&str; 5] = [
    "../geometry/src",
    "../vision/src/image",
    "../world/src",
    "../recordings/src/render_cache.rs",
    "../recordings/src/simulated.rs",
];

fn main() -> io::Result<()> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    emit("SIGHTLINE_RENDERER_SOURCES", &RENDERER.map(|source| package.join(source)))
}
