//! The timeline: one cell a stop, its state by colour, pattern and word; a click goes there.

use egui::{Align2, Painter, Rect, Sense, Stroke, Ui, pos2, vec2};

use crate::command::{Command, Go};
use crate::state::{State, events};
use crate::theme;

/// Height of the cells, points.
const BAND: f32 = 20.0;
/// Height of the whole timeline, points.
pub const HEIGHT: f32 = 46.0;

/// What a cell shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cell {
    /// Before the target was picked, or without a target.
    Before,
    /// Not computed yet.
    Unknown,
    /// State `tracking`.
    Tracking,
    /// State `lost`.
    Lost,
    /// State `failed`.
    Failed,
    /// The stop's files are damaged.
    Fault,
}

impl Cell {
    /// The word for tooltips.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Before => "before the pick",
            Self::Unknown => "not computed yet",
            Self::Tracking => "tracking",
            Self::Lost => "lost",
            Self::Failed => "failed",
            Self::Fault => "fault of the files",
        }
    }
}

/// The cell of a stop.
pub fn cell(state: &State, step: usize) -> Cell {
    let Some(target) = state.target() else { return Cell::Before };
    if step < target.designation.step {
        return Cell::Before;
    }
    match state.row_at(step) {
        None => Cell::Unknown,
        Some(row) if row.fault => Cell::Fault,
        Some(row) => match row.state.as_str() {
            "tracking" => Cell::Tracking,
            "lost" => Cell::Lost,
            "failed" => Cell::Failed,
            _ => Cell::Unknown,
        },
    }
}

/// Shows the timeline.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let count = state.stop_count();
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let painter = ui.painter_at(rect);
    if count == 0 {
        painter.text(
            rect.center(),
            Align2::CENTER_CENTER,
            state.missing_target(),
            theme::image_font(),
            theme::weak(),
        );
        return;
    }
    let width = rect.width() / count as f32;
    let frame = |step: usize| {
        let left = rect.left() + width * step as f32;
        let gap = if width > 6.0 { 1.0 } else { 0.0 };
        Rect::from_min_max(
            pos2(left + gap, rect.top() + 8.0),
            pos2(left + width - gap, rect.top() + 8.0 + BAND),
        )
    };
    for step in 0..count {
        paint_cell(&painter, frame(step), cell(state, step));
        let is_rendered = state.traverse.as_ref().is_some_and(|t| t.stops[step].ready);
        if is_rendered {
            let bottom = frame(step).bottom() + 2.0;
            painter.hline(frame(step).x_range(), bottom, Stroke::new(2.0, theme::unknown()));
        }
    }
    paint_numbers(&painter, count, width, frame);
    paint_words(&painter, state, count, width, frame);
    for event in state.run().map(events).unwrap_or_default() {
        let top = frame(event).left_top() - vec2(0.0, 6.0);
        painter.vline(top.x, top.y..=top.y + 6.0, Stroke::new(2.0, theme::strong()));
    }
    paint_cursor(&painter, frame(state.cursor.step.min(count - 1)));
    let at = |x: f32| (((x - rect.left()) / width).max(0.0) as usize).min(count - 1);
    if let Some(pointer) =
        response.interact_pointer_pos().filter(|_| response.clicked() || response.dragged())
    {
        let step = at(pointer.x);
        if step != state.cursor.step {
            out.push(Command::Go(Go::Step(step)));
        }
    }
    if let Some(pointer) = response.hover_pos() {
        response.on_hover_text_at_pointer(words(state, at(pointer.x)));
    }
}

/// What a stop is, in words.
fn words(state: &State, step: usize) -> String {
    let mut words = format!("step {step}: {}", cell(state, step).word());
    if let Some(row) = state.row_at(step) {
        if let Some(ncc) = row.ncc {
            words += &format!("\nncc {ncc:.2}");
        }
        if let Some(inliers) = row.inliers {
            words += &format!("\n{inliers} inliers");
        }
        if let Some(err_px) = row.err_px {
            words += &format!(", err {err_px:.2} px");
        }
        if let Some(reason) = &row.reason {
            words += &format!("\n{reason}");
        }
    }
    if !state.traverse.as_ref().is_some_and(|t| t.stops.get(step).is_some_and(|s| s.ready)) {
        words += "\nits images are not rendered yet";
    }
    words
}

