//! The panel “Odometry”.

use egui::{Label, Rect, RichText, ScrollArea, Ui, UiBuilder, vec2};
use sightline_geometry::camera::CameraName;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryCorner};
use sightline_vision::image::PixelRect;

use super::corners::{self, At};
use super::{motion, slip};
use crate::cache::{ImageSide, Slot};
use crate::command::Command;
use crate::drawing::view2d::{Canvas, View2d};
use crate::panels::pane::Need;
use crate::panels::panel::Panel;
use crate::panels::{digits, gates, legend};
use crate::state::State;
use crate::theme;

/// Width from which tables and plots are side by side, points.
const TWO_COLUMNS: f32 = 640.0;
/// Height of the line above an image, points.
const CAPTION: f32 = 16.0;
/// Gap between the two images, points.
const GAP: f32 = 4.0;

/// The panel “Odometry”.
pub(crate) struct Odometry;

impl Panel for Odometry {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.missing_odometry()
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::Odometry]
    }
}

/// Shows the panel.
fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let step = state.cursor.step;
    let Some(measured) = state.measured_motion(step) else { return };
    let height = ui.available_height();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        verdict(ui, step, measured);
        ui.add_space(3.0);
        images(ui, state, measured.camera, 0.55 * height, out);
        ui.add_space(4.0);
        if ui.available_width() < TWO_COLUMNS {
            numbers(ui, state, measured);
            slip::show(ui, state, out);
            show_gates(ui, state, measured, out);
        } else {
            ui.columns(2, |columns| {
                numbers(&mut columns[0], state, measured);
                slip::show(&mut columns[0], state, out);
                show_gates(&mut columns[1], state, measured, out);
            });
        }
    });
}

/// Shows whether the update is used, and the disagreement of wheels and vision.
fn verdict(ui: &mut Ui, step: usize, measured: &MeasuredMotion) {
    let (word, colour, sentence) = match (measured.update.refusal(), measured.corrects) {
        (Some(refusal), _) => (
            "NO UPDATE",
            theme::failed(),
            format!(
                "{}; the pose of step {step} is that of wheels and gyro.",
                refusal.trim_start_matches("no update: ")
            ),
        ),
        (None, true) => ("ACCEPTED", theme::tracking(), format!("The pose of step {step} is by vision.")),
        (None, false) => (
            "ACCEPTED",
            theme::tracking(),
            format!("It checks the slip alone: the pose of step {step} is that of wheels and gyro."),
        ),
    };
    let retried = measured.refused_too.as_ref().filter(|_| measured.update.accepted);
    let sentence = retried.map_or_else(
        || sentence.clone(),
        |refused| format!("{sentence} It was measured looking back, because the main pair gave {refused}."),
    );
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(word).strong().color(colour));
        ui.label(RichText::new(sentence).size(12.0).color(theme::text()));
    });
    if let Some(words) = disagreement(measured) {
        ui.add(Label::new(RichText::new(words).size(12.0).color(theme::strong())).wrap());
    }
}

/// The difference of the motions by vision and by wheels, and the slip.
fn disagreement(measured: &MeasuredMotion) -> Option<String> {
    let update = &measured.update;
    let seen = update.after_from_before?.to_pose().inverse().translation.vector;
    let apart_cm = 100.0 * (seen - nalgebra::Vector3::from(update.wheels_m)).norm();
    let apart = format!("The translations by wheels and by vision differ by {} cm", digits(apart_cm));
    Some(match update.slip {
        None => format!("{apart}; the wheels hardly moved, so that there is no slip."),
        Some(slip) => format!(
            "{apart}: slip {:.1} % ± {:.1} % along the motion, {:.1} % to the {}.",
            100.0 * slip.along,
            100.0 * slip.along_sigma,
            100.0 * slip.aside.abs(),
            if slip.aside < 0.0 { "left" } else { "right" },
        ),
    })
}

