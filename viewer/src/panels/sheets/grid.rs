//! A table on the screen: only visible rows are laid out, and screen readers receive it as a table with headings, rows and
//! cells. A click on a step selects it.

use egui::{Button, Label, RichText, ScrollArea, Ui, vec2};

use crate::command::{Command, Go};
use crate::panels::sheets::{Sheet, SheetRow};
use crate::theme;

/// Height of a row, points.
const ROW: f32 = 24.0;
/// Assumed width of a character, points.
const LETTER: f32 = 7.2;
/// Visible rows of each table if there are several.
const TALL: f32 = 14.0;

/// Shows tables, one below the other.
pub(crate) fn show(ui: &mut Ui, sheets: &[Sheet], out: &mut Vec<Command>) {
    let tall =
        if sheets.len() == 1 { (ui.available_height() - 3.0 * ROW).max(4.0 * ROW) } else { TALL * ROW };
    ScrollArea::both().id_salt("tables").auto_shrink(false).show(ui, |ui| {
        for sheet in sheets {
            ui.push_id(&sheet.title, |ui| one(ui, sheet, tall, out));
            ui.add_space(6.0);
        }
    });
}

fn one(ui: &mut Ui, sheet: &Sheet, tall: f32, out: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        ui.label(theme::title(&sheet.title));
        let copy = ui.add(Button::new("Copy as CSV").min_size(vec2(24.0, 24.0)));
        let copy = copy.accessible_name(format!("copy {} as CSV", sheet.title));
        let count = sheet.more.as_ref().map_or(sheet.rows.len(), |more| more.rows.len());
        if copy.on_hover_text(format!("{count} rows with all digits")).clicked() {
            ui.ctx().copy_text(sheet.csv());
        }
    });
    let widths = widths(sheet);
    ui.scope(|ui| {
        let rows = format!("{}, {} rows", sheet.title, sheet.rows.len());
        role(ui, egui::Role::Table, &rows);
        ui.spacing_mut().item_spacing = vec2(0.0, 0.0);
        head(ui, sheet, &widths);
        // A long table keeps its head visible and lays out only the visible rows.
        let mut rows = ScrollArea::vertical().id_salt("rows").max_height(tall).auto_shrink([false, true]);
        if let Some(at) = newly_current_row(ui, sheet) {
            rows = rows.vertical_scroll_offset((at as f32 * ROW - 0.5 * tall).max(0.0));
        }
        rows.show_rows(ui, ROW, sheet.rows.len(), |ui, range| {
            for (number, row) in range.clone().zip(&sheet.rows[range]) {
                ui.push_id(number, |ui| line(ui, row, &widths, out));
            }
        });
    });
}

/// The row of the cursor's step in the frame in which the cursor moved there, else `None`.
fn newly_current_row(ui: &Ui, sheet: &Sheet) -> Option<usize> {
    let present = sheet.rows.iter().position(|row| row.is_present);
    let id = ui.unique_id().with("present row");
    let before =
        ui.data_mut(|data| std::mem::replace(data.get_temp_mut_or_default::<Option<usize>>(id), present));
    present.filter(|_| before != present)
}

/// The width of every column, which fits its longest text, points.
fn widths(sheet: &Sheet) -> Vec<f32> {
    let letters = |column: usize| {
        let head = sheet.columns[column].head().chars().count();
        let cells = sheet.rows.iter().filter_map(|row| row.cells.get(column));
        let longest = cells.map(|cell| cell.shown().chars().count()).max();
        head.max(longest.unwrap_or_default())
    };
    (0..sheet.columns.len()).map(|column| letters(column) as f32 * LETTER + 16.0).collect()
}

fn head(ui: &mut Ui, sheet: &Sheet, widths: &[f32]) {
    ui.horizontal(|ui| {
        role(ui, egui::Role::Row, "head");
        for (column, width) in sheet.columns.iter().zip(widths) {
            let label = ui.add_sized([*width, ROW], Label::new(theme::note(column.head())).truncate());
            ui.ctx().accesskit_node_builder(label.id, |node| {
                node.set_role(egui::Role::ColumnHeader);
                node.set_label(column.head());
            });
        }
    });
}

fn line(ui: &mut Ui, row: &SheetRow, widths: &[f32], out: &mut Vec<Command>) {
    let area = egui::Rect::from_min_size(ui.next_widget_position(), vec2(widths.iter().sum(), ROW));
    if row.is_present {
        ui.painter().rect_filled(area, 2.0, theme::selected());
    }
    ui.horizontal(|ui| {
        let name = match (row.step, row.is_present) {
            (Some(step), true) => format!("step {step}, the current one"),
            (Some(step), false) => format!("step {step}"),
            (None, true) => "the current one".to_owned(),
            (None, false) => String::new(),
        };
        role(ui, egui::Role::Row, &name);
        for (k, (cell, width)) in row.cells.iter().zip(widths).enumerate() {
            let shown = cell.shown();
            match row.step.filter(|_| k == 0) {
                Some(step) => {
                    let mark = if row.is_present { "> " } else { "" };
                    let words = RichText::new(format!("{mark}{step}")).monospace();
                    let button = ui.add_sized([*width, ROW], Button::new(words).frame(false));
                    if button.accessible_name(format!("go to step {step}")).clicked() {
                        out.push(Command::Go(Go::Step(step)));
                    }
                }
                None => {
                    let label = Label::new(theme::number(&shown).size(11.5)).truncate();
                    let label = ui.add_sized([*width, ROW], label);
                    ui.ctx().accesskit_node_builder(label.id, |node| {
                        node.set_role(egui::Role::Cell);
                        node.set_label(shown);
                    });
                }
            }
        }
    });
}

/// Sets the accessibility role and label of `ui`.
fn role(ui: &Ui, role: egui::Role, name: &str) {
    ui.ctx().accesskit_node_builder(ui.unique_id(), |node| {
        node.set_role(role);
        if !name.is_empty() {
            node.set_label(name);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panels::sheets::Column;

    #[test]
    fn a_long_table_shows_the_row_of_the_cursor_s_step() {
        let sheet = |present: usize| {
            let mut sheet = Sheet::over_steps("Over the steps", vec![Column::new("ncc", "")]);
            (0..200).for_each(|step| sheet.step(step, present, vec![Some(0.5).into()]));
            sheet
        };
        let mut harness = egui_kittest::Harness::builder()
            .with_size([300.0, 300.0])
            .build_ui_state(move |ui, present: &mut usize| show(ui, &[sheet(*present)], &mut Vec::new()), 0);
        for step in [150, 20] {
            *harness.state_mut() = step;
            harness.run_steps(4);
            let name = format!("go to step {step}");
            let row = egui_kittest::kittest::Queryable::query_by_label(&harness, &name);
            assert!(row.is_some(), "step {step} is not on the screen");
        }
    }
}
