//! Marks on and above the state bands: events, breakpoint hits, the loop, the playhead, and step numbers.

use egui::{Align2, Painter, Rect, Shape, Stroke, pos2, vec2};

use crate::breakpoints::BreakpointState;
use crate::breakpoints::panel::mark;
use crate::drawing::overlay::paint_mark;
use crate::panels::timeline::lod::Scale;
use crate::state::{State, events};
use crate::theme;

/// Height of the lane above the bands, points.
pub(super) const LANE: f32 = 16.0;
/// Height of the step numbers, points.
pub(super) const NUMBERS: f32 = 15.0;
/// Width of a breakpoint's mark, points: nearer hits share one.
const MARK: f32 = 9.0;
/// Minimum distance of two event ticks, points.
const TICK: f32 = 3.0;

/// A position in the lane with breakpoint hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The first of its steps.
    pub step: usize,
    /// Number of hits at this position.
    pub count: usize,
    /// Index of the breakpoint in the list; `None` if several share the position.
    pub only: Option<usize>,
}

/// The hits of all breakpoints in the selected run, merged to the distance that their marks need.
pub(crate) fn hits(state: &State, scale: &Scale) -> Vec<Hit> {
    let Some(target) = state.cursor.target else { return Vec::new() };
    let mut places: Vec<Hit> = Vec::new();
    for (at, breakpoint) in state.breakpoints.watched() {
        let steps = BreakpointState::hits(breakpoint, target, state.cursor.run).iter().copied();
        places.extend(scale.thinned(steps, MARK).into_iter().map(|(step, count)| Hit {
            step,
            count,
            only: Some(at),
        }));
    }
    places.sort_by_key(|hit| hit.step);
    let mut joined: Vec<Hit> = Vec::new();
    for hit in places {
        match joined.last_mut() {
            Some(last) if scale.middle_of(hit.step) - scale.middle_of(last.step) < MARK => {
                last.count += hit.count;
                last.only = last.only.filter(|at| Some(*at) == hit.only);
            }
            _ => joined.push(hit),
        }
    }
    joined
}

/// Paints the step under the pointer, here or in another panel.
pub(crate) fn hovered(painter: &Painter, all: Rect, step: usize, scale: &Scale) {
    let x = scale.middle_of(step);
    let ends = [pos2(x, all.top()), pos2(x, all.bottom())];
    painter.extend(Shape::dotted_line(&ends, theme::accent(), 4.0, 1.0));
}

/// Paints the lane above the bands: event ticks, and breakpoint marks with a number if a mark represents several hits.
pub(crate) fn lane(painter: &Painter, lane: Rect, state: &State, scale: &Scale) {
    painter.hline(lane.x_range(), lane.bottom() - 0.5, Stroke::new(1.0, theme::line()));
    let events = state.run().map(events).unwrap_or_default();
    for (event, _) in scale.thinned(events, TICK) {
        painter.vline(
            scale.left_of(event),
            lane.bottom() - 6.0..=lane.bottom(),
            Stroke::new(2.0, theme::strong()),
        );
    }
    for hit in hits(state, scale) {
        let at = pos2(scale.middle_of(hit.step), lane.top() + 6.0);
        match hit.only {
            Some(at_list) => {
                let (shape, colour) = mark(at_list);
                paint_mark(painter, at, shape, colour, 4.0);
            }
            None => {
                painter.circle_filled(at, 4.5, theme::strong());
            }
        }
        if hit.count > 1 {
            let words = if hit.count > 99 { "+".to_owned() } else { hit.count.to_string() };
            painter.text(at + vec2(5.0, 0.0), Align2::LEFT_CENTER, words, theme::digit_font(), theme::text());
        }
    }
}

/// Paints the loop: steps outside are shaded, its ends are brackets.
pub(crate) fn loop_range(painter: &Painter, bands: Rect, state: &State, scale: &Scale, count: usize) {
    let play = &state.breakpoints.play;
    if play.loop_in.is_none() && play.loop_out.is_none() {
        return;
    }
    let from = scale.left_of(play.loop_in.unwrap_or(0));
    let to = scale.left_of(play.loop_out.map_or(count, |out| out + 1));
    for outside in [bands.with_max_x(from), bands.with_min_x(to)] {
        painter.rect_filled(outside, 0.0, theme::shade());
    }
    for (x, inwards) in [(from, 4.0), (to, -4.0)] {
        let stroke = Stroke::new(2.0, theme::accent());
        painter.vline(x, bands.y_range(), stroke);
        for y in [bands.top() + 1.0, bands.bottom() - 1.0] {
            painter.line_segment([pos2(x, y), pos2(x + inwards, y)], stroke);
        }
    }
}

/// Paints the playhead: an outline if the step is wide, else a line; with a triangle above.
pub(crate) fn playhead(painter: &Painter, bands: Rect, step: usize, scale: &Scale) {
    let stroke = Stroke::new(2.0, theme::accent());
    let frame = Rect::from_x_y_ranges(scale.left_of(step)..=scale.left_of(step + 1), bands.y_range());
    if frame.width() > 6.0 {
        painter.rect_stroke(frame.expand2(vec2(0.0, 1.0)), 2.0, stroke, egui::StrokeKind::Outside);
    } else {
        painter.vline(frame.center().x, bands.y_range(), stroke);
    }
    let tip = pos2(frame.center().x, bands.top() - 1.0);
    let triangle = vec![tip, tip + vec2(-5.0, -7.0), tip + vec2(5.0, -7.0)];
    painter.add(Shape::convex_polygon(triangle, theme::accent(), Stroke::NONE));
}

/// Paints step numbers below the bands, as many as fit.
pub(crate) fn numbers(painter: &Painter, below: Rect, count: usize, scale: &Scale) {
    let room = |n: usize| n as f32 * scale.step_width() >= 34.0;
    let rounds = (0..9).flat_map(|power| [1, 2, 5].map(|n| n * 10_usize.pow(power)));
    let every = rounds.into_iter().find(|n| room(*n)).unwrap_or(count.max(1));
    for step in (0..count).step_by(every) {
        let at = pos2(scale.middle_of(step), below.top() + (NUMBERS - 11.0) / 2.0);
        painter.text(at, Align2::CENTER_TOP, step.to_string(), theme::digit_font(), theme::weak());
    }
}

/// A line under the steps whose images are rendered.
pub(crate) fn rendered(painter: &Painter, y: f32, scale: &Scale, is_ready: impl Fn(usize) -> bool) {
    use crate::panels::timeline::Cell;
    let ready = |step: usize| if is_ready(step) { Cell::Before } else { Cell::Unknown };
    for span in scale.spans(ready).into_iter().filter(|span| span.cell == Cell::Before) {
        let x = scale.left_of(span.from)..=scale.left_of(span.to);
        painter.hline(x, y, Stroke::new(2.0, theme::unknown()));
    }
}

/// A faint mark in the lane at the step under the pointer.
pub(crate) fn lane_hint(painter: &Painter, lane: Rect, x: f32) {
    let at = pos2(x, lane.top() + LANE / 2.0 - 2.0);
    painter.circle_stroke(at, 4.0, Stroke::new(1.5, theme::weak()));
}
