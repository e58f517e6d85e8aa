//! The error budget: a calculator of K-Eq 1 to 5 for a pair of cameras, the paper's Table I computed beside printed, and
//! predicted against achieved errors (R43–R47). The equations are in `core::estimate::error_budget`.

mod plot;
mod table;

use egui::{ComboBox, DragValue, Grid, RichText, ScrollArea, Ui};
use sightline_geometry::estimate::error_budget::{
    Approach, ErrorBudget, MAKER_PIXEL_UM, PLACEMENT_NEED_M, StereoPair, TABLE_ONE,
};

use crate::command::Command;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets;
use crate::state::State;
use crate::state::calculator::Pair;
use crate::{panels, theme};

/// The MER navcam: its effective focal length, px, and baseline, m (R226).
const MER_NAVCAM: StereoPair = StereoPair { focal_px: 1223.28, baseline_m: 0.20 };

/// The panel “Error budget”.
pub(crate) struct Budget;

impl Panel for Budget {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.traverse.is_none().then(|| state.missing_target())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::places::budget)
    }
}

/// Focal length and baseline; `None` for the current cameras if no step is loaded.
fn stereo(pair: Pair, state: &State) -> Option<StereoPair> {
    match pair {
        Pair::Current => {
            let pointing = &state.trace()?.point_mast;
            let pixel = pointing.predicted_left.unwrap_or_else(|| pointing.left.centre_pixel());
            StereoPair::from_cameras(&pointing.left, &pointing.right, pixel)
        }
        Pair::TableOne(row) => Some(TABLE_ONE[row].pair(MAKER_PIXEL_UM)),
        Pair::MerNavcam => Some(MER_NAVCAM),
    }
}

/// Shows the calculator, the overlay and the table.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        inputs(ui, state, out);
        let stereo = stereo(state.calculator.pair, state);
        match stereo {
            Some(pair) => results(ui, &pair, &state.calculator.approach),
            None => {
                let sentence =
                    "The current cameras are known once a step with a target is loaded: pick one, or choose another pair.";
                ui.add(egui::Label::new(RichText::new(sentence).color(theme::lost())).wrap());
            }
        }
        ui.separator();
        plot::show(ui, state, stereo.as_ref());
        ui.separator();
        table::show(ui);
    });
}

fn inputs(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut calculator = state.calculator;
    ui.horizontal_wrapped(|ui| {
        ui.label(theme::label("cameras"));
        let choice = ComboBox::from_id_salt("pair").width(160.0).selected_text(calculator.pair.name());
        let shown = choice.show_ui(ui, |ui| {
            for pair in Pair::all() {
                if panels::entry(ui, calculator.pair == pair, pair.name()).clicked() {
                    calculator.pair = pair;
                }
            }
        });
        shown.response.accessible_name("cameras");
        let approach = &mut calculator.approach;
        let mut percent = approach.navigation_fraction * 100.0;
        for (name, unit, value, range, help) in [
            ("from", " m", &mut approach.start_m, 0.5..=100.0, "Distance at the designation"),
            ("to", " m", &mut approach.end_m, 0.3..=100.0, "Distance at the end of the approach"),
            (
                "disparity ±",
                " px",
                &mut approach.disparity_error_px,
                0.01..=10.0,
                "3σ error of a disparity [Kim09 §4.2]",
            ),
            (
                "driving ±",
                " %",
                &mut percent,
                0.0..=50.0,
                "3σ navigation error, % of the distance driven [Kim09 §4.2]",
            ),
            ("drift", " px", &mut approach.drift_px, 0.0..=100.0, "Drift of the track in the last image"),
        ] {
            let drag = DragValue::new(value).range(range).speed(0.02).max_decimals(2);
            let drag = drag.prefix(format!("{name} ")).suffix(unit);
            ui.add(drag).accessible_name(name).on_hover_text(help);
        }
        if percent != approach.navigation_fraction * 100.0 {
            approach.navigation_fraction = percent / 100.0;
        }
    });
    if calculator != state.calculator {
        out.push(Command::SetCalculator(calculator));
    }
}

fn results(ui: &mut Ui, pair: &StereoPair, approach: &Approach) {
    let budget = pair.budget(approach);
    let optics =
        format!("focal length {:.1} px, baseline {:.3} m; every error is 3σ", pair.focal_px, pair.baseline_m);
    ui.label(theme::note(optics));
    let rows = [
        ("[Kim09 Eq. 1]", format!("stereo at {} m", approach.start_m), centimetres(budget.designation_m)),
        (
            "[Kim09 Eq. 3]",
            format!("at {} m without tracking", approach.end_m),
            centimetres(budget.without_tracking_m),
        ),
        ("[Kim09 Eq. 1]", format!("stereo at {} m", approach.end_m), centimetres(budget.stereo_m)),
        ("[Kim09 Eq. 4]", "one pixel of drift there".to_owned(), centimetres(budget.drift_per_px_m)),
        (
            "[Kim09 Eq. 5]",
            format!("at {} m with tracking", approach.end_m),
            centimetres(budget.with_tracking_m),
        ),
        (
            "[Kim09 §4.2]",
            "least drift, ± half a pixel of the first image".to_owned(),
            format!("{:.2} px", budget.least_drift_px),
        ),
    ];
    Grid::new("budget values").num_columns(3).spacing([12.0, 2.0]).show(ui, |ui| {
        for (source, name, value) in rows {
            ui.label(theme::note(source));
            ui.label(theme::label(name).size(12.0));
            ui.label(theme::number(value));
            ui.end_row();
        }
    });
    let (words, is_enough) = verdict(&budget);
    ui.add(egui::Label::new(RichText::new(words).color(theme::verdict(is_enough))).wrap());
}

/// Whether the error with tracking suffices for instrument placement (R46), and the improvement over no tracking.
fn verdict(budget: &ErrorBudget) -> (String, bool) {
    let is_enough = budget.with_tracking_m < PLACEMENT_NEED_M;
    let word = if is_enough { "below" } else { "NOT below" };
    let gain = budget.without_tracking_m / budget.with_tracking_m.max(1e-9);
    let need = PLACEMENT_NEED_M * 100.0;
    (
        format!(
            "With tracking {word} the {need:.0} cm that placing an instrument needs; ×{gain:.1} better than without."
        ),
        is_enough,
    )
}

/// A length in centimetres with one digit more than Table I.
fn centimetres(length_m: f64) -> String {
    let length_cm = length_m * 100.0;
    if length_cm < 1.0 { format!("{length_cm:.3} cm") } else { format!("{length_cm:.2} cm") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_compares_with_the_three_centimetres_of_instrument_placement() {
        let navcam = stereo(Pair::TableOne(1), &State::new(String::new(), None)).unwrap();
        let (words, is_enough) = verdict(&navcam.budget(&Approach::default()));
        assert!(is_enough && words.contains("×19.1"), "{words}");
        let (words, is_enough) = verdict(&navcam.budget(&Approach { drift_px: 20.0, ..Approach::default() }));
        assert!(!is_enough && words.contains("NOT below"), "{words}");
    }

    #[test]
    fn lengths_have_one_digit_more_than_the_paper() {
        assert_eq!(centimetres(0.3875), "38.75 cm");
        assert_eq!(centimetres(0.00155), "0.155 cm");
    }
}
