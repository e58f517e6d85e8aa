//! The help sheet and the field in which a step is typed.

use egui::{Id, Key, Modal, RichText, Ui};

use crate::command::{Command, Go, Mode};
use crate::state::State;
use crate::tour::Turn;
use crate::{cache, keys, theme};

/// Shows the sheet or the field, whichever is open.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    match &state.mode {
        Mode::Help => sheet(ui, state, out),
        Mode::GoTo(typed) => go_to(ui, state, typed, out),
        Mode::Look | Mode::Pick | Mode::Palette(_) => {}
    }
}

fn sheet(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let modal = Modal::new(Id::unique("help")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(430.0);
        ui.label(theme::title("Keys and pointer"));
        egui::Grid::new("keys").num_columns(2).spacing([20.0, 3.0]).show(ui, |ui| {
            for (keys, meaning) in keys::SHEET.into_iter().chain(crate::compare::SHEET) {
                ui.label(RichText::new(keys).monospace().color(theme::accent()));
                ui.label(meaning);
                ui.end_row();
            }
        });
        ui.add_space(6.0);
        ui.label(theme::title("Conventions"));
        for line in [
            "Pixels: x right, y down; (0, 0) is the centre of the first pixel.",
            "Rover frame: x forward, y right, z down. Site frame: x north, y east, z down.",
            "Ellipses are 3σ in images, 1σ (solid) and 3σ (dashed) on the map.",
            "Scores are viridis from −1 to 1; a checker is no data.",
        ] {
            ui.add(egui::Label::new(line).wrap());
        }
        ui.add_space(6.0);
        let (used, limit) = (state.cache.bytes() >> 20, cache::LIMIT_BYTES >> 20);
        ui.label(theme::note(format!(
            "This page keeps up to {limit} MiB of steps and images; it holds {used} MiB now."
        )));
        ui.horizontal(|ui| {
            if ui.button("Take the tour").clicked() {
                out.extend([Command::SetMode(Mode::Look), Command::Tour(Turn::Begin)]);
            }
            ui.button("Close").clicked()
        })
        .inner
    });
    if modal.inner || modal.should_close() {
        out.push(Command::SetMode(Mode::Look));
    }
}

fn go_to(ui: &mut Ui, state: &State, typed: &str, out: &mut Vec<Command>) {
    let last = state.stop_count().saturating_sub(1);
    // Digits and signs: the letter that opened the field may come as text, too.
    let ahead = keys::typed_ahead(ui.ctx(), |c| c.is_ascii_digit() || matches!(c, '+' | '-'));
    let mut text = format!("{typed}{ahead}");
    let modal = Modal::new(Id::unique("go to")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(240.0);
        ui.label(theme::title("Go to step"));
        let field =
            ui.add(egui::TextEdit::singleline(&mut text).hint_text(format!("0 to {last}, or +5, -3")));
        field.request_focus();
        if !text.is_empty() && target(&text, state.cursor.step).is_none() {
            ui.label(RichText::new("a step is a whole number").small().color(theme::lost()));
        }
        ui.label(theme::note("Enter goes, Esc cancels"));
        ui.input(|input| input.key_pressed(Key::Enter))
    });
    if modal.inner {
        if let Some(step) = target(&text, state.cursor.step) {
            out.push(Command::Go(Go::Step(step)));
        }
        out.push(Command::SetMode(Mode::Look));
    } else if modal.should_close() {
        out.push(Command::SetMode(Mode::Look));
    } else if text != typed {
        out.push(Command::SetMode(Mode::GoTo(text)));
    }
}

/// The step that was typed: a number, or `+5` and `-3` from the present one.
fn target(text: &str, step: usize) -> Option<usize> {
    let text = text.trim();
    if let Some(on) = text.strip_prefix('+') {
        return Some(step.saturating_add(on.trim().parse().ok()?));
    }
    match text.strip_prefix(['-', '−']) {
        Some(back) => Some(step.saturating_sub(back.trim().parse().ok()?)),
        None => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::target;

    #[test]
    fn a_typed_step_is_absolute_or_relative() {
        assert_eq!(target("12", 3), Some(12));
        assert_eq!(target(" +5", 3), Some(8));
        assert_eq!(target("-5", 3), Some(0));
        assert_eq!(target("−2", 3), Some(1));
        assert_eq!(target("twelve", 3), None);
    }
}
