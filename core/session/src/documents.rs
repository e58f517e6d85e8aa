//! Small documents that a person keeps beside the sessions: arrangements of panels, conditions to stop at, and the like.
//!
//! The server does not look into them. Each has a name and a revision; who replaces one says which revision was read.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

/// How many documents there may be.
pub const DOCUMENT_LIMIT: usize = 200;
/// How large a document may be, bytes of JSON.
pub const DOCUMENT_BYTES: usize = 256 << 10;
/// How many characters a name may have.
const NAME_LIMIT: usize = 64;

/// A document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Document {
    /// Its name in paths.
    pub name: String,
    /// Raised by every change; what `If-Match` names.
    pub revision: u64,
    /// What it holds.
    #[schema(value_type = Value)]
    pub value: Value,
}

/// Whether a text can name a document: small letters, digits, hyphens, underscores and dots, beginning with a letter.
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
