//! The surface of match scores over the search window, with its peaks, the threshold and the prediction.

use egui::{Align2, Rect, Ui, pos2, vec2};
use nalgebra::Matrix2;
use sightline_core::frames::Pixel;
use sightline_core::image::PixelRect;
use sightline_core::locate::template::match_template::TemplateMatch;
use sightline_core::locate::template::settings::Measure;
use sightline_core::trace::{ArrayName, StepTrace};

use super::images_left::STATUS;
use crate::cache::Slot;
use crate::command::{Command, Panel};
use crate::contour::contour;
use crate::overlay::{Line, Mark, Overlay};
use crate::pointed::Pointed;
use crate::raster::{Look, Raster};
use crate::state::State;
use crate::view2d::Canvas;
use crate::{panels, theme};

/// What the panel is for.
const PURPOSE: &str = "The match score of every position in the search window.";

/// Width of the colour bar with its numbers, points.
const BAR: f32 = 62.0;
/// Ticks of the colour bar, both ends among them.
const TICKS: u32 = 5;

/// Shows the surface.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if super::compare::surfaces::show(ui, state, out) {
        return;
    }
    if super::what_if::scores::show(ui, state, out) {
        return;
    }
    recorded(ui, state, out);
}

/// Shows the scores of the run.
pub(super) fn recorded(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let matched = state.trace().and_then(StepTrace::template).and_then(|e| e.match_template.as_ref());
    let (Some(trace), Some(matched)) = (state.trace(), matched) else {
        panels::missing(ui, PURPOSE, &state.missing_template());
        return;
    };
    if matched.descent.is_some() {
        let why = "This configuration descends along the gradient from the prediction: it compares no window of \
                   positions. The Inspector has its steps.";
        return panels::missing(ui, PURPOSE, why);
    }
    let raster = match state.array(ArrayName::Surface) {
        Slot::Ready(raster) => raster,
        Slot::Failed(problem) => {
            return panels::missing(ui, PURPOSE, &format!("The scores cannot be shown: {}", problem.detail));
        }
        Slot::Absent | Slot::Loading => return panels::missing(ui, PURPOSE, "Loading the scores …"),
    };
    raster.look(Look::Values(matched.measure.shown_limits()));
    let area = ui.available_rect_before_wrap();
    let (rest, bar) = area.split_left_right_at_x(area.right() - BAR);
    let mut left = ui.new_child(egui::UiBuilder::new().max_rect(rest).id_salt("scores"));
    let region = region_of(matched.search_window, raster.size());
    let canvas = Canvas::new(&mut left, state.view(Panel::Surface), region, STATUS);
    canvas.checker(region);
    canvas.texture(&raster.texture, region);
    let threshold = state.setting("limits", "ncc_min").and_then(|v| v.as_f64()).unwrap_or(0.7) as f32;
    // The threshold is one of correlation.
    let threshold = (matched.measure == Measure::Ncc).then_some(threshold);
    if state.marks {
        if let Some(threshold) = threshold {
            paint_contour(&canvas, raster, region, threshold);
        }
        paint_marks(&canvas, trace, matched, theme::run(state.cursor.run));
    }
    warn_of_edge(&canvas, matched);
    let here = canvas.hovered(region).map(|pixel| Pixel::new(pixel.x.round(), pixel.y.round()));
    let pointed = state.pointed_left().filter(|pixel| region.contains(*pixel));
    if let Some(pixel) = pointed.filter(|_| here.is_none()) {
        Overlay::new(&canvas.painter, &canvas.transform).mark(pixel, Mark::Plus, theme::accent());
    }
    status(&mut left, here.or(pointed), raster, region, matched);
    out.extend(here.map(|pixel| Command::Point(Pointed::Score(pixel))));
    let bar = bar.shrink2(vec2(4.0, 2.0)).with_max_y(bar.bottom() - STATUS);
    colour_bar(ui, bar, matched, threshold, theme::run(state.cursor.run));
    ui.advance_cursor_after_rect(area);
    if let Some(view) = canvas.moved {
        out.push(Command::View(Panel::Surface, view));
    }
}

