//! The name of a further camera of a stop: a short identifier that is valid in files, paths and commands.
//!
//! The main pair of a stop has no name. A name has 1 to 32 characters of `a` to `z`, `0` to `9` and `_`; it is
//! checked when it is read, so that every [`CameraName`] is valid.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::ToSchema;

/// Largest number of characters of a name.
const LENGTH_LIMIT: usize = 32;

/// The name of a further camera of a stop, for example `front_hazcam`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, ToSchema)]
#[schema(value_type = String, min_length = 1, max_length = 32, pattern = "^[a-z0-9_]+$")]
pub struct CameraName(
    /// Its characters, padded with zeros.
    [u8; LENGTH_LIMIT],
);

impl CameraName {
    /// The stereo pair taken for visual odometry.
    pub const ODOMETRY: Self = Self(*b"odometry\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0");

    /// The name as text.
    pub fn as_str(&self) -> &str {
        let length = self.0.iter().position(|&c| c == 0).unwrap_or(LENGTH_LIMIT);
        // Only ASCII is ever stored.
        std::str::from_utf8(&self.0[..length]).unwrap_or_default()
    }
}

impl FromStr for CameraName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_allowed = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'_';
        if text.is_empty() || text.len() > LENGTH_LIMIT || !text.bytes().all(is_allowed) {
            let shown: String = text.chars().take(LENGTH_LIMIT + 1).collect();
            return Err(format!(
                "{shown:?} is no name of a camera, which has 1 to {LENGTH_LIMIT} characters of a-z, 0-9 and _"
            ));
        }
        let mut characters = [0; LENGTH_LIMIT];
        characters[..text.len()].copy_from_slice(text.as_bytes());
        Ok(Self(characters))
    }
}

impl fmt::Display for CameraName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Debug for CameraName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl Serialize for CameraName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for CameraName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_short_lower_case_identifiers() {
        let longest = "x".repeat(32);
        for name in ["pancam", "front_hazcam", "7", longest.as_str()] {
            let parsed: CameraName = name.parse().unwrap();
            assert_eq!((parsed.as_str(), parsed.to_string().as_str()), (name, name));
            let json = serde_json::to_string(&parsed).unwrap();
            assert_eq!(serde_json::from_str::<CameraName>(&json).unwrap(), parsed);
        }
        let too_long = "x".repeat(33);
        for wrong in ["", "Pancam", "a b", "a/b", "..", "a-b", "é", "a\0", too_long.as_str()] {
            assert!(wrong.parse::<CameraName>().is_err(), "{wrong:?}");
            assert!(serde_json::from_value::<CameraName>(wrong.into()).is_err(), "{wrong:?}");
        }
    }
}
