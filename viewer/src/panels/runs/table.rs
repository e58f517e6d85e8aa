//! The table of runs: one row a run, sorted by any metric, with a baseline and a filter.

use egui::{Button, Grid, Link, RichText, Sense, Ui, vec2};
use serde_json::Value;
use sightline_session::compare::RunName;
use sightline_session::view::{RunView, TargetView};
use sightline_track::settings::Changes;

use crate::command::Command;
use crate::compare::panel::{chip, mark};
use crate::compare::state::RunStyle;
use crate::compare::{CompareCommand, METRICS, Sort};
use crate::drawing::overlay::run_mark;
use crate::panels::digits;
use crate::panels::timeline;
use crate::state::{State, run_letter};
use crate::theme;

/// A row: a run and its target.
#[derive(Clone, Copy)]
pub(crate) struct RunRow<'a> {
    name: RunName,
    target: &'a TargetView,
    run: &'a RunView,
}

/// The number of runs shown, in words.
pub(crate) fn count(state: &State) -> String {
    let (shown, all) = (rows(state).len(), state.all_runs().count());
    match (shown, all) {
        (1, 1) => "1 run".to_owned(),
        (shown, all) if shown == all => format!("{all} runs"),
        (shown, all) => format!("{shown} of {all} runs"),
    }
}

/// The rows that pass the filter, in sort order; runs without a value are last.
fn rows(state: &State) -> Vec<RunRow<'_>> {
    let filter = state.compare.filter.to_lowercase();
    let mut rows: Vec<RunRow<'_>> =
        state.all_runs().map(|(name, target, run)| RunRow { name, target, run }).collect();
    rows.retain(|row| filter.split_whitespace().all(|word| text(state, row).to_lowercase().contains(word)));
    if let Some(metric) = &state.compare.sort.metric {
        let is_descending = state.compare.sort.is_descending;
        let key = |row: &RunRow<'_>| state.metric(row.name, metric).and_then(|metric| metric.value);
        rows.sort_by(|a, b| match (key(a), key(b)) {
            (Some(a), Some(b)) if is_descending => b.total_cmp(&a),
            (Some(a), Some(b)) => a.total_cmp(&b),
            (a, b) => b.is_some().cmp(&a.is_some()),
        });
    }
    rows
}

/// The names of the runs in the order of the table.
#[cfg(test)]
pub(crate) fn order(state: &State) -> Vec<RunName> {
    rows(state).into_iter().map(|row| row.name).collect()
}

/// The text that the filter searches.
fn text(state: &State, row: &RunRow<'_>) -> String {
    let preset = state.configurations.named(&row.run.settings).map_or("", |preset| preset.name);
    let settings: Vec<String> = row.run.changes.iter().map(|(key, value)| format!("{key}={value}")).collect();
    format!("{} run {} {preset} {}", row.target.label, run_letter(row.run.number), settings.join(" "))
}

/// Shows the table.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let rows = rows(state);
    if rows.is_empty() {
        ui.label(theme::label("No run has these words. Empty the field to see all of them."));
        return;
    }
    Grid::new("runs").striped(true).spacing([10.0, 4.0]).show(ui, |ui| {
        for heading in ["base", "vs", "run", "states"] {
            ui.label(theme::note(heading));
        }
        METRICS.iter().for_each(|column| heading(ui, state, column, out));
        ui.label(theme::note(match state.compare.baseline {
            Some(name) => format!("settings unlike {}", state.run_label(name)),
            None => "settings unlike the defaults".to_owned(),
        }));
        ui.end_row();
        for row in &rows {
            show_row(ui, state, row, out);
            ui.end_row();
        }
    });
}

