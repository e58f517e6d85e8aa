//! The change of the pose estimate at `predict`: each axis with its σ and, if the truth is known, its error.

use egui::{Grid, RichText, Ui};
use sightline_session::why::pose_change::AXES;

use crate::command::Command;
use crate::panels::numbers;
use crate::state::State;
use crate::theme;

/// Errors larger than this number of standard deviations are highlighted.
const SIGMAS: f64 = 3.0;

/// Shows the change; nothing at the first stop.
pub(super) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some((found, error)) = state.pose_change() else { return };
    ui.horizontal_wrapped(|ui| {
        let link = ui.link(theme::title("pose change since the stop before"));
        let link = link.on_hover_text("Odometry of this step, in the rover frame of the stop before");
        numbers::explain_on_click(&link, state.cursor.step, "pose_change", "", out);
    });
    Grid::new("pose change").num_columns(4).spacing([12.0, 1.0]).show(ui, |ui| {
        for head in ["", "estimate", "1σ", if error.is_some() { "error" } else { "" }] {
            ui.label(theme::note(head));
        }
        ui.end_row();
        for (k, (name, unit)) in AXES.iter().enumerate() {
            ui.label(theme::label(*name).size(12.0));
            ui.label(theme::number(value(found.change[k], unit)));
            ui.label(theme::number(value(found.sigma[k], unit).trim_start_matches('+').to_owned()));
            if let Some(error) = error.map(|error| error[k]) {
                let is_large = error.abs() > SIGMAS * found.sigma[k].max(1e-6);
                let colour = if is_large { theme::failed() } else { theme::text() };
                ui.label(RichText::new(value(error, unit)).monospace().size(12.0).color(colour));
            }
            ui.end_row();
        }
    });
    ui.add_space(4.0);
}

/// A length in cm or an angle in degrees.
fn value(value: f64, unit: &str) -> String {
    let (value, unit) = if unit == "m" { (100.0 * value, " cm") } else { (value, "°") };
    // Zero has no sign.
    let value = if value.abs() < 0.005 { 0.0 } else { value };
    if value == 0.0 { format!("0.00{unit}") } else { format!("{value:+.2}{unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_in_centimetres_and_zero_has_no_sign() {
        assert_eq!(value(0.2154, "m"), "+21.54 cm");
        assert_eq!(value(-0.000_01, "m"), "0.00 cm");
        assert_eq!(value(-7.02, "deg"), "-7.02°");
    }
}
