//! The template strip: how the reference became what was compared, and what remained.

mod pointed;

use egui::{Align2, Pos2, Rect, Sense, Ui, pos2, vec2};
use sightline_core::trace::{ArrayName, StepTrace};

use crate::cache::Slot;
use crate::command::{Command, Stage};
use crate::raster::{DIFFERENCE_LIMIT, PATCH_SIGMAS, Raster};
use crate::state::State;
use crate::{panels, theme, view2d};

/// What the panel is for.
const PURPOSE: &str = "The template from its reference to what was compared.";

/// Room for the arrow and the number between two patches, points.
const BETWEEN: f32 = 68.0;
/// Room for the words above and below a patch, points.
const WORDS: (f32, f32) = (16.0, 18.0);

/// One patch of the strip.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// The array.
    pub array: ArrayName,
    /// What it is.
    pub title: String,
    /// What happened on the way to it.
    pub step: String,
    /// The stage that made it.
    pub stage: Stage,
}

/// The patches of a step, in their order; those that were not reached are left out.
pub fn patches(trace: &StepTrace) -> Vec<Patch> {
    let Some(evidence) = trace.template() else { return Vec::new() };
    let mut patches = Vec::new();
    let mut add =
        |array, title: String, step: String, stage| patches.push(Patch { array, title, step, stage });
    if let Some(s) = &evidence.scale_roll {
        let applied = |is_on: bool, words: String| if is_on { words } else { "off".to_owned() };
        add(
            ArrayName::Reference,
            format!("reference, step {}", s.template_step),
            String::new(),
            Stage::ScaleRoll,
        );
        let scale = applied(s.applied_scale == s.scale, format!("×{:.3}", s.applied_scale));
        add(ArrayName::Scaled, "scaled".to_owned(), scale, Stage::ScaleRoll);
        if s.warped {
            add(ArrayName::Rolled, "warped".to_owned(), "slope".to_owned(), Stage::ScaleRoll);
        } else {
            let roll = format!("{:+.2}°", s.applied_roll_rad.to_degrees());
            let roll = applied(s.applied_roll_rad == s.roll_rad, roll);
            add(ArrayName::Rolled, "rolled".to_owned(), roll, Stage::ScaleRoll);
        }
    }
    if let Some(m) = &evidence.match_template {
        let score = format!("ncc {:.2}", m.score);
        add(ArrayName::Matched, "matched".to_owned(), score, Stage::MatchTemplate);
        add(ArrayName::Difference, "difference".to_owned(), "−".to_owned(), Stage::MatchTemplate);
    }
    if let Some(s) = &evidence.point_stereo {
        add(
            ArrayName::RightWindow,
            "right image".to_owned(),
            format!("ncc {:.2}", s.score),
            Stage::PointStereo,
        );
    }
    patches
}

/// Shows the strip.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let patches = state.trace().map(patches).unwrap_or_default();
    if patches.is_empty() {
        panels::missing(ui, PURPOSE, &state.missing_template());
        return;
    }
    let area = ui.available_rect_before_wrap();
    let has_pointer = state.trace().is_some_and(pointed::is_there);
    let count = (patches.len() + usize::from(has_pointer)) as f32;
    let across = (area.width() - BETWEEN * (count - 1.0)) / count;
    let side = across.min(area.height() - WORDS.0 - WORDS.1).max(16.0);
    let width = side * count + BETWEEN * (count - 1.0);
    let mut at = pos2(area.left() + ((area.width() - width) / 2.0).max(0.0), area.top() + WORDS.0);
    for (i, patch) in patches.iter().enumerate() {
        if i > 0 {
            arrow(ui, pos2(at.x - BETWEEN / 2.0, at.y + side / 2.0), &patch.step);
        }
        let frame = Rect::from_min_size(at, vec2(side, side));
        show_patch(ui, state, patch, frame, out);
        at.x += side + BETWEEN;
    }
    if has_pointer {
        arrow(ui, pos2(at.x - BETWEEN / 2.0, at.y + side / 2.0), &pointed::score(state));
        pointed::show(ui, state, Rect::from_min_size(at, vec2(side, side)));
    }
    ui.advance_cursor_after_rect(area);
}

/// The arrow between two patches with what happened.
fn arrow(ui: &Ui, middle: Pos2, words: &str) {
    let painter = ui.painter();
    let stroke = egui::Stroke::new(1.5, theme::weak());
    let tip = middle + vec2(12.0, 6.0);
    painter.line_segment([middle + vec2(-12.0, 6.0), tip], stroke);
    painter.line_segment([tip, tip + vec2(-4.0, -4.0)], stroke);
    painter.line_segment([tip, tip + vec2(-4.0, 4.0)], stroke);
    painter.text(middle - vec2(0.0, 2.0), Align2::CENTER_BOTTOM, words, theme::digit_font(), theme::strong());
}