/// Shows the legend, then the corners on the left images of both stops.
fn images(ui: &mut Ui, state: &State, camera: Option<CameraName>, most: f32, out: &mut Vec<Command>) {
    let corners: &[OdometryCorner] = match state.stop_odometry() {
        Slot::Ready(odometry) => {
            legend::above(ui, &corners::entries(&odometry.corners), state, out);
            ui.add_space(4.0);
            &odometry.corners
        }
        Slot::Failed(problem) => {
            let words = format!("The corners cannot be shown: {}", problem.detail);
            ui.add(Label::new(RichText::new(words).color(theme::lost())).wrap());
            &[]
        }
        Slot::Absent | Slot::Loading => {
            ui.label(theme::note("Computing the corners again …"));
            &[]
        }
    };
    let [width, height] = size(state, camera);
    let side = (ui.available_width() - GAP) / 2.0;
    let tall = (side * height as f32 / width.max(1) as f32).min(most.max(120.0));
    let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), tall + CAPTION), egui::Sense::hover());
    let (left, right) = area.split_left_right_at_fraction(0.5);
    let step = state.cursor.step;
    let before = step.checked_sub(1).and_then(|before| {
        let area = left.with_max_x(left.right() - GAP / 2.0);
        image(ui, state, (area, before, camera), "corners of step")
    });
    let area = right.with_min_x(right.left() + GAP / 2.0);
    let after = image(ui, state, (area, step, camera), "matches at step");
    let canvases = [(At::Before, before), (At::After, after)];
    let shown = || canvases.iter().filter_map(|(at, canvas)| Some((*at, canvas.as_ref()?)));
    for (at, canvas) in shown() {
        corners::paint(canvas, state, corners, at);
    }
    let hovered = shown().find_map(|(at, canvas)| {
        Some((corners::hovered(canvas, state, corners, at)?, canvas.response.clone()))
    });
    if let Some((corner, response)) = hovered {
        shown().for_each(|(at, canvas)| corners::ring(canvas, &corners[corner], at));
        response.on_hover_text_at_pointer(corners::words(&corners[corner]));
    }
}

/// Width and height of the left image of a camera, px.
fn size(state: &State, camera: Option<CameraName>) -> [u32; 2] {
    let further = camera.and_then(|name| state.further_camera(state.cursor.step, name));
    let size = further.map(|camera| camera.left_size).or_else(|| state.stop().map(|stop| stop.left_size));
    size.unwrap_or([1, 1])
}

/// Shows the left image of a stop below its caption; `None` until it is loaded.
fn image(
    ui: &mut Ui,
    state: &State,
    (area, step, camera): (Rect, usize, Option<CameraName>),
    caption: &str,
) -> Option<Canvas> {
    let mut ui = ui.new_child(UiBuilder::new().max_rect(area).id_salt(("odometry", step)));
    ui.spacing_mut().item_spacing.y = 0.0;
    let of_camera = camera.map(|name| format!(", camera {name}")).unwrap_or_default();
    let caption = format!("{caption} {step}{of_camera}");
    ui.add_sized([area.width(), CAPTION], Label::new(theme::note(&caption)).truncate());
    let key = state.image_key_in(step, camera, ImageSide::Left)?;
    match state.cache.raster(&key) {
        Slot::Ready(raster) => {
            raster.stretch(state.stretch);
            let [width, height] = raster.size();
            let region = PixelRect::whole(width, height);
            let canvas = Canvas::new(&mut ui, View2d::Fit, region, 0.0);
            canvas.texture(&raster.texture, region);
            let words = format!("left image: {caption}");
            canvas.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &words));
            Some(canvas)
        }
        Slot::Failed(problem) => {
            ui.add(Label::new(RichText::new(&problem.detail).color(theme::lost())).wrap());
            None
        }
        Slot::Absent | Slot::Loading => {
            ui.label(theme::note(format!("Loading the left image of step {step} …")));
            None
        }
    }
}

/// Shows the motion, axis by axis.
fn numbers(ui: &mut Ui, state: &State, measured: &MeasuredMotion) {
    let stops = state.traverse.as_ref().map(|traverse| &traverse.stops);
    let before = state.cursor.step.checked_sub(1).and_then(|before| stops?.get(before));
    if let Some(before) = before {
        motion::show(ui, &motion::axes(measured, &before.site_from_rover.to_pose()));
        ui.add_space(4.0);
    }
}

fn show_gates(ui: &mut Ui, state: &State, measured: &MeasuredMotion, out: &mut Vec<Command>) {
    ui.label(theme::title("gates"));
    ui.spacing_mut().item_spacing.y = 1.0;
    for gate in &measured.update.gates {
        gates::show_gate(ui, state.cursor.step, gate, out);
    }
    if let Some(missing) = &measured.update.missing {
        ui.add(Label::new(theme::note(format!("No motion: {missing}."))).wrap());
    }
}
