//! The row above the left image while runs are compared: how, which stops belong together, and where they differ first.

use egui::{Button, ComboBox, RichText, Ui, vec2};
use sightline_session::compare::Alignment;

use crate::command::Command;
use crate::compare::{Ask, Closeness, View};
use crate::state::State;
use crate::{panels, theme};

/// Shows the row, where runs are compared or the target is held still.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let compare = &state.compare;
    if !state.is_comparing() && !compare.is_held && !compare.has_onion_skin {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(5.0, 2.0);
        if state.is_comparing() {
            choices(ui, state, out);
        }
        for (words, help, is_on, ask) in [
            (
                "hold target",
                "The target stays still and its drift shows (S)",
                compare.is_held,
                Ask::Stabilise,
            ),
            (
                "step before",
                "The step before shines through (onion skin)",
                compare.has_onion_skin,
                Ask::OnionSkin,
            ),
        ] {
            let mut is_on = is_on;
            if ui.checkbox(&mut is_on, RichText::new(words).size(11.5)).on_hover_text(help).changed() {
                out.push(Command::Compare(ask));
            }
        }
    });
    if state.is_comparing() {
        ui.horizontal(|ui| divergence(ui, state, out));
    }
}

fn choices(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let compare = &state.compare;
    let view = compare.view;
    choice(
        ui,
        ("compare by", "view"),
        view.word(),
        View::ALL.map(|v| (v, v.word(), v.help())),
        view,
        |view| {
            out.push(Command::Compare(Ask::View(view)));
        },
    );
    let align = compare.align;
    let all = Alignment::ALL.map(|align| (align, align.word(), align.sentence()));
    choice(ui, ("aligned by", "align"), align.word(), all, align, |align| {
        out.push(Command::Compare(Ask::Align(align)));
    });
    let close = compare.closeness;
    let all = Closeness::ALL.map(|close| (close, close.word(), "What counts as a difference."));
    choice(ui, ("counts", "closeness"), close.word(), all, close, |closeness| {
        out.push(Command::Compare(Ask::Closeness(closeness)));
    });
}

/// A box to choose from, with what it is about before it.
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

/// The sentence of the first divergence, and the way there.
fn divergence(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let button = Button::new(RichText::new("First divergence (D)").size(11.5)).min_size(vec2(0.0, 24.0));
    if ui.add(button).on_hover_text("Goes to the step and the stage at which the runs differ first").clicked()
    {
        out.push(Command::Compare(Ask::FirstDivergence));
    }
    let label = egui::Label::new(RichText::new(sentence(state)).size(11.5).color(theme::text())).truncate();
    ui.add(label);
}

/// Where this run and each other one differ first.
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
