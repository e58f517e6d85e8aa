//! The validation experiments as jobs: choose one, start it, watch it, read its table and its report.

use egui::{ComboBox, Grid, RichText, ScrollArea, TextEdit, Ui, vec2};
use sightline_study::row::Row;
use sightline_study::terrain_table;
use sightline_study::wire::{StudyInfo, StudyJob, StudyState};

use crate::command::Command;
use crate::panels::pane::Need;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::{panels, theme};

/// Columns of the table behind configuration, seed and the study's variable: name in the record, heading, factor.
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

/// The panel “Studies”.
pub(crate) struct Studies;

impl Panel for Studies {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        if state.traverses.is_none() {
            return Some(state.missing_target());
        }
        if state.studies.chosen().is_some() {
            return None;
        }
        let sentence = match &state.studies.infos {
            None => "Asking the server for its studies …",
            Some(_) => "The server offers no studies: it may be older than this page.",
        };
        Some(sentence.to_owned())
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::Studies]
    }
}

/// Shows the form, the jobs and the table.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(chosen) = state.studies.chosen() else { return };
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        form(ui, state, chosen, out);
        ui.separator();
        if state.studies.jobs.is_empty() {
            ui.label(theme::note("No study was started yet."));
        }
        for job in state.studies.jobs.iter().rev() {
            show_job(ui, state, job, out);
        }
        table(ui, state);
    });
}

fn form(ui: &mut Ui, state: &State, chosen: &StudyInfo, out: &mut Vec<Command>) {
    let mut order = state.studies.order.clone();
    ui.horizontal(|ui| {
        ui.label(theme::label("study"));
        let choice = ComboBox::from_id_salt("study").width(150.0).selected_text(&chosen.name);
        let shown = choice.show_ui(ui, |ui| {
            for info in state.studies.infos.iter().flatten() {
                let is_chosen = order.study == info.name;
                if panels::entry(ui, is_chosen, &info.name).on_hover_text(&info.question).clicked() {
                    order.study.clone_from(&info.name);
                }
            }
        });
        shown.response.accessible_name("which study");
    });
    ui.add(egui::Label::new(theme::note(&chosen.question)).wrap());
    let unit = if chosen.unit.is_empty() { String::new() } else { format!(", {}", chosen.unit) };
    let grid = if chosen.grid.is_empty() { "none".to_owned() } else { chosen.grid.join(",") };
    Grid::new("order").num_columns(2).spacing([8.0, 3.0]).show(ui, |ui| {
        for (name, text, hint) in [
            ("seeds".to_owned(), &mut order.seeds, "10 worlds from seed 1 on".to_owned()),
            ("configurations".to_owned(), &mut order.configurations, chosen.configurations.join(",")),
            (format!("{}{unit}", chosen.variable), &mut order.grid, grid),
        ] {
            let label = ui.label(theme::label(&name));
            let edit =
                TextEdit::singleline(text).hint_text(hint).desired_width(ui.available_width().max(120.0));
            ui.add(edit).labelled_by(label.id);
            ui.end_row();
        }
    });
    let problem = order.request(&chosen.name).err();
    ui.horizontal_wrapped(|ui| {
        let button = egui::Button::new("Start the study").min_size(vec2(110.0, 24.0));
        if ui.add_enabled(problem.is_none(), button).clicked() {
            out.push(Command::StartStudy);
        }
        match &problem {
            Some(problem) => ui.label(RichText::new(problem).small().color(theme::lost())),
            None => ui.label(theme::note("Left empty, a field means what stands in it in grey.")),
        };
    });
    if order != state.studies.order {
        out.push(Command::OrderStudy(order));
    }
}

fn show_job(ui: &mut Ui, state: &State, job: &StudyJob, out: &mut Vec<Command>) {
    let (word, colour) = word_of(job.state);
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(&job.study).strong().color(theme::strong())).on_hover_text(&job.command);
        ui.label(RichText::new(word).color(colour));
        if job.n > 0 {
            ui.label(theme::number(format!("{} of {}", job.k, job.n)).size(11.0));
        }
        match job.state {
            StudyState::Waiting | StudyState::Running => {
                if ui.small_button("Cancel").clicked() {
                    out.push(Command::CancelStudy(job.id.clone()));
                }
            }
            StudyState::Cancelled | StudyState::Failed => {
                if ui.small_button("Resume").clicked() {
                    out.push(Command::ResumeStudy(job.id.clone()));
                }
            }
            StudyState::Done => {
                if ui.small_button("Report").on_hover_text("Opens the report in a new tab").clicked() {
                    out.push(Command::OpenReport(job.id.clone()));
                }
            }
        }
        let is_looked = state.studies.looked.as_ref() == Some(&job.id);
        if ui.add(egui::Button::selectable(is_looked, RichText::new("Table").size(12.0))).clicked() {
            out.push(Command::LookAtStudy(job.id.clone()));
        }
    });
    if matches!(job.state, StudyState::Waiting | StudyState::Running) {
        let share = job.k as f32 / job.n.max(1) as f32;
        ui.add(egui::ProgressBar::new(share).desired_height(6.0).fill(theme::accent()));
    }
    if !job.doing.is_empty() {
        ui.add(egui::Label::new(theme::note(&job.doing)).wrap());
    }
    for notice in &job.notices {
        ui.add(egui::Label::new(RichText::new(format!("! {notice}")).small().color(theme::lost())).wrap());
    }
    ui.add_space(4.0);
}

fn word_of(state: StudyState) -> (&'static str, egui::Color32) {
    match state {
        StudyState::Waiting => ("waiting", theme::weak()),
        StudyState::Running => ("running", theme::accent()),
        StudyState::Done => ("done", theme::tracking()),
        StudyState::Cancelled => ("cancelled", theme::lost()),
        StudyState::Failed => ("failed", theme::failed()),
    }
}

/// The table of the job that is looked at.
fn table(ui: &mut Ui, state: &State) {
    let Some(job) = &state.studies.looked else { return };
    ui.separator();
    let Some(rows) = state.studies.rows.get(job) else {
        ui.label(theme::note("Loading the table …"));
        return;
    };
    if rows.is_empty() {
        ui.label(theme::note("No unit of this study is done yet: its rows appear as they are."));
        return;
    }
    let of_job = state.studies.jobs.iter().find(|known| &known.id == job);
    let infos = state.studies.infos.iter().flatten();
    let variable = of_job.and_then(|job| infos.clone().find(|info| info.name == job.study));
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

/// Table II with ours beside it, for the study that has odometry.
fn table_ii(ui: &mut Ui, rows: &[Row], job: &str) {
    let table = terrain_table::table(rows);
    if table.is_empty() {
        return;
    }
    ui.label(theme::note("Table II (R125), the paper's rows beside ours"));
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

/// A value of a row; a dash where there is none.
fn cell(row: &Row, column: &str, factor: f64) -> String {
    match (row.number(column), row.columns.get(column).and_then(|value| value.as_str())) {
        (Some(number), _) if factor == 1.0 && number.fract() == 0.0 => format!("{number}"),
        (Some(number), _) => format!("{:.2}", number * factor),
        (None, Some(word)) => word.to_owned(),
        (None, None) => "–".to_owned(),
    }
}
