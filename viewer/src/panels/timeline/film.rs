//! The filmstrip of the timeline: the matched windows of the run, each above its step; for long drives only every n-th
//! step.

use egui::{Painter, Rect, StrokeKind, pos2, vec2};
use sightline_session::step::StepRow;
use sightline_session::view::RunView;

use crate::cache::Slot;
use crate::panels::timeline::lod::Scale;
use crate::state::State;
use crate::theme;

/// Height of the filmstrip, points; its windows are square.
pub(super) const FILM: f32 = 25.0;

/// Maximum number of windows.
const WINDOWS: usize = 48;

/// The rows whose windows the filmstrip shows: every n-th step, such that at most `WINDOWS` are loaded.
pub(crate) fn rows<'a>(state: &State, run: &'a RunView) -> impl Iterator<Item = &'a StepRow> {
    let every = state.stop_count().div_ceil(WINDOWS).max(1);
    run.rows.iter().filter(move |row| row.step % every == 0)
}

/// Paints the loaded windows, as many as fit side by side; the window of the current step has an accented frame.
pub(super) fn paint(painter: &Painter, strip: Rect, state: &State, scale: &Scale) {
    let Some(run) = state.run() else { return };
    let side = strip.height() - 2.0;
    let mut free_from = strip.left();
    for row in rows(state, run) {
        let middle = scale.middle_of(row.step).clamp(strip.left() + side / 2.0, strip.right() - side / 2.0);
        if middle - side / 2.0 < free_from {
            continue;
        }
        let Some(Slot::Ready(raster)) = state.window_key(run, row).map(|key| state.cache.raster(&key)) else {
            continue;
        };
        let frame = Rect::from_center_size(pos2(middle, strip.center().y), vec2(side, side));
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(raster.texture.id(), frame, whole, theme::UNTINTED);
        let is_here = row.step == state.cursor.step;
        let border = if is_here { theme::accent() } else { theme::state(crate::state::state_of(row)) };
        painter.rect_stroke(frame, 0.0, egui::Stroke::new(1.0, border), StrokeKind::Outside);
        free_from = frame.right() + 2.0;
    }
}
