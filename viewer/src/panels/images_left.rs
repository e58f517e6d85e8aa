//! The left image with the tracker's marks of the selected target, other targets, features and corners.

use egui::{Margin, Ui, vec2};
use sightline_session::marks::{basin_of, square};
use sightline_session::view::TargetView;
use sightline_vision::image::PixelRect;

use crate::cache::{ImageSide, Slot};
use crate::command::{Command, Layer, Mode, Zoomable};
use crate::compare::panel::{bar, marks as compared, modes};
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::Canvas;
use crate::driving::ground;
use crate::hovered::Hovered;
use crate::layout::left_image::keep_left_image;
use crate::odometry::corners;
use crate::panels::broken;
use crate::panels::camera_choice;
use crate::panels::epipolar::Curve;
use crate::panels::exposure;
use crate::panels::features::marks;
use crate::panels::image_marks::{self, Of};
use crate::panels::legend::Entry;
use crate::panels::panel::Panel;
use crate::panels::status_line::{STATUS, status_line};
use crate::panels::track;
use crate::picking;
use crate::state::{State, row_of, run_letter};
use crate::what_if::panel;
use crate::{panels, theme};

/// The panel of the left image.
pub(crate) struct LeftView;

impl Panel for LeftView {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        let place = show(ui, state, out);
        keep_left_image(ui, place);
    }

    fn margin(&self) -> Margin {
        Margin { left: 4, right: 4, top: 4, bottom: 0 }
    }
}

/// Shows the left image. Returns its canvas' transform and size, from which a test can compute where to click.
pub(crate) fn show(
    ui: &mut Ui,
    state: &State,
    out: &mut Vec<Command>,
) -> Option<(crate::drawing::view2d::Transform, [u32; 2])> {
    camera_choice::show(ui, state, out);
    let raster = ready_image(ui, state, ImageSide::Left, out)?;
    raster.stretch(state.stretch);
    exposure::show(ui, state, raster, &theme::on_image(|| entries(state)), out);
    bar::show(ui, state, out);
    if let Some(shown) = modes::instead(ui, state, raster, out) {
        return shown;
    }
    Some((picture(ui, state, raster, out), raster.size()))
}

/// The image with its marks and the status line below it.
fn picture(
    ui: &mut Ui,
    state: &State,
    raster: &Raster,
    out: &mut Vec<Command>,
) -> crate::drawing::view2d::Transform {
    let [width, height] = raster.size();
    let region = PixelRect::whole(width, height);
    let view = state.stabilised_view(state.view(Zoomable::Left), state.trace_on_image());
    let canvas = Canvas::new(ui, view, region, STATUS);
    canvas.texture(&raster.texture, region);
    modes::under(&canvas, state);
    canvas.pixel_grid(region);
    picking::map::paint(&canvas, state);
    if state.marks {
        theme::on_image(|| paint_marks(&canvas, state));
    }
    theme::on_image(|| modes::over(ui, &canvas, state, out));
    theme::on_image(|| crate::notes::marks::image(&canvas, state));
    let described = picking::show(ui, &canvas, raster, state, out);
    if state.shows_targets_camera() {
        marks::hover(&canvas, state, |feature| Some(feature.pixel));
        panel::over_image(ui, &canvas, state, out);
    }
    corners::hover_left(&canvas, state);
    let hovered = theme::on_image(|| paint_hovered(&canvas, state));
    if picking::footer::is_shown(state) {
        picking::footer::show(ui, &canvas, state, described, out);
    } else {
        status_line(ui, &canvas, raster, region, hovered);
    }
    out.extend(canvas.hovered(region).map(|pixel| Command::Hover(Hovered::Left(pixel))));
    if let Some(view) = canvas.moved {
        out.push(Command::View(Zoomable::Left, view));
    }
    canvas.transform
}

/// The marks of the step: ground, other targets, corners, features, track, and the evidence for the target.
fn paint_marks(canvas: &Canvas, state: &State) {
    ground::paint(canvas, state);
    paint_others(canvas, state);
    corners::paint_left(canvas, state);
    let Some(trace) = state.trace_on_image().filter(|_| state.shows_target()) else { return };
    marks::paint_left(canvas, state);
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    track::paint(&overlay, state);
    let of = Of::Shown(theme::run(state.cursor.run));
    image_marks::paint(&overlay, trace, state.template_side_px(), ImageSide::Left, of, state);
}

/// An image of the cursor's stop; otherwise shows why it is not available and returns `None`.
pub(crate) fn ready_image<'a>(
    ui: &mut Ui,
    state: &'a State,
    side: ImageSide,
    out: &mut Vec<Command>,
) -> Option<&'a Raster> {
    let word = side.word();
    let step = state.cursor.step;
    if state.lacks_images_yet(step) {
        let sentence = state.missing_by_pause(step).unwrap_or_else(|| state.missing_step());
        panels::missing(ui, &format!("The {word} image of step {step} is not taken yet."), &sentence);
        return None;
    }
    if let Some(sentence) = state.lacks_image(side) {
        panels::missing(ui, "", &sentence);
        return None;
    }
    match state.image(side) {
        Slot::Ready(raster) => return Some(raster),
        Slot::Failed(problem) => broken::show(ui, word, step, problem, out),
        Slot::Absent if state.traverse.is_none() => panels::missing(ui, "", &state.missing_target()),
        Slot::Absent | Slot::Loading => panels::missing(ui, "", &waiting_words(state, word, step)),
    }
    None
}

