//! The template's history: the window that every step matched, and how the present view correlates with each of the
//! earlier ones (R72).
//!
//! The matched windows are fetched when this panel is looked at for the first time.

pub mod drift;

use egui::{Align2, Rect, ScrollArea, Sense, Ui, UiBuilder, pos2, vec2};
use egui_plot::{GridMark, Line, MarkerShape, Plot, Points};
use sightline_core::session::view::RunView;
use sightline_core::settings::TrackerKind;
use sightline_core::trace::StepRow;

use self::drift::Comparison;
use super::plots::{few_marks, pieces, plain};
use crate::cache::Slot;
use crate::command::{Command, Go};
use crate::raster::Raster;
use crate::state::State;
use crate::{panels, theme, thin, view2d};

/// What the panel is for.
const PURPOSE: &str = "Every step’s matched window, and how today’s view compares with them.";

/// Width of the two plots, points.
const PLOTS: f32 = 330.0;
/// Room for the lines of words above and below a window, points.
const WORDS: (f32, f32) = (14.0, 26.0);
/// Least width of a frame, points: its words must fit.
const FRAME: f32 = 76.0;

/// Shows strip and plots.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(run) = state.run() else {
        panels::missing(ui, PURPOSE, &state.missing_target());
        return;
    };
    if run.settings.tracker != TrackerKind::Template {
        panels::missing(ui, PURPOSE, &state.missing_template());
        return;
    }
    let area = ui.available_rect_before_wrap();
    let (film, plots) =
        area.split_left_right_at_x((area.right() - PLOTS).max(area.left() + area.width() * 0.4));
    let part = |rect: Rect, salt: &str| UiBuilder::new().max_rect(rect).id_salt(salt.to_owned());
    strip(&mut ui.new_child(part(film.shrink2(vec2(3.0, 0.0)), "film")), state, run, out);
    comparisons(&mut ui.new_child(part(plots.with_min_x(plots.left() + 8.0), "plots")), state, run);
    ui.advance_cursor_after_rect(area);
}

fn strip(ui: &mut Ui, state: &State, run: &RunView, out: &mut Vec<Command>) {
    ScrollArea::horizontal().auto_shrink(false).show(ui, |ui| {
        let side = (ui.available_height() - WORDS.0 - WORDS.1 - 6.0).max(24.0);
        let width = side.max(FRAME);
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = 5.0;
            for row in state.near_rows(run) {
                let size = vec2(width, side + WORDS.0 + WORDS.1);
                let (place, response) = ui.allocate_exact_size(size, Sense::click());
                let window = Rect::from_min_size(
                    pos2(place.center().x - side / 2.0, place.top() + WORDS.0),
                    vec2(side, side),
                );
                frame(ui, state, run, row, (place, window));
                let words = format!("window of step {}: {}", row.step, words_of(run, row).join(", "));
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &words));
                if response.on_hover_text("Click to go to this step").clicked() {
                    out.push(Command::Go(Go::Step(row.step)));
                }
            }
        });
    });
}

/// Scale and roll, then the score, of a step.
fn words_of(run: &RunView, row: &StepRow) -> [String; 2] {
    if is_pick(run, row) {
        return ["as picked".to_owned(), String::new()];
    }
    let scale = row.scale.map_or_else(String::new, |scale| format!("×{scale:.2}"));
    let roll = row.roll_deg.map_or_else(String::new, |roll| format!("{roll:+.1}°"));
    let score = row.ncc.map_or_else(|| "no match".to_owned(), |ncc| format!("ncc {ncc:.2}"));
    [format!("{scale} {roll}").trim().to_owned(), score]
}

fn is_pick(run: &RunView, row: &StepRow) -> bool {
    run.rows.first().is_some_and(|first| first.step == row.step)
}

fn frame(ui: &Ui, state: &State, run: &RunView, row: &StepRow, (place, window): (Rect, Rect)) {
    let is_here = row.step == state.cursor.step;
    let painter = ui.painter();
    let colour = if is_here { theme::accent() } else { theme::text() };
    let title = if is_pick(run, row) { format!("pick, {}", row.step) } else { format!("step {}", row.step) };
    painter.text(place.center_top(), Align2::CENTER_TOP, title, theme::image_font(), colour);
    let message = match state.window_key(run, row).map(|key| state.cache.raster(&key)) {
        Some(Slot::Ready(raster)) => {
            view2d::checker(painter, window);
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            painter.image(raster.texture.id(), window, whole, theme::UNTINTED);
            None
        }
        Some(Slot::Absent | Slot::Loading) => Some("loading …"),
        Some(Slot::Failed(_)) => Some("not kept"),
        None => Some("none"),
    };
    if let Some(message) = message {
        painter.rect_filled(window, 0.0, theme::well());
        painter.text(window.center(), Align2::CENTER_CENTER, message, theme::digit_font(), theme::weak());
    }
    let stroke = egui::Stroke::new(
        if is_here { 2.0 } else { 1.0 },
        if is_here { theme::accent() } else { theme::line() },
    );
    painter.rect_stroke(window, 0.0, stroke, egui::StrokeKind::Outside);
    let [geometry, score] = words_of(run, row);
    let below = window.center_bottom() + vec2(0.0, 2.0);
    painter.text(below, Align2::CENTER_TOP, geometry, theme::digit_font(), theme::text());
    let is_low = state_is_lost(row);
    let colour = if is_low { theme::lost() } else { theme::strong() };
    painter.text(below + vec2(0.0, 12.0), Align2::CENTER_TOP, score, theme::digit_font(), colour);
}

