//! Plots and surfaces as tables: the same values as numbers, with units, the present step marked, to be read, heard
//! and copied as CSV.
//!
//! | file | what it does |
//! |---|---|
//! | `sheet` | a table: columns with units, rows, CSV |
//! | `grid` | a table on the screen and for a screen reader |
//! | `scores` | the surface of scores and the stereo profile |
//! | `steps` | what is plotted over the steps |
//! | `places` | the map, the error budget and the template's history |
//! | `features` | residuals, draws and features |
//! | `shape` | registration, errors of depth, coarse search and refinement |

mod features;
mod grid;
mod places;
mod scores;
mod shape;
pub mod sheet;
mod steps;

use egui::{Button, Ui, vec2};

pub use self::sheet::{Cell, Column, Row, Sheet};

use crate::command::Command;
use crate::layout::Pane;
use crate::panels;
use crate::state::State;

/// The panels that can be looked at as tables.
pub const PANES: [Pane; 10] = [
    Pane::Plots,
    Pane::Tolerances,
    Pane::Uncertainty,
    Pane::Surface,
    Pane::StereoProfile,
    Pane::Map,
    Pane::Budget,
    Pane::History,
    Pane::Features,
    Pane::Shape,
];

/// What a panel shows, as tables.
///
/// # Errors
/// The sentence that says why there is nothing yet, and how to fill it.
pub fn of(state: &State, pane: Pane) -> Result<Vec<Sheet>, String> {
    match pane {
        Pane::Plots => panels::plots::sheets(state),
        Pane::Tolerances => panels::tolerances::sheets(state),
        Pane::Uncertainty => steps::uncertainty(state),
        Pane::Surface => scores::surface(state),
        Pane::StereoProfile => scores::stereo_profile(state),
        Pane::Map => places::map(state),
        Pane::Budget => places::budget(state),
        Pane::History => places::history(state),
        Pane::Features => features::features(state),
        Pane::Shape => shape::shape(state),
        _ => Err("This panel is made of words and numbers already.".to_owned()),
    }
}

/// Shows a panel as tables.
pub fn show(ui: &mut Ui, state: &State, pane: Pane, out: &mut Vec<Command>) {
    match of(state, pane) {
        Ok(sheets) => grid::show(ui, &sheets, out),
        Err(sentence) => panels::missing(ui, "The values of this panel as a table.", &sentence),
    }
}

/// The switch between a panel and its table; nothing for a panel that has none.
pub fn switch(ui: &mut Ui, state: &State, pane: Pane, out: &mut Vec<Command>) {
    if !PANES.contains(&pane) {
        return;
    }
    let is_table = state.is_table(pane);
    let words = egui::RichText::new("table").size(11.0);
    let button = ui.add(Button::selectable(is_table, words).min_size(vec2(24.0, 20.0)));
    let button = button.on_hover_text("The values as a table, to be read and copied");
    let name = format!("{} as table", pane.title());
    button.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, is_table, &name));
    if button.clicked() {
        out.push(Command::Table(pane));
    }
}
