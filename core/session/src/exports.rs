//! The files to which a session can be exported.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A file that can be exported.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ExportEntry {
    /// Its name in paths and on the command line.
    pub name: String,
    /// Its title in menus.
    pub title: String,
    /// Its contents and purpose.
    pub sentence: String,
    /// The suggested file name.
    pub file: String,
    /// Its size, or an estimate.
    pub size: Size,
    /// Its path below `/api/v1/`, with the query.
    pub path: String,
    /// The command line that writes the same file.
    pub command: String,
}

/// A size of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Size {
    /// Bytes.
    pub bytes: u64,
    /// Whether the size is exact; otherwise it is an estimate.
    pub is_exact: bool,
}

impl Size {
    /// The size as text: `about 2.3 MB`.
    pub fn words(self) -> String {
        let about = if self.is_exact { "" } else { "about " };
        let bytes = self.bytes as f64;
        match self.bytes {
            0..1_000 => format!("{about}{bytes} B"),
            1_000..1_000_000 => format!("{about}{:.0} kB", bytes / 1e3),
            1_000_000..1_000_000_000 => format!("{about}{:.1} MB", bytes / 1e6),
            _ => format!("{about}{:.1} GB", bytes / 1e9),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Size;

    #[test]
    fn an_estimate_is_called_one() {
        assert_eq!(Size { bytes: 2_340_000, is_exact: false }.words(), "about 2.3 MB");
        assert_eq!(Size { bytes: 950, is_exact: true }.words(), "950 B");
    }
}
