//! The version of the program as reports, recordings and `--version` give it.

/// The package version and the commit, `0.1.0 (1a2b3c4-dirty)`, or a digest of the sources where there is no repository.
pub(crate) const VERSION: &str = env!("SIGHTLINE_VERSION");
