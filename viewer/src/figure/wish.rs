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

/// Ground and width of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sheet {
    /// As the panel is on the screen.
    Screen,
    /// For a paper: white, without controls, this many points wide.
    Paper(u16),
}

impl Default for Sheet {
    fn default() -> Self {
        Self::Paper(720)
    }
}

impl Sheet {
    /// All choices.
    pub const ALL: [Self; 4] = [Self::Paper(360), Self::Paper(720), Self::Paper(1080), Self::Screen];

    /// The words of its button.
    pub fn words(self) -> String {
        match self {
            Self::Screen => "as on the screen".to_owned(),
            Self::Paper(width) => format!("white, {width} points wide"),
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
