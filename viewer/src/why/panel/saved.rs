//! What would have saved the step: the question, how far it is, and the findings with what can be done with each.

use egui::{Button, Label, ProgressBar, RichText, Ui, vec2};
use sightline_session::counterfactual::wire::{Question, QuestionState};
use sightline_session::counterfactual::{Answer, Finding, Outcome};
use sightline_session::view::RunView;

use crate::command::Command;
use crate::state::{State, run_letter};
use crate::theme;
use crate::why::{Ask, Told};

/// The button that asks.
pub(crate) fn button(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let row = state.row();
    let is_worth =
        row.is_some_and(|row| !row.fault && (row.state != "tracking" || row.tracked == Some(false)));
    let help =
        "Looks for the smallest change of each setting with which this step would have been accepted. Key C";
    let why_not = "This step was accepted, and nothing says that it is wrong: there is nothing to save.";
    let button = ui.add_enabled(is_worth, Button::new("What would have saved it?").min_size(vec2(0.0, 24.0)));
    if button.on_hover_text(help).on_disabled_hover_text(why_not).clicked() {
        out.push(Command::Why(Ask::Saved));
    }
}

/// The findings so far.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    match state.question() {
        None => {}
        Some(Told::Waiting) => {
            ui.label(theme::note("Asking …"));
        }
        Some(Told::Refused(why)) => {
            ui.add(Label::new(RichText::new(why).color(theme::lost())).wrap());
        }
        Some(Told::Here(question)) => show_question(ui, state, question, out),
    }
}

fn show_question(ui: &mut Ui, state: &State, question: &Question, out: &mut Vec<Command>) {
    ui.add_space(2.0);
    ui.label(theme::title("what would have saved it"));
    progress(ui, question, out);
    let Some(answer) = &question.answer else { return };
    for (number, finding) in answer.findings.iter().enumerate() {
        ui.push_id(number, |ui| show_finding(ui, state, number, finding, out));
    }
    if question.state == QuestionState::Done && answer.findings.is_empty() {
        ui.label("No change of one setting, and no other prediction, turns this step.");
    }
    if !answer.without.is_empty() {
        let words = format!("{} without effect", answer.without.len());
        ui.label(theme::note(words)).on_hover_text(answer.without.join(", "));
    }
}

fn progress(ui: &mut Ui, question: &Question, out: &mut Vec<Command>) {
    let (k, n, doing, runs) = match &question.answer {
        Some(Answer { k, n, doing, runs, .. }) => (*k, *n, doing.as_str(), *runs),
        None => (0, 0, "", 0),
    };
    match question.state {
        QuestionState::Unasked => {}
        QuestionState::Waiting | QuestionState::Running => {
            ui.horizontal(|ui| {
                if ui.button("Cancel search").clicked() {
                    out.push(Command::Why(Ask::CancelSaved));
                }
                let words =
                    if n == 0 { "waiting for its turn".to_owned() } else { format!("{k} of {n}: {doing}") };
                ui.add(ProgressBar::new(k as f32 / n.max(1) as f32).text(words));
            });
        }
        QuestionState::Done => {
            ui.label(theme::note(format!(
                "{n} settings and places looked at, the step computed {runs} times"
            )));
        }
        QuestionState::Cancelled => {
            ui.label(theme::note(format!(
                "Cancelled after {k} of {n}; what was found is kept. C goes on anew."
            )));
        }
        QuestionState::Failed => {
            let why = question.problem.as_deref().unwrap_or("it failed");
            ui.add(Label::new(RichText::new(why).color(theme::failed())).wrap());
        }
    }
}

fn show_finding(ui: &mut Ui, state: &State, number: usize, finding: &Finding, out: &mut Vec<Command>) {
    let (word, colour) = match finding.outcome {
        Outcome::Right => ("RIGHT", theme::tracking()),
        Outcome::Rejected => ("REJECTED", theme::lost()),
        Outcome::Unknown => ("ACCEPTED", theme::prediction()),
        Outcome::False => ("FALSE", theme::failed()),
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(word).strong().color(colour));
        ui.label(theme::note(format!("{:.0} %", 100.0 * finding.relative)))
            .on_hover_text("The size of the change, over the present value");
    });
    ui.add(Label::new(RichText::new(&finding.sentence).color(theme::text())).wrap());
    let what_if = finding.what_if();
    ui.horizontal_wrapped(|ui| {
        // Their names tell one finding from the others.
        let name = |verb: &str| format!("{verb} finding {}", number + 1);
        let tried = state.trial().is_some_and(|trial| trial.what_if == what_if);
        let attempt = ui.add(Button::new("Try").selected(tried).min_size(vec2(40.0, 24.0)));
        if attempt.accessible_name(name("try")).on_hover_text("Shows it as a ghost at this step").clicked() {
            out.push(Command::Why(Ask::Try(what_if.clone())));
        }
        match state.branch_of(&what_if) {
            Some(branch) => branch_words(ui, state, branch, out),
            None => {
                let run = ui.add(Button::new("Run from here").min_size(vec2(90.0, 24.0)));
                let help = "Leaves this run with that change, to see how long it stays tracked";
                if run.accessible_name(name("run from here with")).on_hover_text(help).clicked() {
                    out.push(Command::Why(Ask::BranchWith(what_if.clone())));
                }
            }
        }
    });
}

/// How long a branch stayed tracked.
fn branch_words(ui: &mut Ui, state: &State, branch: &RunView, out: &mut Vec<Command>) {
    let step = state.cursor.step;
    let later = || branch.rows.iter().filter(|row| row.step > step);
    let stayed = later().take_while(|row| row.state == "tracking" && row.tracked != Some(false)).count();
    let words = format!(
        "run {}: {stayed} of {} further steps stay tracked",
        run_letter(branch.number),
        later().count()
    );
    if ui.link(words).clicked() {
        out.extend(state.cursor.target.map(|target| Command::Look { target, run: branch.number }));
    }
}