fn paint_cell(painter: &Painter, frame: Rect, cell: Cell) {
    let fill = |colour: egui::Color32, strength: f32| {
        painter.rect_filled(frame, 1.0, colour.gamma_multiply(strength));
    };
    match cell {
        Cell::Before => fill(theme::before(), 1.0),
        Cell::Unknown => fill(theme::unknown(), 1.0),
        Cell::Tracking => fill(theme::tracking(), 1.0),
        Cell::Lost => {
            fill(theme::lost(), 0.25);
            dashes(painter, frame, theme::lost());
        }
        Cell::Failed => {
            fill(theme::failed(), 0.3);
            hatch(painter, frame, theme::failed());
        }
        Cell::Fault => {
            fill(theme::unknown(), 1.0);
            hatch(painter, frame, theme::weak());
            cross(painter, frame, theme::failed());
        }
    }
}

/// Three dashed rows.
fn dashes(painter: &Painter, frame: Rect, colour: egui::Color32) {
    for i in 0..3 {
        let y = frame.top() + frame.height() * (i as f32 + 0.5) / 3.0;
        let ends = [pos2(frame.left() + 1.0, y), pos2(frame.right() - 1.0, y)];
        painter.extend(egui::Shape::dashed_line(&ends, Stroke::new(3.0, colour), 6.0, 4.0));
    }
}

/// Slanted lines.
fn hatch(painter: &Painter, frame: Rect, colour: egui::Color32) {
    let inside = painter.with_clip_rect(frame.intersect(painter.clip_rect()));
    let mut x = frame.left() - frame.height();
    while x < frame.right() {
        let ends = [pos2(x, frame.bottom()), pos2(x + frame.height(), frame.top())];
        inside.line_segment(ends, Stroke::new(1.5, colour));
        x += 6.0;
    }
}

fn cross(painter: &Painter, frame: Rect, colour: egui::Color32) {
    let (middle, reach) = (frame.center(), (frame.height() / 2.0 - 3.0).min(frame.width() / 2.0));
    for sign in [-1.0, 1.0] {
        let way = vec2(reach, reach * sign);
        painter.line_segment([middle - way, middle + way], Stroke::new(2.0, colour));
    }
}

/// Step numbers below the cells, as many as fit.
fn paint_numbers(painter: &Painter, count: usize, width: f32, frame: impl Fn(usize) -> Rect) {
    let every = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].into_iter().find(|&n| n as f32 * width >= 26.0);
    let every = every.unwrap_or(5000);
    for step in (0..count).step_by(every) {
        let at = frame(step).center_bottom() + vec2(0.0, 5.0);
        painter.text(at, Align2::CENTER_TOP, step.to_string(), theme::digit_font(), theme::weak());
    }
}

/// The word of each stretch of equal cells at its beginning, where it fits.
fn paint_words(painter: &Painter, state: &State, count: usize, width: f32, frame: impl Fn(usize) -> Rect) {
    let cells: Vec<Cell> = (0..count).map(|step| cell(state, step)).collect();
    let mut step = 0;
    for stretch in cells.chunk_by(|a, b| a == b) {
        let (cell, first) = (stretch[0], frame(step));
        step += stretch.len();
        let room = width * stretch.len() as f32;
        let galley = painter.layout_no_wrap(cell.word().to_owned(), theme::image_font(), theme::strong());
        if galley.size().x + 16.0 > room || state.target().is_none() {
            continue;
        }
        let at = first.left_center() + vec2(7.0, -galley.size().y / 2.0);
        painter.rect_filled(
            Rect::from_min_size(at, galley.size()).expand2(vec2(4.0, 0.0)),
            2.0,
            theme::scrim(),
        );
        painter.galley(at, galley, theme::strong());
    }
}

fn paint_cursor(painter: &Painter, frame: Rect) {
    let outline = frame.expand2(vec2(1.0, 2.0));
    painter.rect_stroke(outline, 2.0, Stroke::new(2.0, theme::accent()), egui::StrokeKind::Outside);
    let tip = frame.center_top() - vec2(0.0, 1.0);
    let triangle = vec![tip, tip + vec2(-5.0, -7.0), tip + vec2(5.0, -7.0)];
    painter.add(egui::Shape::convex_polygon(triangle, theme::accent(), Stroke::NONE));
}
