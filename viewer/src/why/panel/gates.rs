//! The gates by margin: value, limit, margin, and a slider that tries another limit.

use egui::{RichText, Sense, Slider, Ui, WidgetInfo, pos2, vec2};
use serde_json::json;
use sightline_session::why::gates::{by_margin, label};
use sightline_session::why::words::{number, setting_name, signed, told_apart};
use sightline_track::limits::Domain;
use sightline_track::stages::judge::{Gate, Verdict};

use crate::command::Command;
use crate::state::State;
use crate::theme;
use crate::why::WhyCommand;

/// Height of the bar of a margin, points.
const BAR: f32 = 8.0;

/// Shows all gates.
pub(crate) fn show(ui: &mut Ui, state: &State, verdict: &Verdict, out: &mut Vec<Command>) {
    for margin in by_margin(&verdict.gates) {
        let gate = margin.gate;
        ui.push_id(&gate.name, |ui| {
            headline(ui, state.cursor.step, gate, out);
            bar(ui, gate, margin.relative);
            if let Some(setting) = gate.setting.as_deref() {
                limit_slider(ui, state, setting, out);
            }
        });
    }
}

/// Shows name, value, relation, limit and margin; a click on the name explains the margin.
fn headline(ui: &mut Ui, step: usize, gate: &Gate, out: &mut Vec<Command>) {
    let relation = if gate.at_least { "≥" } else { "≤" };
    let [value, limit] = match gate.value {
        Some(value) => told_apart(value, gate.limit),
        None => ["none".to_owned(), number(gate.limit)],
    };
    ui.horizontal_wrapped(|ui| {
        let word = if gate.passed { "pass" } else { "FAIL" };
        ui.label(RichText::new(word).strong().color(theme::verdict(gate.passed)));
        for (words, name) in [
            (label(&gate.name).to_owned(), format!("gate.{}", gate.name)),
            (value, format!("value.{}", gate.name)),
            (
                format!("{relation} {limit} {}", gate.unit).trim_end().to_owned(),
                format!("limit.{}", gate.name),
            ),
        ] {
            let link = ui.link(words.clone()).on_hover_text(format!("Why? Where {name} comes from"));
            if link.clicked() {
                out.push(Command::Why(WhyCommand::Value { step, value: name.clone() }));
            }
            link.context_menu(|ui| {
                if ui.button("Why").clicked() {
                    out.push(Command::Why(WhyCommand::Value { step, value: name.clone() }));
                    ui.close();
                }
                if ui.button("Copy value").clicked() {
                    ui.ctx().copy_text(words.clone());
                    ui.close();
                }
            });
        }
        let margin = gate.margin.map_or_else(|| "nothing to judge".to_owned(), signed);
        ui.label(theme::number(margin).size(12.0).color(theme::verdict(gate.passed)));
    });
}

/// Shows the margin relative to the limit, from −1 to +1 about the centre line.
fn bar(ui: &mut Ui, gate: &Gate, relative: f64) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), BAR + 4.0), Sense::hover());
    let rail = egui::Rect::from_min_size(rect.min + vec2(0.0, 2.0), vec2(rect.width(), BAR));
    ui.painter().rect_filled(rail, 2.0, theme::well());
    let middle = rail.center().x;
    let end = middle + rail.width() / 2.0 * relative.clamp(-1.0, 1.0) as f32;
    let (left, right) = if end < middle { (end, middle) } else { (middle, end.max(middle + 1.0)) };
    let fill = egui::Rect::from_min_max(pos2(left, rail.top()), pos2(right, rail.bottom()));
    ui.painter().rect_filled(fill, 2.0, theme::verdict(gate.passed).gamma_multiply(0.85));
    ui.painter().vline(middle, rail.expand(2.0).y_range(), egui::Stroke::new(2.0, theme::strong()));
    let words = match gate.margin {
        Some(margin) => format!("margin of {}: {} {}", label(&gate.name), signed(margin), gate.unit),
        None => format!("margin of {}: nothing to judge", label(&gate.name)),
    };
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Meter, true, words.trim_end()));
    response.on_hover_text("The margin over the limit, from −100 % to +100 %; the line is the limit.");
}

/// Shows a slider that tries another limit.
fn limit_slider(ui: &mut Ui, state: &State, setting: &str, out: &mut Vec<Command>) {
    let Some(info) = state.settings.iter().find(|info| info.key == setting) else { return };
    let (Some(in_run), Some(tried)) = (
        state.setting(&info.group, setting).and_then(|value| value.as_f64()),
        state.trial_setting(&info.group, setting).and_then(|value| value.as_f64()),
    ) else {
        return;
    };
    let Domain::Between(low, high) = info.domain else { return };
    // A limit of up to 100 is rarely dragged beyond five times its value.
    let high = if high > 1.0 { high.min((5.0 * in_run).max(1.0)) } else { high };
    let mut value = tried;
    let name = theme::note(format!("try {}", setting_name(setting)));
    let response = ui.add(Slider::new(&mut value, low..=high).max_decimals(3).text(name));
    if response.on_hover_text(format!("Drag to try another {setting} at this step")).changed() {
        let new = (value != in_run).then(|| json!(value));
        out.push(Command::Why(WhyCommand::Change { key: setting.to_owned(), value: new }));
    }
}
