//! Names of traverses and folders, and the digest that identifies contents.

use sha2::{Digest, Sha256};
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;

/// The part of a traverse's name that is derived from its index: readable, and unique to the index.
///
/// # Errors
/// An index that cannot be serialised as JSON.
pub(crate) fn name_of(traverse: &Traverse) -> Result<String> {
    let index = serde_json::to_vec(traverse.index()).map_err(|error| Error::Request(error.to_string()))?;
    Ok(format!("{}-{}", slug(&traverse.index().name), &hash(&index)[..6]))
}

/// Converts a name for use in a path or file name: lower-case letters, digits and hyphens.
pub(crate) fn slug(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { ' ' };
    let words: String = name.chars().map(plain).take(60).collect();
    let joined = words.split_whitespace().collect::<Vec<_>>().join("-");
    if joined.is_empty() { "traverse".to_owned() } else { joined }
}

/// The SHA-256 of `bytes`, as hexadecimal digits.
pub fn hash(bytes: &[u8]) -> String {
    digits(&Sha256::digest(bytes))
}

/// Bytes as hexadecimal digits.
pub(crate) fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
