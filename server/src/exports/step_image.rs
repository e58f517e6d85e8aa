//! The target in the left image of a step, with the predicted, found and true position, and the tracking state as text.
//!
//! | mark | meaning |
//! |---|---|
//! | blue square with cross, and ellipse | the found window and its 3σ |
//! | sky ring, and dotted ellipse | the prediction and its 3σ gate |
//! | white plus | the ground truth |
//! Colours are those of Okabe and Ito, the same as in the viewer and in recordings.

use nalgebra::{Matrix2, SymmetricEigen, Vector2};
use sightline_geometry::frames::Pixel;
use sightline_record::Unit;
use sightline_session::marks::{Mark, MarkName, Shape, marks, square};
use sightline_session::records;
use sightline_session::step::{RunStep, StepRow};
use sightline_track::settings::Settings;
use sightline_track::target::TrackingState;
use sightline_vision::image::GrayImage;

use super::canvas::{Canvas, LineStyle, Rgb, Window};
use super::source::target_pixel;

/// Side of the visible part, px of the image.
const SIDE_PX: f64 = 160.0;
/// Side of the drawn image, px.
pub(super) const IMAGE_PX: u32 = 320;
/// Height of the text above and below, px.
const HEAD_PX: u32 = 22;
const FOOT_PX: u32 = 42;

pub(super) const PAPER: Rgb = [0xff, 0xff, 0xff];
pub(super) const INK: Rgb = [0x22, 0x22, 0x22];
const TRACKING: Rgb = [0x00, 0x9e, 0x73];
const LOST: Rgb = [0xe6, 0x9f, 0x00];
const FAILED: Rgb = [0xd5, 0x5e, 0x00];
const CLEARED: Rgb = [0x99, 0x99, 0x99];
const PREDICTION: Rgb = [0x56, 0xb4, 0xe9];
const MEASUREMENT: Rgb = [0x2f, 0x8f, 0xd0];
const TRUTH: Rgb = [0xff, 0xff, 0xff];

/// Explains the marks in text, for readers who cannot see the image or have no legend.
pub(crate) const LEGEND: &str = "Blue square: where it was found, with its 3σ ellipse. Sky blue ring: the prediction, with its 3σ gate dotted. \
                          White plus: the truth, where it is known.";

/// Width and height of the image with its text, px.
pub(super) fn size(has_head: bool) -> [u32; 2] {
    [IMAGE_PX, IMAGE_PX + FOOT_PX + if has_head { HEAD_PX } else { 0 }]
}

/// Width and height without a heading, px.
pub(crate) fn plain_size() -> [u32; 2] {
    size(false)
}

/// Draws the image of a step as PNG.
///
/// # Errors
/// The message of the encoder.
pub(crate) fn png(trace: &RunStep, left: Option<&GrayImage>, settings: &Settings) -> Result<Vec<u8>, String> {
    draw(trace, left, settings, None).ok_or("a picture without pixels")?.png()
}

/// Draws the image of a step with an optional heading `head`; a chequerboard without the left image.
pub(super) fn draw(
    trace: &RunStep,
    left: Option<&GrayImage>,
    settings: &Settings,
    head: Option<&str>,
) -> Option<Canvas> {
    let [width, height] = size(head.is_some());
    let mut canvas = Canvas::new(width, height, PAPER)?;
    let top = if head.is_some() { HEAD_PX } else { 0 };
    if let Some(words) = head {
        canvas.text([6.0, 4.0], 13.0, width as f32 - 12.0, INK, words);
    }
    let empty = GrayImage::default();
    let image = left.unwrap_or(&empty);
    let centre = target_pixel(trace).unwrap_or_else(|| {
        Pixel::new(f64::from(image.width()) / 2.0 - 0.5, f64::from(image.height()) / 2.0 - 0.5)
    });
    let window = Window {
        origin: [centre.x + 0.5 - SIDE_PX / 2.0, centre.y + 0.5 - SIDE_PX / 2.0],
        scale: f64::from(IMAGE_PX) / SIDE_PX,
        at: [0.0, f64::from(top)],
        size: [IMAGE_PX; 2],
    };
    canvas.image(image, &window);
    paint_marks(&mut canvas, trace, &window, settings);
    // Drawn after the marks, to cover any that extend beyond the image.
    if let Some(words) = head {
        canvas.fill([0.0, 0.0], [width as f32, top as f32], PAPER);
        canvas.text([6.0, 4.0], 13.0, width as f32 - 12.0, INK, words);
    }
    foot(&mut canvas, trace, (top + IMAGE_PX) as f32);
    Some(canvas)
}

