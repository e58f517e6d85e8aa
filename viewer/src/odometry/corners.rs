//! The corners of visual odometry on the images: position at the previous stop, match, and outcome (fate).
//!
//! | mark | fate |
//! |---|---|
//! | dot, solid line | inlier: from its previous position to its match |
//! | cross, dashed line | outlier |
//! | ring, dotted line | matched, but no motion was estimated |
//! | square, diamond, triangle, plus, small ring | lost: out of view, no match, no stereo after, no stereo, out of range |

use egui::{Color32, Pos2};
use sightline_geometry::frames::Pixel;
use sightline_rover::visual_odometry::{Fate, OdometryCorner};

use crate::command::{Layer, Mode};
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle, paint_mark};
use crate::drawing::view2d::Canvas;
use crate::panels::legend::Entry;
use crate::state::State;
use crate::theme;

/// Half the size of a corner's mark, points.
const REACH: f32 = 3.0;
/// Maximum distance of the pointer from a corner to show its values, points.
const HOVER_REACH: f32 = 8.0;

/// The fates, in the order of the legend.
const FATES: [Fate; 8] = [
    Fate::Inlier,
    Fate::Outlier,
    Fate::Unused,
    Fate::NoMatch,
    Fate::OutOfView,
    Fate::NoStereoAfter,
    Fate::NoStereo,
    Fate::OutOfRange,
];

/// An image on which corners are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum At {
    /// The left image of the previous stop.
    Before,
    /// The left image of the stop.
    After,
}

impl At {
    /// The position of a corner in the image; `None` without a match.
    fn place(self, corner: &OdometryCorner) -> Option<Pixel> {
        let [x, y] = match self {
            Self::Before => corner.before_px,
            Self::After => corner.after_px?,
        };
        Some(Pixel::new(x, y))
    }
}

/// Mark, colour and label of a fate.
fn corner_style(fate: Fate) -> (Mark, Color32, &'static str) {
    match fate {
        Fate::Inlier => (Mark::Dot, theme::inlier(), "inliers"),
        Fate::Outlier => (Mark::Cross, theme::outlier(), "outliers"),
        Fate::Unused => (Mark::Ring, theme::lost(), "matched, no motion"),
        Fate::NoMatch => (Mark::Diamond, theme::search(), "no match"),
        Fate::OutOfView => (Mark::Square, theme::prediction(), "out of view"),
        Fate::NoStereoAfter => (Mark::Triangle, theme::run(1), "no stereo after"),
        Fate::NoStereo => (Mark::Plus, theme::keypoint(), "no stereo before"),
        Fate::OutOfRange => (Mark::Ring, theme::keypoint(), "out of range"),
    }
}

/// The legend entries: the fates that occur, with their counts.
pub(crate) fn entries(corners: &[OdometryCorner]) -> Vec<Entry> {
    let entry = |fate: Fate| {
        let count = corners.iter().filter(|corner| corner.fate == fate).count();
        let (mark, colour, word) = corner_style(fate);
        (count > 0).then(|| Entry::new(Layer::Corners(fate), mark, colour, format!("{word} {count}")))
    };
    FATES.into_iter().filter_map(entry).collect()
}

/// The legend entry for all corners on the page's left image; `None` if the stop has no odometry.
pub(crate) fn left_entry(state: &State) -> Option<Entry> {
    let step = state.cursor.step;
    let measured = state.odometry_on_image()?;
    let word = format!("odometry from step {}, {} inliers", step.saturating_sub(1), measured.update.inliers);
    Some(Entry::new(Layer::Odometry, Mark::Stroke(StrokeStyle::Solid), theme::inlier(), word))
}

/// The corners on the page's left image; empty while their layer is hidden.
fn on_left_image(state: &State) -> &[OdometryCorner] {
    let is_shown = state.shows(Layer::Odometry) && state.odometry_on_image().is_some();
    let odometry = state.stop_odometry().ready().filter(|_| is_shown);
    odometry.map_or(&[], |odometry| odometry.corners.as_slice())
}

/// Paints the matches on the page's left image.
pub(crate) fn paint_left(canvas: &Canvas, state: &State) {
    paint(canvas, state, on_left_image(state), At::After);
}

/// Shows a tooltip for the corner under the pointer on the page's left image.
pub(crate) fn hover_left(canvas: &Canvas, state: &State) {
    let corners = on_left_image(state);
    if let Some(corner) = hovered(canvas, state, corners, At::After) {
        ring(canvas, &corners[corner], At::After);
        canvas.response.clone().on_hover_text_at_pointer(words(&corners[corner]));
    }
}

/// Paints the corners of visible fates; at the stop itself with a line from their previous position.
pub(crate) fn paint(canvas: &Canvas, state: &State, corners: &[OdometryCorner], at: At) {
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    for corner in corners.iter().filter(|corner| state.shows(Layer::Corners(corner.fate))) {
        let Some(place) = at.place(corner) else { continue };
        let (mark, colour, _) = corner_style(corner.fate);
        if at == At::After
            && let Some(before) = At::Before.place(corner)
        {
            let line = match corner.fate {
                Fate::Inlier => StrokeStyle::Solid,
                Fate::Outlier => StrokeStyle::Dashed,
                _ => StrokeStyle::Dotted,
            };
            overlay.thin_line(&[before, place], colour, line);
        }
        paint_mark(&canvas.painter, canvas.transform.to_screen(place), mark, colour, REACH);
    }
}

/// Paints a ring around a corner.
pub(crate) fn ring(canvas: &Canvas, corner: &OdometryCorner, at: At) {
    if let Some(place) = at.place(corner) {
        Overlay::new(&canvas.painter, &canvas.transform).mark(place, Mark::Ring, theme::accent());
    }
}

/// Index of the corner under the pointer.
pub(crate) fn hovered(canvas: &Canvas, state: &State, corners: &[OdometryCorner], at: At) -> Option<usize> {
    let pointer: Pos2 = canvas.response.hover_pos().filter(|_| state.mode == Mode::Look)?;
    let distance = |corner: &OdometryCorner| {
        let place = at.place(corner).filter(|_| state.shows(Layer::Corners(corner.fate)))?;
        Some(canvas.transform.to_screen(place).distance(pointer)).filter(|d| *d <= HOVER_REACH)
    };
    let near = corners.iter().enumerate().filter_map(|(k, corner)| Some((k, distance(corner)?)));
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// The values of a corner, one per line.
pub(crate) fn words(corner: &OdometryCorner) -> String {
    let [x, y] = corner.before_px;
    let mut lines = vec![format!("before at {x:.1}, {y:.1}")];
    if let Some([x, y]) = corner.after_px {
        lines.push(format!("matched at {x:.1}, {y:.1}"));
    }
    if let Some(range_m) = corner.range_m {
        lines.push(format!("range before {range_m:.2} m"));
    }
    if let Some(sigmas) = corner.residual_sigmas {
        lines.push(format!("residual {sigmas:.2} σ"));
    }
    lines.push(
        match corner.fate {
            Fate::Inlier => "inlier of the transform",
            Fate::Outlier => "outlier of the transform",
            Fate::Unused => "matched, but no transform was fitted",
            Fate::NoMatch => "lost: no match between the stops",
            Fate::OutOfView => "lost: outside the current image",
            Fate::NoStereoAfter => "lost: no stereo match at the current stop",
            Fate::NoStereo => "lost: no stereo match at the previous stop",
            Fate::OutOfRange => "lost: its range is beyond the limits",
        }
        .to_owned(),
    );
    lines.join("\n")
}
