//! Handles in the left image: the search window's and the template's corners, and the predicted point.

use egui::{Color32, CursorIcon, Rect, Response, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, vec2};
use serde_json::json;
use sightline_geometry::frames::Pixel;
use sightline_track::settings::TrackerKind;
use sightline_track::trace::StepTrace;

use crate::command::Command;
use crate::drawing::view2d::Canvas;
use crate::state::State;
use crate::theme;
use crate::what_if::panel::values::{predicted, side};
use crate::why::WhyCommand;

/// Side of a handle's sensitive area, points.
const TAKEN: f32 = 24.0;
/// Half the side of a handle's mark, points.
const MARK: f32 = 4.0;
/// Minimum sizes of search window and template, px.
const LEAST: [u64; 2] = [21, 5];
/// Maximum sizes of search window and template, px.
const MOST: [u64; 2] = [1023, 101];

/// Shows the handles and handles their drags.
pub(crate) fn show(ui: &mut Ui, canvas: &Canvas, state: &State, trace: &StepTrace, out: &mut Vec<Command>) {
    let Some(centre) = predicted(state, trace) else { return };
    let window = side(state, "search_window_px");
    if let Some(window) = window.filter(|_| state.tracker() == TrackerKind::Template) {
        let template = side(state, "template_size_px").unwrap_or(LEAST[1]);
        let limits = [LEAST[0].max(template), MOST[0]];
        let corner = Corner { name: "search window size", key: "search_window_px", centre, limits };
        corner.show(ui, canvas, window, theme::on_image(theme::search), state, out);
        let matched = trace.located().and_then(|located| located.left_pixel).unwrap_or(centre);
        let limits = [LEAST[1], MOST[1].min(window)];
        let corner = Corner { name: "template size", key: "template_size_px", centre: matched, limits };
        let colour = theme::on_image(|| theme::run(state.cursor.run));
        corner.show(ui, canvas, template, colour, state, out);
    }
    point(ui, canvas, centre, out);
}

/// A handle at the lower right corner of a square.
struct Corner {
    name: &'static str,
    key: &'static str,
    centre: Pixel,
    limits: [u64; 2],
}

impl Corner {
    fn show(
        &self,
        ui: &mut Ui,
        canvas: &Canvas,
        side: u64,
        colour: Color32,
        state: &State,
        out: &mut Vec<Command>,
    ) {
        let half = side as f64 / 2.0;
        let at = self.centre.offset(half, half);
        let Some(response) = handle(ui, canvas, self.key, at, colour) else { return };
        response.widget_info(|| WidgetInfo::slider(true, side as f64, format!("{} handle, px", self.name)));
        // Without limits of its own, an HTML slider ends at 100.
        ui.ctx().accesskit_node_builder(response.id, |node| {
            let [least, most] = self.limits.map(|limit| limit as f64);
            node.set_min_numeric_value(least);
            node.set_max_numeric_value(most);
            node.set_numeric_value_step(2.0);
        });
        let dragged = response.dragged().then(|| response.interact_pointer_pos()).flatten();
        if let Some(pointer) = dragged {
            let to = canvas.transform.to_pixel(pointer);
            let reach = (to.x - self.centre.x).max(to.y - self.centre.y);
            let wanted = odd(2.0 * reach, self.limits);
            if wanted != side {
                let in_run = state.setting("template", self.key).and_then(|value| value.as_u64());
                let value = (in_run != Some(wanted)).then(|| json!(wanted));
                out.push(Command::Why(WhyCommand::Change { key: self.key.to_owned(), value }));
            }
        }
        response
            .on_hover_cursor(CursorIcon::ResizeNwSe)
            .on_hover_text(format!("Drag to try another {}: {side} px", self.name));
    }
}

/// The handle of the predicted point.
fn point(ui: &mut Ui, canvas: &Canvas, at: Pixel, out: &mut Vec<Command>) {
    let Some(response) = handle(ui, canvas, "prediction", at, theme::on_image(theme::prediction)) else {
        return;
    };
    let words = format!("prediction handle, at {:.1}, {:.1} px", at.x, at.y);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, &words));
    let dragged = response.dragged().then(|| response.interact_pointer_pos()).flatten();
    if let Some(pointer) = dragged {
        let to = canvas.transform.to_pixel(pointer);
        let tenth = |v: f64| (v * 10.0).round() / 10.0;
        let pixel = Pixel::new(tenth(to.x), tenth(to.y));
        if pixel != at {
            out.push(Command::Why(WhyCommand::Displace(Some(pixel))));
        }
    }
    response.on_hover_cursor(CursorIcon::Move).on_hover_text("Drag to try another prediction");
}

/// Shows a handle if it is on the canvas; it is painted only while the pointer or the focus is on the image.
fn handle(ui: &mut Ui, canvas: &Canvas, id: &str, at: Pixel, colour: Color32) -> Option<Response> {
    let place = canvas.transform.to_screen(at);
    if !canvas.transform.rect.contains(place) {
        return None;
    }
    let area = Rect::from_center_size(place, Vec2::splat(TAKEN));
    let response = ui.interact(area, ui.scope_id().with(("what if", id)), Sense::drag());
    let reach = if response.hovered() || response.dragged() { MARK + 2.0 } else { MARK };
    let mark = Rect::from_center_size(place, vec2(2.0 * reach, 2.0 * reach));
    // Without pointer or focus on the image, nothing covers it.
    let is_near =
        ui.rect_contains_pointer(canvas.transform.rect) || response.dragged() || response.has_focus();
    if is_near {
        for (colour, width) in [(theme::on_image(theme::halo), 3.4), (colour, 1.4)] {
            canvas.painter.rect_stroke(mark, 1.0, Stroke::new(width, colour), StrokeKind::Middle);
        }
    }
    Some(response)
}

/// The odd whole number nearest to `value` within limits.
fn odd(value: f64, [low, high]: [u64; 2]) -> u64 {
    let nearest = 2.0 * ((value - 1.0) / 2.0).round() + 1.0;
    let bounded = nearest.clamp(low as f64, high as f64) as u64;
    if bounded.is_multiple_of(2) { bounded - 1 } else { bounded }
}

#[cfg(test)]
mod tests {
    use crate::what_if::panel::handles::odd;

    #[test]
    fn a_dragged_side_is_odd_and_keeps_to_its_limits() {
        assert_eq!(odd(60.2, [21, 1023]), 61);
        assert_eq!(odd(62.2, [21, 1023]), 63);
        assert_eq!(odd(-5.0, [21, 1023]), 21);
        assert_eq!(odd(5000.0, [21, 1023]), 1023);
        assert_eq!(odd(99.0, [5, 60]), 59);
    }
}
