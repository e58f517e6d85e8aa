//! The last patch of the strip: the window at the pointer, which may be in the score map, the left image or another panel.
//!
//! It consists of whole pixels of the left image about the nearest pixel; the match interpolates between pixels.

use std::sync::Arc;

use egui::{Align2, Id, Rect, Sense, Ui};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::trace::{ArrayName, StepTrace};
use sightline_vision::image::PixelRect;

use crate::cache::ImageSide;
use crate::drawing::overlay::{Mark, paint_mark};
use crate::drawing::raster::Raster;
use crate::hovered::window;
use crate::panels::score_marks::region_of;
use crate::panels::strip::patch::{paint_patch, paint_title};
use crate::state::State;
use crate::theme;

/// The title of the patch.
pub(crate) const TITLE: &str = "at the pointer";

/// Minimum width for text in an empty patch, points.
const WORDS_FROM: f32 = 100.0;

/// Whether the step compared windows, so that a pointed window is meaningful.
pub(crate) fn is_there(trace: &StepTrace) -> bool {
    matched(trace).is_some()
}

fn matched(trace: &StepTrace) -> Option<&TemplateMatch> {
    let matched = trace.template()?.match_template.as_ref()?;
    matched.descent.is_none().then_some(matched)
}

/// The score at the pointed pixel in words, shown above the arrow.
pub(crate) fn score(state: &State) -> String {
    let found = state.hovered_left().and_then(|pixel| score_at(state, pixel));
    found.map_or_else(String::new, |(word, value)| match value {
        Some(value) => format!("{word} {value:.2}"),
        None => "excluded".to_owned(),
    })
}

/// The measure and its value at the nearest position; `None` outside the searched positions.
fn score_at(state: &State, pixel: Pixel) -> Option<(&'static str, Option<f32>)> {
    let matched = matched(state.trace()?)?;
    let raster = state.array(ArrayName::SURFACE).ready()?;
    let region = region_of(matched.search_window, raster.size());
    let at = |v: f64, from: i32| v.round() as i64 - i64::from(from);
    region
        .contains(pixel)
        .then(|| (matched.measure.word(), raster.at(at(pixel.x, region.x), at(pixel.y, region.y))))
}

/// Shows the patch.
pub(crate) fn show(ui: &mut Ui, state: &State, frame: Rect) {
    paint_title(ui, frame, TITLE);
    let words = match state.hovered_left().map(|pixel| cut(ui, state, pixel, Cut::Hovered)) {
        Some(Some(raster)) => {
            paint_patch(ui, &raster, frame);
            let score = score(state);
            let words = if score.is_empty() { "outside of the search window" } else { &score };
            format!("{TITLE}: {words}")
        }
        Some(None) => empty(ui, frame, "leaves the image"),
        None => empty(ui, frame, "point at the scores or at the left image"),
    };
    let stroke = egui::Stroke::new(1.0, theme::line());
    ui.painter().rect_stroke(frame, 0.0, stroke, egui::StrokeKind::Outside);
    let response = ui.interact(frame, ui.scope_id().with("pointed patch"), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &words));
    response.on_hover_text(format!(
        "{words}\nThe left image about the pixel that is pointed at, in whatever panel."
    ));
}

/// An empty patch with the reason in `words`.
fn empty(ui: &Ui, frame: Rect, words: &str) -> String {
    let painter = ui.painter();
    painter.rect_filled(frame, 0.0, theme::well());
    if frame.width() < WORDS_FROM {
        paint_mark(painter, frame.center(), Mark::Plus, theme::weak(), 6.0);
        return format!("{TITLE}: {words}");
    }
    let galley = painter.layout(words.to_owned(), theme::image_font(), theme::weak(), frame.width() - 6.0);
    let area = Align2::CENTER_CENTER.anchor_size(frame.center(), galley.size());
    painter.galley(area.min, galley, theme::weak());
    format!("{TITLE}: {words}")
}

/// The patches that are cut from the left image.
#[derive(Clone, Copy, Debug, Hash)]
pub(super) enum Cut {
    /// The patch about the pointer.
    Hovered,
    /// The template of the designation.
    Template,
}

/// The patch about a pixel, cached while the pixel does not change; `None` if it would leave the image.
pub(super) fn cut(ui: &Ui, state: &State, pixel: Pixel, which: Cut) -> Option<Arc<Raster>> {
    let image = state.image(ImageSide::Left).ready()?;
    let side = match state.array(ArrayName::ROLLED).ready() {
        Some(rolled) => rolled.size()[0],
        None => state.template_side_px(),
    };
    let area = window(pixel, side, image.size())?;
    let of = (state.traverse.as_ref()?.id.clone(), state.cursor.step, area);
    let id = Id::unique(("a patch of the left image", which));
    let cached = ui.data(|data| data.get_temp::<CachedPatch>(id)).filter(|cached| cached.of == of);
    let cached = cached.unwrap_or_else(|| CachedPatch { of, raster: Arc::new(raster(ui, image, area)) });
    ui.data_mut(|data| data.insert_temp(id, cached.clone()));
    Some(cached.raster)
}

/// The patch of the previous frame, identified by traverse, step and area.
#[derive(Clone)]
struct CachedPatch {
    of: (String, usize, PixelRect),
    raster: Arc<Raster>,
}

fn raster(ui: &Ui, image: &Raster, area: PixelRect) -> Raster {
    let (x, y) = (area.x as u32, area.y as u32);
    let values = image::imageops::crop_imm(&image.values, x, y, area.width, area.height).to_image();
    Raster::from_values(ui.ctx(), ArrayName::MATCHED, values)
}
