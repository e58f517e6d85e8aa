//! The depth errors before and after the registration as a histogram; its two handles set the limit of the colours.

use egui::{Align2, Color32, CursorIcon, Id, Painter, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

use crate::command::Command;
use crate::drawing::overlay::Mark;
use crate::panels::chart_legend;
use crate::shape_view::ShapeView;
use crate::state::State;
use crate::theme;

/// Height of the histogram with its axis, points.
pub(crate) const HEIGHT: f32 = 96.0;
/// Height of the axis, points.
const AXIS: f32 = 15.0;
/// Number of bars.
const BARS: usize = 61;
/// Width of a handle's drag area, points.
const GRIP: f32 = 14.0;
/// The end of the axis, as a multiple of the automatic limit.
const BEYOND: f64 = 1.25;
/// The smallest limit that can be set, as a share of the axis.
const LEAST: f64 = 0.01;

/// Depth errors, m; NaN if missing.
pub(crate) struct Errors<'a> {
    /// Before the registration.
    pub(crate) before: &'a [f32],
    /// At its end.
    pub(crate) end: &'a [f32],
}

/// Shows the histogram; `limit_m` is the limit of the colours, `automatic_m` its automatic value.
pub(crate) fn show(
    ui: &mut Ui,
    state: &State,
    errors: &Errors<'_>,
    [limit_m, automatic_m]: [f64; 2],
    out: &mut Vec<Command>,
) {
    let end_m = automatic_m * BEYOND;
    let colour = theme::run(state.cursor.run);
    ui.horizontal_wrapped(|ui| {
        let title = format!("errors of depth; colours end at ± {:.2} cm", limit_m * 100.0);
        let said = [
            (Mark::Square, theme::keypoint(), format!("at the start, {}", words(errors.before))),
            (Mark::Dot, colour, format!("at the end, {}", words(errors.end))),
        ];
        chart_legend::wrapped(ui, &title, &said);
        let is_set = state.shape_view.error_limit_m.is_some();
        let button = ui.add_enabled(is_set, egui::Button::new("Automatic limit").small());
        if button.on_hover_text("99th percentile of the absolute errors at the start").clicked() {
            out.push(set(state, None));
        }
    });
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let words = "histogram of the errors of depth: drag a handle to set the limit of the colours";
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, words));
    let plot = Rect::from_min_max(rect.min, rect.max - vec2(0.0, AXIS));
    ui.painter().rect_filled(plot, 0.0, theme::well());
    let (before, end) = (bars(errors.before, end_m), bars(errors.end, end_m));
    let most = before.iter().chain(&end).copied().max().unwrap_or_default().max(1);
    paint(ui.painter(), plot, &end, most, Some(colour));
    paint(ui.painter(), plot, &before, most, None);
    axis(ui.painter(), plot, end_m);
    handles(ui, state, plot, [limit_m, end_m], out);
}

fn set(state: &State, error_limit_m: Option<f64>) -> Command {
    Command::SetShapeView(ShapeView { error_limit_m, ..state.shape_view })
}

/// RMS, 95th percentile of the absolute errors, and share of pixels that have an error.
fn words(errors: &[f32]) -> String {
    let mut sizes: Vec<f32> = errors.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    if sizes.is_empty() {
        return "no pixel is visible on both surfaces".to_owned();
    }
    let sum: f64 = sizes.iter().map(|v| f64::from(*v).powi(2)).sum();
    let rms_m = (sum / sizes.len() as f64).sqrt();
    let at = (sizes.len() - 1) * 95 / 100;
    let p95_m = *sizes.select_nth_unstable_by(at, f32::total_cmp).1;
    let share = 100.0 * sizes.len() as f64 / errors.len() as f64;
    format!("rms {:.2} cm, 95 % within {:.2} cm, {share:.0} % of pixels", rms_m * 100.0, p95_m * 100.0)
}

/// Counts of errors in bars from −`end_m` to `end_m`; the outermost bars also count all errors beyond.
fn bars(errors: &[f32], end_m: f64) -> [usize; BARS] {
    let mut bars = [0; BARS];
    for error in errors.iter().filter(|v| v.is_finite()) {
        let share = (f64::from(*error) / end_m + 1.0) / 2.0;
        let bar = (share * BARS as f64).floor().clamp(0.0, (BARS - 1) as f64);
        bars[bar as usize] += 1;
    }
    bars
}

