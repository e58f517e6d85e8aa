//! The gates of the current step with value, limit and margin, and the verdict as a sentence.

use egui::{Align2, Rect, RichText, ScrollArea, Sense, Ui, pos2, vec2};
use sightline_session::why::words::capitalised;
use sightline_track::stages::judge::{Gate, Verdict};
use sightline_track::target::TrackingState;

use crate::command::Command;
use crate::compare::panel::readouts;
use crate::panels::numbers;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::theme;

/// Width of the margin's digits, points.
const MARGIN: f32 = 50.0;
/// Minimum widths of the columns pass or fail, limit, value; points.
const COLUMNS: [f32; 3] = [28.0, 56.0, 38.0];
/// Space between the columns, points.
const SPACE: f32 = 5.0;
/// Height of a margin bar, points.
const BAR: f32 = 8.0;

/// The panel “Gates”.
pub(crate) struct Gates;

impl Panel for Gates {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        verdict(state).is_none().then(|| state.missing_step())
    }
}

/// The verdict on the current step.
fn verdict(state: &State) -> Option<&Verdict> {
    state.trace()?.verdict()
}

/// Shows the gates.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(verdict) = verdict(state) else { return };
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        sentence(ui, verdict, state);
        ui.add_space(3.0);
        for gate in &verdict.gates {
            show_gate(ui, state.cursor.step, gate, out);
            readouts::gate(ui, state, gate);
        }
    });
}

/// The verdict in words, with the transition of the state machine.
fn sentence(ui: &mut Ui, verdict: &Verdict, state: &State) {
    let (word, colour) = match (verdict.accepted, verdict.good) {
        (true, _) => ("ACCEPTED", theme::tracking()),
        (false, true) => ("GOOD, BUT NOT USED", theme::lost()),
        (false, false) => ("REJECTED", theme::failed()),
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(word).strong().color(colour));
        ui.label(theme::note(transition(verdict, state)));
    });
    if let Some(reason) = &verdict.reason {
        ui.add(egui::Label::new(RichText::new(reason).small().color(theme::text())).wrap());
    }
}

/// The change of state, with the number of retries left.
fn transition(verdict: &Verdict, state: &State) -> String {
    let limits = &state.run_settings().limits;
    let retries = limits.n_retry.saturating_sub(u32::from(limits.count_detecting_update));
    let [before, now] = [verdict.state_before.word(), verdict.state.word()].map(capitalised);
    match verdict.state {
        TrackingState::Lost { count } => {
            let left = retries.saturating_sub(count.saturating_sub(1));
            format!("{before} → {now} (bad update {count}; {})", retries_left(left))
        }
        TrackingState::Failed if before != now => format!("{before} → {now} ({})", retries_left(0)),
        TrackingState::Failed => "Failed: designate the target anew to track it again".to_owned(),
        _ if now == before => format!("Stays {}", verdict.state.word()),
        _ => format!("{before} → {now}"),
    }
}

/// The number of retries that remain, in words.
pub(crate) fn retries_left(left: u32) -> String {
    match left {
        0 => "no retry left".to_owned(),
        1 => "1 retry left".to_owned(),
        left => format!("{left} retries left"),
    }
}

/// A gate with its value, limit and margin.
pub(crate) fn show_gate(ui: &mut Ui, step: usize, gate: &Gate, out: &mut Vec<Command>) {
    let colour = theme::verdict(gate.passed);
    let relation = if gate.at_least { "≥" } else { "≤" };
    let word = if gate.passed { "pass" } else { "FAIL" };
    let limit = format!("{relation} {} {}", digits(gate.limit), gate.unit);
    let value = gate.value.map_or_else(|| "none".to_owned(), digits);
    let columns =
        [RichText::new(word).strong().color(colour), theme::note(limit.trim_end()), theme::number(value)];
    let widths: [f32; 3] = std::array::from_fn(|k| width_of(ui, &columns[k]).max(COLUMNS[k]));
    let name = RichText::new(readable(&gate.name)).size(12.0).color(theme::text());
    let number = theme::note(gate.criterion.to_string());
    let named = width_of(ui, &name) + width_of(ui, &number) + SPACE;
    let needed = named + widths.iter().sum::<f32>() + 4.0 * SPACE;
    let show_name = |ui: &mut Ui, out: &mut Vec<Command>| {
        ui.label(number);
        let link = ui.link(name).on_hover_text("Why? Where this margin comes from");
        let copied = gate.value.map_or_else(|| "none".to_owned(), |value| value.to_string());
        numbers::explain_on_click(&link, step, &format!("gate.{}", gate.name), &copied, out);
    };
    let show_columns = |ui: &mut Ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            for (text, width) in columns.into_iter().zip(widths) {
                column(ui, width, text);
            }
        });
    };
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE;
        if ui.available_width() >= needed {
            ui.horizontal(|ui| {
                show_name(ui, out);
                show_columns(ui);
            });
        } else {
            ui.horizontal_wrapped(|ui| show_name(ui, out));
            ui.horizontal(show_columns);
        }
    });
    bar(ui, gate, colour);
}