fn waiting_words(state: &State, word: &str, step: usize) -> String {
    if let Some(name) = state.camera() {
        return format!("Loading the {word} image of {name} at step {step} …");
    }
    let is_rendered = state.stop().is_some_and(|stop| stop.ready);
    match (is_rendered, state.rendering) {
        (true, _) => format!("Loading the {word} image of step {step} …"),
        (false, Some((k, n))) => {
            format!(
                "The images of step {step} are being rendered: {k} of {n} stops are done. They appear here by themselves."
            )
        }
        (false, None) => {
            format!("The images of step {step} are being rendered. They appear here by themselves.")
        }
    }
}

/// The legend entries of the left image.
fn entries(state: &State) -> Vec<Entry> {
    let mut entries = entries_of_step(state);
    if state.mode == Mode::Pick && state.trackability_map().is_some() {
        entries.extend(picking::footer::entries());
    }
    entries
}

fn entries_of_step(state: &State) -> Vec<Entry> {
    let Some(trace) = state.trace_on_image() else { return Vec::new() };
    let evidence = trace.template();
    let matched = evidence.and_then(|e| e.match_template.as_ref());
    let run = theme::run(state.cursor.run);
    let mut entries = Vec::new();
    if trace.truth.as_ref().is_some_and(|t| t.left_pixel.is_some()) {
        entries.push(Entry::new(Layer::Truth, Mark::Plus, theme::truth(), "truth"));
    }
    if trace.located().is_some_and(|l| l.left_pixel.is_some()) {
        let by_shape =
            trace.shape().is_some_and(|shape| shape.registration.is_some() && shape.is_judged_by_shape);
        let word = match (trace.prediction().is_some(), trace.features().is_some()) {
            (false, _) => "picked",
            (true, _) if by_shape => "registered here, 1σ 2σ 3σ",
            (true, false) => "match, 3σ",
            (true, true) => "moved here, 1σ 2σ 3σ",
        };
        let word = format!("{word} · run {}", run_letter(state.cursor.run));
        entries.push(Entry::new(Layer::Match, Mark::Ring, run, word));
    }
    if trace.prediction().is_some() && trace.point_mast.predicted_left.is_some() {
        entries.push(Entry::new(
            Layer::Prediction,
            Mark::Stroke(StrokeStyle::Dotted),
            theme::prediction(),
            "predicted, 3σ gate",
        ));
    }
    if let Some((_, half_width_m)) = basin_of(trace) {
        let word = format!("basin, half width {:.0} cm", half_width_m * 100.0);
        entries.push(Entry::new(Layer::Basin, Mark::Stroke(StrokeStyle::Dashed), theme::basin(), word));
    }
    if matched.is_some() {
        entries.push(Entry::new(Layer::Template, Mark::Stroke(StrokeStyle::Solid), run, "template window"));
        entries.push(Entry::new(
            Layer::SearchWindow,
            Mark::Stroke(StrokeStyle::Dashed),
            theme::search(),
            "search window",
        ));
    }
    if trace.capture().is_some_and(|c| c.subframe.is_some()) {
        entries.push(Entry::new(
            Layer::Subframe,
            Mark::Stroke(StrokeStyle::Dotted),
            theme::subframe(),
            "subframe",
        ));
    }
    if track::is_there(state) {
        entries.push(Entry::new(
            Layer::Track,
            Mark::Stroke(StrokeStyle::Solid),
            run,
            "track: past solid, future dotted",
        ));
    }
    if state.session.as_ref().is_some_and(|s| s.targets.len() > 1) {
        entries.push(Entry::new(Layer::Others, Mark::Diamond, theme::weak(), "other targets"));
    }
    entries.extend(marks::left_entries(state));
    entries.extend(compared::entries(state));
    entries.extend(corners::left_entry(state));
    entries.extend(ground::entry(state));
    entries
}

/// The other targets, at the positions of their latest runs.
fn paint_others(canvas: &Canvas, state: &State) {
    let Some(session) = state.session.as_ref().filter(|_| state.shows(Layer::Others)) else { return };
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    let is_here = |target: &&TargetView| target.designation.camera == state.camera();
    let others = session.targets.iter().filter(|target| Some(target.number) != state.cursor.target);
    let is_shown = |target: &&TargetView| !state.hidden_targets.contains(&target.number);
    for target in others.filter(is_here).filter(is_shown) {
        let row = target.runs.last().and_then(|run| row_of(run, state.cursor.step));
        if let Some(pixel) = row.and_then(|row| row.left_pixel) {
            let colour = state.colour_of(target.number);
            overlay.mark(pixel, Mark::Diamond, colour);
            overlay.words(pixel, vec2(10.0, 0.0), &target.label, colour);
        }
    }
}

/// Paints the position that the pointer selects in another panel. Returns its description.
fn paint_hovered(canvas: &Canvas, state: &State) -> Option<String> {
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    match state.hovered.filter(|_| state.marks)? {
        Hovered::Right(pixel) => {
            let (to, from) = state.stereo_cameras()?;
            Curve::new(from, to, pixel)?.paint(canvas, theme::accent(), StrokeStyle::Dashed);
            Some(format!("curve of x {:.1}  y {:.1} of the right image", pixel.x, pixel.y))
        }
        Hovered::Score(pixel) if state.shows_targets_camera() => {
            let quad = square(pixel, state.template_side_px(), &nalgebra::Matrix2::identity());
            overlay.outline(&quad, theme::accent(), StrokeStyle::Dashed);
            overlay.mark(pixel, Mark::Plus, theme::accent());
            Some(format!("template at x {:.0}  y {:.0}", pixel.x, pixel.y))
        }
        _ => None,
    }
}
