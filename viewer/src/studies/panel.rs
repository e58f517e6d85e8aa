//! The validation studies as jobs: choose one, start it, follow its progress, read its table and its report.

use egui::{ComboBox, Grid, RichText, ScrollArea, TextEdit, Ui, vec2};
use sightline_study::wire::{StudyInfo, StudyJob, StudyState};

use crate::command::Command;
use crate::figure;
use crate::panels::numbers::counted;
use crate::panels::pane::Need;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::studies::estimate::{self, Estimate};
use crate::studies::{StudyForm, WORLDS, table};
use crate::{panels, theme};

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
        if !figure::is_on_paper() {
            form(ui, state, chosen, out);
            ui.separator();
        }
        if state.studies.jobs.is_empty() {
            ui.label(theme::note("No study was started yet."));
        }
        for job in state.studies.jobs.iter().rev() {
            // A fixed id: a press that arrives a frame late must not meet another job's button.
            let own = egui::UiBuilder::new().scope_id(egui::Id::unique(("study", &job.id)));
            ui.scope_builder(own, |ui| show_job(ui, state, job, out));
        }
        table::show(ui, state);
    });
}

fn form(ui: &mut Ui, state: &State, chosen: &StudyInfo, out: &mut Vec<Command>) {
    let mut form = state.studies.form.clone();
    ui.horizontal(|ui| {
        ui.label(theme::label("study"));
        let choice = ComboBox::from_id_salt("study").width(150.0).selected_text(&chosen.name);
        let shown = choice.show_ui(ui, |ui| {
            for info in state.studies.infos.iter().flatten() {
                let is_chosen = form.study == info.name;
                if panels::entry(ui, is_chosen, &info.name).on_hover_text(&info.question).clicked() {
                    form.study.clone_from(&info.name);
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
            ("seeds".to_owned(), &mut form.seeds, format!("{WORLDS} worlds from seed 1 on")),
            ("configurations".to_owned(), &mut form.configurations, StudyForm::proposed(chosen).join(",")),
            (format!("{}{unit}", chosen.variable), &mut form.grid, grid),
        ] {
            let label = ui.label(theme::label(&name));
            let edit =
                TextEdit::singleline(text).hint_text(hint).desired_width(ui.available_width().max(120.0));
            ui.add(edit).labelled_by(label.id);
            ui.end_row();
        }
    });
    start(ui, state, chosen, &form, out);
    let all = chosen.configurations.join(",");
    if chosen.configurations.len() > StudyForm::proposed(chosen).len() && form.configurations != all {
        let words = format!("Use all {} configurations of this study", chosen.configurations.len());
        if ui.link(theme::note(words)).clicked() {
            form.configurations = all;
        }
    }
    if form != state.studies.form {
        out.push(Command::SetStudyForm(form));
    }
}

/// Shows the button that starts the study, with the number of runs and the expected duration.
fn start(ui: &mut Ui, state: &State, chosen: &StudyInfo, form: &StudyForm, out: &mut Vec<Command>) {
    let request = form.request(chosen);
    ui.horizontal_wrapped(|ui| {
        let button = egui::Button::new("Start the study").min_size(vec2(110.0, 24.0));
        if ui.add_enabled(request.is_ok(), button).clicked() {
            out.push(Command::StartStudy);
        }
        match &request {
            Err(problem) => ui.label(RichText::new(problem).small().color(theme::lost())),
            Ok(new) => {
                let estimate = Estimate::of(new, chosen, &state.studies.jobs);
                ui.label(theme::note(estimate.words()).color(theme::text()))
            }
        };
    });
    ui.label(theme::note("Empty fields use the grey defaults."));
}

fn show_job(ui: &mut Ui, state: &State, job: &StudyJob, out: &mut Vec<Command>) {
    let (word, colour) = word_of(job.state);
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(&job.study).strong().color(theme::strong())).on_hover_text(&job.command);
        ui.label(RichText::new(word).color(colour));
        // Placed before the parts that change during the study, so that the buttons do not move.
        if !figure::is_on_paper() {
            buttons(ui, state, job, out);
        }
        if job.n > 0 {
            ui.label(theme::number(format!("{} of {}", job.k, counted(job.n, "run"))).size(11.0));
        }
        if let Some(left) = estimate::left(job) {
            ui.label(theme::note(left));
        }
    });
    let settings = estimate::settings(job);
    if !settings.is_empty() {
        ui.add(egui::Label::new(theme::note(settings)).wrap());
    }
    if matches!(job.state, StudyState::Waiting | StudyState::Running) {
        let bar = egui::ProgressBar::new(job.share as f32).desired_height(6.0).fill(theme::accent());
        ui.add(bar).accessible_name(format!("{:.0} % done", 100.0 * job.share));
    }
    // Studies of earlier versions repeat their state here.
    if !job.doing.is_empty() && job.doing != word {
        ui.add(egui::Label::new(theme::note(&job.doing)).wrap());
    }
    for notice in &job.notices {
        ui.add(egui::Label::new(RichText::new(format!("! {notice}")).small().color(theme::lost())).wrap());
    }
    ui.add_space(4.0);
}

/// Shows the buttons of a job.
fn buttons(ui: &mut Ui, state: &State, job: &StudyJob, out: &mut Vec<Command>) {
    match job.state {
        StudyState::Waiting | StudyState::Running if state.studies.cancelling.contains(&job.id) => {
            ui.label(theme::note("cancelling …")).on_hover_text("The run that has begun ends first.");
        }
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
    let is_shown_job = state.studies.shown_job.as_ref() == Some(&job.id);
    if ui.add(egui::Button::selectable(is_shown_job, RichText::new("Result").size(12.0))).clicked() {
        out.push(Command::ShowStudy(job.id.clone()));
    }
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
