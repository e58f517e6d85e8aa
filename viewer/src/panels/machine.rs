//! The state machine of loss: the current tracking state, and the gates that rejected each past update (R89–R93).
//!
//! ```text
//! CLEARED → TRACKING ⇄ LOST (k of n_retry) → FAILED          clear leads to CLEARED from every state
//! ```
//! The papers call `tracking` NORMAL and `failed` FAILURE. While lost, up to `n_retry` further updates are tried; the
//! update that detects the loss does not count unless `count_detecting_update` is set (R91).

use egui::{Align2, Color32, Pos2, Rect, RichText, ScrollArea, Sense, Stroke, StrokeKind, Ui, pos2, vec2};
use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::target::TrackingState;

use crate::command::{Command, Go};
use crate::panels::gates;
use crate::panels::panel::Panel;
use crate::state::{State, state_of};
use crate::theme;

/// Height of the diagram, points.
const DIAGRAM: f32 = 96.0;
/// Height of a state's box, points.
const BOX: f32 = 34.0;

/// The panel “State machine”.
pub(crate) struct Machine;

impl Panel for Machine {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.run().is_none().then(|| state.missing_target())
    }
}

/// Shows diagram and history.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(run) = state.run() else { return };
    let now = state.tracking().unwrap_or_default();
    diagram(ui, state, now);
    ui.label(RichText::new(sentence(state, now)).color(theme::text()));
    ui.separator();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let past = run.rows.iter().filter(|row| row.step <= state.cursor.step).rev();
        for row in past {
            history(ui, state, run, row, out);
        }
    });
}

/// Number of updates that may follow the one that detects a loss.
fn retries(state: &State) -> u32 {
    let limits = &state.run_settings().limits;
    limits.n_retry.saturating_sub(u32::from(limits.count_detecting_update))
}

/// Number of retries used up after `count` rejected updates in a row.
fn used(count: u32, retries: u32) -> u32 {
    count.saturating_sub(1).min(retries)
}

/// The current state in words, with its possible transitions.
fn sentence(state: &State, now: TrackingState) -> String {
    let n = retries(state);
    match now {
        TrackingState::Cleared => "Nothing is tracked at this step.".to_owned(),
        TrackingState::Tracking => {
            format!("Tracking. A bad update leads to Lost ({}).", gates::retries_left(n))
        }
        TrackingState::Lost { count } => {
            let left = gates::retries_left(n - used(count, n));
            format!("Lost ({left}). A good update leads back to Tracking.")
        }
        TrackingState::Failed => {
            "Failed (no retry left). Designate the target anew to track it again.".to_owned()
        }
    }
}

/// The four states with their transitions.
fn diagram(ui: &mut Ui, state: &State, now: TrackingState) {
    let (area, response) = ui.allocate_exact_size(vec2(ui.available_width(), DIAGRAM), Sense::hover());
    let lost = match now {
        TrackingState::Lost { count } => format!("{} of {}", used(count, retries(state)), retries(state)),
        _ => format!("k of {}", retries(state)),
    };
    let boxes = [
        ("CLEARED", String::new(), TrackingState::Cleared),
        ("TRACKING", "normal".to_owned(), TrackingState::Tracking),
        ("LOST", lost, TrackingState::Lost { count: 1 }),
        ("FAILED", "failure".to_owned(), TrackingState::Failed),
    ];
    let gap = (area.width() * 0.06).clamp(12.0, 40.0);
    let width = (area.width() - 3.0 * gap - 4.0) / 4.0;
    let frame = |i: usize| {
        let left = area.left() + 2.0 + i as f32 * (width + gap);
        Rect::from_min_size(pos2(left, area.center().y - BOX / 2.0), vec2(width, BOX))
    };
    for (i, (word, below, of)) in boxes.iter().enumerate() {
        paint_state(ui, frame(i), word, below, theme::state(*of), now.word() == of.word());
    }
    paint_transitions(ui, [frame(0), frame(1), frame(2), frame(3)]);
    let words = format!("state {}: {}", now.word(), sentence(state, now));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &words));
    response.on_hover_text("Clear leads to CLEARED from every state: remove the target.");
}