/// The pixels on which the template's centre lay: the search window less half a template on each side.
pub fn region_of(search_window: PixelRect, size: [u32; 2]) -> PixelRect {
    let inset = |whole: u32, inner: u32| (whole.saturating_sub(inner) / 2) as i32;
    PixelRect::new(
        search_window.x + inset(search_window.width, size[0]),
        search_window.y + inset(search_window.height, size[1]),
        size[0],
        size[1],
    )
}

/// The line along which the scores have the threshold's height.
pub(super) fn paint_contour(canvas: &Canvas, raster: &Raster, region: PixelRect, threshold: f32) {
    let (x, y) = (f64::from(region.x), f64::from(region.y));
    let stroke = egui::Stroke::new(1.5, theme::strong());
    for segment in contour(raster.values.as_raw(), raster.values.width() as usize, threshold) {
        let ends = segment.map(|[dx, dy]| canvas.transform.to_screen(Pixel::new(x + dx, y + dy)));
        canvas.painter.line_segment(ends, stroke);
    }
}

/// Prediction, peaks and truth on the scores.
pub(super) fn paint_marks(canvas: &Canvas, trace: &StepTrace, matched: &TemplateMatch, run: egui::Color32) {
    let pointing = trace.point_mast.as_ref();
    let predicted = pointing.and_then(|p| Some((p.predicted_left?, p.predicted_covariance_px2)));
    let truth = trace.truth.as_ref().and_then(|t| t.left_pixel);
    paint_peaks(canvas, &Marked { predicted, matched, truth, colour: run });
}

/// What is marked on scores.
pub(super) struct Marked<'a> {
    /// The prediction with its covariance, px and px².
    pub predicted: Option<(Pixel, Option<Matrix2<f64>>)>,
    /// The match.
    pub matched: &'a TemplateMatch,
    /// The truth, px.
    pub truth: Option<Pixel>,
    /// The colour of the match.
    pub colour: egui::Color32,
}

/// Prediction, peaks and truth.
pub(super) fn paint_peaks(canvas: &Canvas, marked: &Marked<'_>) {
    let (matched, run) = (marked.matched, marked.colour);
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    if let Some((pixel, covariance)) = marked.predicted {
        if let Some(covariance) = &covariance {
            overlay.ellipse(pixel, covariance, 3.0, theme::prediction(), Line::Dotted);
        }
        overlay.mark(pixel, Mark::Cross, theme::prediction());
    }
    if let Some(second) = &matched.second_peak {
        overlay.mark(second.pixel, Mark::Square, theme::strong());
        let words = format!("2nd: {:.0} % at {:.0} px", second.ratio * 100.0, second.distance_px);
        overlay.words(second.pixel, vec2(12.0, 12.0), &words, theme::strong());
    }
    let peak = &matched.peak;
    overlay.ellipse(peak.pixel, &matched.covariance_px2, 3.0, run, Line::Solid);
    overlay.mark(peak.pixel, Mark::Ring, run);
    overlay.words(peak.pixel, vec2(12.0, -12.0), &format!("peak {:.3}", peak.score), theme::strong());
    if let Some(pixel) = marked.truth {
        overlay.mark(pixel, Mark::Plus, theme::truth());
    }
}

fn warn_of_edge(canvas: &Canvas, matched: &TemplateMatch) {
    if matched.peak.at_edge {
        let area = canvas.transform.rect.shrink(1.0);
        canvas.painter.rect_stroke(
            area,
            0.0,
            egui::Stroke::new(2.0, theme::lost()),
            egui::StrokeKind::Inside,
        );
        let words = "The peak is at the edge: the true one may lie outside the search window.";
        let galley =
            canvas.painter.layout(words.to_owned(), theme::image_font(), theme::lost(), area.width() - 16.0);
        let frame = Rect::from_min_size(area.left_top() + vec2(8.0, 6.0), galley.size());
        canvas.painter.rect_filled(frame.expand(3.0), 2.0, theme::scrim());
        canvas.painter.galley(frame.min, galley, theme::lost());
    }
}