fn paint_marks(canvas: &mut Canvas, trace: &RunStep, window: &Window, settings: &Settings) {
    let side_px = settings.template.template_size_px;
    for Mark { name, shape } in marks(trace, side_px) {
        match (name, shape) {
            (MarkName::PredictedLeft, Shape::Point(pixel)) => {
                canvas.line(&ring(window, pixel, 2.5), true, PREDICTION, LineStyle::Solid);
            }
            (MarkName::PredictionGate, Shape::Ellipse { centre, covariance_px2, sigmas }) => {
                let contours = sigmas.iter().filter_map(|s| ellipse(window, centre, &covariance_px2, *s));
                contours.for_each(|points| canvas.line(&points, true, PREDICTION, LineStyle::Dotted));
            }
            (MarkName::LocatedLeft, Shape::Point(pixel)) => {
                let corners = square(pixel, side_px, &Matrix2::identity());
                let corners = corners.map(|corner| window.to_canvas(corner.x, corner.y));
                canvas.line(&corners, true, MEASUREMENT, LineStyle::Solid);
                for stroke in cross(window, pixel, 2.0) {
                    canvas.line(&stroke, false, MEASUREMENT, LineStyle::Solid);
                }
            }
            (MarkName::LocatedError, Shape::Ellipse { centre, covariance_px2, sigmas }) => {
                let contours = sigmas.iter().filter_map(|s| ellipse(window, centre, &covariance_px2, *s));
                contours.for_each(|points| canvas.line(&points, true, MEASUREMENT, LineStyle::Solid));
            }
            (MarkName::TrueLeft, Shape::Point(pixel)) => {
                let [x, y] = window.to_canvas(pixel.x, pixel.y);
                canvas.line(&[[x - 8.0, y], [x + 8.0, y]], false, TRUTH, LineStyle::Solid);
                canvas.line(&[[x, y - 8.0], [x, y + 8.0]], false, TRUTH, LineStyle::Solid);
            }
            _ => {}
        }
    }
}

fn foot(canvas: &mut Canvas, trace: &RunStep, top: f32) {
    let [width, height] = canvas.size();
    canvas.fill([0.0, top], [width as f32, height as f32 - top], PAPER);
    canvas.fill([0.0, top], [8.0, height as f32 - top], state_colour(trace.update.state));
    let row = trace.row();
    let first = format!("step {}  {}", row.step, state_words(trace));
    canvas.text([16.0, top + 4.0], 14.0, width as f32 - 22.0, INK, &first);
    canvas.text([16.0, top + 23.0], 11.0, width as f32 - 20.0, INK, &numbers(&row));
}

/// The state in capitals, with the number of failed updates if lost.
pub(crate) fn state_words(trace: &RunStep) -> String {
    match trace.update.state {
        TrackingState::Lost { count } => format!("LOST {count}"),
        other => other.word().to_uppercase(),
    }
}

/// The row columns printed below an image, each with its display unit and number of digits.
const COLUMNS: [(&str, Unit, usize); 5] = [
    ("ncc", Unit::One, 2),
    ("inliers", Unit::One, 0),
    ("err_px", Unit::Pixel, 2),
    ("sigma_m", Unit::Centimetre, 1),
    ("range_m", Unit::Metre, 2),
];

/// The main numbers of a step, with units.
pub(crate) fn numbers(row: &StepRow) -> String {
    let words = |(name, unit, digits): &(&str, Unit, usize)| {
        let value = records::row_value_in(row, name, *unit)?;
        let label = &records::row_quantity(name)?.label;
        Some(format!("{label} {value:.digits$} {}", unit.symbol()).trim_end().to_owned())
    };
    let known: Vec<String> = COLUMNS.iter().filter_map(words).collect();
    if known.is_empty() { "nothing was measured".to_owned() } else { known.join(" · ") }
}

/// The colour of a tracking state.
pub(super) fn state_colour(state: TrackingState) -> Rgb {
    match state {
        TrackingState::Cleared => CLEARED,
        TrackingState::Tracking => TRACKING,
        TrackingState::Lost { .. } => LOST,
        TrackingState::Failed => FAILED,
    }
}

fn ring(window: &Window, at: Pixel, radius_px: f64) -> Vec<[f32; 2]> {
    around(|x, y| window.to_canvas(at.x + radius_px * x, at.y + radius_px * y))
}

fn ellipse(window: &Window, at: Pixel, covariance_px2: &Matrix2<f64>, sigmas: f64) -> Option<Vec<[f32; 2]>> {
    if !covariance_px2.iter().all(|v| v.is_finite()) || covariance_px2.trace() <= 0.0 {
        return None;
    }
    let eigen = SymmetricEigen::new(*covariance_px2);
    let lengths = eigen.eigenvalues.map(|v| v.max(0.0).sqrt() * sigmas);
    let axes = eigen.eigenvectors * Matrix2::from_diagonal(&lengths);
    Some(around(|x, y| {
        let offset = axes * Vector2::new(x, y);
        window.to_canvas(at.x + offset.x, at.y + offset.y)
    }))
}

fn around(to_canvas: impl Fn(f64, f64) -> [f32; 2]) -> Vec<[f32; 2]> {
    const POINTS: u32 = 64;
    let angle = |k: u32| f64::from(k) / f64::from(POINTS) * std::f64::consts::TAU;
    (0..POINTS).map(|k| to_canvas(angle(k).cos(), angle(k).sin())).collect()
}

fn cross(window: &Window, at: Pixel, arm_px: f64) -> [[[f32; 2]; 2]; 2] {
    let stroke =
        |x: f64, y: f64| [window.to_canvas(at.x - x, at.y - y), window.to_canvas(at.x + x, at.y + y)];
    [stroke(arm_px, arm_px), stroke(arm_px, -arm_px)]
}