fn paint_state(ui: &Ui, frame: Rect, word: &str, below: &str, colour: Color32, is_present: bool) {
    let painter = ui.painter();
    // The current state is filled and has a thick border, the others are outlines.
    let fill = if is_present { colour.gamma_multiply(0.35) } else { Color32::TRANSPARENT };
    let stroke = Stroke::new(if is_present { 3.0 } else { 1.0 }, colour);
    painter.rect(frame, 6.0, fill, stroke, StrokeKind::Inside);
    let text = if is_present { theme::strong() } else { theme::text() };
    let font = |of: egui::FontId| egui::FontId::new(of.size.min(frame.width() / 5.8), of.family);
    if below.is_empty() {
        painter.text(frame.center(), Align2::CENTER_CENTER, word, font(theme::image_font()), text);
        return;
    }
    let middle = frame.center();
    painter.text(middle - vec2(0.0, 7.0), Align2::CENTER_CENTER, word, font(theme::image_font()), text);
    painter.text(
        middle + vec2(0.0, 7.0),
        Align2::CENTER_CENTER,
        below,
        font(theme::digit_font()),
        theme::text(),
    );
}

/// The arrows: pick, bad and good updates, and exhausted retries.
fn paint_transitions(ui: &Ui, [cleared, tracking, lost, failed]: [Rect; 4]) {
    let above = |a: Rect, b: Rect, word: &str| {
        let (from, to) = (a.right_top() + vec2(-8.0, 0.0), b.left_top() + vec2(8.0, 0.0));
        bent(ui, from, to, -12.0, word);
    };
    above(cleared, tracking, "pick");
    above(tracking, lost, "bad");
    above(lost, failed, "k = n, bad");
    let below = |a: Rect, b: Rect, word: &str| {
        let (from, to) = (a.left_bottom() + vec2(8.0, 0.0), b.right_bottom() + vec2(-8.0, 0.0));
        bent(ui, from, to, 12.0, word);
    };
    below(lost, tracking, "good");
}

/// An arrow that leaves and enters a box from above (`rise` < 0) or from below, with a word.
fn bent(ui: &Ui, from: Pos2, to: Pos2, rise: f32, word: &str) {
    let painter = ui.painter();
    let stroke = Stroke::new(1.5, theme::weak());
    let (up, over) = (from + vec2(0.0, rise), to + vec2(0.0, rise));
    painter.line(vec![from, up, over, to], stroke);
    let back = rise.signum() * 4.0;
    painter.line(vec![to + vec2(-3.0, back), to, to + vec2(3.0, back)], stroke);
    let middle = up + (over - up) * 0.5;
    let (at, align) = if rise < 0.0 {
        (middle - vec2(0.0, 2.0), Align2::CENTER_BOTTOM)
    } else {
        (middle + vec2(0.0, 2.0), Align2::CENTER_TOP)
    };
    painter.text(at, align, word, theme::digit_font(), theme::text());
}

/// One past update: its step, its state, and the failed gates.
fn history(ui: &mut Ui, state: &State, run: &RunView, row: &StepRow, out: &mut Vec<Command>) {
    let is_here = row.step == state.cursor.step;
    ui.horizontal_wrapped(|ui| {
        let step = RichText::new(format!("step {:>3}", row.step)).monospace().size(11.0);
        let button = egui::Button::selectable(is_here, step);
        if ui.add(button).clicked() {
            out.push(Command::Go(Go::Step(row.step)));
        }
        let colour = theme::state(state_of(row));
        let state_word = ui.label(RichText::new(&row.state).size(12.0).color(colour));
        if let Some(reason) = &row.reason {
            state_word.on_hover_text(reason);
        }
        if run.rows.first().is_some_and(|first| first.step == row.step) {
            ui.label(theme::note("designated here"));
        } else if row.failed_gates.is_empty() {
            ui.label(theme::note(row.reason.as_deref().unwrap_or("all gates passed")));
        }
        for gate in &row.failed_gates {
            let words = format!("gate {}: {}", gate.criterion, gates::failed_words(gate));
            ui.add(egui::Label::new(RichText::new(words).size(11.5).color(theme::lost())).wrap());
        }
    });
}
