//! The bar above the left image while runs are compared: the view, the alignment of stops, and the first divergence.

use egui::{Button, ComboBox, RichText, Ui, vec2};
use sightline_session::compare::Alignment;

use crate::command::Command;
use crate::compare::{CompareCommand, ToleranceLevel, View};
use crate::state::State;
use crate::{figure, panels, theme};

/// Shows the bar if runs are compared, the target is stabilised, or the previous step is overlaid.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let compare = &state.compare;
    let is_comparing = state.is_comparing();
    if figure::is_on_paper() || !is_comparing && !compare.is_stabilised && !compare.has_onion_skin {
        return;
    }
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing = vec2(5.0, 2.0);
        if is_comparing {
            let all = View::ALL.map(|view| (view, view.word(), view.help()));
            choice(ui, ("compare by", "view"), compare.view.word(), all, compare.view, |view| {
                out.push(Command::Compare(CompareCommand::View(view)));
            });
            options(ui, state, out);
            divergence(ui, state, out);
        } else {
            switches(ui, state, out);
        }
    });
}

/// The rarely used options: alignment of the stops, tolerance, and behaviour of the image.
fn options(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let compare = &state.compare;
    let button = Button::new(RichText::new("Options").size(11.5)).min_size(vec2(0.0, 24.0));
    let menu = egui::containers::menu::MenuButton::from_button(button).ui(ui, |ui| {
        ui.label(theme::note("align stops by"));
        for align in Alignment::ALL {
            let entry =
                panels::entry(ui, align == compare.align, align.word()).on_hover_text(align.sentence());
            if entry.accessible_name(format!("align by {}", align.word())).clicked() {
                out.push(Command::Compare(CompareCommand::Align(align)));
            }
        }
        ui.label(theme::note("ignore differences below"));
        for close in ToleranceLevel::ALL {
            let entry = panels::entry(ui, close == compare.tolerance, close.word());
            if entry.accessible_name(format!("ignore below {}", close.word())).clicked() {
                out.push(Command::Compare(CompareCommand::Tolerance(close)));
            }
        }
        ui.separator();
        switches(ui, state, out);
    });
    menu.0.accessible_name("compare options").on_hover_text(format!(
        "Stops aligned by {}; differences ignored below: {}",
        compare.align.word(),
        compare.tolerance.word()
    ));
}

fn switches(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let compare = &state.compare;
    for (words, help, is_on, command) in [
        (
            "hold target",
            "The target stays still and its drift shows (S)",
            compare.is_stabilised,
            CompareCommand::Stabilise,
        ),
        (
            "overlay previous step",
            "The previous step shines through (onion skin)",
            compare.has_onion_skin,
            CompareCommand::OnionSkin,
        ),
    ] {
        let mut is_on = is_on;
        if ui.checkbox(&mut is_on, RichText::new(words).size(11.5)).on_hover_text(help).changed() {
            out.push(Command::Compare(command));
        }
    }
}

/// A labelled combo box.
fn choice<T: Copy + PartialEq, const N: usize>(
    ui: &mut Ui,
    (name, salt): (&str, &str),
    word: &str,
    all: [(T, &'static str, &'static str); N],
    present: T,
    mut chosen: impl FnMut(T),
) {
    ui.label(theme::note(name));
    let choice = ComboBox::from_id_salt(salt).width(84.0).selected_text(RichText::new(word).size(11.5));
    let shown = choice.show_ui(ui, |ui| {
        for (value, word, help) in all {
            if panels::entry(ui, value == present, word).on_hover_text(help).clicked() {
                chosen(value);
            }
        }
    });
    shown.response.accessible_name(format!("{name}: {word}"));
}

/// Shows the sentence of the first divergence, and the button that goes there.
fn divergence(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let button = Button::new(RichText::new("First divergence (D)").size(11.5)).min_size(vec2(0.0, 24.0));
    if ui.add(button).on_hover_text("Goes to the step and the stage at which the runs differ first").clicked()
    {
        out.push(Command::Compare(CompareCommand::FirstDivergence));
    }
    let label = egui::Label::new(RichText::new(sentence(state)).size(11.5).color(theme::text())).truncate();
    ui.add(label);
}

/// The first divergence between the selected run and each compared one, as sentences.
pub(crate) fn sentence(state: &State) -> String {
    if let Some(problem) = state.comparison_problem() {
        return problem.to_owned();
    }
    let Some(found) = state.comparison() else { return "comparing …".to_owned() };
    let line = |first: &sightline_session::compare::FirstDivergence| {
        format!("vs {}: {}", state.run_label(first.run), first.sentence)
    };
    found.first.iter().map(line).collect::<Vec<_>>().join("; ")
}
