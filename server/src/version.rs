//! The version of the program in reports, recordings and `--version`.

/// The package version and the commit, `0.1.0 (1a2b3c4-dirty)`, or a digest of the sources without a repository.
pub(crate) const VERSION: &str = env!("SIGHTLINE_VERSION");
