//! The placeholder for an image of a step that cannot be shown: hatching, the file at fault, a hint, and a button to try
//! again. Only this step is hatched; the others can still be selected.

use egui::{Align, Button, Label, Layout, RichText, Stroke, Ui, UiBuilder, pos2, vec2};
use sightline_api::wire::Problem;

use crate::command::Command;
use crate::files::FilesCommand;
use crate::theme;

/// Spacing of the hatching lines, points.
const APART: f32 = 14.0;

/// Fills the panel.
pub(crate) fn show(ui: &mut Ui, word: &str, step: usize, problem: &Problem, out: &mut Vec<Command>) {
    let space = ui.available_rect_before_wrap();
    let painter = ui.painter().with_clip_rect(space);
    let count = ((space.width() + space.height()) / APART) as usize;
    for line in 0..count {
        let x = space.left() + APART * line as f32;
        let ends = [pos2(x, space.top()), pos2(x - space.height(), space.bottom())];
        painter.line_segment(ends, Stroke::new(1.0, theme::weak().gamma_multiply(0.25)));
    }
    let builder = UiBuilder::new().max_rect(space.shrink(6.0)).layout(Layout::top_down(Align::Center));
    let mut middle = ui.new_child(builder);
    middle.add_space((space.height() / 2.0 - 40.0).clamp(0.0, 80.0));
    egui::Frame::new().fill(theme::panel()).inner_margin(8).show(&mut middle, |ui| {
        let words = format!("The {word} image of step {step} cannot be shown: {}", problem.detail);
        ui.add(Label::new(RichText::new(words).color(theme::text())).wrap());
        if let Some(hint) = &problem.hint {
            ui.add(Label::new(theme::note(hint)).wrap());
        }
        let button = Button::new("Try again").min_size(vec2(24.0, 24.0));
        let name = format!("try the {word} image of step {step} again");
        if ui.add(button).accessible_name(name).clicked() {
            out.push(Command::Files(FilesCommand::TryAgain));
        }
    });
    ui.advance_cursor_after_rect(space);
}
