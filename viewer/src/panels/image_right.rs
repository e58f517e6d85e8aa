//! The right image with the epipolar curve of the target, its range ticks and the stereo match.

use egui::{Ui, vec2};
use sightline_core::camera::Camera;
use sightline_core::frames::Pixel;
use sightline_core::image::PixelRect;
use sightline_core::trace::StepTrace;

use super::compare::marks as compared;
use super::features::marks;
use super::images_left::{STATUS, ready_image, status_line};
use super::legend::{self, Entry};
use crate::cache::Eye;
use crate::command::{Command, Layer, Panel};
use crate::overlay::{Line, Mark, Overlay};
use crate::raster::Raster;
use crate::state::{State, run_letter};
use crate::theme;
use crate::view2d::Canvas;

/// Ranges with a tick, m.
const TICKS_M: [f64; 12] = [0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 50.0, 100.0];

/// Nearest and farthest range of the whole curve, m.
const CURVE_M: (f64, f64) = (0.4, 1000.0);

/// Samples of the whole curve, at equal steps of inverse range.
const SAMPLES: usize = 160;

/// Two ticks are at least this far apart, points.
const TICK_GAP: f32 = 34.0;

/// Shows the right image.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(raster) = ready_image(ui, state, Eye::Right, out) else { return };
    raster.stretch(state.stretch);
    let [width, height] = raster.size();
    let shape = (width as f32 / height.max(1) as f32, STATUS);
    legend::beside(ui, &entries(state), shape, state, out, |ui, out| picture(ui, state, raster, out));
}

/// The image itself with its marks and the line below it.
fn picture(ui: &mut Ui, state: &State, raster: &Raster, out: &mut Vec<Command>) {
    let [width, height] = raster.size();
    let region = PixelRect::whole(width, height);
    let canvas = Canvas::new(ui, state.view(Panel::Right), region, STATUS);
    canvas.texture(&raster.texture, region);
    canvas.pixel_grid(region);
    if state.marks {
        marks::paint_right(&canvas, state);
    }
    marks::hover(&canvas, state, |feature| feature.right);
    if let Some(trace) = state.trace().filter(|_| state.marks) {
        paint_marks(&canvas, trace, state);
    }
    compared::paint_right(&Overlay::new(&canvas.painter, &canvas.transform), state);
    status_line(ui, &canvas, raster, region);
    if let Some(view) = canvas.moved {
        out.push(Command::View(Panel::Right, view));
    }
}

fn entries(state: &State) -> Vec<Entry> {
    let Some(trace) = state.trace() else { return Vec::new() };
    let mut entries = Vec::new();
    if trace.locate.as_ref().is_some_and(|l| l.right_pixel.is_some()) {
        let is_moved = trace.predict.is_some() && trace.features().is_some();
        let what = if is_moved { "moved here" } else { "stereo match" };
        let word = format!("{what} · run {}", run_letter(state.cursor.run));
        entries.push(Entry::new(Layer::Match, Mark::Ring, theme::run(state.cursor.run), word));
    }
    if trace.predict.is_some() && trace.point_mast.as_ref().is_some_and(|p| p.predicted_right.is_some()) {
        entries.push(Entry::new(Layer::Prediction, Mark::Cross, theme::prediction(), "predicted"));
    }
    if trace.locate.as_ref().is_some_and(|l| l.left_pixel.is_some()) {
        let word = "epipolar curve, range in m";
        entries.push(Entry::new(Layer::Curve, Mark::Stroke(Line::Solid), theme::search(), word));
    }
    entries.extend(marks::right_entries(state));
    entries.extend(compared::entries(state));
    entries
}

