//! The help sheet, and the field for a step to go to.

use egui::{Id, Key, Modal, RichText, Ui};

use crate::breakpoints::goto;
use crate::command::{Command, Go, Mode};
use crate::command::{keys, table};
use crate::state::State;
use crate::tour::Turn;
use crate::{cache, theme};

/// Shows the help sheet or the field, if one of them is open.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    match &state.mode {
        Mode::Help => sheet(ui, state, out),
        Mode::GoTo(typed) => go_to(ui, state, typed, out),
        Mode::Look | Mode::Pick | Mode::Palette(_) => {}
    }
}

fn sheet(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let modal = Modal::new(Id::unique("help")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(470.0);
        // Leaves room for the text below the list, even on a small screen.
        let height = (ui.ctx().content_rect().height() - 260.0).max(120.0);
        ui.label(theme::title("Keys and pointer"));
        let words = search(ui);
        let list = egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        list.auto_shrink(false).show(ui, |ui| key_list(ui, &words));
        ui.add_space(6.0);
        ui.label(theme::title("Conventions"));
        for line in [
            "Pixels: x right, y down; (0, 0) is the centre of the first pixel.",
            "Rover frame: x forward, y right, z down. Site frame: x north, y east, z down.",
            "Ellipses are 3σ, in images and on the map; a legend that names 1σ, 2σ, 3σ has all three.",
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
            ui.button("Close").accessible_name("Close keys and conventions").clicked()
        })
        .inner
    });
    if modal.inner || modal.should_close() {
        out.push(Command::SetMode(Mode::Look));
    }
}

/// Shows the field that filters the keys, and returns its text.
fn search(ui: &mut Ui) -> String {
    let id = ui.scope_id().with("help search");
    let mut words = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_default();
    let field = egui::TextEdit::singleline(&mut words).hint_text("search keys").desired_width(f32::INFINITY);
    ui.add(field).accessible_name("search keys");
    ui.data_mut(|data| data.insert_temp(id, words.clone()));
    words
}

/// Shows the keys whose line contains all words, by group.
fn key_list(ui: &mut Ui, words: &str) {
    let mut is_empty = true;
    for group in table::Group::ALL {
        let lines: Vec<_> = table::sheet(group).filter(|(keys, help)| matches(words, keys, help)).collect();
        if lines.is_empty() {
            continue;
        }
        is_empty = false;
        ui.add_space(4.0);
        ui.label(theme::title(group.title()));
        egui::Grid::new(group.title()).num_columns(2).spacing([20.0, 3.0]).min_col_width(130.0).show(
            ui,
            |ui| {
                for (keys, meaning) in lines {
                    ui.label(RichText::new(keys).monospace().color(theme::accent()));
                    ui.label(meaning);
                    ui.end_row();
                }
            },
        );
    }
    if is_empty {
        ui.label(theme::label("No key matches."));
    }
}

/// Whether a line of the sheet contains all words.
fn matches(words: &str, keys: &str, help: &str) -> bool {
    let line = format!("{keys} {help}").to_lowercase();
    words.to_lowercase().split_whitespace().all(|word| line.contains(word))
}

fn go_to(ui: &mut Ui, state: &State, typed: &str, out: &mut Vec<Command>) {
    // Text entered before the field had the focus would otherwise be lost.
    let ahead = keys::typed_ahead(ui.ctx(), |c| !c.is_control());
    // The letter that opened the field may also arrive as text.
    let ahead = if typed.is_empty() { ahead.trim_start_matches(['g', 'G']) } else { &ahead };
    let mut text = format!("{typed}{ahead}");
    let modal = Modal::new(Id::unique("go to")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(330.0);
        ui.label(theme::title("Go to step"));
        let field = ui.add(egui::TextEdit::singleline(&mut text).hint_text("12, +5, t=3.5, lost"));
        field.accessible_name("go to step").request_focus();
        let meant = state.step_meant(&text);
        match &meant {
            Ok(step) => ui.label(theme::note(format!("step {step}"))),
            Err(_) if text.is_empty() => ui.add(egui::Label::new(theme::note(goto::FORMS)).wrap()),
            Err(why) => ui.add(egui::Label::new(RichText::new(why).small().color(theme::lost())).wrap()),
        };
        ui.label(theme::note("Enter goes, Esc cancels"));
        (ui.input(|input| input.key_pressed(Key::Enter)), meant)
    });
    match modal.inner {
        // Invalid input stays in the field, so that the user can correct it.
        (true, Err(_)) if !text.trim().is_empty() => {}
        (true, meant) => {
            out.extend(meant.ok().map(|step| Command::Go(Go::Step(step))));
            out.push(Command::SetMode(Mode::Look));
            return;
        }
        (false, _) if modal.should_close() => {
            out.push(Command::SetMode(Mode::Look));
            return;
        }
        (false, _) => {}
    }
    if text != typed {
        out.push(Command::SetMode(Mode::GoTo(text)));
    }
}
