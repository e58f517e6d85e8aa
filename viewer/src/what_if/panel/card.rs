//! The result of a trial: the ghost, dashed over the image, and a small card that lists the changes.

use egui::{Align, Button, Frame, Label, Layout, Margin, Pos2, Rect, RichText, Ui, UiBuilder, vec2};
use sightline_session::marks::square;
use sightline_session::what_if::Ghost;
use sightline_session::why::gates;
use sightline_session::why::words::{capitalised, setting_name, signed};

use crate::command::Command;
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle};
use crate::drawing::view2d::Canvas;
use crate::state::State;
use crate::state::state_of;
use crate::theme;
use crate::what_if::Trial;
use crate::what_if::panel::place;
use crate::what_if::panel::place::Edge;
use crate::why::WhyCommand;

/// Width of the card, points.
const WIDTH: f32 = 230.0;

/// Paints the ghost of a trial.
pub(crate) fn ghost(canvas: &Canvas, trial: &Trial) {
    let Some(ghost) = &trial.ghost else { return };
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    if let Some(window) = ghost.search_window {
        overlay.rectangle(window, theme::ghost(), StrokeStyle::Dashed);
    }
    if let Some(pixel) = ghost.predicted_left.filter(|_| trial.what_if.prediction_px.is_some()) {
        overlay.mark(pixel, Mark::Cross, theme::ghost());
        if let Some(covariance) = &ghost.predicted_covariance_px2 {
            overlay.ellipse(pixel, covariance, 3.0, theme::ghost(), StrokeStyle::Dotted);
        }
    }
    if let Some(pixel) = ghost.left_pixel {
        if let Some(map) = &ghost.prepared_from_template {
            let quad = square(pixel, ghost.template_size_px, map);
            overlay.outline(&quad, theme::ghost(), StrokeStyle::Dashed);
        }
        if let Some(covariance) = &ghost.left_covariance_px2 {
            overlay.ellipse(pixel, covariance, 3.0, theme::ghost(), StrokeStyle::Dashed);
        }
        overlay.mark(pixel, Mark::Diamond, theme::ghost());
    }
}

/// Shows the card in a corner of the image.
pub(crate) fn over(ui: &mut Ui, canvas: &Canvas, at: Pos2, state: &State, out: &mut Vec<Command>) {
    let Some(trial) = state.trial() else { return };
    let area = canvas.transform.rect;
    let corner = Rect::from_min_max(at, area.max).with_max_x((at.x + WIDTH).min(area.right()));
    let builder =
        UiBuilder::new().max_rect(corner).layout(Layout::top_down(Align::Min)).id_salt("what if card");
    let mut inside = ui.new_child(builder);
    inside.set_clip_rect(area.intersect(ui.clip_rect()));
    let shown = frame().show(&mut inside, |ui| contents(ui, state, trial, out));
    place::remember(ui, shown.response.rect.size());
}

/// Shows the card as a strip along an edge of the image.
pub(crate) fn strip(ui: &mut Ui, canvas: &Canvas, edge: Edge, state: &State, out: &mut Vec<Command>) {
    let Some(trial) = state.trial() else { return };
    let area = canvas.transform.rect;
    let top = if edge == Edge::Top { area.top() } else { (area.bottom() - place::STRIP).max(area.top()) };
    let builder = UiBuilder::new()
        .max_rect(area.with_min_y(top))
        .layout(Layout::top_down(Align::Min))
        .id_salt("what if strip");
    let mut inside = ui.new_child(builder);
    inside.set_clip_rect(area.intersect(ui.clip_rect()));
    frame().show(&mut inside, |ui| {
        ui.set_min_size(vec2(ui.available_width(), place::STRIP - 12.0));
        ui.spacing_mut().item_spacing.y = 2.0;
        // The buttons are first, so that results that arrive later do not move them.
        ui.horizontal_wrapped(|ui| {
            buttons(ui, out);
            what(ui, state, trial);
        });
    });
}

fn frame() -> Frame {
    let stroke = egui::Stroke::new(1.0, theme::ghost());
    Frame::new().fill(theme::scrim()).stroke(stroke).corner_radius(4).inner_margin(Margin::same(6))
}

fn contents(ui: &mut Ui, state: &State, trial: &Trial, out: &mut Vec<Command>) {
    what(ui, state, trial);
    ui.horizontal_wrapped(|ui| buttons(ui, out));
}

