//! The template strip: the patches from the reference template to the matched window and their difference.

mod designated;
mod patch;
mod hovered;

use egui::{Align2, Margin, Rect, Sense, Ui, pos2, vec2};
use sightline_record::{ArrayKind, Unit, label};
use sightline_session::records::{self, StageQuantity};
use sightline_session::step::RunStep;
use sightline_track::trace::ArrayName;

use crate::cache::Slot;
use crate::command::{Command, Stage};
use crate::drawing::raster::{DIFFERENCE_LIMIT, PATCH_SIGMAS};
use crate::panels::panel::Panel;
use crate::panels::strip::patch::{BETWEEN, paint_patch, paint_title};
use crate::state::State;
use crate::{figure, theme};

/// Heights of the text above and below a patch, points.
const WORDS: (f32, f32) = (16.0, 18.0);
/// Minimum side of a patch, points.
const SIDE_MIN: f32 = 16.0;
/// A single row is kept if its patches have at least this side, points.
const ONE_ROW_MIN: f32 = 64.0;

/// One patch of the strip.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Patch {
    /// The array.
    pub array: ArrayName,
    /// The title above the patch.
    pub title: String,
    /// The operation that leads to it, above the arrow.
    pub step: String,
    /// The stage that produced it.
    pub stage: Stage,
}

/// The stages whose patches are shown.
const STAGES: [Stage; 3] = [Stage::SCALE_ROLL, Stage::MATCH_TEMPLATE, Stage::POINT_STEREO];

/// The patches of a step, in the order in which the stages declare them; those of stages that were not reached are
/// omitted.
pub(crate) fn patches(trace: &RunStep) -> Vec<Patch> {
    let reached = STAGES.into_iter().filter_map(|stage| Some((stage, records::stage(stage.word())?)));
    let of_stage = |(stage, recorded): (Stage, &'static sightline_record::Stage<RunStep>)| {
        let arrays = recorded.schema().arrays.iter().filter(|_| recorded.is_reached(trace));
        let patches = arrays.filter(|array| matches!(array.kind, ArrayKind::Patch | ArrayKind::Difference));
        patches.filter_map(move |array| {
            let array = ArrayName::from_word(&array.name)?;
            let (title, step) = caption(trace, array);
            Some(Patch { array, title, step, stage })
        })
    };
    reached.flat_map(of_stage).collect()
}

/// The title of a patch, and the operation that leads to it.
fn caption(trace: &RunStep, array: ArrayName) -> (String, String) {
    let number = |name: &str| StageQuantity::named(name)?.number(trace);
    let applied = |[applied, computed]: [&str; 2], words: fn(f64) -> String| {
        let is_on = number(applied) == number(computed);
        number(applied).filter(|_| is_on).map_or_else(|| "off".to_owned(), words)
    };
    let score = |name: &str| number(name).map_or_else(String::new, |score| format!("score {score:.2}"));
    let (title, step) = match array {
        ArrayName::REFERENCE => {
            let step = number("scale_roll.template_step").unwrap_or_default();
            return (format!("reference, step {step}"), String::new());
        }
        ArrayName::SCALED => {
            let scale = applied(["scale_roll.applied_scale", "scale_roll.scale"], |v| format!("×{v:.3}"));
            ("scaled", scale)
        }
        ArrayName::ROLLED if number("scale_roll.warped") == Some(1.0) => {
            ("warp: surface slope", String::new())
        }
        ArrayName::ROLLED => {
            let roll = applied(["scale_roll.applied_roll_rad", "scale_roll.roll_rad"], |v| {
                format!("{:+.2}°", v.to_degrees())
            });
            ("rolled", roll)
        }
        ArrayName::MATCHED => ("matched", score("match_template.score")),
        ArrayName::DIFFERENCE => ("difference", "−".to_owned()),
        ArrayName::RIGHT_WINDOW => ("right image", score("point_stereo.score")),
        other => return (label(other.word(), Unit::One), String::new()),
    };
    (title.to_owned(), step)
}

/// The panel “Template strip”.
pub(crate) struct Strip;

impl Panel for Strip {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.trace().map(patches).unwrap_or_default().is_empty().then(|| state.missing_template())
    }

    fn margin(&self) -> Margin {
        Margin::symmetric(theme::MARGIN, 3)
    }
}

/// Shows the strip.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let patches = state.trace().map(patches).unwrap_or_default();
    let area = ui.available_rect_before_wrap();
    // A figure includes the pointed pixel only while there is one.
    let has_pointer = state.trace().is_some_and(|trace| hovered::is_there(trace))
        && (!figure::is_on_paper() || state.hovered_left().is_some());
    let template = state.trace().and_then(designated::pixel).filter(|_| !patches.is_empty());
    let first = usize::from(template.is_some());
    let frames = frames(area, first + patches.len() + usize::from(has_pointer));
    if let Some((pixel, &frame)) = template.zip(frames.first()) {
        designated::show(ui, state, pixel, frame);
    }
    for (number, (patch, &frame)) in patches.iter().zip(frames.iter().skip(first)).enumerate() {
        if first + number > 0 {
            arrow(ui, frame, &patch.step);
        }
        show_patch(ui, state, patch, frame, out);
    }
    if let Some(&frame) = frames.last().filter(|_| has_pointer) {
        arrow(ui, frame, &hovered::score(state));
        hovered::show(ui, state, frame);
    }
    ui.advance_cursor_after_rect(area);
}

/// The squares of `count` patches in reading order: in one row, or, if its squares would be small, in the number of rows
/// with the largest squares.
fn frames(area: Rect, count: usize) -> Vec<Rect> {
    if count == 0 {
        return Vec::new();
    }
    // With several rows, each row begins with an arrow.
    let arrows = |rows: usize, columns: usize| if rows > 1 { columns } else { columns - 1 } as f32;
    let side = |rows: usize| {
        let columns = count.div_ceil(rows);
        let across = (area.width() - BETWEEN * arrows(rows, columns)) / columns as f32;
        across.min(area.height() / rows as f32 - WORDS.0 - WORDS.1)
    };
    let most = if side(1) < ONE_ROW_MIN { count } else { 1 };
    let rows = (1..=most).fold(1, |best, rows| if side(rows) > side(best) { rows } else { best });
    let (columns, side) = (count.div_ceil(rows), side(rows).max(SIDE_MIN));
    let width = side * columns as f32 + BETWEEN * arrows(rows, columns);
    let lead = if rows > 1 { BETWEEN } else { 0.0 };
    let left = area.left() + ((area.width() - width) / 2.0).max(0.0) + lead;
    let frame = |number: usize| {
        let [column, row] = [number % columns, number / columns].map(|at| at as f32);
        let x = left + (side + BETWEEN) * column;
        let y = area.top() + WORDS.0 + (side + WORDS.0 + WORDS.1) * row;
        Rect::from_min_size(pos2(x, y), vec2(side, side))
    };
    (0..count).map(frame).collect()
}

/// The arrow before a patch with the operation that leads to it.
fn arrow(ui: &Ui, frame: Rect, words: &str) {
    let middle = frame.left_center() - vec2(BETWEEN / 2.0, 0.0);
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

fn explain(array: ArrayName) -> String {
    let what = array.declaration().map_or("", |array| array.description.as_ref());
    if array == ArrayName::DIFFERENCE {
        format!("{what}.\nShown from −{DIFFERENCE_LIMIT} (blue) over 0 (white) to +{DIFFERENCE_LIMIT} (red).")
    } else {
        format!(
            "{what}.\nShown from {PATCH_SIGMAS} σ below its mean to {PATCH_SIGMAS} σ above: correlation ignores both."
        )
    }
}
