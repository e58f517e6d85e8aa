//! The paper's Table I, printed and computed with both pixel sizes (R43, R44).

use egui::{Grid, RichText, ScrollArea, Ui};
use sightline_geometry::estimate::error_budget::{
    Approach, DERIVED_PIXEL_UM, ErrorBudget, MAKER_PIXEL_UM, TABLE_ONE, TableOneRow,
};

use crate::theme;

/// The errata of the printed table.
const ERRATA: &str = "These are the test bed's cameras, not those on Mars.\n\
    The table was computed with the maker's pixel of 4.65 µm; the text derives 4.69 µm (4.8 mm over 1024 pixels).\n\
    The printed 42.0 cm and 2.3 cm come from inputs that had been rounded: 41.9 and 2.2 cm come out.\n\
    The printed field of view of 49° × 37° does not follow from a lens of 6 mm: 43.3° × 33.1° does.";

/// Largest difference of two values that agree, cm (R44).
const AGREE_CM: f64 = 0.105;

/// A row of the table: its name, and its printed and computed values.
struct Quantity {
    name: &'static str,
    printed_cm: fn(&TableOneRow) -> f64,
    computed_m: fn(&ErrorBudget) -> f64,
    digits: usize,
}

const QUANTITIES: [Quantity; 5] = [
    Quantity {
        name: "stereo at 10 m",
        printed_cm: |row| row.printed_designation_cm,
        computed_m: |budget| budget.designation_m,
        digits: 1,
    },
    Quantity {
        name: "at 2 m without tracking",
        printed_cm: |row| row.printed_without_cm,
        computed_m: |budget| budget.without_tracking_m,
        digits: 1,
    },
    Quantity {
        name: "stereo at 2 m",
        printed_cm: |row| row.printed_stereo_cm,
        computed_m: |budget| budget.stereo_m,
        digits: 1,
    },
    Quantity {
        name: "one pixel of drift at 2 m",
        printed_cm: |row| row.printed_drift_per_px_cm,
        computed_m: |budget| budget.drift_per_px_m,
        digits: 2,
    },
    Quantity {
        name: "at 2 m after 10 px of drift",
        printed_cm: |row| row.printed_ten_px_cm,
        computed_m: |budget| budget.with_tracking_m,
        digits: 1,
    },
];

/// Shows the table.
pub(crate) fn show(ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(theme::title("Table I of the paper, cm"));
        ui.label(RichText::new("errata").small().underline().color(theme::accent())).on_hover_text(ERRATA);
    });
    ScrollArea::horizontal().id_salt("table one").auto_shrink([false, true]).show(ui, grid);
    ui.label(theme::note("Printed under the camera's name; computed under the pixel size that was taken."));
}

fn grid(ui: &mut Ui) {
    Grid::new("table one").num_columns(7).spacing([10.0, 2.0]).striped(true).show(ui, |ui| {
        ui.label("");
        for row in &TABLE_ONE {
            for heading in [row.name.split(' ').next().unwrap_or_default(), "4.65 µm", "4.69 µm"] {
                ui.label(theme::note(heading));
            }
        }
        ui.end_row();
        for quantity in &QUANTITIES {
            ui.label(theme::label(quantity.name).size(12.0));
            for row in &TABLE_ONE {
                cells(ui, row, quantity);
            }
            ui.end_row();
        }
        views(ui);
    });
}

/// The printed value, then the values computed with either pixel size.
fn cells(ui: &mut Ui, row: &TableOneRow, quantity: &Quantity) {
    let printed_cm = (quantity.printed_cm)(row);
    ui.label(theme::number(format!("{printed_cm:.*}", quantity.digits)));
    for pixel_um in [MAKER_PIXEL_UM, DERIVED_PIXEL_UM] {
        let computed_cm = computed_cm(row, quantity, pixel_um);
        let agrees = (computed_cm - printed_cm).abs() <= AGREE_CM;
        let mark = if agrees { "" } else { " ≠" };
        let text = theme::number(format!("{computed_cm:.*}{mark}", quantity.digits + 1));
        ui.label(if agrees { text } else { text.color(theme::lost()) });
    }
}

fn computed_cm(row: &TableOneRow, quantity: &Quantity, pixel_um: f64) -> f64 {
    (quantity.computed_m)(&row.pair(pixel_um).budget(&Approach::default())) * 100.0
}

/// The row of the fields of view, deg.
fn views(ui: &mut Ui) {
    ui.label(theme::label("field of view, °").size(12.0));
    for row in &TABLE_ONE {
        let [width, height] = row.printed_view_deg;
        ui.label(theme::number(format!("{width:.0} × {height:.0}")));
        for pixel_um in [MAKER_PIXEL_UM, DERIVED_PIXEL_UM] {
            let [width, height] = row.view_deg(pixel_um);
            ui.label(theme::number(format!("{width:.1} × {height:.1}")));
        }
    }
    ui.end_row();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_computed_columns_are_those_of_the_golden_table() {
        // R44, cm: stereo at 10 m and without tracking, by pixel.
        let navcam = &TABLE_ONE[1];
        for (pixel_um, designation_cm, without_cm) in
            [(MAKER_PIXEL_UM, 38.750, 41.923), (DERIVED_PIXEL_UM, 39.062, 42.212)]
        {
            assert!((computed_cm(navcam, &QUANTITIES[0], pixel_um) - designation_cm).abs() < 1e-3);
            assert!((computed_cm(navcam, &QUANTITIES[1], pixel_um) - without_cm).abs() < 1e-3);
        }
    }
}
