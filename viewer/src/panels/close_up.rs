//! The target's close-up: its surroundings in both images, magnified four times, with the marks of the step and the 3σ
//! ellipses.

use egui::{Align2, Margin, Painter, Pos2, Rect, Sense, Ui, pos2, vec2};
use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;
use sightline_vision::image::PixelRect;

use crate::cache::{ImageSide, Slot};
use crate::command::Command;
use crate::drawing::overlay::{Overlay, paint_words};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::{Transform, View2d};
use crate::panels::image_marks::{self, Of};
use crate::panels::panel::Panel;
use crate::state::State;
use crate::theme;

/// Points on the screen per pixel.
const SCALE: f64 = 4.0;

/// Room between the two views, points.
const GAP: f32 = 4.0;

/// The panel “Close-up”.
pub(crate) struct CloseUp;

impl Panel for CloseUp {
    fn show(&self, ui: &mut Ui, state: &State, _out: &mut Vec<Command>) {
        show(ui, state);
    }

    fn missing(&self, state: &State) -> Option<String> {
        let is_there = state.trace_on_image().is_some_and(|trace| place(trace, ImageSide::Left).is_some());
        (!is_there).then(|| state.missing_step())
    }

    fn margin(&self) -> Margin {
        Margin::same(4)
    }
}

/// The target's pixel in an image: as located, else as predicted.
fn place(trace: &RunStep, side: ImageSide) -> Option<Pixel> {
    let located = trace.located();
    match side {
        ImageSide::Left => located.and_then(|found| found.left_pixel).or(trace.point_mast.predicted_left),
        ImageSide::Right => located.and_then(|found| found.right_pixel).or(trace.point_mast.predicted_right),
    }
}

fn show(ui: &mut Ui, state: &State) {
    let Some(trace) = state.trace_on_image() else { return };
    let area = ui.available_rect_before_wrap();
    let has_right = place(trace, ImageSide::Right).is_some() && state.lacks_image(ImageSide::Right).is_none();
    let width = if has_right { (area.width() - GAP) / 2.0 } else { area.width() };
    let frame = |left: f32| Rect::from_min_size(pos2(left, area.top()), vec2(width, area.height()));
    view(ui, state, trace, ImageSide::Left, frame(area.left()));
    if has_right {
        view(ui, state, trace, ImageSide::Right, frame(area.left() + width + GAP));
    }
    ui.advance_cursor_after_rect(area);
}

/// The view of one camera.
fn view(ui: &Ui, state: &State, trace: &RunStep, side: ImageSide, frame: Rect) {
    let painter = ui.painter_at(frame);
    painter.rect_filled(frame, 0.0, theme::well());
    let name = format!("close-up of the {} image", side.word());
    let response = ui.interact(frame, ui.scope_id().with(side.word()), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
    let (Some(centre), Slot::Ready(raster)) = (place(trace, side), state.image(side)) else {
        let words = format!("Loading the {} image …", side.word());
        painter.text(frame.center(), Align2::CENTER_CENTER, words, theme::image_font(), theme::weak());
        return;
    };
    raster.stretch(state.stretch);
    let transform = transform(raster, centre, frame);
    theme::on_image(|| {
        picture(&painter, raster, &transform);
        if state.marks {
            let of = Of::Shown(theme::run(state.cursor.run));
            image_marks::paint(
                &Overlay::new(&painter, &transform),
                trace,
                state.template_side_px(),
                side,
                of,
                state,
            );
        }
        let corner: Pos2 = frame.left_bottom() + vec2(6.0, -10.0);
        paint_words(&painter, corner, &format!("{} ×{SCALE}", side.word()), theme::weak());
    });
}

fn transform(raster: &Raster, centre: Pixel, frame: Rect) -> Transform {
    let [width, height] = raster.size();
    Transform::new(View2d::At { centre, scale: SCALE }, PixelRect::whole(width, height), frame)
}

fn picture(painter: &Painter, raster: &Raster, transform: &Transform) {
    let [width, height] = raster.size();
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(
        raster.texture.id(),
        transform.area(PixelRect::whole(width, height)),
        whole,
        theme::UNTINTED,
    );
}
