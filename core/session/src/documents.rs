//! Small documents that a person stores beside the sessions: panel layouts, lists of breakpoints and others.
//!
//! The server does not interpret them. Each has a name and a revision; a request that replaces one names the revision that
//! it read.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

/// Maximum number of documents.
pub const DOCUMENT_LIMIT: usize = 200;
/// Maximum size of a document, bytes of JSON.
pub const DOCUMENT_BYTES: usize = 256 << 10;
/// Maximum length of a name, bytes.
const NAME_LIMIT: usize = 64;

/// A document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Document {
    /// Its name in paths.
    pub name: String,
    /// Increased by every change; the value for `If-Match`.
    pub revision: u64,
    /// The content.
    #[schema(value_type = Value)]
    pub value: Value,
}

/// Whether a text can name a document: lower-case ASCII letters, digits, hyphens, underscores and dots; first a letter.
pub fn is_name(text: &str) -> bool {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_.".contains(c);
    text.len() <= NAME_LIMIT && text.starts_with(|c: char| c.is_ascii_lowercase()) && text.chars().all(plain)
}

#[cfg(test)]
mod tests {
    use super::is_name;

    #[test]
    fn names_are_plain() {
        assert!(is_name("layout.mine-2") && is_name("breakpoints"));
        for name in ["", "../x", "A", "2x", "a b", "é", &"x".repeat(65)] {
            assert!(!is_name(name), "{name}");
        }
    }
}
