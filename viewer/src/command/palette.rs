//! The palette: finds any command by a few letters of its name.

use egui::{Id, Key, Modal, RichText, Ui, WidgetInfo};

use crate::command::actions;
use crate::command::actions::Action;
use crate::command::keys;
use crate::command::{Command, Mode, Search};
use crate::state::State;
use crate::theme;

/// Shows the palette while it is open.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Mode::Palette(search) = &state.mode else { return };
    let mut words = search.words.clone() + &keys::typed_ahead(ui.ctx(), |c| !c.is_control());
    let found = actions::find(state, &words);
    let chosen = search.chosen.min(found.len().saturating_sub(1));
    let step = ui.input_mut(|input| {
        let down = input.consume_key(egui::Modifiers::NONE, Key::ArrowDown);
        let up = input.consume_key(egui::Modifiers::NONE, Key::ArrowUp);
        isize::from(down) - isize::from(up)
    });
    let moved = chosen.saturating_add_signed(step).min(found.len().saturating_sub(1));
    // Anchored at the top, so that the field does not move when the list grows or shrinks.
    let place = Modal::default_area(Id::unique("palette")).anchor(egui::Align2::CENTER_TOP, [0.0, 90.0]);
    let modal = Modal::new(Id::unique("palette")).area(place);
    let modal = modal.backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(520.0);
        let field = egui::TextEdit::singleline(&mut words)
            .hint_text("an action, a step, a panel, a setting, a value")
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("palette");
        field.request_focus();
        ui.add_space(4.0);
        if found.is_empty() {
            ui.label(theme::label("Nothing is called that. Try one word, or part of one."));
        }
        let clicked = list(ui, &found, moved);
        ui.add_space(4.0);
        ui.label(theme::note("Up and Down choose, Enter does it, Esc closes"));
        let entered = clicked.or_else(|| ui.input(|input| input.key_pressed(Key::Enter)).then_some(moved));
        if entered.is_some() {
            // The next key belongs to the page again, even if it follows immediately.
            field.surrender_focus();
        }
        entered
    });
    // Text entered in the same frame as Enter counts; the displayed list is of the previous frame.
    let is_newer = words != search.words;
    let meant = if is_newer { actions::find(state, &words) } else { found };
    let at = modal.inner.map(|at| if is_newer { 0 } else { at });
    if let Some(action) = at.and_then(|at| meant.get(at)) {
        out.push(Command::SetMode(Mode::Look));
        out.push(action.command.clone());
    } else if modal.should_close() {
        out.push(Command::SetMode(Mode::Look));
    } else if words != search.words {
        out.push(Command::SetMode(Mode::Palette(Search { words, chosen: 0 })));
    } else if moved != search.chosen {
        out.push(Command::SetMode(Mode::Palette(Search { words, chosen: moved })));
    }
}

/// Shows the results; returns the index of the clicked one.
fn list(ui: &mut Ui, found: &[Action], chosen: usize) -> Option<usize> {
    let mut clicked = None;
    for (at, action) in found.iter().enumerate() {
        let row = ui.allocate_response(egui::vec2(ui.available_width(), 24.0), egui::Sense::click());
        row.widget_info(|| {
            WidgetInfo::selected(egui::Role::ListBoxOption, true, at == chosen, &action.title)
        });
        if at == chosen || row.hovered() {
            ui.painter().rect_filled(row.rect, 3.0, theme::selected());
        }
        let mut line = ui.new_child(
            egui::UiBuilder::new()
                .max_rect(row.rect.shrink2(egui::vec2(6.0, 0.0)))
                .layout(egui::Layout::right_to_left(egui::Align::Center)),
        );
        line.label(RichText::new(&action.keys).monospace().small().color(theme::accent()));
        line.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.add(egui::Label::new(RichText::new(&action.title).color(theme::text())).truncate());
        });
        if row.clicked() {
            clicked = Some(at);
        }
    }
    clicked
}
