//! The counterfactuals of a step: the search, its progress, and the findings with their actions.

use egui::{Button, CollapsingHeader, Color32, Frame, Label, Margin, ProgressBar, RichText, Ui, vec2};
use sightline_session::counterfactual::wire::{Question, QuestionState};
use sightline_session::counterfactual::{Answer, Finding, Outcome, SettingChange};
use sightline_session::view::RunView;
use sightline_session::what_if::WhatIf;
use sightline_session::why::gates::label;
use sightline_session::why::words::{number, setting_name, signed};

use crate::command::Command;
use crate::state::{State, run_letter};
use crate::theme;
use crate::why::panel::view;
use crate::why::{Remote, WhyCommand, WhySection};

/// The button that starts the search.
pub(crate) fn button(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let row = state.row();
    let is_worth =
        row.is_some_and(|row| !row.fault && (row.state != "tracking" || row.tracked == Some(false)));
    let help =
        "Looks for the smallest change of each setting with which this step would have been accepted. Key C";
    let why_not = "This step was accepted, and nothing says that it is wrong: there is nothing to save.";
    let button = ui.add_enabled(is_worth, Button::new("What would have saved it?").min_size(vec2(0.0, 24.0)));
    if button.on_hover_text(help).on_disabled_hover_text(why_not).clicked() {
        out.push(Command::Why(WhyCommand::Saved));
    }
}

/// Shows the findings so far.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let top = ui.cursor().top();
    match state.question() {
        None => {}
        Some(Remote::Pending) => {
            ui.label(theme::note("Asking …"));
        }
        Some(Remote::Refused(why)) => {
            ui.add(Label::new(RichText::new(why).color(theme::lost())).wrap());
        }
        Some(Remote::Received(question)) => show_question(ui, state, question, out),
    }
    let is_here = match state.question() {
        Some(Remote::Received(question)) => {
            let is_searching = matches!(question.state, QuestionState::Waiting | QuestionState::Running);
            !is_searching || question.answer.as_ref().is_some_and(|answer| !answer.findings.is_empty())
        }
        remote => !matches!(remote, Some(Remote::Pending)),
    };
    view::scroll_to(ui, state.why.scroll_request, WhySection::Saved, top, is_here);
}

fn show_question(ui: &mut Ui, state: &State, question: &Question, out: &mut Vec<Command>) {
    ui.add_space(2.0);
    ui.label(theme::title("what would have saved it"));
    progress(ui, question, out);
    let Some(answer) = &question.answer else { return };
    let all = || answer.findings.iter().enumerate();
    for (number, finding) in all().filter(|(_, finding)| finding.outcome != Outcome::False) {
        ui.push_id(number, |ui| show_finding(ui, state, number, finding, out));
    }
    let is_false = |(_, finding): &(usize, &Finding)| finding.outcome == Outcome::False;
    let count = all().filter(is_false).count();
    if count > 0 {
        let changes = if count == 1 { "1 change leads" } else { &format!("{count} changes lead") };
        let title = theme::note(format!("{changes} to a wrong target"));
        CollapsingHeader::new(title).id_salt("wrong targets").show(ui, |ui| {
            for (number, finding) in all().filter(is_false) {
                ui.push_id(number, |ui| show_finding(ui, state, number, finding, out));
            }
        });
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
                    out.push(Command::Why(WhyCommand::CancelSaved));
                }
                let words = if n == 0 {
                    "waiting for its turn".to_owned()
                } else {
                    format!("{k} of {n}: {}", setting_name(doing))
                };
                ui.add(ProgressBar::new(k as f32 / n.max(1) as f32).text(words));
            });
        }
        QuestionState::Done => {
            ui.label(theme::note(format!("Searched {n} changes ({runs} re-runs of this step)")));
        }
        QuestionState::Cancelled => {
            ui.label(theme::note(format!(
                "Cancelled after {k} of {n}; the findings are kept. Press C to search again."
            )));
        }
        QuestionState::Failed => {
            let why = question.problem.as_deref().unwrap_or("it failed");
            ui.add(Label::new(RichText::new(why).color(theme::failed())).wrap());
        }
    }
}

