//! The scores of the trial, beside those of the run or in their place: same colour map, same pixels, a dashed frame, and a
//! description of the changed peaks.

use egui::{Button, Label, Rect, Shape, Stroke, Ui, UiBuilder, vec2};
use sightline_session::what_if::Ghost;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::locate::template::settings::Measure;
use sightline_track::settings::TrackerKind;

use crate::command::{Command, Zoomable};
use crate::drawing::overlay::paint_words;
use crate::drawing::raster::{ColourMap, Raster};
use crate::drawing::view2d::Canvas;
use crate::panels::score_marks::{Marked, paint_contour, paint_peaks, region_of};
use crate::panels::status_line::STATUS;
use crate::state::State;
use crate::what_if::{Scores, Trial};
use crate::why::WhyCommand;
use crate::{panels, theme};

/// Gap between the two score maps, points.
const GAP: f32 = 4.0;
/// Minimum width at which a score map is readable, points.
const LEAST: f32 = 190.0;

/// Shows the scores of the trial beside those of the run, which `show_recorded` shows. `false` if there is no trial, or the
/// tracker matches no template.
pub(crate) fn show(
    ui: &mut Ui,
    state: &State,
    out: &mut Vec<Command>,
    show_recorded: fn(&mut Ui, &State, &mut Vec<Command>),
) -> bool {
    let Some(trial) = state.trial().filter(|_| state.tracker() == TrackerKind::Template) else {
        return false;
    };
    let has_room = ui.available_width() >= 2.0 * LEAST + GAP;
    let chosen = state.why.scores_shown;
    let shown = if chosen == Scores::Both && !has_room { Scores::Tried } else { chosen };
    let tried = state.trial_scores(ui.ctx());
    let recorded = state.trace().and_then(|trace| trace.template()).and_then(|e| e.match_template.as_ref());
    ui.horizontal(|ui| {
        ui.label(theme::note("scores"));
        for choice in Scores::ALL {
            let button = Button::selectable(shown == choice, choice.words()).min_size(vec2(24.0, 24.0));
            let button = ui.add_enabled(choice != Scores::Both || has_room, button);
            let button =
                button.on_disabled_hover_text("The panel is too narrow for both: let it fill the page (`)");
            if button.accessible_name(format!("scores: {}", choice.words())).clicked() {
                out.push(Command::Why(WhyCommand::Scores(choice)));
            }
        }
    });
    let tried_match = tried.as_ref().and_then(|(ghost, _)| ghost.matched.as_ref());
    if let Some(matched) = tried_match.filter(|_| shown != Scores::Recorded) {
        ui.add(Label::new(theme::note(words(matched, recorded)).color(theme::text())).wrap());
    }
    let area = ui.available_rect_before_wrap();
    let half = (area.width() - GAP) / 2.0;
    let (left, right) = match shown {
        Scores::Both => (area.with_max_x(area.left() + half), area.with_min_x(area.right() - half)),
        Scores::Recorded | Scores::Tried => (area, area),
    };
    let part = |ui: &mut Ui, place: Rect, name: &str, show: &mut dyn FnMut(&mut Ui)| {
        let mut inside = ui.new_child(UiBuilder::new().max_rect(place).id_salt(name));
        inside.set_clip_rect(place.intersect(ui.clip_rect()));
        show(&mut inside);
    };
    if shown != Scores::Tried {
        part(ui, left, "recorded", &mut |ui| show_recorded(ui, state, out));
    }
    if shown != Scores::Recorded {
        part(ui, right, "tried", &mut |ui| match &tried {
            Some((ghost, raster)) => show_tried(ui, state, ghost, raster, out),
            None => panels::missing(ui, "", &why_none(trial)),
        });
    }
    ui.advance_cursor_after_rect(area);
    true
}

/// Why there are no scores to show.
fn why_none(trial: &Trial) -> String {
    match (&trial.refused, &trial.ghost) {
        (Some(refused), _) => format!("What if cannot be tried: {refused}"),
        (None, Some(ghost)) if trial.has_scores && ghost.what_if == trial.what_if => {
            let why = ghost.missing.as_deref().unwrap_or("this step did not reach the search");
            format!("What if has no scores: {why}.")
        }
        (None, _) => "What if: computing the scores …".to_owned(),
    }
}

/// A comparison of the peaks.
fn words(tried: &TemplateMatch, recorded: Option<&TemplateMatch>) -> String {
    let second = |matched: &TemplateMatch| {
        let peak = matched.second_peak.as_ref();
        peak.map_or_else(
            || "none".to_owned(),
            |peak| format!("{:.2} of best, {:.0} px away", peak.ratio, peak.distance_px),
        )
    };
    let peak = &tried.peak;
    let mut words = format!("what if: peak {:.3} at {:.1}, {:.1} px", peak.score, peak.pixel.x, peak.pixel.y);
    let Some(recorded) = recorded.filter(|recorded| recorded.descent.is_none()) else {
        return format!("{words}; second peak {}; the run compared no positions here", second(tried));
    };
    words += &if recorded.measure == tried.measure {
        format!(", {:+.3} against the recorded {:.3}", peak.score - recorded.peak.score, recorded.peak.score)
    } else {
        format!(", by {} and not {}", tried.measure.word(), recorded.measure.word())
    };
    let moved = peak.pixel.distance(recorded.peak.pixel);
    words += &format!(", {moved:.1} px away from it");
    format!("{words}; second peak {}, recorded {}", second(tried), second(recorded))
}

fn show_tried(ui: &mut Ui, state: &State, ghost: &Ghost, raster: &Raster, out: &mut Vec<Command>) {
    let Some(matched) = &ghost.matched else { return };
    raster.set_colour_map(ColourMap::Values(matched.measure.shown_limits()));
    let region = region_of(matched.search_window, raster.size());
    let canvas = Canvas::new(ui, state.view(Zoomable::ScoreMap), region, STATUS);
    canvas.checker(region);
    canvas.texture(&raster.texture, region);
    if state.marks {
        let threshold = state.trial_setting("limits", "ncc_min").and_then(|value| value.as_f64());
        if let Some(threshold) = threshold.filter(|_| matched.measure == Measure::Ncc) {
            paint_contour(&canvas, raster, region, threshold as f32);
        }
        let predicted = ghost.predicted_left.map(|pixel| (pixel, ghost.predicted_covariance_px2));
        let truth = ghost.truth.as_ref().and_then(|truth| truth.left_pixel);
        paint_peaks(&canvas, &Marked { predicted, matched, truth, colour: theme::ghost() });
    }
    let frame = canvas.transform.rect.shrink(1.5);
    let corners =
        [frame.left_top(), frame.right_top(), frame.right_bottom(), frame.left_bottom(), frame.left_top()];
    canvas.painter.extend(Shape::dashed_line(&corners, Stroke::new(2.0, theme::ghost()), 7.0, 4.0));
    paint_words(&canvas.painter, frame.left_top() + vec2(8.0, 12.0), "what if", theme::ghost());
    let said = format!("match scores of what if: {}", words(matched, None));
    canvas.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &said));
    let [least, greatest] = matched.measure.shown_limits();
    let line = format!("what if, {} positions; colours {least:+} to {greatest:+}", matched.positions);
    ui.add(Label::new(theme::note(line)).truncate());
    if let Some(view) = canvas.moved {
        out.push(Command::View(Zoomable::ScoreMap, view));
    }
}