fn state_is_lost(row: &StepRow) -> bool {
    crate::state::state_of_word(&row.state).is_lost()
}

/// The present view against every earlier window: score and shift.
fn comparisons(ui: &mut Ui, state: &State, run: &RunView) {
    let all = compare_all(state, run);
    let known: Vec<&Comparison> = all.iter().flatten().collect();
    let mut words = sentence(state, &all, &known);
    let shown = state.near_rows(run).count();
    if shown < run.rows.len() {
        words += &format!("; of {} windows the pick and {} near it", run.rows.len(), shown - 1);
    }
    ui.add(egui::Label::new(theme::note(words)).truncate());
    let size = vec2((ui.available_width() - 6.0) / 2.0, ui.available_height());
    let colour = theme::run(run.number);
    ui.horizontal_top(|ui| {
        let score = |c: &Comparison| [c.step as f64, c.score];
        chart(ui, "score, by earlier step", size, [0.0, 1.0], &points(&all, score), colour);
        let shift = |c: &Comparison| [c.step as f64, c.shift_px];
        chart(ui, "shift, px, by earlier step", size, [0.0, 1.0], &points(&all, shift), theme::lost());
    });
}

fn points(all: &[Option<Comparison>], of: impl Fn(&Comparison) -> [f64; 2]) -> Vec<Option<[f64; 2]>> {
    all.iter().map(|comparison| comparison.as_ref().map(&of)).collect()
}

fn sentence(state: &State, all: &[Option<Comparison>], known: &[&Comparison]) -> String {
    let step = state.cursor.step;
    match (known.first(), known.len()) {
        (Some(first), n) => {
            let loading =
                if n < all.len() { format!("; {} of {} loaded", n, all.len()) } else { String::new() };
            format!(
                "step {step} against step {}: score {:.2}, shift {:.2} px{loading}",
                first.step, first.score, first.shift_px
            )
        }
        (None, _) if all.is_empty() => format!("step {step} has no earlier window to compare with"),
        (None, _) => format!("loading the windows before step {step}: 0 of {} are here", all.len()),
    }
}

/// One entry for every earlier window; none where it, or what leads from it to now, is not loaded.
pub(in crate::panels) fn compare_all(state: &State, run: &RunView) -> Vec<Option<Comparison>> {
    let here = state.row().filter(|row| row.ncc.is_some());
    let Some(here) = here else { return Vec::new() };
    let window =
        |row: &StepRow| -> Option<&Raster> { state.cache.raster(&state.window_key(run, row)?).ready() };
    let now = window(here);
    let earlier =
        state.near_rows(run).filter(|row| row.step < here.step && state.window_key(run, row).is_some());
    let compare = |row: &StepRow| {
        let now_from_then = drift::now_from_then(state, run, row.step, here.step)?;
        drift::compare(row.step, &window(row)?.values, &now?.values, &now_from_then)
    };
    earlier.map(compare).collect()
}

fn chart(
    ui: &mut Ui,
    title: &'static str,
    size: egui::Vec2,
    in_view: [f64; 2],
    points: &[Option<[f64; 2]>],
    colour: egui::Color32,
) {
    ui.vertical(|ui| {
        ui.set_width(size.x);
        ui.label(theme::note(title));
        let plot = Plot::new(title)
            .width(size.x)
            .height((ui.available_height() - 2.0).max(30.0))
            .allow_scroll(false)
            .allow_drag(false)
            .allow_zoom(false)
            .allow_boxed_zoom(false)
            .allow_axis_zoom_drag(false)
            .include_y(in_view[0])
            .include_y(in_view[1])
            .set_margin_fraction(vec2(0.04, 0.1))
            .y_grid_spacer(few_marks)
            .y_axis_formatter(plain)
            .y_axis_min_width(22.0)
            .x_axis_formatter(|mark: GridMark, _: &std::ops::RangeInclusive<f64>| {
                if mark.value.fract() == 0.0 { format!("{}", mark.value) } else { String::new() }
            })
            .label_formatter(|_| None);
        plot.show(ui, |plot| {
            for piece in pieces(points) {
                plot.line(Line::new("", piece.clone()).color(colour).width(1.5));
                plot.points(
                    Points::new("", thin::marks(piece)).color(colour).radius(2.5).shape(MarkerShape::Circle),
                );
            }
        });
    });
}
