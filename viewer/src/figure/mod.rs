//! A panel as a figure: the shapes that egui painted inside the panel's rectangle, independent of the screen.
//!
//! ```text
//! painted shapes ─► shapes ─► Figure ─┬─► svg      vector, text stays text
//!                     words ──┘       └─► bitmap   PNG, rendered at 1× to 4×
//! ```
//! | file | what it does |
//! |---|---|
//! | `shapes` | converts egui's shapes to inks |
//! | `words` | egui's text layouts as text with size, colour and the position of every letter |
//! | `svg` | a figure as a self-contained SVG file |
//! | `bitmap` | a figure as an opaque PNG file |
//! | `faces` | the outlines of the letters |
//! | `request` | the request for a figure: panel and file type |
//! | `save` | the figure of a panel, visible or not, with or without a caption, and its file name |
//!
//! The figure contains the layer in which panels are painted; menus and tooltips above it are not part of it.

pub(crate) mod bitmap;
mod faces;
pub(crate) mod shapes;
pub(crate) mod save;
pub(crate) mod svg;
pub(crate) mod request;
pub(crate) mod words;

use std::cell::Cell;
use std::sync::Arc;

use egui::{Color32, ColorImage, FontFamily, Pos2, Rect, Stroke, Vec2};

thread_local! {
    /// Whether a figure for a paper is being rendered; the page paints on one thread.
    static ON_PAPER: Cell<bool> = const { Cell::new(false) };
}

/// Whether a figure for a paper is being rendered, which omits controls.
pub(crate) fn is_on_paper() -> bool {
    ON_PAPER.get()
}

/// The contents of a panel, in points from the figure's upper left corner.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Width and height, points.
    pub size: Vec2,
    /// The title of the file.
    pub title: String,
    /// The contents in words.
    pub description: String,
    /// The background colour.
    pub ground: Color32,
    /// The painted shapes, from bottom to top.
    pub pieces: Vec<Piece>,
    /// Number of shapes that could not be converted: GPU callbacks, and textures without known pixels.
    pub left_out: usize,
}

/// One shape with its clip rectangle.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    /// The clip rectangle.
    pub clip: Rect,
    /// The shape.
    pub ink: Ink,
}

/// A shape.
#[derive(Clone, Debug)]
pub(crate) enum Ink {
    /// An outline, filled or stroked.
    Area {
        /// Its outline.
        form: Form,
        /// The fill colour; transparent: no fill.
        fill: Color32,
        /// The stroke.
        stroke: Stroke,
    },
    /// Text on one line.
    Words(Words),
    /// An image in a rectangle.
    Picture {
        /// Its pixels.
        pixels: Arc<ColorImage>,
        /// The rectangle, points.
        place: Rect,
    },
}

/// An outline.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Form {
    /// A rectangle with its corner radii: upper left, upper right, lower right, lower left.
    Rect(Rect, [f32; 4]),
    /// An ellipse: centre, half axes, and clockwise rotation, rad.
    Ellipse(Pos2, Vec2, f32),
    /// Straight lines through points; closed if the flag is set.
    Lines(Vec<Pos2>, bool),
    /// A cubic Bézier curve; closed by a straight line if the flag is set.
    Curve([Pos2; 4], bool),
}

/// Text on one line in one format.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Words {
    /// The text.
    pub text: String,
    /// The start of the baseline, points.
    pub at: Pos2,
    /// Clockwise rotation about the start, rad.
    pub angle: f32,
    /// Offset of each letter from the start, points; `None` for a letter that egui painted as part of a ligature: it
    /// follows the letter before it.
    pub places: Vec<Option<f32>>,
    /// Distance from the start to the end of the last letter, points.
    pub width: f32,
    /// Font size, points.
    pub size: f32,
    /// Font family.
    pub family: FontFamily,
    /// Whether it is italic.
    pub is_italic: bool,
    /// Whether it has extra letter spacing.
    pub is_spaced: bool,
    /// The colour.
    pub colour: Color32,
}

impl Form {
    /// The same outline, translated.
    fn moved(self, by: Vec2) -> Self {
        match self {
            Self::Rect(rect, radii) => Self::Rect(rect.translate(by), radii),
            Self::Ellipse(middle, half, angle) => Self::Ellipse(middle + by, half, angle),
            Self::Lines(points, closed) => {
                Self::Lines(points.into_iter().map(|point| point + by).collect(), closed)
            }
            Self::Curve(points, closed) => Self::Curve(points.map(|point| point + by), closed),
        }
    }

    /// A bounding box.
    fn bounds(&self) -> Rect {
        match self {
            Self::Rect(rect, _) => *rect,
            Self::Ellipse(middle, half, _) => {
                Rect::from_center_size(*middle, Vec2::splat(2.0 * half.max_elem()))
            }
            Self::Lines(points, _) => Rect::from_points(points),
            Self::Curve(points, _) => Rect::from_points(points),
        }
    }
}

impl Ink {
    fn moved(self, by: Vec2) -> Self {
        match self {
            Self::Area { form, fill, stroke } => Self::Area { form: form.moved(by), fill, stroke },
            Self::Words(words) => Self::Words(Words { at: words.at + by, ..words }),
            Self::Picture { pixels, place } => Self::Picture { pixels, place: place.translate(by) },
        }
    }

    /// A bounding box.
    pub(crate) fn bounds(&self) -> Rect {
        match self {
            Self::Area { form, stroke, .. } => form.bounds().expand(stroke.width),
            Self::Words(words) => {
                let reach = words.width.max(words.size) + words.size;
                if words.angle == 0.0 {
                    let top = words.at - Vec2::new(0.0, words.size);
                    Rect::from_min_size(top, Vec2::new(words.width, 1.5 * words.size))
                } else {
                    Rect::from_center_size(words.at, Vec2::splat(2.0 * reach))
                }
            }
            Self::Picture { place, .. } => *place,
        }
    }
}
