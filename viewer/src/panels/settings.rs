//! The settings of the run, generated from the table of settings: change some and run again from the cursor's step.

use egui::{Align, CollapsingHeader, Color32, ComboBox, DragValue, Layout, RichText, ScrollArea, Ui, vec2};
use serde_json::{Value, json};
use sightline_track::limits::{Domain, SettingInfo};
use sightline_track::settings::TrackerKind;

use crate::command::Command;
use crate::panels::numbers;
use crate::panels::panel::Panel;
use crate::state::{State, run_letter};
use crate::{panels, theme};

/// Width of the column of units, points.
const UNIT: f32 = 24.0;

/// The panel “Settings”.
pub(crate) struct Settings;

impl Panel for Settings {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        if state.settings.is_empty() {
            return Some("Asking the server for its settings …".to_owned());
        }
        state.run().is_none().then(|| state.missing_target())
    }

    fn badge(&self, state: &State) -> Option<(usize, Color32)> {
        (!state.draft.is_empty()).then(|| (state.draft.len(), theme::accent()))
    }
}

/// Shows the form.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    presets(ui, state, out);
    foot(ui, state, out);
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for infos in state.settings.chunk_by(|a, b| a.group == b.group) {
            show_group(ui, state, infos, out);
        }
    });
}

/// A group of settings; the group of a tracker that the next run does not use is collapsed and labelled so.
fn show_group(ui: &mut Ui, state: &State, infos: &[SettingInfo], out: &mut Vec<Command>) {
    let Some(group) = infos.first().map(|info| info.group.as_str()) else { return };
    let tracker = state.pending().map_or_else(|| state.tracker(), |settings| settings.tracker);
    let is_used = match group {
        "template" => tracker == TrackerKind::Template,
        "features" => tracker.follows_features(),
        "shape" => tracker.asks_shape(),
        _ => true,
    };
    ui.add_space(4.0);
    let settings = |ui: &mut Ui, out: &mut Vec<Command>| {
        infos.iter().for_each(|info| show_setting(ui, state, info, out));
    };
    if is_used {
        ui.label(theme::title(group));
        settings(ui, out);
    } else {
        let words = theme::title(&format!("{group}: not used by this tracker"));
        CollapsingHeader::new(words).id_salt(group).show(ui, |ui| settings(ui, out));
    }
}

/// The named configurations: choosing one drafts the changes that lead to it for the next run.
fn presets(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let now = state.pending().and_then(|settings| state.configurations.named(&settings));
    let name = now.map_or("no preset", |preset| preset.name);
    ui.horizontal(|ui| {
        ui.label(theme::label("preset"));
        let choice = ComboBox::from_id_salt("preset").width(ui.available_width()).height(420.0);
        let shown = choice.selected_text(RichText::new(name).color(theme::strong())).show_ui(ui, |ui| {
            ui.set_min_width(300.0);
            for preset in state.configurations.all() {
                let is_chosen = now.is_some_and(|now| now.name == preset.name);
                if panels::entry(ui, is_chosen, preset.name).clicked() {
                    out.push(Command::UsePreset(preset.name));
                }
                ui.add(egui::Label::new(theme::note(preset.description)).wrap());
                ui.add_space(3.0);
            }
        });
        shown.response.accessible_name("configuration preset");
    });
    let sentence = now.map_or("Settings that no preset has.", |preset| preset.description);
    ui.add(egui::Label::new(theme::note(sentence)).wrap());
}

/// The drafted changes, and the buttons that run or discard them.
fn foot(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let step = state.cursor.step;
    ui.horizontal(|ui| {
        let wrong = state.settings.iter().find_map(|info| problem(state, info));
        let button =
            ui.add_enabled(wrong.is_none(), egui::Button::new("Run from here").min_size(vec2(100.0, 24.0)));
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
        0 => format!("No changes to run {letter}; would restart at step {step}"),
        1 => format!("1 change against run {letter}, from step {step}"),
        n => format!("{n} changes against run {letter}, from step {step}"),
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
    let idle = (!has_effect(state, info)).then(|| info.condition()).flatten();
    let colour = match (drafted, in_run == info.default) {
        _ if idle.is_some() => theme::weak(),
        (Some(_), _) => theme::accent(),
        (None, false) => theme::strong(),
        (None, true) => theme::text(),
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
        // From the right: the unit, the control, and the name in the remaining width.
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.allocate_ui_with_layout(vec2(UNIT, 18.0), Layout::left_to_right(Align::Center), |ui| {
                ui.set_width(UNIT);
                // Longer units are words, which the help contains.
                let unit = Some(&info.unit).filter(|unit| unit.chars().count() <= 3);
                ui.label(theme::note(unit.map_or("", String::as_str)));
            });
            if let Some(new) = edit(ui, info, &value) {
                let value = (new != in_run).then_some(new);
                out.push(Command::Draft { key: info.key.clone(), value });
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                ui.add(egui::Label::new(label).truncate()).on_hover_text(help(info, &in_run));
            });
        });
    });
    if let Some(condition) = idle.filter(|_| drafted.is_some()) {
        ui.label(theme::note(format!("{} has an effect only if {condition}", info.key)));
    }
    if let Some(problem) = problem(state, info) {
        ui.label(RichText::new(format!("{} {problem}", info.key)).small().color(theme::lost()));
    }
}

/// Whether a setting has an effect with the current values of the others, drafted changes included.
fn has_effect(state: &State, info: &SettingInfo) -> bool {
    let value = |info: &SettingInfo| {
        let drafted = state.draft.get(&info.key).cloned();
        let in_run = || state.setting(&info.group, &info.key);
        drafted.or_else(in_run).unwrap_or_else(|| info.default.clone())
    };
    info.has_effect(&state.settings, &value)
}

/// The control of a setting. Returns the new value if the user changed it.
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
                    if panels::entry(ui, chosen == *word, word).clicked() {
                        chosen.clone_from(word);
                    }
                }
            });
            shown.response.accessible_name(&info.key);
            (chosen != before).then(|| json!(chosen))
        }
        Domain::OddBetween(low, high) => {
            let mut number = value.as_u64().unwrap_or_default();
            let before = number;
            let field = DragValue::new(&mut number).speed(0.2);
            numbers::field(ui, field, f64::from(*low), f64::from(*high)).accessible_name(&info.key);
            // Only odd numbers are valid: round an even one in the direction of the change.
            if number != before && number.is_multiple_of(2) {
                number = if number > before { number + 1 } else { number - 1 };
            }
            (number != before).then(|| json!(number))
        }
        Domain::Between(low, high) if info.default.is_u64() => {
            let mut number = value.as_i64().unwrap_or_default();
            let before = number;
            let field = DragValue::new(&mut number).speed(0.05);
            numbers::field(ui, field, low.ceil(), high.floor()).accessible_name(&info.key);
            (number != before).then(|| json!(number))
        }
        Domain::Between(low, high) => {
            let mut number = value.as_f64().unwrap_or_default();
            let before = number;
            let speed = (before.abs() * 0.01).max(0.002);
            let field = DragValue::new(&mut number).speed(speed).max_decimals(4);
            numbers::field(ui, field, *low, *high).accessible_name(&info.key);
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
    let condition =
        info.condition().map(|words| format!("\nhas an effect only if: {words}")).unwrap_or_default();
    format!(
        "{}\n\nthis run: {in_run}{unit}\ndefault: {}{unit}\nvalues: {range}{condition}\nsource: {}",
        info.help, info.default, info.source
    )
}
