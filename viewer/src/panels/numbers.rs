//! A number that can be asked about: a click leads to where it came from, the menu copies it too.

use egui::{Response, RichText, Ui};

use crate::command::Command;
use crate::why::Ask;

/// Shows a number as a link to where it came from; `name` is what it is called there.
pub(crate) fn show(ui: &mut Ui, text: RichText, step: usize, name: &str, out: &mut Vec<Command>) {
    let words = text.text().to_owned();
    let response = ui.link(text).on_hover_text(format!("Why? Where {name} comes from"));
    ask(&response, step, name, &words, out);
}

/// Lets a click on something lead to where a value came from.
pub(crate) fn ask(response: &Response, step: usize, name: &str, copied: &str, out: &mut Vec<Command>) {
    let why = || Command::Why(Ask::Value { step, value: name.to_owned() });
    if response.clicked() {
        out.push(why());
    }
    response.context_menu(|ui| {
        if ui.button("Why").clicked() {
            out.push(why());
            ui.close();
        }
        if ui.button("Copy value").clicked() {
            ui.ctx().copy_text(copied.to_owned());
            ui.close();
        }
    });
}
