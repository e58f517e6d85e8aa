//! The features on the two images: circles with the radius of their scale, and the outcome of their matching (R170).
//!
//! | mark | meaning |
//! |---|---|
//! | circle with a tick | a feature: its radius is the scale, the tick points along its orientation |
//! | dot, solid line | an inlier, and the line from its earlier pixel |
//! | cross, dashed line | an outlier, and the line from its earlier pixel |
//! | arrow | from the pixel predicted by the motion to the detected one, magnified |
//! | small dots about the target | the target's positions in the bootstrap sets |

use egui::{Color32, Stroke, vec2};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::features::rows::{Feature, Matched};

use crate::command::{Layer, Mode};
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle, paint_mark};
use crate::drawing::view2d::Canvas;
use crate::panels::legend::Entry;
use crate::state::State;
use crate::tables::MatchOutcome;
use crate::theme;

/// Half the size of the mark of a match, points: small, because many are close together.
const REACH: f32 = 4.0;
/// Largest distance of the pointer from a feature whose values are shown, points.
const HOVER_REACH: f32 = 9.0;
/// Length of the two strokes of an arrow's tip, points.
const TIP: f32 = 4.0;

/// The legend entries of the features in the left image.
pub(crate) fn left_entries(state: &State) -> Vec<Entry> {
    let mut entries = kinds(state, "features with scale and orientation");
    let matched = state.feature_evidence().and_then(|e| e.match_features.as_ref());
    if let Some(matched) = matched.filter(|_| state.features().ready().is_some()) {
        let from = format!("from step {}", matched.from_step);
        let magnified = format!("residuals × {}", state.feature_view.magnification);
        let (solid, dashed) = (Mark::Stroke(StrokeStyle::Solid), Mark::Stroke(StrokeStyle::Dashed));
        entries.extend([
            Entry::new(Layer::Flow, solid, theme::inlier(), format!("inliers {from}")),
            Entry::new(Layer::OutlierFlow, dashed, theme::outlier(), format!("outliers {from}")),
            Entry::new(Layer::Residuals, solid, theme::search(), magnified),
        ]);
    }
    if let Some(cloud) = state.cloud().ready() {
        let word = format!("bootstrap, {} sets", cloud.len());
        entries.push(Entry::new(Layer::Cloud, Mark::Dot, theme::run(state.cursor.run), word));
    }
    entries
}

/// The legend entries of the features in the right image.
pub(crate) fn right_entries(state: &State) -> Vec<Entry> {
    kinds(state, "matches of features in the other image")
}

/// The three kinds with the number shown of each.
fn kinds(state: &State, all: &str) -> Vec<Entry> {
    let Some(features) = state.features().ready() else { return Vec::new() };
    let count = |kind: MatchOutcome| state.feature_view.count(features, kind);
    let mut entries = Vec::new();
    if features.iter().any(|feature| feature.matched.is_some()) {
        let words = |kind: MatchOutcome, name: &str| format!("{name} {}", count(kind).words());
        let word = words(MatchOutcome::Inlier, "inliers");
        entries.push(Entry::new(Layer::Inliers, Mark::Dot, theme::inlier(), word));
        let word = words(MatchOutcome::Outlier, "outliers");
        entries.push(Entry::new(Layer::Outliers, Mark::Cross, theme::outlier(), word));
    }
    entries.push(Entry::new(Layer::Keypoints, Mark::Ring, theme::keypoint(), all));
    entries
}

/// The layer, mark and colour of a kind.
fn match_style(kind: MatchOutcome) -> (Layer, Mark, Color32) {
    match kind {
        MatchOutcome::Unmatched => (Layer::Keypoints, Mark::Ring, theme::keypoint()),
        MatchOutcome::Inlier => (Layer::Inliers, Mark::Dot, theme::inlier()),
        MatchOutcome::Outlier => (Layer::Outliers, Mark::Cross, theme::outlier()),
    }
}

/// Whether a feature has a mark: it passes the filters, and a layer that contains it is shown.
pub(crate) fn is_drawn(state: &State, feature: &Feature) -> bool {
    let (layer, ..) = match_style(MatchOutcome::of(feature));
    (state.shows(layer) || state.shows(Layer::Keypoints)) && state.feature_view.shows(feature)
}

/// Paints the features of the left image and the cloud of the bootstrap.
pub(crate) fn paint_left(canvas: &Canvas, state: &State) {
    let features = state.features().ready().map_or(&[][..], Vec::as_slice);
    let shown = || features.iter().filter(|feature| state.feature_view.shows(feature));
    if state.shows(Layer::Keypoints) {
        shown().for_each(|feature| keypoint(canvas, feature));
    }
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    for feature in shown() {
        let Some(matched) = &feature.matched else { continue };
        let (layer, mark, colour) = match_style(MatchOutcome::of(feature));
        let (flow, line) = if matched.is_inlier {
            (Layer::Flow, StrokeStyle::Solid)
        } else {
            (Layer::OutlierFlow, StrokeStyle::Dashed)
        };
        if state.shows(flow) {
            overlay.thin_line(&[matched.then, feature.pixel], colour, line);
        }
        if state.shows(layer) {
            if state.shows(Layer::Residuals) {
                residual(canvas, feature, matched, state.feature_view.magnification);
            }
            dot(canvas, feature.pixel, mark, colour);
        }
    }
    if let Some(cloud) = state.cloud().ready().filter(|_| state.shows(Layer::Cloud)) {
        let colour = theme::run(state.cursor.run);
        for pixel in cloud.iter().filter_map(|point| point.left_pixel) {
            paint_mark(&canvas.painter, canvas.transform.to_screen(pixel), Mark::Dot, colour, 2.0);
        }
    }
}