/// A heading: the first click sorts best first, the second reverses the order, the third removes the sorting.
fn heading(
    ui: &mut Ui,
    state: &State,
    (metric, words, is_more_better): &(&str, &str, bool),
    out: &mut Vec<Command>,
) {
    let sort = &state.compare.sort;
    let is_sorted = sort.metric.as_deref() == Some(metric);
    let arrow = match (is_sorted, sort.is_descending) {
        (false, _) => "",
        (true, true) => " ▼",
        (true, false) => " ▲",
    };
    let button = Button::new(RichText::new(format!("{words}{arrow}")).size(11.0))
        .frame(false)
        .min_size(vec2(24.0, 22.0));
    let direction = if *is_more_better { "more is better" } else { "less is better" };
    let response = ui.add(button).on_hover_text(format!("{metric}; {direction}"));
    if response.accessible_name(format!("sort by {metric}")).clicked() {
        // The best value is first.
        let next = match (is_sorted, sort.is_descending == *is_more_better) {
            (false, _) => Sort { metric: Some((*metric).to_owned()), is_descending: *is_more_better },
            (true, true) => Sort { metric: Some((*metric).to_owned()), is_descending: !*is_more_better },
            (true, false) => Sort::default(),
        };
        out.push(Command::Compare(CompareCommand::Sort(next)));
    }
}

fn show_row(ui: &mut Ui, state: &State, row: &RunRow<'_>, out: &mut Vec<Command>) {
    let label = format!("{} · run {}", row.target.label, run_letter(row.run.number));
    let is_baseline = state.compare.baseline == Some(row.name);
    if star(ui, is_baseline, &label).clicked() {
        out.push(Command::Compare(CompareCommand::Baseline(row.name)));
    }
    let is_own = state.own_name() == Some(row.name);
    let mut is_compared = is_own || state.compare.others.contains(&row.name);
    let check = ui.add_enabled(!is_own, egui::Checkbox::without_text(&mut is_compared));
    if check.accessible_name(format!("compare {label}")).changed() {
        out.push(Command::Compare(CompareCommand::Toggle(row.name)));
    }
    ui.horizontal(|ui| {
        mark(ui, style_of(state, row.name));
        let words =
            RichText::new(&label).size(12.0).color(if is_own { theme::strong() } else { theme::text() });
        let button = Button::selectable(is_own, words).min_size(vec2(0.0, 24.0));
        if ui.add(button).on_hover_text("looks at this run").clicked() {
            out.push(Command::SelectRun { target: row.name.target, run: row.name.run });
        }
    });
    states(ui, row, state.stop_count());
    for (metric, ..) in METRICS {
        cell(ui, state, row.name, metric, &label, out);
    }
    ui.add(egui::Label::new(theme::note(changes(state, row)).monospace())).on_hover_text(text(state, row));
}

/// The star of the baseline, drawn because the fonts have none.
fn star(ui: &mut Ui, is_baseline: bool, label: &str) -> egui::Response {
    let (frame, response) = ui.allocate_exact_size(vec2(24.0, 24.0), Sense::click());
    let centre = frame.center();
    let corner = |i: usize| {
        let angle = std::f32::consts::PI * (i as f32 / 5.0 - 0.5);
        centre + egui::Vec2::angled(angle) * if i.is_multiple_of(2) { 8.0 } else { 3.6 }
    };
    let corners: Vec<egui::Pos2> = (0..10).map(corner).collect();
    if is_baseline {
        // A star is not convex: it is filled with triangles about its centre.
        for i in 0..10 {
            let triangle = vec![centre, corners[i], corners[(i + 1) % 10]];
            ui.painter().add(egui::Shape::convex_polygon(triangle, theme::accent(), egui::Stroke::NONE));
        }
    }
    let is_marked = response.hovered() || response.has_focus() || is_baseline;
    let colour = if is_marked { theme::accent() } else { theme::weak() };
    ui.painter().add(egui::Shape::closed_line(corners, egui::Stroke::new(1.5, colour)));
    response.widget_info(|| {
        egui::WidgetInfo::selected(egui::Role::CheckBox, true, is_baseline, format!("baseline: {label}"))
    });
    response.on_hover_text("the baseline: the others are given with their difference to it")
}

/// The colour and mark of a run: those of the comparison, else those of its number.
fn style_of(state: &State, name: RunName) -> RunStyle {
    let compared = state.others().into_iter().find(|other| other.name == name).map(|other| other.style);
    compared.unwrap_or(RunStyle { colour: theme::run(name.run), mark: run_mark(name.run) })
}

