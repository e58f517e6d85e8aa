//! A panel as a figure: what egui painted inside the panel's rectangle, as shapes that do not depend on the screen.
//!
//! ```text
//! painted shapes ─► shapes ─► Figure ─┬─► svg      vector, words stay words
//!                     words ──┘       └─► bitmap   PNG at 1× to 4×, drawn anew at that scale
//! ```
//! | file | what it does |
//! |---|---|
//! | `shapes` | egui's shapes as inks |
//! | `words` | egui's laid out text as words with size, colour and the place of every letter |
//! | `svg` | a figure as a self-contained SVG file |
//! | `bitmap` | a figure as an opaque PNG file |
//! | `faces` | the outlines of the letters |
//! | `wish` | what is wanted of a figure |
//! | `save` | the figure of a panel: on the screen or not, with a title or without; its file name |
//!
//! The figure is made of the layer in which panels are painted: menus and tips that lie above it are no part of it.

pub(crate) mod bitmap;
mod faces;
pub(crate) mod shapes;
pub(crate) mod save;
pub(crate) mod svg;
pub(crate) mod wish;
pub(crate) mod words;

use std::cell::Cell;
use std::sync::Arc;

use egui::{Color32, ColorImage, FontFamily, Pos2, Rect, Stroke, Vec2};

thread_local! {
    /// Whether a figure for a paper is being drawn; the page paints on one thread.
    static ON_PAPER: Cell<bool> = const { Cell::new(false) };
}

/// Whether a figure for a paper is being drawn: controls are left out then.
pub(crate) fn is_on_paper() -> bool {
    ON_PAPER.get()
}

/// What is painted of a panel, in points from the figure's upper left corner.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Width and height, points.
    pub size: Vec2,
    /// What it is called.
    pub title: String,
    /// What it shows, in words.
    pub description: String,
    /// What lies behind everything.
    pub ground: Color32,
    /// What is painted, the lowest first.
    pub pieces: Vec<Piece>,
    /// How many shapes could not be taken over: what only a graphics card paints, and textures that nobody knows.
    pub left_out: usize,
}

/// One shape with the rectangle to which it is cut.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    /// Where it may be seen.
    pub clip: Rect,
    /// What it is.
    pub ink: Ink,
}

/// A shape.
#[derive(Clone, Debug)]
pub(crate) enum Ink {
    /// An outline, filled or drawn.
    Area {
        /// Its form.
        form: Form,
        /// What fills it; transparent: nothing.
        fill: Color32,
        /// What draws it.
        stroke: Stroke,
    },
    /// Words on one line.
    Words(Words),
    /// A picture in a rectangle.
    Picture {
        /// Its pixels.
        pixels: Arc<ColorImage>,
        /// Where they lie.
        place: Rect,
    },
}

/// The form of an outline.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Form {
    /// A rectangle with the radii of its corners: upper left, upper right, lower right, lower left.
    Rect(Rect, [f32; 4]),
    /// An ellipse: its middle, its half axes, and by how much it is turned clockwise, rad.
    Ellipse(Pos2, Vec2, f32),
    /// Straight lines through points, perhaps back to the first.
    Lines(Vec<Pos2>, bool),
    /// A cubic Bézier curve, perhaps closed by a straight line.
    Curve([Pos2; 4], bool),
}

/// Words on one line in one look.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Words {
    /// What they say.
    pub text: String,
    /// Where the baseline begins, points.
    pub at: Pos2,
    /// By how much they are turned clockwise about their beginning, rad.
    pub angle: f32,
    /// From the beginning to where each letter begins, points; `None` for a letter that egui painted as part of a
    /// ligature: it follows the letter before it.
    pub places: Vec<Option<f32>>,
    /// From the beginning to the end of the last letter, points.
    pub width: f32,
    /// Size of the letters, points.
    pub size: f32,
    /// Their family.
    pub family: FontFamily,
    /// Whether they lean.
    pub is_italic: bool,
    /// Whether there is more room between the letters than their own.
    pub is_spaced: bool,
    /// Their colour.
    pub colour: Color32,
}

impl Form {
    /// The same, moved.
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

    /// A box around it.
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

    /// A box around it.
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
