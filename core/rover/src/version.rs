//! The version of the tracker, by which sessions and exports recognise results of other code.

/// Digest of the sources of this crate and of all its dependencies, from the build script.
const SOURCES: &str = env!("SIGHTLINE_TRACKER_SOURCES");

/// The package version and the first twelve hexadecimal digits of the digest of the tracker's sources.
pub fn tracker_version() -> String {
    format!("{}-{}", env!("CARGO_PKG_VERSION"), &SOURCES[..12])
}
