//! The text field for the motions of a directed drive. The text is parsed as it is entered; errors are shown below it.

use egui::{Id, TextEdit, Ui};
use sightline_rover::driving::{DriveCommand, Motion};

use crate::theme;

/// Shows the field.
pub(super) fn field(ui: &mut Ui, command: &mut DriveCommand) {
    let id = Id::unique("motions of the drive");
    let typed = ui.data(|data| data.get_temp::<String>(id));
    // Keep the entered text until the command has other motions.
    let is_own = |typed: &String| read(typed).map_or(true, |motions| motions == command.motions);
    let mut text = typed.filter(is_own).unwrap_or_else(|| written(&command.motions));
    let help = "Motions to drive one after the other instead of those to the goal: metres (0.5), turn and degrees (turn 20), or both \
                (0.5 turn 20), separated by commas. Empty: to the goal.";
    let edit = TextEdit::singleline(&mut text).hint_text("motions: 0.5, turn 20").desired_width(190.0);
    let response = ui.add(edit).accessible_name("motions").on_hover_text(help);
    if response.changed() {
        if let Ok(motions) = read(&text) {
            command.motions = motions;
        }
        ui.data_mut(|data| data.insert_temp(id, text.clone()));
    }
    if let Err(problem) = read(&text) {
        ui.label(egui::RichText::new(problem).color(theme::lost()));
    }
}

fn read(text: &str) -> Result<Vec<Motion>, String> {
    let parts = text.split(',').map(str::trim).filter(|part| !part.is_empty());
    parts.map(|part| part.parse::<Motion>().map_err(|error| error.to_string())).collect()
}

fn written(motions: &[Motion]) -> String {
    motions.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_are_read_as_they_are_written_and_a_wrong_one_is_named() {
        let text = "0.5, turn 20, -0.3 turn 5";
        assert_eq!(written(&read(text).unwrap()), text);
        assert_eq!(read(" 0.5 ,, "), read("0.5"));
        assert_eq!(read(""), Ok(Vec::new()));
        assert!(read("0.5, left 20").unwrap_err().contains("`left 20` is not a motion"));
    }
}