/// Shows the changes and their result.
fn what(ui: &mut Ui, state: &State, trial: &Trial) {
    ui.label(theme::title(&format!("what if, step {}", trial.of.step)));
    for line in changes(state, trial) {
        sentence(ui, theme::note(line));
    }
    match (&trial.ghost, &trial.refused) {
        (_, Some(why)) => {
            sentence(ui, RichText::new(why).color(theme::lost()));
        }
        (Some(ghost), None) => result(ui, ghost, ghost.what_if == trial.what_if),
        (None, None) => {
            ui.label(theme::note("computing …"));
        }
    }
}

fn buttons(ui: &mut Ui, out: &mut Vec<Command>) {
    let run = ui.add(Button::new("Run from here as branch").min_size(vec2(0.0, 24.0)));
    if run.on_hover_text("Nothing recorded is overwritten. Key R").clicked() {
        out.push(Command::Why(WhyCommand::Branch));
    }
    let discard = ui.add(Button::new("Discard").min_size(vec2(0.0, 24.0)));
    if discard.accessible_name("discard what if").on_hover_text("Key Esc").clicked() {
        out.push(Command::Why(WhyCommand::Discard));
    }
}

/// Shows words that may be long; in a row they wrap with it.
fn sentence(ui: &mut Ui, words: RichText) {
    let label = Label::new(words);
    ui.add(if ui.layout().is_horizontal() { label } else { label.wrap() });
}

/// Shows pieces beside each other; in a strip they become part of its row.
fn flow(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    if ui.layout().is_horizontal() {
        contents(ui);
    } else {
        ui.horizontal_wrapped(contents);
    }
}

/// The changes against the run, one per line.
fn changes(state: &State, trial: &Trial) -> Vec<String> {
    let group = |key: &str| state.settings.iter().find(|info| info.key == key).map(|info| info.group.clone());
    let settings = trial.what_if.settings.iter().map(|(key, value)| {
        let before = group(key).and_then(|group| state.setting(&group, key));
        let unit = state.settings.iter().find(|info| info.key == *key).map_or("", |info| info.unit.as_str());
        let words = format!("{} {} → {value} {unit}", setting_name(key), before.unwrap_or_default());
        words.trim_end().to_owned()
    });
    let moved = trial.what_if.prediction_px.map(|to| {
        let from = state.trace().and_then(|trace| trace.point_mast.predicted_left);
        let way = from.map_or_else(String::new, |from| {
            format!(", moved by {}, {} px", signed(to.x - from.x), signed(to.y - from.y))
        });
        format!("prediction at {:.1}, {:.1}{way}", to.x, to.y)
    });
    settings.chain(moved).collect()
}

/// The recorded state and the one of the trial: `Lost → Tracking`.
fn transition(recorded: &str, tried: &str) -> String {
    let tried = capitalised(tried);
    if recorded == tried.to_lowercase() { tried } else { format!("{} → {tried}", capitalised(recorded)) }
}

/// Shows state, score and position of the ghost, with their changes.
fn result(ui: &mut Ui, ghost: &Ghost, is_newest: bool) {
    let tracking = state_of(&ghost.row);
    let deltas = &ghost.deltas;
    flow(ui, |ui| {
        let words = transition(&deltas.state_recorded, &ghost.row.state);
        ui.label(RichText::new(words).strong().color(theme::state(tracking)));
        match ghost.is_right() {
            Some(true) => {
                ui.label(theme::note("(correct)"));
            }
            Some(false) if ghost.row.state == "tracking" => {
                ui.label(RichText::new("(wrong target)").strong().color(theme::failed()));
            }
            _ => {}
        }
    });
    let lines = [
        (gates::label("ncc"), ghost.row.ncc, deltas.ncc, ""),
        (gates::label("stereo_ncc"), ghost.row.stereo_score, deltas.stereo_score, ""),
        ("confidence", ghost.row.confidence.filter(|_| ghost.row.ncc.is_none()), deltas.confidence, ""),
        ("error", ghost.row.err_px, deltas.err_px, " px"),
    ];
    for (name, value, delta, unit) in lines {
        if let Some(value) = value {
            let change = delta.map_or_else(String::new, |delta| format!("  Δ {delta:+.3}{unit}"));
            ui.label(theme::number(format!("{name} {value:.3}{unit}{change}")).size(11.0));
        }
    }
    if let Some(moved) = deltas.moved_px {
        ui.label(theme::number(format!("Match shift {moved:.1} px")).size(11.0));
    }
    if let Some(missing) = &ghost.missing {
        sentence(ui, RichText::new(missing).small().color(theme::lost()));
    }
    if !is_newest {
        ui.label(theme::note("computing the newest change …"));
    }
}