/// The outcome of a finding as a word, in the colour of the state.
fn outcome(finding: &Finding) -> (&'static str, Color32) {
    match finding.outcome {
        Outcome::Right => ("Correct", theme::tracking()),
        Outcome::Rejected => ("Rejected", theme::lost()),
        Outcome::Unknown => ("Accepted", theme::prediction()),
        Outcome::False => ("Wrong target", theme::failed()),
    }
}

/// Shows a finding as a row: outcome, change, effect, and actions.
fn show_finding(ui: &mut Ui, state: &State, number: usize, finding: &Finding, out: &mut Vec<Command>) {
    let (word, colour) = outcome(finding);
    let frame = Frame::new().fill(theme::well()).corner_radius(3).inner_margin(Margin::symmetric(6, 3));
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(word).strong().color(colour));
            let size = theme::note(format!("change {:.0} %", 100.0 * finding.relative));
            ui.label(size).on_hover_text("The size of the change, over the present value");
            ui.label(RichText::new(changes(finding)).color(theme::strong())).on_hover_text(&finding.sentence);
            ui.label(theme::note(effect(finding)));
        });
        ui.horizontal_wrapped(|ui| {
            let what_if = finding.what_if();
            attempt(ui, state, (&format!("try finding {}", number + 1), "Try"), &what_if, out);
            if let Some(change) = &finding.with_margin {
                let words = format!("Try with margin: {}", value(change));
                let name = format!("try finding {} with margin", number + 1);
                let settings = [(change.setting.clone(), change.to.clone())].into_iter().collect();
                let wide = WhatIf { settings, ..WhatIf::default() };
                attempt(ui, state, (&name, &words), &wide, out);
            }
            run(ui, state, number, &what_if, out);
        });
    });
}

/// The changes of a finding, each with its unit.
fn changes(finding: &Finding) -> String {
    let settings =
        finding.changes.iter().map(|change| format!("{} {}", setting_name(&change.setting), change.words()));
    let moved = finding.moved.as_ref().map(|moved| {
        let [dx, dy] = [moved.to.x - moved.from.x, moved.to.y - moved.from.y];
        format!("prediction moved by ({dx:+.1}, {dy:+.1}) px")
    });
    settings.chain(moved).collect::<Vec<_>>().join(", ")
}

/// The effect of a finding: its distance from the ground truth, and the margin of the failed gate.
fn effect(finding: &Finding) -> String {
    let error = finding.row.err_px.map(|px| format!("{} px from the truth", number(px)));
    let margin = finding.gate.as_ref().zip(finding.margin_after).map(|(gate, margin)| {
        format!("{} margin {} {}", label(gate), signed(margin), finding.gate_unit).trim_end().to_owned()
    });
    error.into_iter().chain(margin).collect::<Vec<_>>().join(" · ")
}

/// The value after a change, with its unit.
fn value(change: &SettingChange) -> String {
    let value = change.to.as_f64().map_or_else(|| change.to.to_string(), number);
    format!("{value} {}", change.unit).trim_end().to_owned()
}

/// A button that tries a change.
fn attempt(
    ui: &mut Ui,
    state: &State,
    (name, words): (&str, &str),
    what_if: &WhatIf,
    out: &mut Vec<Command>,
) {
    let tried = state.trial().is_some_and(|trial| trial.what_if == *what_if);
    let button = ui.add(Button::new(words).selected(tried).min_size(vec2(40.0, 24.0)));
    if button.accessible_name(name).on_hover_text("Shows it as a ghost at this step").clicked() {
        out.push(Command::Why(WhyCommand::Try(what_if.clone())));
    }
}

/// The button that forks the run with a change; after that, how long the branch stayed tracked.
fn run(ui: &mut Ui, state: &State, number: usize, what_if: &WhatIf, out: &mut Vec<Command>) {
    if let Some(branch) = state.branch_of(what_if) {
        branch_words(ui, state, branch, out);
        return;
    }
    let run = ui.add(Button::new("Run").min_size(vec2(40.0, 24.0)));
    let help = "Runs on from this step with the change, as a branch, to see how long it stays tracked";
    let name = format!("run from here with finding {}", number + 1);
    if run.accessible_name(name).on_hover_text(help).clicked() {
        out.push(Command::Why(WhyCommand::BranchWith(what_if.clone())));
    }
}

/// Shows how long a branch stayed tracked.
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
        out.extend(state.cursor.target.map(|target| Command::SelectRun { target, run: branch.number }));
    }
}
