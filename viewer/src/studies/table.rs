//! The result of a study in the page: plot and table.

use egui::{Grid, RichText, ScrollArea, Ui};
use sightline_study::row::Row;
use sightline_study::terrain_table;
use sightline_study::wire::StudyState;

use crate::state::State;
use crate::studies::chart;
use crate::theme;

/// Columns of the table after configuration, seed and the study's variable: name in the record, heading, factor.
const COLUMNS: [(&str, &str, f64); 10] = [
    ("targets", "targets", 1.0),
    ("tracked", "tracked", 1.0),
    ("false_tracked", "false tracked", 1.0),
    ("false_lost", "false lost", 1.0),
    ("lost_by_pose", "lost by pose", 1.0),
    ("not_driven", "not driven", 1.0),
    ("err_px_median", "median, px", 1.0),
    ("err_px_p95", "95 %, px", 1.0),
    ("err_m_median", "median, cm", 100.0),
    ("err_m_p95", "95 %, cm", 100.0),
];

/// Shows plot and table of the selected job.
pub(super) fn show(ui: &mut Ui, state: &State) {
    let Some(job) = &state.studies.shown_job else { return };
    ui.separator();
    let Some(rows) = state.studies.rows.get(job) else {
        ui.label(theme::note("Loading the table …"));
        return;
    };
    if rows.is_empty() {
        let is_stopped = state.studies.jobs.iter().any(|known| {
            &known.id == job && matches!(known.state, StudyState::Cancelled | StudyState::Failed)
        });
        ui.label(theme::note(if is_stopped {
            "The study was stopped before a run was done. The images that are rendered are kept: Resume goes on from there."
        } else {
            "No run of this study is done yet. Rows appear as runs end."
        }));
        return;
    }
    let of_job = state.studies.jobs.iter().find(|known| &known.id == job);
    let infos = state.studies.infos.iter().flatten();
    let variable = of_job.and_then(|job| infos.clone().find(|info| info.name == job.study));
    chart::show(ui, rows, variable.map_or("scenario", |info| info.variable.as_str()), job);
    let variables: Vec<&str> = variable
        .map(|info| info.variable.as_str())
        .into_iter()
        .chain(["odometry"])
        .filter(|name| rows[0].columns.contains_key(*name))
        .collect();
    table_ii(ui, rows, job);
    let columns: Vec<_> = COLUMNS.iter().filter(|(name, ..)| rows[0].columns.contains_key(*name)).collect();
    ScrollArea::horizontal().auto_shrink([false, true]).show(ui, |ui| {
        Grid::new(("rows", job)).striped(true).spacing([12.0, 2.0]).show(ui, |ui| {
            let headings = ["configuration", "seed"].into_iter().chain(variables.iter().copied());
            for heading in headings.chain(columns.iter().map(|(_, heading, _)| *heading)) {
                ui.label(theme::note(heading.replace('_', " ")));
            }
            ui.end_row();
            for row in rows {
                ui.label(RichText::new(&row.configuration).size(12.0));
                ui.label(theme::number(row.seed.to_string()));
                for name in &variables {
                    ui.label(theme::number(cell(row, name, 1.0)));
                }
                for (name, _, factor) in &columns {
                    ui.label(theme::number(cell(row, name, *factor)));
                }
                ui.end_row();
            }
        });
    });
}

/// Shows Table II of the paper beside our results, for a study with odometry.
fn table_ii(ui: &mut Ui, rows: &[Row], job: &str) {
    let table = terrain_table::table(rows);
    if table.is_empty() {
        return;
    }
    ui.label(theme::note("Kim 2009, Table II: the rows of the paper beside ours"));
    ScrollArea::horizontal().id_salt(("table II scroll", job)).auto_shrink([false, true]).show(ui, |ui| {
        Grid::new(("table II", job)).striped(true).spacing([12.0, 2.0]).show(ui, |ui| {
            for heading in terrain_table::HEADINGS {
                ui.label(theme::note(heading));
            }
            ui.end_row();
            for line in &table {
                for cell in line.cells() {
                    ui.label(theme::number(cell));
                }
                ui.end_row();
            }
        });
    });
    ui.separator();
}

/// A value of a row; a dash if it is missing.
fn cell(row: &Row, column: &str, factor: f64) -> String {
    match (row.number(column), row.columns.get(column).and_then(|value| value.as_str())) {
        (Some(number), _) if factor == 1.0 && number.fract() == 0.0 => format!("{number}"),
        (Some(number), _) => format!("{:.2}", number * factor),
        (None, Some(word)) => word.to_owned(),
        (None, None) => "–".to_owned(),
    }
}