/// Paints the stereo matches of the features in the right image.
pub(crate) fn paint_right(canvas: &Canvas, state: &State) {
    let features = state.features().ready().map_or(&[][..], Vec::as_slice);
    for feature in features.iter().filter(|feature| is_drawn(state, feature)) {
        let (_, mark, colour) = match_style(MatchOutcome::of(feature));
        if let Some(pixel) = feature.right {
            dot(canvas, pixel, mark, colour);
        }
    }
}

fn dot(canvas: &Canvas, pixel: Pixel, mark: Mark, colour: Color32) {
    let at = canvas.transform.to_screen(pixel);
    if canvas.transform.rect.contains(at) {
        paint_mark(&canvas.painter, at, mark, colour, REACH);
    }
}

/// A circle with the radius of the scale and a tick along the orientation; fainter if the feature was not triangulated.
fn keypoint(canvas: &Canvas, feature: &Feature) {
    let at = canvas.transform.to_screen(feature.pixel);
    let radius = ((feature.sigma_px * canvas.transform.scale) as f32).max(1.5);
    if !canvas.transform.rect.expand(radius).contains(at) {
        return;
    }
    let strength = if feature.range_m.is_some() { 1.0 } else { 0.5 };
    let (sin, cos) = (feature.orientation_rad.sin() as f32, feature.orientation_rad.cos() as f32);
    for (colour, width) in [(theme::halo(), 3.0), (theme::keypoint().gamma_multiply(strength), 1.0)] {
        let stroke = Stroke::new(width, colour);
        canvas.painter.circle_stroke(at, radius, stroke);
        canvas.painter.line_segment([at, at + vec2(cos, sin) * radius], stroke);
    }
}

/// An arrow from the pixel predicted by the motion towards the detected one, magnified.
fn residual(canvas: &Canvas, feature: &Feature, matched: &Matched, magnification: f64) {
    let Some((moved, vector)) = matched.moved.zip(matched.residual_px(feature.pixel)) else { return };
    let end = moved.offset(vector.x * magnification, vector.y * magnification);
    let (line, colour) = if matched.is_inlier {
        (StrokeStyle::Solid, theme::search())
    } else {
        (StrokeStyle::Dashed, theme::outlier())
    };
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    overlay.thin_line(&[moved, end], colour, line);
    let [from, tip] = [moved, end].map(|pixel| canvas.transform.to_screen(pixel));
    let along = (from - tip).normalized() * TIP;
    for turn in [0.5_f32, -0.5] {
        let side =
            vec2(along.x * turn.cos() - along.y * turn.sin(), along.x * turn.sin() + along.y * turn.cos());
        canvas.painter.line_segment([tip, tip + side], Stroke::new(1.0, colour));
    }
}

/// Describes the feature under the pointer; `place` returns a feature's pixel on this image.
pub(crate) fn hover(canvas: &Canvas, state: &State, place: fn(&Feature) -> Option<Pixel>) {
    let Some(pointer) = canvas.response.hover_pos().filter(|_| state.mode == Mode::Look && state.marks)
    else {
        return;
    };
    let Some(features) = state.features().ready() else { return };
    let near = |feature: &Feature| {
        let at = canvas.transform.to_screen(place(feature)?);
        Some(at.distance(pointer)).filter(|distance| *distance <= HOVER_REACH)
    };
    let drawn = features.iter().filter(|feature| is_drawn(state, feature));
    let nearest = drawn.filter_map(|f| Some((f, near(f)?))).min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((feature, _)) = nearest else { return };
    if let Some(pixel) = place(feature) {
        Overlay::new(&canvas.painter, &canvas.transform).mark(pixel, Mark::Ring, theme::accent());
    }
    let from_step = state.feature_evidence().and_then(|e| Some(e.match_features.as_ref()?.from_step));
    canvas.response.clone().on_hover_text_at_pointer(words(feature, from_step));
}

/// The values of a feature, one a line.
pub(crate) fn words(feature: &Feature, from_step: Option<usize>) -> String {
    let place = |pixel: Pixel| format!("{:.1}, {:.1}", pixel.x, pixel.y);
    let mut lines = vec![
        format!("feature at {}", place(feature.pixel)),
        format!(
            "scale {:.2} px, orientation {:+.0}°",
            feature.sigma_px,
            feature.orientation_rad.to_degrees()
        ),
    ];
    lines.push(match (feature.range_m, feature.right) {
        (Some(range_m), Some(right)) => format!("range {range_m:.3} m, partner at {}", place(right)),
        _ => "no match in the other image".to_owned(),
    });
    let Some(matched) = &feature.matched else {
        lines.push("no match with the earlier stop".to_owned());
        return lines.join("\n");
    };
    let step = from_step.map_or_else(|| "earlier".to_owned(), |step| format!("at step {step}"));
    lines.push(format!("{step} at {}", place(matched.then)));
    let verdict = if matched.is_inlier { "inlier" } else { "outlier" };
    let residual = matched.residual_m.map_or_else(String::new, |m| format!("residual {:.1} mm", m * 1000.0));
    let pixels =
        matched.residual_px(feature.pixel).map_or_else(String::new, |v| format!(", {:.2} px", v.norm()));
    lines.push(format!("{residual}{pixels}: {verdict}"));
    lines.join("\n")
}