fn show_patch(ui: &mut Ui, state: &State, patch: &Patch, frame: Rect, out: &mut Vec<Command>) {
    let response = ui.interact(frame, ui.scope_id().with(("patch", patch.array)), Sense::click());
    let painter = ui.painter();
    paint_title(ui, frame, &patch.title);
    let border = if response.hovered() { theme::accent() } else { theme::line() };
    match state.array(patch.array) {
        Slot::Ready(raster) => paint_patch(ui, raster, frame),
        Slot::Failed(_) => {
            painter.rect_filled(frame, 0.0, theme::well());
            painter.text(
                frame.center(),
                Align2::CENTER_CENTER,
                "not kept",
                theme::image_font(),
                theme::lost(),
            );
        }
        Slot::Absent | Slot::Loading => {
            painter.rect_filled(frame, 0.0, theme::well());
            painter.text(
                frame.center(),
                Align2::CENTER_CENTER,
                "loading …",
                theme::image_font(),
                theme::weak(),
            );
        }
    }
    ui.painter().rect_stroke(frame, 0.0, egui::Stroke::new(1.0, border), egui::StrokeKind::Outside);
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{} patch", patch.title))
    });
    if response.on_hover_text(explain(patch.array)).clicked() {
        out.push(Command::SelectStage(patch.stage));
    }
}

/// What a patch is, above it.
fn paint_title(ui: &Ui, frame: Rect, title: &str) {
    let above = frame.center_top() - vec2(0.0, 3.0);
    ui.painter().text(above, Align2::CENTER_BOTTOM, title, theme::image_font(), theme::text());
}

/// A patch with its statistics below it.
fn paint_patch(ui: &Ui, raster: &Raster, frame: Rect) {
    view2d::checker(ui.painter(), frame);
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(raster.texture.id(), frame, whole, theme::UNTINTED);
    statistics(ui, raster, frame);
}

/// Mean and standard deviation below a patch.
fn statistics(ui: &Ui, raster: &Raster, frame: Rect) {
    let below = frame.center_bottom() + vec2(0.0, 4.0);
    let words = match frame.width() + BETWEEN {
        room if room > 170.0 => format!("mean {:.3}  σ {:.3}", raster.mean, raster.sigma),
        _ => format!("{:.3} ±{:.3}", raster.mean, raster.sigma),
    };
    ui.painter().text(below, Align2::CENTER_TOP, words, theme::digit_font(), theme::text());
}

fn explain(array: ArrayName) -> String {
    let what = match array {
        ArrayName::Reference => "The template as it was taken.",
        ArrayName::Scaled => {
            "The template magnified by the ratio of distances, so that it has the size expected now."
        }
        ArrayName::Rolled => "Then turned by the roll of the camera: this is what was searched for.",
        ArrayName::Matched => "The left image at the match.",
        ArrayName::Difference => {
            "Matched minus rolled, both with mean 0 and deviation 1: blue is darker, red brighter."
        }
        ArrayName::RightWindow => {
            "The right image at the stereo match, resampled as the left camera sees it."
        }
        ArrayName::Surface => "The scores of all positions.",
        ArrayName::Features => "The features of the left image.",
        ArrayName::Cloud => "Where the bootstrap puts the target.",
        ArrayName::Disparities => "The disparities of the aligned left image.",
        ArrayName::Ranges => "The distances from the left camera.",
        ArrayName::Sensor => "The earlier surface as the virtual range sensor sees it.",
        ArrayName::ErrorBefore => "Present less earlier depth before the registration.",
        ArrayName::ErrorCoarse => "Present less earlier depth after the coarse search.",
        ArrayName::ErrorFine => "Present less earlier depth at the end.",
        ArrayName::CoarseSearch => "How far the surfaces are apart for every shift of the search.",
        ArrayName::RefinePath => "The way of the refinement.",
        ArrayName::MeshFixed => "The earlier surface.",
        ArrayName::MeshMoving => "The present surface.",
        ArrayName::Draped => "The earlier image draped over the surface, as this camera would see it.",
        ArrayName::DrapedMatch => "This camera's image where that was found.",
    };
    if array == ArrayName::Difference {
        format!("{what}\nShown from −{DIFFERENCE_LIMIT} (blue) over 0 (white) to +{DIFFERENCE_LIMIT} (red).")
    } else {
        format!(
            "{what}\nShown from {PATCH_SIGMAS} σ below its mean to {PATCH_SIGMAS} σ above: correlation ignores both."
        )
    }
}
