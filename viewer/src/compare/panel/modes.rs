//! Views that show two runs in one left image (all marks, wipe, blink), and the overlay of the previous step.

use egui::accesskit::{Action, ActionData};
use egui::{CursorIcon, EventFilter, Key, Rect, Sense, Ui, pos2, vec2};
use sightline_vision::image::PixelRect;

use crate::cache::ImageSide;
use crate::command::{Command, Mode, Zoomable};
use crate::compare::keys::wipe_id;
use crate::compare::panel::{difference, marks, side_by_side};
use crate::compare::state::{Other, place_of_target};
use crate::compare::{CompareCommand, View};
use crate::drawing::overlay::{Overlay, paint_words};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::{Canvas, Transform};
use crate::layout::left_image::LeftImage;
use crate::state::State;
use crate::theme;

/// Movement of the divider per key press, as a fraction of the width.
const KEY_STEP: f32 = 0.05;

/// Shows the views that replace the single image; `None` for the others.
pub(crate) fn instead(
    ui: &mut Ui,
    state: &State,
    raster: &Raster,
    out: &mut Vec<Command>,
) -> Option<LeftImage> {
    // A target is picked on the whole image.
    if !state.is_comparing() || state.mode == Mode::Pick {
        return None;
    }
    match state.compare.view {
        View::SideBySide => Some(side_by_side::show(ui, state, raster, out)),
        View::Difference => {
            difference::show(ui, state);
            Some(None)
        }
        View::Marks | View::Wipe | View::Blink => None,
    }
}

/// Paints the layer below the marks: the previous step, if it is overlaid.
pub(crate) fn under(canvas: &Canvas, state: &State) {
    if !state.compare.has_onion_skin {
        return;
    }
    let Some(before) = state.cursor.step.checked_sub(1) else { return };
    let Some(raster) =
        state.image_key(before, ImageSide::Left).and_then(|key| state.cache.raster(&key).ready())
    else {
        return;
    };
    raster.stretch(state.stretch);
    let [width, height] = raster.size();
    let mut area = canvas.transform.area(PixelRect::whole(width, height));
    // With stabilisation, aligns the target's previous position with its current one.
    let now = state.trace_on_image().and_then(place_of_target);
    let places = state.trace_at(before).ready().and_then(place_of_target).zip(now);
    if let Some((then, now)) = places.filter(|_| state.compare.is_stabilised) {
        area = area.translate(canvas.transform.to_screen(now) - canvas.transform.to_screen(then));
    }
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    canvas.painter.image(raster.texture.id(), area, whole, theme::ONION);
    let words = format!("step {before} shines through");
    paint_words(
        &canvas.painter,
        canvas.transform.rect.left_bottom() + vec2(8.0, -12.0),
        &words,
        theme::text(),
    );
}

/// Paints the layer above the marks of the selected run.
pub(crate) fn over(ui: &Ui, canvas: &Canvas, state: &State, out: &mut Vec<Command>) {
    let others = state.others();
    let Some(other) = others.first().filter(|_| state.mode != Mode::Pick) else { return };
    if state.compare.is_blinking {
        return paint_other(canvas, state, other, canvas.transform.rect);
    }
    match state.compare.view {
        View::Marks if state.marks => {
            marks::paint_all(&Overlay::new(&canvas.painter, &canvas.transform), state);
            if let Some(words) = marks::elsewhere(state) {
                corner(canvas, canvas.transform.rect, &words, theme::text());
            }
        }
        View::Wipe => wipe(ui, canvas, state, other, out),
        View::Blink => {
            let words = format!("hold X to see {}", state.run_label(other.name));
            corner(canvas, canvas.transform.rect, &words, other.style.colour);
        }
        View::Marks | View::SideBySide | View::Difference => {}
    }
}

/// Paints the image and the marks of another run on a part of the canvas.
fn paint_other(canvas: &Canvas, state: &State, other: &Other<'_>, part: Rect) {
    let label = state.run_label(other.name);
    let Some(raster) = state.other_image(other.name).ready() else {
        return corner(canvas, part, &format!("{label}: its image is not loaded here"), theme::lost());
    };
    raster.stretch(state.stretch);
    let trace = state.other_trace(other.name).ready();
    let [width, height] = raster.size();
    let region = PixelRect::whole(width, height);
    let painter = canvas.painter.with_clip_rect(part.intersect(canvas.painter.clip_rect()));
    let view = state.stabilised_view(state.view(Zoomable::Left), trace);
    let transform = Transform::new(view, region, canvas.transform.rect);
    painter.rect_filled(part, 0.0, theme::well());
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(raster.texture.id(), transform.area(region), whole, theme::UNTINTED);
    if let Some(trace) = trace.filter(|_| state.marks) {
        marks::paint(&Overlay::new(&painter, &transform), trace, other.run, other.style, state);
    }
    let words = match trace {
        Some(trace) if trace.step != state.cursor.step => format!("{label}, step {}", trace.step),
        Some(_) => label,
        None => format!("{label}: this step is not loaded or not computed"),
    };
    corner(canvas, part, &words, other.style.colour);
}

