//! The names of a step's arrays. Each stage declares its arrays beside its evidence (`impl Record`), with a constant
//! for each array that a panel draws individually.
//!
//! The lookup of a name among the declarations is in `trace::arrays`.

use std::fmt;

use serde::{Serialize, Serializer};

/// The name of an array that a stage declares.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ArrayName(&'static str);

impl ArrayName {
    /// The name of a declared array; a test compares the constants with the declarations.
    pub(crate) const fn new(word: &'static str) -> Self {
        Self(word)
    }

    /// The name, as in paths and files.
    pub const fn word(self) -> &'static str {
        self.0
    }
}

impl fmt::Debug for ArrayName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

impl Serialize for ArrayName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0)
    }
}
