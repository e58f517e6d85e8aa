//! Every metric of the selected run and the compared runs, with the evaluation protocol and the excluded steps.

use egui::{Grid, Ui};
use sightline_session::compare::RunName;
use sightline_session::metrics::{Excluded, NAMES, RunMetrics};

use crate::command::Command;
use crate::panels::numbers::counted;
use crate::panels::runs::table;
use crate::state::State;
use crate::theme;

/// Width of a remark, and margin beside a sentence, points.
const REMARK: f32 = 220.0;
const MARGIN: f32 = 16.0;

/// Shows the metrics.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(own) = state.own_name() else { return };
    ui.label(theme::title("Metrics"));
    let Some(found) = state.metrics(own) else {
        let why = state.metrics_problem(own).unwrap_or("The metrics are being computed …");
        ui.label(theme::label(why));
        return;
    };
    ui.scope(|ui| {
        // The panel scrolls horizontally; sentences are as wide as its visible part.
        ui.set_max_width((ui.clip_rect().width() - MARGIN).max(REMARK));
        for line in header(found) {
            ui.add(egui::Label::new(theme::note(line)).wrap());
        }
    });
    let names: Vec<RunName> =
        std::iter::once(own).chain(state.others().iter().map(|other| other.name)).collect();
    Grid::new("metrics").striped(true).spacing([14.0, 2.0]).show(ui, |ui| {
        ui.label(theme::note("metric"));
        names.iter().for_each(|&name| table::head(ui, state, name));
        ui.label(theme::note("steps"));
        ui.label(theme::note("remark"));
        ui.end_row();
        for metric in NAMES {
            let first = found.metrics.iter().find(|found| found.name == metric);
            let unit = first.map_or("", |first| first.unit.as_str());
            ui.label(theme::label(title(metric, unit)).size(11.5)).on_hover_text(metric);
            for &name in &names {
                table::cell(ui, state, name, metric, &state.run_label(name), out);
            }
            ui.label(theme::note(first.map_or_else(String::new, |first| first.used.to_string())));
            ui.vertical(|ui| {
                ui.set_max_width(REMARK);
                let remark = first.and_then(|first| first.note.clone()).unwrap_or_default();
                ui.add(egui::Label::new(theme::note(remark)).wrap());
            });
            ui.end_row();
        }
    });
    settings(ui, state);
}

/// The title of a metric, with its unit.
fn title(metric: &str, unit: &str) -> String {
    let words = match metric.split_once('_') {
        Some(("ade", of)) => return format!("mean error, {of}"),
        Some((which @ ("median" | "max"), of)) => return format!("{which} error, {of}"),
        Some(("pck", radius)) => {
            let digits = radius.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
            format!("within {digits} {}", &radius[digits.len()..])
        }
        _ => metric.replace("nees", "NEES").replace("nis", "NIS").replace('_', " "),
    };
    if unit.is_empty() || words.ends_with(unit) { words } else { format!("{words}, {unit}") }
}

/// The settings that differ between the compared runs.
fn settings(ui: &mut Ui, state: &State) {
    let Some(found) = state.comparison() else { return };
    ui.add_space(8.0);
    ui.label(theme::title("Settings that differ"));
    if found.settings.is_empty() {
        ui.label(theme::note("The compared runs have the same settings."));
        return;
    }
    Grid::new("settings that differ").striped(true).spacing([14.0, 2.0]).show(ui, |ui| {
        ui.label(theme::note("setting"));
        found.runs.iter().for_each(|&name| table::head(ui, state, name));
        ui.end_row();
        for setting in &found.settings {
            ui.label(theme::label(format!("{} {}", setting.key, setting.unit)).size(11.5));
            for value in &setting.values {
                ui.label(theme::number(table::plain(value)).size(11.5));
            }
            ui.end_row();
        }
    });
}

/// Protocol, version, kind of truth, and excluded steps.
fn header(found: &RunMetrics) -> Vec<String> {
    let truth = match found.truth {
        None => "no truth is known: only survival_steps and mean_nis can be given",
        Some(sightline_world::target_truth::TruthKind::Surface) => {
            "the truth is the surface point that was designated"
        }
        Some(sightline_world::target_truth::TruthKind::Carried) => {
            "the truth is the first estimate carried along by true poses: errors are drift"
        }
    };
    let mut lines = vec![
        format!("protocol: {}; version {}", found.protocol, found.version),
        format!("{} so far; {truth}", counted(found.steps, "step")),
    ];
    lines.extend(found.excluded.iter().map(excluded));
    lines
}

fn excluded(left_out: &Excluded) -> String {
    const LISTED: usize = 12;
    let mut steps: Vec<String> = left_out.steps.iter().take(LISTED).map(ToString::to_string).collect();
    if left_out.steps.len() > LISTED {
        steps.push(format!("and {} more", left_out.steps.len() - LISTED));
    }
    let noun = if left_out.steps.len() == 1 { "step" } else { "steps" };
    format!("left out of {}: {noun} {} ({})", left_out.of, steps.join(", "), left_out.why)
}
