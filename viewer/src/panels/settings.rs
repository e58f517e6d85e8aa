//! The settings of the run, made from the table of settings: change some and run again from the cursor's step.

use egui::{Align, ComboBox, DragValue, Layout, RichText, ScrollArea, Ui, vec2};
use serde_json::{Value, json};
use sightline_core::limits::{Domain, SettingInfo};

use crate::command::Command;
use crate::state::{State, run_letter};
use crate::{panels, theme};

/// Shows the form.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if state.settings.is_empty() {
        panels::missing(ui, "Asking the server for its settings …");
        return;
    }
    if state.run().is_none() {
        panels::missing(ui, &format!("Settings belong to a run. {}", state.missing_target()));
        return;
    }
    foot(ui, state, out);
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let mut group = "";
        for info in &state.settings {
            if info.group != group {
                group = &info.group;
                ui.add_space(4.0);
                ui.label(theme::title(group));
            }
            show_setting(ui, state, info, out);
        }
    });
}

/// What is changed, and the buttons that use or drop it.
fn foot(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let step = state.cursor.step;
    ui.horizontal(|ui| {
        let words = format!("Run from here (step {step})");
        let wrong = state.settings.iter().find_map(|info| problem(state, info));
        let button = ui.add_enabled(wrong.is_none(), egui::Button::new(words).min_size(vec2(150.0, 24.0)));
        if button
            .on_hover_text(
                "Forks a new run with the changed settings; nothing recorded is overwritten. Key R",
            )
            .clicked()
        {
            out.push(Command::RunFromHere(state.draft.clone()));
        }
        if ui.add_enabled(!state.draft.is_empty(), egui::Button::new("Discard")).clicked() {
            out.push(Command::ClearDraft);
        }
    });
    let letter = run_letter(state.cursor.run);
    let words = match state.draft.len() {
        0 => format!("As in run {letter}. Change a value to try another."),
        1 => format!("1 change against run {letter}"),
        n => format!("{n} changes against run {letter}"),
    };
    ui.label(theme::note(words));
}

fn problem(state: &State, info: &SettingInfo) -> Option<String> {
    info.domain.problem_with(state.draft.get(&info.key)?)
}

fn show_setting(ui: &mut Ui, state: &State, info: &SettingInfo, out: &mut Vec<Command>) {
    let in_run = state.setting(&info.group, &info.key).unwrap_or_else(|| info.default.clone());
    let drafted = state.draft.get(&info.key);
    let value = drafted.unwrap_or(&in_run).clone();
    let colour = match (drafted, in_run == info.default) {
        (Some(_), _) => theme::ACCENT,
        (None, false) => theme::STRONG,
        (None, true) => theme::TEXT,
    };
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let mark = if drafted.is_some() {
            "● "
        } else if in_run != info.default {
            "○ "
        } else {
            ""
        };
        let label = RichText::new(format!("{mark}{}", info.key)).size(12.0).color(colour);
        let room = (ui.available_width() - 118.0).max(60.0);
        ui.allocate_ui_with_layout(vec2(room, 20.0), Layout::left_to_right(Align::Center), |ui| {
            ui.set_width(room);
            ui.add(egui::Label::new(label).truncate()).on_hover_text(help(info, &in_run));
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.allocate_ui(vec2(34.0, 18.0), |ui| {
                ui.set_width(34.0);
                ui.label(theme::note(&info.unit));
            });
            if let Some(new) = edit(ui, info, &value) {
                let value = (new != in_run).then_some(new);
                out.push(Command::Draft { key: info.key.clone(), value });
            }
        });
    });
    if let Some(problem) = problem(state, info) {
        ui.label(RichText::new(format!("{} {problem}", info.key)).small().color(theme::LOST));
    }
}

/// The control of a setting. Returns the new value where the person gave one.
fn edit(ui: &mut Ui, info: &SettingInfo, value: &Value) -> Option<Value> {
    match &info.domain {
        Domain::Switch => {
            let mut is_on = value.as_bool().unwrap_or_default();
            let response = ui.checkbox(&mut is_on, "").accessible_name(&info.key);
            response.changed().then(|| json!(is_on))
        }
        Domain::Choice(words) => {
            let mut chosen = value.as_str().unwrap_or_default().to_owned();
            let before = chosen.clone();
            let choice = ComboBox::from_id_salt(&info.key)
                .width(78.0)
                .selected_text(RichText::new(&chosen).size(11.0));
            let shown = choice.show_ui(ui, |ui| {
                for word in words {
                    ui.selectable_value(&mut chosen, word.clone(), word);
                }
            });
            shown.response.accessible_name(&info.key);
            (chosen != before).then(|| json!(chosen))
        }
        Domain::OddBetween(low, high) => {
            let mut number = value.as_u64().unwrap_or_default();
            let before = number;
            ui.add(DragValue::new(&mut number).range(u64::from(*low)..=u64::from(*high)).speed(0.2))
                .accessible_name(&info.key);
            // An even number cannot be meant: the odd one in the direction of the change is.
            if number != before && number.is_multiple_of(2) {
                number = if number > before { number + 1 } else { number - 1 };
            }
            (number != before).then(|| json!(number))
        }
        Domain::Between(low, high) if info.default.is_u64() => {
            let mut number = value.as_i64().unwrap_or_default();
            let before = number;
            ui.add(DragValue::new(&mut number).range(low.ceil() as i64..=high.floor() as i64).speed(0.05))
                .accessible_name(&info.key);
            (number != before).then(|| json!(number))
        }
        Domain::Between(low, high) => {
            let mut number = value.as_f64().unwrap_or_default();
            let before = number;
            let speed = (before.abs() * 0.01).max(0.002);
            ui.add(DragValue::new(&mut number).range(*low..=*high).speed(speed).max_decimals(4))
                .accessible_name(&info.key);
            (number != before).then(|| json!(number))
        }
    }
}

fn help(info: &SettingInfo, in_run: &Value) -> String {
    let range = match &info.domain {
        Domain::Between(low, high) => format!("from {low} to {high}"),
        Domain::OddBetween(low, high) => format!("odd, from {low} to {high}"),
        Domain::Switch => "on or off".to_owned(),
        Domain::Choice(words) => words.join(", "),
    };
    let unit = if info.unit.is_empty() { String::new() } else { format!(" {}", info.unit) };
    format!(
        "{}\n\nthis run: {in_run}{unit}\ndefault: {}{unit}\nvalues: {range}\nsource: {}",
        info.help, info.default, info.source
    )
}