fn corner(canvas: &Canvas, part: Rect, words: &str, colour: egui::Color32) {
    let width = canvas.painter.layout_no_wrap(words.to_owned(), theme::image_font(), colour).size().x;
    paint_words(&canvas.painter, part.right_top() + vec2(-width - 8.0, 12.0), words, colour);
}

/// Shows the selected run left of the divider and the other right of it.
fn wipe(ui: &Ui, canvas: &Canvas, state: &State, other: &Other<'_>, out: &mut Vec<Command>) {
    let area = canvas.transform.rect;
    let at = state.compare.wipe.unwrap_or(0.5);
    let x = area.left() + area.width() * at;
    paint_other(canvas, state, other, area.with_min_x(x));
    let own = state.own_name().map_or_else(String::new, |own| state.run_label(own));
    paint_words(&canvas.painter, area.left_top() + vec2(8.0, 12.0), &own, state.own_style().colour);
    let grip = Rect::from_center_size(pos2(x, area.center().y), vec2(24.0, area.height()));
    let response = ui.interact(grip.intersect(area), wipe_id(), Sense::click_and_drag());
    let is_marked = response.hovered() || response.has_focus() || response.dragged();
    let colour = if is_marked { theme::accent() } else { theme::strong() };
    canvas.painter.vline(x, area.y_range(), egui::Stroke::new(4.0, theme::halo()));
    canvas.painter.vline(x, area.y_range(), egui::Stroke::new(2.0, colour));
    canvas.painter.circle_filled(pos2(x, area.center().y), 7.0, colour);
    response.widget_info(|| {
        let per_cent = (f64::from(at) * 1000.0).round() / 10.0;
        egui::WidgetInfo::slider(true, per_cent, "wipe divider, per cent of the image's width")
    });
    ui.ctx().accesskit_node_builder(response.id, |node| {
        for action in [Action::Increment, Action::Decrement, Action::SetValue] {
            node.add_action(action);
        }
        node.set_min_numeric_value(0.0);
        node.set_max_numeric_value(100.0);
        // Rounded to a decimal: an HTML slider accepts only multiples of its step.
        node.set_numeric_value_step((f64::from(KEY_STEP) * 1000.0).round() / 10.0);
    });
    if response.clicked() || response.drag_started() {
        response.request_focus();
    }
    // Uses the pointer's position: summed drag deltas would drift away from it.
    let pointer = response.dragged().then(|| response.interact_pointer_pos()).flatten();
    let dragged = pointer.map(|pointer| (pointer.x - area.left()) / area.width().max(1.0));
    let to = accesskit_value(ui, response.id).or(dragged).or_else(|| moved(ui, &response).map(|by| at + by));
    if let Some(to) = to.map(|to| to.clamp(0.0, 1.0)).filter(|&to| to != at) {
        out.push(Command::Compare(CompareCommand::Wipe(to)));
    }
    response.on_hover_cursor(CursorIcon::ResizeHorizontal);
}

/// The position that a screen reader sets, as a fraction of the width.
fn accesskit_value(ui: &Ui, id: egui::Id) -> Option<f32> {
    ui.input(|input| {
        let mut requests = input.accesskit_action_requests(id, Action::SetValue);
        requests.find_map(|request| match request.data {
            Some(ActionData::NumericValue(value)) => Some(value as f32 / 100.0),
            _ => None,
        })
    })
}

/// The movement by keys or a screen reader, as a fraction of the width.
fn moved(ui: &Ui, response: &egui::Response) -> Option<f32> {
    let steps = ui.input(|input| {
        let count = |action: Action| input.num_accesskit_action_requests(response.id, action) as f32;
        count(Action::Increment) - count(Action::Decrement)
    });
    if steps != 0.0 || !response.has_focus() {
        return Some(steps * KEY_STEP).filter(|by| *by != 0.0);
    }
    let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    ui.input(|input| {
        let pressed = |key: Key| input.num_presses(key) as f32 * KEY_STEP;
        let ends = f32::from(u8::from(input.key_pressed(Key::End)))
            - f32::from(u8::from(input.key_pressed(Key::Home)));
        Some(pressed(Key::ArrowRight) - pressed(Key::ArrowLeft) + ends)
    })
}
