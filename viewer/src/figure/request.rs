//! A request for a figure: the panel and the file type.

use crate::panels::pane::Pane;

/// The file type of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// Vector graphics.
    Svg,
    /// PNG at this number of pixels per point.
    Png(u8),
}

impl Default for FigureFormat {
    fn default() -> Self {
        Self::Png(2)
    }
}

impl FigureFormat {
    /// All file types.
    pub const ALL: [Self; 5] = [Self::Svg, Self::Png(1), Self::Png(2), Self::Png(3), Self::Png(4)];

    /// The name in menus.
    pub fn word(self) -> String {
        match self {
            Self::Svg => "SVG".to_owned(),
            Self::Png(scale) => format!("PNG {scale}x"),
        }
    }
}

/// Background and width of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigurePage {
    /// As the panel is on the screen.
    Screen,
    /// For a paper: white, without controls, this many points wide.
    Paper(u16),
}

impl Default for FigurePage {
    fn default() -> Self {
        Self::Paper(720)
    }
}

impl FigurePage {
    /// All choices.
    pub const ALL: [Self; 4] = [Self::Paper(360), Self::Paper(720), Self::Paper(1080), Self::Screen];

    /// The label of its button.
    pub fn words(self) -> String {
        match self {
            Self::Screen => "as on the screen".to_owned(),
            Self::Paper(width) => format!("white, {width} points wide"),
        }
    }
}

/// A request for a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FigureRequest {
    /// The panel.
    pub pane: Pane,
    /// The file type.
    pub kind: FigureFormat,
}