/// Width of a text on one line, points.
fn width_of(ui: &Ui, text: &RichText) -> f32 {
    let text: egui::WidgetText = text.clone().into();
    text.into_galley(ui, Some(egui::TextWrapMode::Extend), f32::INFINITY, egui::TextStyle::Body).size().x
}

/// A number with three decimals; whole numbers of ten or more without.
fn digits(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() >= 10.0 { format!("{value:.0}") } else { format!("{value:.3}") }
}

/// A text in its own column, right aligned.
fn column(ui: &mut Ui, width: f32, text: RichText) {
    ui.allocate_ui_with_layout(vec2(width, 16.0), egui::Layout::right_to_left(egui::Align::Center), |ui| {
        ui.set_width(width);
        ui.label(text);
    });
}

/// A bar with the value against its limit; passing values are right of the limit for scores, else left of it.
fn bar(ui: &mut Ui, gate: &Gate, colour: egui::Color32) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), BAR + 5.0), Sense::hover());
    let rail = Rect::from_min_size(rect.min + vec2(0.0, 2.0), vec2(rect.width() - MARGIN, BAR));
    let painter = ui.painter();
    painter.rect_filled(rail, 2.0, theme::well());
    let (value, limit) = fractions(gate);
    let at = |fraction: f32| rail.left() + rail.width() * fraction;
    if let Some(value) = value {
        let right = at(value).max(rail.left() + 2.0);
        let fill = Rect::from_min_max(rail.min, pos2(right, rail.bottom()));
        painter.rect_filled(fill, 2.0, colour.gamma_multiply(0.85));
    }
    painter.vline(at(limit), rail.expand(2.0).y_range(), egui::Stroke::new(2.0, theme::strong()));
    let sign = if gate.margin.is_some_and(|margin| margin >= 0.0) { "+" } else { "" };
    let margin = gate.margin.map_or_else(|| "–".to_owned(), |m| format!("{sign}{}", digits(m)));
    painter.text(rect.right_center(), Align2::RIGHT_CENTER, margin, theme::digit_font(), colour);
    response.on_hover_text("Right: the margin, positive if the gate is passed.");
}

/// Value and limit as fractions of the bar: scores and shares from 0 to 1, others from 0 to twice the limit.
fn fractions(gate: &Gate) -> (Option<f32>, f32) {
    let is_share = gate.at_least && gate.unit.is_empty() && gate.limit <= 1.0;
    let full = if is_share { 1.0 } else { 2.0 * gate.limit.max(1e-9) };
    let fraction = |v: f64| (v / full).clamp(0.0, 1.0) as f32;
    (gate.value.map(fraction), fraction(gate.limit))
}

/// The display name of a gate.
pub(crate) fn readable(name: &str) -> &str {
    sightline_session::why::gates::label(name)
}

/// Name, value and limit of a failed gate, lengths in centimetres: `range change 25.0 > 12.0 cm`.
pub(crate) fn failed_words(gate: &Gate) -> String {
    let relation = if gate.at_least { "<" } else { ">" };
    let name = readable(&gate.name);
    let Some(value) = gate.value else { return format!("{name}: no value to judge") };
    let words = match gate.unit.as_str() {
        "m" => format!("{name} {:.1} {relation} {:.1} cm", value * 100.0, gate.limit * 100.0),
        unit => format!("{name} {value:.3} {relation} {:.3} {unit}", gate.limit),
    };
    words.trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(value: Option<f64>, limit: f64, at_least: bool) -> Gate {
        let (name, unit) = ("ncc".to_owned(), String::new());
        Gate { criterion: 1, name, unit, value, limit, at_least, margin: None, passed: true, setting: None }
    }

    #[test]
    fn a_score_fills_its_bar_up_to_one_and_a_distance_up_to_twice_its_limit() {
        assert_eq!(fractions(&gate(Some(0.83), 0.7, true)), (Some(0.83), 0.7));
        assert_eq!(fractions(&gate(Some(0.05), 0.1, false)), (Some(0.25), 0.5));
        assert_eq!(fractions(&gate(Some(9.0), 0.1, false)), (Some(1.0), 0.5));
        assert_eq!(fractions(&gate(None, 0.1, false)), (None, 0.5));
        // A ratio with a lower limit above one, and a distance with a lower limit, also extend to twice their limits.
        assert_eq!(fractions(&gate(Some(1.725), 1.15, true)), (Some(0.75), 0.5));
        let edge = Gate { unit: "m".to_owned(), ..gate(Some(0.004), 0.004, true) };
        assert_eq!(fractions(&edge), (Some(0.5), 0.5));
    }

    #[test]
    fn counts_have_no_decimals() {
        assert_eq!([97.0, 1.0, -12.5].map(digits), ["97", "1.000", "-12.500"]);
    }
}