/// The pixel that is pointed at with its score, else what the surface holds.
fn status(ui: &mut Ui, pointed: Option<Pixel>, raster: &Raster, region: PixelRect, matched: &TemplateMatch) {
    ui.horizontal(|ui| {
        ui.set_height(STATUS - 6.0);
        let Some(pixel) = pointed else {
            let flat = if matched.flat_positions > 0 {
                format!(", {} flat", matched.flat_positions)
            } else {
                String::new()
            };
            let line = if matched.measure == Measure::Ncc { "; white line: threshold" } else { "" };
            ui.label(theme::note(format!("{} positions{flat}{line}", matched.positions)));
            return;
        };
        let (x, y) = (pixel.x.round() as i64, pixel.y.round() as i64);
        let value = raster.at(x - i64::from(region.x), y - i64::from(region.y));
        ui.label(theme::number(format!("x {x}  y {y}")).size(11.0));
        ui.label(theme::note(matched.measure.word()));
        ui.label(
            theme::number(value.map_or_else(|| "excluded".to_owned(), |v| format!("{v:+.3}"))).size(11.0),
        );
    });
}

/// The colour bar between the measure's limits with ticks, the threshold and the peak.
fn colour_bar(ui: &Ui, area: Rect, matched: &TemplateMatch, threshold: Option<f32>, run: egui::Color32) {
    let painter = ui.painter();
    let strip = Rect::from_min_max(area.min + vec2(2.0, 8.0), pos2(area.left() + 13.0, area.bottom() - 8.0));
    let [least, greatest] = matched.measure.shown_limits();
    let share = |score: f32| (score.clamp(least, greatest) - least) / (greatest - least);
    let at = |score: f32| strip.bottom() - share(score) * strip.height();
    let of = |share: f32| least + (greatest - least) * share;
    let mut mesh = egui::Mesh::default();
    let steps = 64;
    for i in 0..steps {
        let [low, high] = [i, i + 1].map(|i| i as f32 / steps as f32);
        let row = Rect::from_min_max(pos2(strip.left(), at(of(high))), pos2(strip.right(), at(of(low))));
        mesh.add_colored_rect(row, theme::score((low + high) / 2.0));
    }
    painter.add(egui::Shape::mesh(mesh));
    for tick in (0..TICKS).map(|i| of(i as f32 / (TICKS - 1) as f32)) {
        let end = pos2(strip.right() + 4.0, at(tick));
        painter.line_segment([pos2(strip.right(), at(tick)), end], egui::Stroke::new(1.0, theme::weak()));
        let words =
            if tick == 0.0 { "0".to_owned() } else { format!("{:+}", (tick * 1000.0).round() / 1000.0) };
        painter.text(end + vec2(2.0, 0.0), Align2::LEFT_CENTER, words, theme::digit_font(), theme::weak());
    }
    if let Some(threshold) = threshold {
        painter.hline(strip.x_range(), at(threshold), egui::Stroke::new(2.0, theme::strong()));
    }
    let tip = pos2(strip.left() - 1.0, at(matched.peak.score as f32));
    let arrow = vec![tip, tip + vec2(-5.0, -4.0), tip + vec2(-5.0, 4.0)];
    painter.add(egui::Shape::convex_polygon(arrow, run, egui::Stroke::NONE));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_region_of_the_scores_is_the_window_less_half_a_template() {
        let window = PixelRect::new(100, 50, 143, 143);
        assert_eq!(region_of(window, [123, 123]), PixelRect::new(110, 60, 123, 123));
    }
}
