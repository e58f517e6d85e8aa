//! The cells of a state band: the state of a stop by colour, pattern and word.

use egui::{Color32, Painter, Rect, Shape, Stroke, pos2, vec2};
use sightline_session::view::{RunView, TargetView};

use crate::state::{State, row_of};
use crate::theme;

/// The state of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cell {
    /// Before the target was picked, or without a target.
    Before,
    /// Not computed yet.
    Unknown,
    /// Visual odometry ran alone: the tracker did not look for the target.
    NotSearched,
    /// State `tracking`.
    Tracking,
    /// State `tracking`, but the truth is beyond its tolerance.
    FalseTracking,
    /// State `lost`.
    Lost,
    /// State `failed`.
    Failed,
    /// The stop's files are damaged.
    Fault,
}

impl Cell {
    /// The word for tooltips.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Before => "before the pick",
            Self::Unknown => "not computed yet",
            Self::NotSearched => "not searched: visual odometry alone",
            Self::Tracking => "tracking",
            Self::FalseTracking => "false tracking",
            Self::Lost => "lost",
            Self::Failed => "failed",
            Self::Fault => "fault of the files",
        }
    }

    /// Severity: of the steps in one column the most severe is shown.
    pub(crate) const fn weight(self) -> u8 {
        match self {
            Self::Before => 0,
            Self::Unknown => 1,
            Self::NotSearched => 2,
            Self::Tracking => 3,
            Self::Fault => 4,
            Self::FalseTracking => 5,
            Self::Lost => 6,
            Self::Failed => 7,
        }
    }
}

/// The cell of a stop in the selected run.
pub(crate) fn cell(state: &State, step: usize) -> Cell {
    state.target().map_or(Cell::Before, |target| cell_of(target, state.run(), step))
}

/// The cell of a stop in a run.
pub(crate) fn cell_of(target: &TargetView, run: Option<&RunView>, step: usize) -> Cell {
    if step < target.designation.step {
        return Cell::Before;
    }
    match run.and_then(|run| row_of(run, step)) {
        None => Cell::Unknown,
        Some(row) if row.fault => Cell::Fault,
        Some(row) if row.not_searched => Cell::NotSearched,
        Some(row) if row.state == "tracking" && row.tracked == Some(false) => Cell::FalseTracking,
        Some(row) => match row.state.as_str() {
            "tracking" => Cell::Tracking,
            "lost" => Cell::Lost,
            "failed" => Cell::Failed,
            _ => Cell::Unknown,
        },
    }
}

/// Paints a span of equal cells.
pub(crate) fn paint(painter: &Painter, frame: Rect, cell: Cell) {
    let fill = |colour: Color32, strength: f32| {
        painter.rect_filled(frame, 1.0, colour.gamma_multiply(strength));
    };
    match cell {
        Cell::Before => fill(theme::before(), 1.0),
        Cell::Unknown => fill(theme::unknown(), 1.0),
        Cell::NotSearched => {
            fill(theme::unknown(), 1.0);
            painter.hline(frame.x_range(), frame.center().y, Stroke::new(1.0, theme::tracking()));
        }
        Cell::Tracking => fill(theme::tracking(), 1.0),
        Cell::FalseTracking => {
            fill(theme::tracking(), 1.0);
            cross(painter, frame, theme::strong());
        }
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

/// Dashed rows: three on a high band, one on a thin one.
fn dashes(painter: &Painter, frame: Rect, colour: Color32) {
    let rows = if frame.height() > 14.0 { 3 } else { 1 };
    for i in 0..rows {
        let y = frame.top() + frame.height() * (i as f32 + 0.5) / rows as f32;
        if frame.width() < 8.0 {
            // Too short for a dash and its gap.
            painter.hline(frame.x_range(), y, Stroke::new(3.0, colour));
            continue;
        }
        let ends = [pos2(frame.left() + 1.0, y), pos2(frame.right() - 1.0, y)];
        painter.extend(Shape::dashed_line(&ends, Stroke::new(3.0, colour), 6.0, 4.0));
    }
}

/// Slanted lines.
fn hatch(painter: &Painter, frame: Rect, colour: Color32) {
    let inside = painter.with_clip_rect(frame.intersect(painter.clip_rect()));
    let slant = frame.height();
    // Lines are on a common grid, so that many short spans have no more of them than one long span.
    let first = ((frame.left() - slant) / 6.0).ceil() as i32;
    let last = (frame.right() / 6.0).floor() as i32;
    let crossing = (first..=last).filter(|line| frame.width() >= 6.0 || *line == last);
    for line in crossing {
        let x = line as f32 * 6.0;
        let ends = [pos2(x, frame.bottom()), pos2(x + slant, frame.top())];
        inside.line_segment(ends, Stroke::new(1.5, colour));
    }
}

fn cross(painter: &Painter, frame: Rect, colour: Color32) {
    let (middle, reach) = (frame.center(), (frame.height() / 2.0 - 3.0).min(frame.width() / 2.0));
    for sign in [-1.0, 1.0] {
        let way = vec2(reach, reach * sign);
        painter.line_segment([middle - way, middle + way], Stroke::new(2.0, colour));
    }
}