fn paint_marks(canvas: &Canvas, trace: &StepTrace, state: &State) {
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    let (Some(pointing), Some(located)) = (&trace.point_mast, &trace.locate) else { return };
    if let Some(left_pixel) = located.left_pixel.filter(|_| state.shows(Layer::Curve)) {
        let curve = |range_m: f64| on_curve(&pointing.left, &pointing.right, left_pixel, range_m);
        let whole: Vec<Pixel> = ranges().filter_map(curve).collect();
        overlay.line(&whole, theme::search(), Line::Dotted);
        if let Some(stereo) = trace.template().and_then(|e| e.point_stereo.as_ref()) {
            let searched: Vec<Pixel> = stereo.curve.iter().map(|point| point.pixel).collect();
            overlay.line(&searched, theme::search(), Line::Solid);
        }
        paint_ticks(canvas, &overlay, curve);
    }
    if trace.predict.is_some()
        && state.shows(Layer::Prediction)
        && let Some(pixel) = pointing.predicted_right
    {
        overlay.mark(pixel, Mark::Cross, theme::prediction());
    }
    if let Some(pixel) = located.right_pixel.filter(|_| state.shows(Layer::Match)) {
        let run = theme::run(state.cursor.run);
        if let Some(stereo) = trace.template().and_then(|e| e.point_stereo.as_ref()) {
            overlay.ellipse(pixel, &stereo.covariance_px2, 3.0, run, Line::Solid);
            let words = format!("{:.2} m, ncc {:.2}", stereo.range_m, stereo.score);
            overlay.words(pixel, vec2(12.0, -14.0), &words, run);
            if stereo.at_end {
                overlay.words(pixel, vec2(12.0, 4.0), "at the end of the searched ranges", theme::lost());
            }
        }
        overlay.mark(pixel, Mark::Ring, run);
    }
}

/// Ranges at equal steps of inverse range, far end first.
fn ranges() -> impl Iterator<Item = f64> {
    let (near, far) = (1.0 / CURVE_M.0, 1.0 / CURVE_M.1);
    (0..SAMPLES).map(move |i| 1.0 / (far + (near - far) * i as f64 / (SAMPLES - 1) as f64))
}

/// Where the right camera sees the point of the left pixel's ray at a range.
fn on_curve(left: &Camera, right: &Camera, left_pixel: Pixel, range_m: f64) -> Option<Pixel> {
    right.project(&left.ray(left_pixel)?.at(range_m))
}

/// Ticks across the curve with their range; where they would crowd, some are left out.
fn paint_ticks(canvas: &Canvas, overlay: &Overlay<'_>, curve: impl Fn(f64) -> Option<Pixel>) {
    let mut last: Option<egui::Pos2> = None;
    for range_m in TICKS_M {
        let (Some(at), Some(beyond)) = (curve(range_m), curve(range_m * 1.01)) else { continue };
        let screen = canvas.transform.to_screen(at);
        if !canvas.transform.rect.contains(screen)
            || last.is_some_and(|last| last.distance(screen) < TICK_GAP)
        {
            continue;
        }
        let length = at.distance(beyond).max(1e-9);
        let across = (-(beyond.y - at.y) / length, (beyond.x - at.x) / length);
        let reach = 5.0 / canvas.transform.scale;
        let ends = [-reach, reach].map(|t| at.offset(across.0 * t, across.1 * t));
        overlay.line(&ends, theme::search(), Line::Solid);
        overlay.words(at, vec2(-8.0, 15.0), &format!("{range_m}"), theme::search());
        last = Some(screen);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_sampled_from_far_to_near() {
        let all: Vec<f64> = ranges().collect();
        assert!((all[0] - CURVE_M.1).abs() < 1e-6 && (all[SAMPLES - 1] - CURVE_M.0).abs() < 1e-9);
        assert!(all.windows(2).all(|pair| pair[0] > pair[1]));
    }

    #[test]
    fn the_curve_of_two_parallel_eyes_ends_at_the_same_pixel_far_away() {
        let mast = sightline_core::camera::Mast::spirit();
        let pixel = mast.left_in_head.centre_pixel();
        let far = on_curve(&mast.left_in_head, &mast.right_in_head, pixel, 1000.0).unwrap();
        let near = on_curve(&mast.left_in_head, &mast.right_in_head, pixel, 2.0).unwrap();
        assert!(far.x > near.x, "nearer points lie further left in the right image");
    }
}
