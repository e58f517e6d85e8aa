//! The right image with the epipolar curve of the target, its range ticks and the stereo match.

use egui::{Margin, Ui, vec2};
use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;
use sightline_vision::image::PixelRect;

use crate::cache::ImageSide;
use crate::command::{Command, Layer, Mode, Zoomable};
use crate::compare::panel::marks as compared;
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::Canvas;
use crate::hovered::Hovered;
use crate::panels::camera_choice;
use crate::panels::epipolar::Curve;
use crate::panels::features::marks;
use crate::panels::image_marks::{self, Of};
use crate::panels::images_left::ready_image;
use crate::panels::legend;
use crate::panels::legend::Entry;
use crate::panels::panel::Panel;
use crate::panels::status_line::{STATUS, status_line};
use crate::state::{State, run_letter};
use crate::{figure, theme};

/// Largest distance from the curve at which the pointer shows its range, px.
const NEAR_PX: f64 = 40.0;

/// The panel of the right image.
pub(crate) struct RightView;

impl Panel for RightView {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn margin(&self) -> Margin {
        Margin { left: 4, right: 4, top: 4, bottom: 0 }
    }
}

/// Shows the right image.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    camera_choice::show(ui, state, out);
    let Some(raster) = ready_image(ui, state, ImageSide::Right, out) else { return };
    raster.stretch(state.stretch);
    let entries = theme::on_image(|| entries(state));
    if figure::is_on_paper() {
        legend::above_image(ui, &entries, state, out);
    } else {
        ui.horizontal(|ui| legend::button(ui, &entries, state, out));
    }
    picture(ui, state, raster, out);
}

/// The image with its marks and the status line below it.
fn picture(ui: &mut Ui, state: &State, raster: &Raster, out: &mut Vec<Command>) {
    let [width, height] = raster.size();
    let region = PixelRect::whole(width, height);
    let canvas = Canvas::new(ui, state.view(Zoomable::Right), region, STATUS);
    canvas.texture(&raster.texture, region);
    canvas.pixel_grid(region);
    let of_target = state.shows_targets_camera();
    if state.marks && of_target {
        theme::on_image(|| marks::paint_right(&canvas, state));
    }
    if of_target {
        marks::hover(&canvas, state, |feature| feature.right);
    }
    if let Some(trace) = state.trace_on_image().filter(|_| state.marks && state.shows_target()) {
        theme::on_image(|| paint_marks(&canvas, trace, state));
    }
    theme::on_image(|| compared::paint_right(&Overlay::new(&canvas.painter, &canvas.transform), state));
    let hovered = paint_hovered(&canvas, state);
    let here = canvas.hovered(region);
    status_line(ui, &canvas, raster, region, hovered);
    if let Some(pixel) = here {
        paint_range(&canvas, state, pixel);
        out.push(Command::Hover(Hovered::Right(pixel)));
    }
    if let Some(view) = canvas.moved {
        out.push(Command::View(Zoomable::Right, view));
    }
}

fn entries(state: &State) -> Vec<Entry> {
    let Some(trace) = state.trace_on_image() else { return Vec::new() };
    let mut entries = Vec::new();
    if trace.located().is_some_and(|l| l.right_pixel.is_some()) {
        let is_moved = trace.prediction().is_some() && trace.features().is_some();
        let what = if is_moved { "moved here" } else { "stereo match" };
        let word = format!("{what} · run {}", run_letter(state.cursor.run));
        entries.push(Entry::new(Layer::Match, Mark::Ring, theme::run(state.cursor.run), word));
    }
    if trace.prediction().is_some() && trace.point_mast.predicted_right.is_some() {
        entries.push(Entry::new(Layer::Prediction, Mark::Cross, theme::prediction(), "predicted"));
    }
    if trace.located().is_some_and(|l| l.left_pixel.is_some()) {
        let word = "epipolar curve, range in m";
        entries.push(Entry::new(Layer::Curve, Mark::Stroke(StrokeStyle::Solid), theme::search(), word));
    }
    entries.extend(marks::right_entries(state));
    entries.extend(compared::entries(state));
    entries
}

fn paint_marks(canvas: &Canvas, trace: &RunStep, state: &State) {
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    if let Some(curve) = target_curve(state).filter(|_| state.shows(Layer::Curve)) {
        curve.paint(canvas, theme::search(), StrokeStyle::Dotted);
    }
    let run = theme::run(state.cursor.run);
    image_marks::paint(&overlay, trace, state.template_side_px(), ImageSide::Right, Of::Shown(run), state);
    let stereo = trace.template().and_then(|evidence| evidence.point_stereo.as_ref());
    if let Some(stereo) = stereo.filter(|_| state.shows(Layer::Match)) {
        let words = format!("{:.2} m, ncc {:.2}", stereo.range_m, stereo.score);
        overlay.words(stereo.right_pixel, vec2(12.0, -14.0), &words, run);
        if stereo.at_end {
            let words = "at the end of the searched ranges";
            overlay.words(stereo.right_pixel, vec2(12.0, 4.0), words, theme::lost());
        }
    }
}

/// Paints the position that the pointer selects in another panel. Returns its description.
fn paint_hovered(canvas: &Canvas, state: &State) -> Option<String> {
    let hovered = state.hovered.filter(|_| state.marks)?;
    if let Hovered::Range(range_m) = hovered {
        let pixel = curve_on_image(state)?.at(range_m)?;
        let overlay = Overlay::new(&canvas.painter, &canvas.transform);
        overlay.mark(pixel, Mark::Plus, theme::accent());
        return Some(format!("range {range_m:.2} m"));
    }
    let (pixel, (from, to)) = (hovered.left()?, state.stereo_cameras()?);
    let curve = Curve::new(from, to, pixel)?;
    curve.paint(canvas, theme::accent(), StrokeStyle::Dashed);
    // While a target is picked, the range of each cell is known: mark the corresponding pixel on the curve.
    let cell = state.trackability_map().filter(|_| state.mode == Mode::Pick).and_then(|map| map.at(pixel));
    if let Some(seen) = cell.and_then(|cell| curve.at(cell.range_m?)) {
        Overlay::new(&canvas.painter, &canvas.transform).mark(seen, Mark::Ring, theme::accent());
    }
    Some(format!("curve of x {:.1}  y {:.1} of the left image", pixel.x, pixel.y))
}

/// Labels the pointer with the range of the nearest point of the target's curve, m.
fn paint_range(canvas: &Canvas, state: &State, pixel: Pixel) {
    let near = curve_on_image(state).and_then(|curve| curve.nearest(pixel));
    if let Some((range_m, off_px)) = near.filter(|(_, off_px)| state.marks && *off_px <= NEAR_PX) {
        let words = format!("{range_m:.2} m, {off_px:.1} px beside the curve");
        Overlay::new(&canvas.painter, &canvas.transform).words(
            pixel,
            vec2(14.0, 16.0),
            &words,
            theme::accent(),
        );
    }
}

/// The curve of the target's left pixel, if the shown images are those of the target's camera.
fn curve_on_image(state: &State) -> Option<Curve<'_>> {
    target_curve(state).filter(|_| state.shows_targets_camera())
}

/// The curve of the target's left pixel.
pub(crate) fn target_curve(state: &State) -> Option<Curve<'_>> {
    let trace = state.trace()?;
    let (pointing, located) = (&trace.point_mast, trace.located()?);
    Curve::new(&pointing.left, &pointing.right, located.left_pixel?)
}
