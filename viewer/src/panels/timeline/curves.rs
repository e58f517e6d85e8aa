//! Two curves of the timeline: match score or confidence, and the error of the target, by step.
//!
//! They are drawn by columns, each of which shows its worst step.

use egui::{Align2, Painter, Pos2, Rect, Stroke, pos2, vec2};
use sightline_session::step::StepRow;
use sightline_session::view::RunView;

use crate::panels::timeline::lod::Scale;
use crate::state::State;
use crate::theme;

/// Height of a curve's lane, points.
const LANE: f32 = 14.0;
/// Space below a lane, points.
const GAP: f32 = 1.0;
/// Height of all curves, points.
pub(super) const HEIGHT: f32 = 2.0 * (LANE + GAP);

/// The value of a curve at a step.
type Value = fn(&StepRow) -> Option<f64>;

/// One curve: its name, its value at a step, and the values at the bottom and top of its lane.
struct Curve {
    name: String,
    value: Value,
    span: [f64; 2],
    /// Whether smaller values are worse.
    is_low_bad: bool,
}

/// The curves of a run: the match score, or the confidence without one; the error, or 1σ without a ground truth.
fn curves(run: &RunView) -> [Curve; 2] {
    let has = |value: Value| run.rows.iter().any(|row| value(row).is_some());
    let score = if has(|row| row.ncc) {
        Curve { name: "ncc".to_owned(), value: |row| row.ncc, span: [0.0, 1.0], is_low_bad: true }
    } else {
        let value: Value = |row| row.confidence;
        Curve { name: "confidence".to_owned(), value, span: [0.0, 1.0], is_low_bad: true }
    };
    let ([name, unit], value): ([&str; 2], Value) = if has(|row| row.err_px) {
        (["err", "px"], |row| row.err_px)
    } else {
        (["1σ", "cm"], |row| row.sigma_m.map(|sigma| 100.0 * sigma))
    };
    let largest = run.rows.iter().filter_map(value).fold(0.0, f64::max);
    let decimals = usize::from(largest < 10.0);
    let name = format!("{name} ≤ {largest:.decimals$} {unit}");
    [score, Curve { name, value, span: [0.0, largest.max(1e-9)], is_low_bad: false }]
}

/// Paints the curves downwards from `top`.
pub(super) fn paint(painter: &Painter, drive: Rect, top: f32, gutter: f32, state: &State, scale: &Scale) {
    let Some(run) = state.run() else { return };
    for (number, curve) in curves(run).iter().enumerate() {
        let top = top + (LANE + GAP) * number as f32;
        let lane = drive.with_min_y(top).with_max_y(top + LANE);
        painter.rect_filled(lane, 0.0, theme::well());
        let name =
            painter.with_clip_rect(lane.with_min_x(drive.left() - gutter).with_max_x(drive.left() - 4.0));
        let at = lane.left_center() - vec2(6.0, 0.0);
        name.text(at, Align2::RIGHT_CENTER, &curve.name, theme::image_font(), theme::weak());
        for polyline in polylines(run, curve, lane, scale) {
            if let [point] = polyline[..] {
                painter.circle_filled(point, 1.5, theme::run(run.number));
            } else {
                painter.line(polyline, Stroke::new(1.3, theme::run(run.number)));
            }
        }
    }
}

/// The points of a curve, split at steps without a value.
fn polylines(run: &RunView, curve: &Curve, lane: Rect, scale: &Scale) -> Vec<Vec<Pos2>> {
    let [low, high] = curve.span;
    let height = |value: f64| {
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0) as f32;
        lane.bottom() - 1.5 - share * (lane.height() - 3.0)
    };
    let mut polylines: Vec<Vec<Pos2>> = Vec::new();
    let mut last: Option<usize> = None;
    for row in &run.rows {
        let Some(value) = (curve.value)(row) else { continue };
        let point = pos2(scale.middle_of(row.step), height(value));
        let is_next = last.is_some_and(|step| step + 1 == row.step);
        last = Some(row.step);
        match polylines.last_mut() {
            Some(polyline) if is_next => match polyline.last_mut() {
                Some(end) if point.x - end.x < super::lod::COLUMN => {
                    // Several steps in a column: keep the worst value.
                    end.y = if curve.is_low_bad { end.y.max(point.y) } else { end.y.min(point.y) };
                }
                _ => polyline.push(point),
            },
            _ => polylines.push(vec![point]),
        }
    }
    polylines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    #[test]
    fn a_curve_has_a_gap_where_steps_have_no_value_and_no_more_points_than_columns() {
        let state = fixture::at_step(&egui::Context::default(), 2);
        let mut run = state.run().unwrap().clone();
        let row = run.rows[1].clone();
        run.rows = (0..4000)
            .map(|step| StepRow { step, ncc: (step != 2000).then_some(0.9), ..row.clone() })
            .collect();
        run.rows[3001].ncc = Some(0.1);
        let lane = Rect::from_min_size(Pos2::ZERO, vec2(400.0, 14.0));
        let polylines = polylines(&run, &curves(&run)[0], lane, &Scale::new(lane.x_range(), 4000));
        assert_eq!(polylines.len(), 2);
        assert!(polylines.iter().map(Vec::len).sum::<usize>() <= 202);
        let lowest = polylines[1].iter().map(|point| point.y).fold(0.0, f32::max);
        assert!(lowest > 10.0, "the one poor step in its column shows: {lowest}");
    }
}