/// Lower and upper edge of each bar, m, and its counts at the start and at the end.
pub(crate) fn counts(errors: &Errors<'_>, automatic_m: f64) -> Vec<(f64, f64, [usize; 2])> {
    let end_m = automatic_m * BEYOND;
    let edge = |bar: usize| end_m * (2.0 * bar as f64 / BARS as f64 - 1.0);
    let both = bars(errors.before, end_m).into_iter().zip(bars(errors.end, end_m)).enumerate();
    both.map(|(bar, (before, end))| (edge(bar), edge(bar + 1), [before, end])).collect()
}

/// Bars, filled if a colour is given, else outlined.
fn paint(painter: &Painter, plot: Rect, bars: &[usize; BARS], most: usize, fill: Option<Color32>) {
    let width = plot.width() / BARS as f32;
    for (i, count) in bars.iter().enumerate().filter(|(_, count)| **count > 0) {
        let height = (plot.height() - 3.0) * *count as f32 / most as f32;
        let corner = pos2(plot.left() + width * i as f32, plot.bottom() - height);
        let bar = Rect::from_min_size(corner, vec2(width - 1.0, height));
        match fill {
            Some(colour) => painter.rect_filled(bar, 0.0, colour),
            None => painter.rect_stroke(bar, 0.0, Stroke::new(1.0, theme::keypoint()), StrokeKind::Inside),
        };
    }
}

fn axis(painter: &Painter, plot: Rect, end_m: f64) {
    for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let at = pos2(plot.center().x + plot.width() / 2.0 * share, plot.bottom());
        let anchor = match share {
            s if s < -0.9 => Align2::LEFT_TOP,
            s if s > 0.9 => Align2::RIGHT_TOP,
            _ => Align2::CENTER_TOP,
        };
        painter.vline(at.x, plot.bottom()..=plot.bottom() + 3.0, Stroke::new(1.0, theme::weak()));
        let words = match f64::from(share) * end_m * 100.0 {
            0.0 => "0 cm".to_owned(),
            cm if cm.abs() < 10.0 => format!("{cm:+.2}"),
            cm => format!("{cm:+.1}"),
        };
        painter.text(at + vec2(0.0, 3.0), anchor, words, theme::digit_font(), theme::weak());
    }
}

/// The two handles: dragging either sets the limit on both sides.
fn handles(ui: &mut Ui, state: &State, plot: Rect, [limit_m, end_m]: [f64; 2], out: &mut Vec<Command>) {
    let half = f64::from(plot.width()) / 2.0;
    for (name, side) in [("lower limit of the colours", -1.0), ("upper limit of the colours", 1.0)] {
        let x = plot.center().x + (side * half * (limit_m / end_m).min(1.0)) as f32;
        let grip = Rect::from_center_size(pos2(x, plot.center().y), vec2(GRIP, plot.height()));
        let response = ui.interact(grip, Id::unique(("errors of depth", name)), Sense::drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, name));
        let is_held = response.hovered() || response.dragged();
        let colour = if is_held { theme::strong() } else { theme::accent() };
        ui.painter().vline(x, plot.y_range(), Stroke::new(2.0, colour));
        let knob = Rect::from_center_size(pos2(x, plot.center().y), vec2(6.0, 18.0));
        ui.painter().rect_filled(knob, 2.0, colour);
        if is_held {
            ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) {
            let share = f64::from((pointer.x - plot.center().x).abs()) / half;
            out.push(set(state, Some(share.clamp(LEAST, 1.0) * end_m)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_fall_into_bars_about_zero_and_what_lies_beyond_into_the_outermost() {
        let bars = bars(&[0.0, 0.001, -0.001, -5.0, 5.0, f32::NAN], 0.1);
        assert_eq!((bars[BARS / 2], bars[0], bars[BARS - 1]), (3, 1, 1));
        assert_eq!(bars.iter().sum::<usize>(), 5);
    }

    #[test]
    fn the_words_give_rms_and_share_of_what_exists() {
        let words = words(&[0.03, -0.04, f32::NAN, f32::NAN]);
        assert!(words.starts_with("rms 3.54 cm") && words.ends_with("50 % of pixels"), "{words}");
        assert_eq!(super::words(&[f32::NAN]), "no pixel is visible on both surfaces");
    }
}
