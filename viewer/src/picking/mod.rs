//! Picking a target in the left image: the trackability map, the loupe, the aim, and the line below the image.
//!
//! A click designates. If the map advises against a position, the line gives the reason and offers the nearest good pixel
//! and the position itself; the page never refuses a pick.

pub(crate) mod aim;
pub(crate) mod footer;
mod loupe;
pub(crate) mod map;

use egui::{CursorIcon, Stroke, Ui};
use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::Verdict;
use sightline_rover::trackability::map::Cell;
use sightline_session::marks::square;
use sightline_vision::image::PixelRect;

use crate::command::{Command, Mode};
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::Canvas;
use crate::state::{ImagePosition, State};
use crate::theme;

impl State {
    /// Whether a click on the left image designates a target: while one is being picked, or if there is no target yet.
    pub(crate) fn picks_on_click(&self) -> bool {
        let has_none = self.session.as_ref().is_some_and(|session| session.targets.is_empty());
        self.mode == Mode::Pick || (self.mode == Mode::Look && has_none)
    }
}

/// Whether a position is in the images that are shown.
fn is_here(state: &State, place: &ImagePosition) -> bool {
    place.step == state.cursor.step && place.camera == state.camera()
}

/// A description of a cell: verdict and reason, range and longest safe step.
pub(crate) fn words(cell: &Cell) -> String {
    let mut words = cell.verdict.title().to_owned();
    if let Some(sentence) = cell.sentence() {
        words += &format!(": {sentence}");
    }
    if let Some(range_m) = cell.range_m {
        words += &format!(" · range {range_m:.2} m");
    }
    if let Some(step_m) = cell.longest_step_m {
        words += &format!(" · step ≤ {step_m:.2} m");
    }
    words
}

/// Paints loupe, aim and marks of a pick over the image, and designates on a click. Returns the position that the line
/// below the image describes.
pub(crate) fn show(
    ui: &Ui,
    canvas: &Canvas,
    raster: &Raster,
    state: &State,
    out: &mut Vec<Command>,
) -> Option<Pixel> {
    paint_designation(canvas, state);
    if !state.picks_on_click() {
        return None;
    }
    let is_picking = state.mode == Mode::Pick;
    if is_picking {
        let border = canvas.transform.rect.shrink(1.0);
        canvas.painter.rect_stroke(border, 0.0, Stroke::new(2.0, theme::accent()), egui::StrokeKind::Inside);
    }
    let [width, height] = raster.size();
    // Controls above the image block picking.
    let hovered = canvas.hovered(PixelRect::whole(width, height)).filter(|_| canvas.response.hovered());
    let described = state.trackability.aim.or(hovered);
    let text = described_words(state, described);
    canvas.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, text.clone()));
    if let Some(pixel) = state.trackability.aim {
        paint_window(canvas, state, pixel);
    }
    // The loupe is visible as long as a target is being picked.
    let magnified = described.or_else(|| is_picking.then(|| state.first_aim()));
    if let Some(pixel) = magnified {
        loupe::paint(canvas, raster, pixel, state.template_side_px());
    }
    if let Some(pixel) = hovered {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        if canvas.response.clicked() {
            out.push(Command::Pick(pixel));
        }
    }
    described
}

/// Paints the window that a pick at the pixel would take.
fn paint_window(canvas: &Canvas, state: &State, pixel: Pixel) {
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    let window = square(pixel, state.template_side_px(), &nalgebra::Matrix2::identity());
    overlay.outline(&window, theme::accent(), StrokeStyle::Dotted);
    overlay.mark(pixel, Mark::Plus, theme::accent());
}

/// Paints the designation being computed, or the position that was advised against with the nearest good pixel.
fn paint_designation(canvas: &Canvas, state: &State) {
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    let begun = state.designating.or(state.trackability.judged);
    if let Some(place) = begun.filter(|place| is_here(state, place)) {
        overlay.mark(place.pixel, Mark::Ring, theme::accent());
    }
    if let Some(refusal) = state.refusal.as_ref().filter(|refusal| is_here(state, &refusal.place)) {
        overlay.mark(refusal.place.pixel, Mark::Cross, theme::failed());
        if let Some(pixel) = refusal.nearest {
            overlay.mark(pixel, Mark::Diamond, theme::trackability(Verdict::Good));
        }
    }
}

/// A description of the image for screen readers.
fn described_words(state: &State, pixel: Option<Pixel>) -> String {
    let mut words = format!("left image of step {}", state.cursor.step);
    if let Some(name) = state.camera() {
        words += &format!(", camera {name}");
    }
    if let Some(map) = state.trackability_map() {
        let shares = map.shares().map(|share| 100.0 * share);
        let share = |(verdict, share): (Verdict, f64)| format!("{share:.0} % {}", verdict.word());
        let shares = Verdict::ALL.into_iter().zip(shares).map(share).collect::<Vec<_>>().join(", ");
        words += &format!(", trackability: {shares}; {}", footer::made_with(state));
    }
    if let Some(pixel) = pixel {
        words += &format!("; at {:.1}, {:.1}", pixel.x, pixel.y);
        if let Some(cell) = state.trackability_at(pixel) {
            words += &format!(": {}", self::words(&cell));
        }
    }
    words
}
