//! Filters of the features, here and on the images: by residual and by scale; and the magnification of residuals.

use std::ops::RangeInclusive;

use egui::{Slider, Ui};

use crate::command::Command;
use crate::panels::digits;
use crate::state::State;
use crate::tables::FeatureView;
use crate::theme;

/// Width of a slider, points.
const SLIDER: f32 = 64.0;
/// Minimum width at which all sliders are in one row, points.
const ONE_ROW: f32 = 900.0;

/// A filtered quantity.
struct Filter {
    name: &'static str,
    unit: &'static str,
    /// Number of display units in one unit of the filter.
    factor: f64,
    /// Smallest step above zero, and the end of the slider, which applies no upper limit.
    range: [f64; 2],
}

const RESIDUAL: Filter = Filter { name: "residual", unit: "mm", factor: 1000.0, range: [0.1, 1000.0] };
const SCALE: Filter = Filter { name: "scale", unit: "px", factor: 1.0, range: [0.1, 64.0] };

/// Shows the sliders: in one row if the width suffices, else one below the other.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut view = state.feature_view;
    ui.spacing_mut().slider_width = SLIDER;
    let mut rows = |ui: &mut Ui| {
        ui.horizontal(|ui| limits(ui, &RESIDUAL, &mut view.residual_m));
        ui.horizontal(|ui| limits(ui, &SCALE, &mut view.sigma_px));
        ui.horizontal(|ui| magnification(ui, &mut view));
    };
    if ui.available_width() < ONE_ROW {
        rows(ui);
    } else {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 14.0;
            rows(ui);
        });
    }
    view.magnification = view.magnification.round();
    if view != state.feature_view {
        out.push(Command::SetFeatureView(view));
    }
}

/// The magnification of residuals, and the button that resets all filters.
fn magnification(ui: &mut Ui, view: &mut FeatureView) {
    ui.spacing_mut().item_spacing.x = 5.0;
    ui.label(theme::label("residuals ×"));
    let factor = Slider::new(&mut view.magnification, 1.0..=100.0).logarithmic(true).max_decimals(0);
    ui.add(factor).accessible_name("magnification of residuals").on_hover_text(
        "How much longer than it is a residual is drawn on the left image: from where the motion puts the feature to \
         where it was found. The layer “residuals” is switched on in the image’s legend.",
    );
    let reset = ui.add_enabled(*view != FeatureView::default(), egui::Button::new("Show all"));
    if reset.on_hover_text("Takes all filters back").clicked() {
        *view = FeatureView::default();
    }
}

/// Two sliders: the smallest and the largest value shown.
fn limits(ui: &mut Ui, filter: &Filter, [least, largest]: &mut [f64; 2]) {
    let end = filter.range[1];
    ui.spacing_mut().item_spacing.x = 5.0;
    ui.label(theme::label(filter.name));
    let mut low = *least * filter.factor;
    let response = ui.add(slider(&mut low, filter.range)).accessible_name(format!("least {}", filter.name));
    if response.changed() {
        *least = low / filter.factor;
        *largest = largest.max(*least);
    }
    ui.label(theme::label("to"));
    let mut high = (*largest * filter.factor).min(end);
    let response =
        ui.add(slider(&mut high, filter.range)).accessible_name(format!("largest {}", filter.name));
    if response.changed() {
        // The end of the slider applies no upper limit.
        *largest = if high >= end { f64::INFINITY } else { high / filter.factor };
        *least = least.min(*largest);
    }
    ui.label(theme::note(filter.unit));
}

fn slider(value: &mut f64, [smallest, end]: [f64; 2]) -> Slider<'_> {
    let words = move |value: f64, _: RangeInclusive<usize>| {
        if value >= end { "any".to_owned() } else { digits((value * 100.0).round() / 100.0) }
    };
    Slider::new(value, 0.0..=end).logarithmic(true).smallest_positive(smallest).custom_formatter(words)
}
