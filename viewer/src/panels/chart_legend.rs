//! The row above a chart that names its lines, each with its shape, so that nothing covers the chart.

use egui::text::{LayoutJob, TextWrapping};
use egui::{Color32, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, vec2};

use crate::drawing::overlay::{Mark, paint_mark};
use crate::theme;

/// Height of the row, points.
pub(crate) const HEIGHT: f32 = 15.0;

/// A row with less space for a word than this omits the name, points.
const WORD_MIN: f32 = 24.0;

/// Paints a mark beside its name: centre, mark, colour, and half its size in points.
type PaintMark = fn(&Painter, Pos2, Mark, Color32, f32);

/// Shows the title and the names of plotted lines in one row. Their marks are filled, like the plotted points.
pub(crate) fn show(ui: &mut Ui, title: &str, names: &[(Mark, Color32, String)]) {
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        contents(ui, title, names, paint_filled);
    });
}

/// Shows the title and the names in as many rows as needed.
pub(crate) fn wrapped(ui: &mut Ui, title: &str, names: &[(Mark, Color32, String)]) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        ui.spacing_mut().interact_size.y = HEIGHT;
        contents(ui, title, names, paint_mark);
    });
}

fn contents(ui: &mut Ui, title: &str, names: &[(Mark, Color32, String)], paint: PaintMark) {
    ui.spacing_mut().item_spacing.x = 10.0;
    if !title.is_empty() {
        ui.label(theme::note(title).color(theme::text()));
    }
    for (mark, colour, name) in names {
        entry(ui, (*mark, *colour, paint), name);
    }
}

/// A mark with its word, which stay together at a line break. A word longer than the row is elided, so that the row does
/// not widen its panel.
fn entry(ui: &mut Ui, (mark, colour, paint): (Mark, Color32, PaintMark), name: &str) {
    let reach = if matches!(mark, Mark::Stroke(_)) { 8.0 } else { 4.0 };
    let beside = 2.0 * reach + 6.0;
    let is_wrapped = ui.layout().main_wrap();
    let room = if is_wrapped { ui.max_rect().width() } else { ui.available_width() };
    if !is_wrapped && room < beside + WORD_MIN {
        return;
    }
    let mut job = LayoutJob::simple_singleline(name.to_owned(), theme::image_font(), theme::weak());
    job.wrap = TextWrapping::truncate_at_width(room - beside);
    let word = ui.painter().layout_job(job);
    let size = vec2(beside + word.size().x, word.size().y.max(HEIGHT - 2.0));
    let (frame, response) = ui.allocate_exact_size(size, Sense::hover());
    paint(ui.painter(), frame.left_center() + vec2(reach + 1.0, 0.0), mark, colour, reach);
    let at = frame.left_center() + vec2(beside, -word.size().y / 2.0);
    let is_elided = word.elided;
    ui.painter().galley(at, word, theme::weak());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, name));
    if is_elided {
        response.on_hover_text(name);
    }
}

/// A mark in the style of plotted points: closed shapes are filled.
fn paint_filled(painter: &Painter, at: Pos2, mark: Mark, colour: Color32, reach: f32) {
    let polygon = |corners: &[[f32; 2]]| {
        let corners = corners.iter().map(|&[x, y]| at + vec2(x, y) * reach).collect();
        painter.add(Shape::convex_polygon(corners, colour, Stroke::NONE));
    };
    match mark {
        Mark::Ring | Mark::Dot => {
            painter.circle_filled(at, reach * 0.75, colour);
        }
        Mark::Square => {
            painter.rect_filled(Rect::from_center_size(at, Vec2::splat(1.4 * reach)), 0.0, colour);
        }
        Mark::Diamond => polygon(&[[0.0, -0.9], [0.9, 0.0], [0.0, 0.9], [-0.9, 0.0]]),
        Mark::Triangle => polygon(&[[0.0, -0.9], [0.85, 0.65], [-0.85, 0.65]]),
        Mark::Plus | Mark::Cross | Mark::Stroke(_) => paint_mark(painter, at, mark, colour, reach),
    }
}
