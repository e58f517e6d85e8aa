//! Marks of the notes on the timeline and on the left image.

use egui::{Painter, Rect, Stroke, StrokeKind, pos2, vec2};

use crate::drawing::overlay::paint_words;
use crate::drawing::view2d::Canvas;
use crate::panels::timeline::lod::Scale;
use crate::state::State;
use crate::theme;

/// Side of a mark, points.
const SIDE: f32 = 6.0;
/// Minimum distance of two marks on the timeline, points.
const APART: f32 = 7.0;
/// Maximum length of a note in a tooltip, characters.
const LETTERS: usize = 60;

/// Paints the steps with notes in the lane above the state bands.
pub(crate) fn timeline(painter: &Painter, lane: Rect, state: &State, scale: &Scale) {
    for (step, _) in scale.thinned(steps(state), APART) {
        let at = pos2(scale.middle_of(step), lane.bottom() - SIDE / 2.0 - 1.0);
        sheet(painter, at);
    }
}

/// Paints the notes of the cursor's step at their pixels in the left image.
pub(crate) fn image(canvas: &Canvas, state: &State) {
    for note in state.notes_at(state.cursor.step) {
        let Some(pixel) = note.pin.pixel else { continue };
        let at = canvas.transform.to_screen(pixel) + vec2(14.0, 14.0);
        sheet(&canvas.painter, at);
        let place = state.notes.list.iter().flatten().position(|other| other.id == note.id);
        let words = format!("note {}", place.map_or(0, |place| place + 1));
        paint_words(&canvas.painter, at + vec2(SIDE + 2.0, 0.0), &words, theme::text());
    }
}

/// The first words of the notes at a step, for the tooltip of the timeline.
pub(crate) fn words(state: &State, step: usize) -> Vec<String> {
    let begin = |text: &str| {
        let line = text.lines().next().unwrap_or_default();
        let short: String = line.chars().take(LETTERS).collect();
        if short.len() < text.len() { format!("{short} …") } else { short }
    };
    state.notes_at(step).into_iter().map(|note| format!("note: {}", begin(&note.text))).collect()
}

/// The steps with notes of the selected run, or of the stop only, in order.
fn steps(state: &State) -> Vec<usize> {
    let pinned = state.notes.list.iter().flatten().map(|note| note.pin.step);
    let mut steps: Vec<usize> = pinned.filter(|step| !state.notes_at(*step).is_empty()).collect();
    steps.sort_unstable();
    steps.dedup();
    steps
}

fn sheet(painter: &Painter, at: egui::Pos2) {
    let frame = Rect::from_center_size(at, vec2(SIDE, SIDE));
    painter.rect(frame, 1.0, theme::accent(), Stroke::new(1.0, theme::panel()), StrokeKind::Outside);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    #[test]
    fn a_note_is_marked_at_its_step_in_its_run() {
        let mut state = fixture::at_step(&egui::Context::default(), 2);
        let note = |id: u64, step: usize, target: Option<usize>| -> sightline_session::notes::Note {
            serde_json::from_value(serde_json::json!({
                "id": id, "revision": 1, "target": target, "run": 0, "step": step, "text": "look here\nand there",
                "made": "2026-11-27T10:00:00Z", "changed": "2026-11-27T10:00:00Z",
            }))
            .unwrap()
        };
        state.notes.list = Some(vec![note(1, 4, Some(0)), note(2, 1, None), note(3, 2, Some(9))]);
        assert_eq!(steps(&state), [1, 4], "not that of another target");
        assert_eq!(words(&state, 4), ["note: look here …"]);
    }
}