/// The states of a run as a thin band.
fn states(ui: &mut Ui, row: &RunRow<'_>, stop_count: usize) {
    let (rect, response) = ui.allocate_exact_size(vec2(90.0, 12.0), Sense::hover());
    timeline::thin_band(ui.painter(), rect, row.target, row.run, stop_count);
    let words = in_words(row.run);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("states: {words}")));
    response.on_hover_text(words);
}

/// Maximum number of state changes listed individually.
const CHANGES_SHOWN: usize = 12;

/// The states of a run in words.
fn in_words(run: &RunView) -> String {
    let mut pieces: Vec<(usize, usize, &str)> = Vec::new();
    for line in &run.rows {
        match pieces.last_mut() {
            Some(last) if last.2 == line.state => last.1 = line.step,
            _ => pieces.push((line.step, line.step, &line.state)),
        }
    }
    let piece = |(first, last, state): &(usize, usize, &str)| {
        if first == last { format!("{state} {first}") } else { format!("{state} {first} to {last}") }
    };
    let mut words = pieces.iter().take(CHANGES_SHOWN).map(piece).collect::<Vec<_>>().join(", ");
    if let Some(more) = pieces.len().checked_sub(CHANGES_SHOWN).filter(|more| *more > 0) {
        words += &format!(" and {more} more changes");
    }
    words
}

/// A metric: a link to its worst step, with its difference to the baseline.
pub(crate) fn cell(
    ui: &mut Ui,
    state: &State,
    name: RunName,
    metric: &str,
    label: &str,
    out: &mut Vec<Command>,
) {
    let Some(found) = state.metric(name, metric) else {
        let (word, why) = match state.metrics_problem(name) {
            Some(problem) => ("–", problem.to_owned()),
            None => ("…", "being computed".to_owned()),
        };
        ui.label(theme::note(word)).on_hover_text(why);
        return;
    };
    let Some(value) = found.value else {
        ui.label(theme::note("–")).on_hover_text(found.note.clone().unwrap_or_default());
        return;
    };
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let words = found.words(value);
        match found.worst_step {
            Some(step) => {
                let help = format!("{metric}: worst at step {step}; a click goes there");
                let link = ui.add(Link::new(theme::number(&words).size(11.5)));
                let link = link.accessible_name(format!("{metric} {words} of {label}, worst at step {step}"));
                if link.on_hover_text(help).clicked() {
                    out.push(Command::Compare(CompareCommand::Visit { run: name, step }));
                }
            }
            None => {
                ui.label(theme::number(&words).size(11.5)).on_hover_text("no step does badly by it");
            }
        }
        let baseline = state.compare.baseline.filter(|&baseline| baseline != name);
        let there = baseline.and_then(|baseline| state.metric(baseline, metric)?.value);
        if let Some(there) = there.filter(|there| *there != value) {
            let sign = if value > there { "+" } else { "−" };
            ui.label(theme::note(format!("Δ{sign}{}", digits((value - there).abs()))));
        }
    });
}

/// The settings that differ from the baseline's, or from the defaults without a baseline.
fn changes(state: &State, row: &RunRow<'_>) -> String {
    let baseline = state.compare.baseline.filter(|&name| name != row.name);
    let against = baseline.and_then(|name| Some(&state.run_named(name)?.1.changes));
    let nothing = Changes::new();
    let against = against.unwrap_or(&nothing);
    let keys: std::collections::BTreeSet<&String> = row.run.changes.keys().chain(against.keys()).collect();
    let line = |key: &&String| {
        let (own, there) = (row.run.changes.get(*key), against.get(*key));
        let default =
            || state.settings.iter().find(|info| info.key == **key).map(|info| info.default.clone());
        let shown = own.cloned().or_else(default).map_or_else(|| "default".to_owned(), |value| plain(&value));
        (own != there).then(|| format!("{key}={shown}"))
    };
    let lines: Vec<String> = keys.iter().filter_map(line).collect();
    if lines.is_empty() { "none".to_owned() } else { lines.join(" ") }
}

/// The text of a setting's value.
pub(crate) fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// A run's mark with its name, as a column heading.
pub(crate) fn head(ui: &mut Ui, state: &State, name: RunName) {
    ui.horizontal(|ui| chip(ui, style_of(state, name), &state.run_label(name)));
}
