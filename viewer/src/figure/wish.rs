//! What is wanted of a figure: of which panel, and as what.

use crate::panels::pane::Pane;

/// What a figure is saved as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Vectors.
    Svg,
    /// Pixels: so many of them a point.
    Png(u8),
}

impl Default for Kind {
    fn default() -> Self {
        Self::Png(2)
    }
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Svg, Self::Png(1), Self::Png(2), Self::Png(3), Self::Png(4)];

    /// What it is called.
    pub fn word(self) -> String {
        match self {
            Self::Svg => "SVG".to_owned(),
            Self::Png(scale) => format!("PNG {scale}x"),
        }
    }
}

/// A figure that is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wish {
    /// Of which panel.
    pub pane: Pane,
    /// As what.
    pub kind: Kind,
}
