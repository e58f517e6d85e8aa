//! The score map of the match over the search window, with its peaks, the threshold and the prediction.

use egui::{Align2, Margin, Rect, Ui, pos2, vec2};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::locate::template::settings::Measure;
use sightline_track::trace::ArrayName;
use sightline_vision::image::PixelRect;

use crate::cache::Slot;
use crate::command::{Command, Zoomable};
use crate::drawing::overlay::{Mark, Overlay};
use crate::drawing::raster::{ColourMap, Raster};
use crate::drawing::view2d::Canvas;
use crate::hovered::Hovered;
use crate::panels::pane::{Need, Pane};
use crate::panels::panel::{Panel, TableOf};
use crate::panels::score_marks::{paint_contour, paint_marks, region_of};
use crate::panels::sheets;
use crate::panels::status_line::STATUS;
use crate::state::State;
use crate::{panels, theme};

/// The purpose of the panel.
const PURPOSE: &str = Pane::Surface.about().help;

/// Width of the colour bar with its numbers, points.
const BAR: f32 = 62.0;
/// Number of ticks of the colour bar, both ends included.
const TICKS: u32 = 5;

/// The panel of match scores.
pub(crate) struct Scores;

impl Panel for Scores {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::scores::surface)
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::TriedScores]
    }

    fn margin(&self) -> Margin {
        Margin { left: 4, right: 4, top: 4, bottom: 0 }
    }
}

/// Shows the scores: of compared runs, of tried changes, or of the run.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if crate::compare::panel::surfaces::show(ui, state, out) {
        return;
    }
    if crate::what_if::panel::scores::show(ui, state, out, recorded) {
        return;
    }
    recorded(ui, state, out);
}

/// Shows the recorded scores of the run.
pub(crate) fn recorded(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let matched = state.trace().and_then(|trace| trace.template()).and_then(|e| e.match_template.as_ref());
    let (Some(trace), Some(matched)) = (state.trace(), matched) else {
        panels::missing(ui, PURPOSE, &state.missing_template());
        return;
    };
    if matched.descent.is_some() {
        let why = "This configuration descends along the gradient from the prediction: it compares no window of \
                   positions. The Inspector has its steps.";
        return panels::missing(ui, PURPOSE, why);
    }
    let raster = match state.array(ArrayName::SURFACE) {
        Slot::Ready(raster) => raster,
        Slot::Failed(problem) => {
            return panels::missing(ui, PURPOSE, &format!("The scores cannot be shown: {}", problem.detail));
        }
        Slot::Absent | Slot::Loading => return panels::missing(ui, PURPOSE, "Loading the scores …"),
    };
    raster.set_colour_map(ColourMap::Values(matched.measure.shown_limits()));
    let area = ui.available_rect_before_wrap();
    let (rest, bar) = area.split_left_right_at_x(area.right() - BAR);
    let mut left = ui.new_child(egui::UiBuilder::new().max_rect(rest).id_salt("scores"));
    let region = region_of(matched.search_window, raster.size());
    let canvas = Canvas::new(&mut left, state.view(Zoomable::ScoreMap), region, STATUS);
    canvas.checker(region);
    canvas.texture(&raster.texture, region);
    let threshold = state.run_settings().limits.ncc_min as f32;
    // The threshold applies to correlation scores only.
    let threshold = (matched.measure == Measure::Ncc).then_some(threshold);
    if state.marks {
        if let Some(threshold) = threshold {
            paint_contour(&canvas, raster, region, threshold);
        }
        paint_marks(&canvas, trace, matched, theme::run(state.cursor.run));
    }
    warn_of_edge(&canvas, matched);
    let here = canvas.hovered(region).map(|pixel| Pixel::new(pixel.x.round(), pixel.y.round()));
    let hovered = state.hovered_left().filter(|pixel| region.contains(*pixel));
    if let Some(pixel) = hovered.filter(|_| here.is_none()) {
        Overlay::new(&canvas.painter, &canvas.transform).mark(pixel, Mark::Plus, theme::accent());
    }
    status(&mut left, here.or(hovered), raster, region, matched);
    out.extend(here.map(|pixel| Command::Hover(Hovered::Score(pixel))));
    let bar = bar.shrink2(vec2(4.0, 2.0)).with_max_y(bar.bottom() - STATUS);
    colour_bar(ui, bar, matched, threshold, theme::run(state.cursor.run));
    ui.advance_cursor_after_rect(area);
    if let Some(view) = canvas.moved {
        out.push(Command::View(Zoomable::ScoreMap, view));
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

/// The pointed pixel with its score; else the number of positions in the score map.
fn status(ui: &mut Ui, hovered: Option<Pixel>, raster: &Raster, region: PixelRect, matched: &TemplateMatch) {
    ui.horizontal(|ui| {
        ui.set_height(STATUS - 6.0);
        let Some(pixel) = hovered else {
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

/// The colour bar over the measure's range with ticks, the threshold and the peak.
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
