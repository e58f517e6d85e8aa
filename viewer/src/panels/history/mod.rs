//! The template's history: the matched window of every step, and the correlation of the current view with each earlier
//! template of the run (R72), which the server computes.
//!
//! Both are fetched only while this panel is visible.

use egui::{Align2, Margin, Rect, ScrollArea, Sense, Ui, UiBuilder, pos2, vec2};
use egui_plot::{GridMark, Line, MarkerShape, Plot, Points};
use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::locate::template::history::AgainstEarlier;
use sightline_track::settings::TrackerKind;

use crate::cache::Slot;
use crate::command::{Command, Go};
use crate::drawing::{decimate, view2d};
use crate::panels::chart::{few_marks, plain, polylines};
use crate::panels::pane::Need;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets;
use crate::state::State;
use crate::theme;

/// Width of the two plots, points.
const PLOTS: f32 = 330.0;
/// Heights of the text above and below a window, points.
const WORDS: (f32, f32) = (14.0, 26.0);
/// Minimum width of a frame, in which its text fits, points.
const FRAME: f32 = 76.0;

/// The panel “Template history”.
pub(crate) struct History;

impl Panel for History {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        match state.run() {
            None => Some(state.missing_target()),
            Some(run) if run.settings.tracker != TrackerKind::Template => Some(state.missing_template()),
            Some(_) => None,
        }
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::places::history)
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::MatchedWindows]
    }

    fn margin(&self) -> Margin {
        Margin::symmetric(theme::MARGIN, 3)
    }
}

/// Shows the strip and the plots.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(run) = state.run() else { return };
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

/// Scale and roll of a step, then its score.
fn words_of(run: &RunView, row: &StepRow) -> [String; 2] {
    if is_pick(run, row) {
        return ["as designated".to_owned(), String::new()];
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
    crate::state::state_of(row).is_lost()
}

/// The current view compared with every earlier template: score and shift.
fn comparisons(ui: &mut Ui, state: &State, run: &RunView) {
    let found = state.earlier_templates().ready().unwrap_or_default();
    ui.add(egui::Label::new(theme::note(sentence(state, found))).truncate());
    let size = vec2((ui.available_width() - 6.0) / 2.0, ui.available_height());
    let colour = theme::run(run.number);
    let points = |of: &dyn Fn(&AgainstEarlier) -> f64| -> Vec<Option<[f64; 2]>> {
        found.iter().map(|one| Some([one.template_step as f64, of(one)])).collect()
    };
    ui.horizontal_top(|ui| {
        chart(ui, "score by template step", size, [0.0, 1.0], &points(&|one| one.score), colour);
        chart(
            ui,
            "shift, px, by template step",
            size,
            [0.0, 1.0],
            &points(&AgainstEarlier::shift_px),
            theme::lost(),
        );
    });
}

fn sentence(state: &State, found: &[AgainstEarlier]) -> String {
    let step = state.cursor.step;
    match (found.first(), state.earlier_templates()) {
        (Some(first), _) => format!(
            "step {step} against the template of step {}: score {:.2}, shift {:.2} px",
            first.template_step,
            first.score,
            first.shift_px()
        ),
        (None, Slot::Ready(_)) => format!("step {step} has no earlier template to compare with"),
        (None, Slot::Failed(problem)) => {
            format!("step {step} cannot be compared with earlier templates: {}", problem.detail)
        }
        (None, _) if state.row().is_none() => state.missing_step(),
        (None, _) => format!("comparing step {step} with the earlier templates …"),
    }
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
        ui.add(egui::Label::new(theme::note(title)).truncate());
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
            for polyline in polylines(points) {
                plot.line(Line::new("", polyline.clone()).color(colour).width(1.5));
                plot.points(
                    Points::new("", decimate::marks(polyline))
                        .color(colour)
                        .radius(2.5)
                        .shape(MarkerShape::Circle),
                );
            }
        });
    });
}
