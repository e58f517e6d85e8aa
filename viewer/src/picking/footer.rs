//! The line below the left image while a target is picked: the verdict on a position with its reason, and the possible
//! actions.
//!
//! It replaces the status line, so that the layout does not move when picking starts or ends, and no text covers the image.

use egui::{Align, Button, Color32, Label, Layout, Rect, Ui, vec2};
use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::{TrackabilityLimits, Verdict};

use crate::command::{Command, Layer, Mode};
use crate::drawing::overlay::{Mark, StrokeStyle};
use crate::drawing::view2d::Canvas;
use crate::panels::legend;
use crate::panels::legend::Entry;
use crate::picking::aim::Aim;
use crate::picking::{is_here, words};
use crate::state::{Refusal, State};
use crate::theme;
use crate::trackability::limits;

/// Height of the line's contents, points.
const ROW: f32 = 18.0;

/// Minimum width of the sentence, points; with less the legend is omitted.
const SENTENCE_MIN: f32 = 120.0;

/// Whether the line replaces the status line.
pub(crate) fn is_shown(state: &State) -> bool {
    state.picks_on_click()
        || state.designating.is_some_and(|place| is_here(state, &place))
        || refusal(state).is_some()
}

/// The refusal to show: one of this stop and camera.
fn refusal(state: &State) -> Option<&Refusal> {
    state.refusal.as_ref().filter(|refusal| is_here(state, &refusal.place))
}

/// Shows the line; `place` is the aim, or the pixel under the pointer.
pub(crate) fn show(
    ui: &mut Ui,
    canvas: &Canvas,
    state: &State,
    place: Option<Pixel>,
    out: &mut Vec<Command>,
) {
    // By default a row is as high as a control, which exceeds the line.
    ui.spacing_mut().interact_size.y = ROW;
    ui.spacing_mut().button_padding.y = 0.0;
    ui.horizontal(|ui| {
        ui.set_height(ROW);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(theme::note(format!("×{:.2}", canvas.transform.scale)))
                .on_hover_text("Points on the screen per pixel. (0, 0) is the centre of the first pixel.");
            match refusal(state) {
                Some(refusal) => choices(ui, refusal, out),
                None if state.mode == Mode::Pick => legend_and_limits(ui, state, out),
                None => {}
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let (sentence, colour) = sentence(state, place);
                let text = egui::RichText::new(&sentence).size(11.5).color(colour);
                ui.add(Label::new(text).truncate()).on_hover_text(sentence);
            });
        });
    });
}

/// The text of the line, and its colour.
fn sentence(state: &State, place: Option<Pixel>) -> (String, Color32) {
    if state.designating.is_some_and(|place| is_here(state, &place)) {
        return ("Computing the position …".to_owned(), theme::accent());
    }
    if state.trackability.judged.is_some_and(|place| is_here(state, &place)) {
        return ("Judging this place … Esc cancels.".to_owned(), theme::accent());
    }
    if let Some(refusal) = refusal(state) {
        let Pixel { x, y } = refusal.place.pixel;
        return (format!("({x:.0}, {y:.0}) {}", closed(&refusal.sentence)), theme::lost());
    }
    if state.mode != Mode::Pick {
        let hint = "Click a rock to track it. T shows where targets are easy to track.";
        return (hint.to_owned(), theme::accent());
    }
    let Some(pixel) = place else { return (hint(state), theme::accent()) };
    let Some(cell) = state.trackability_at(pixel) else {
        return (format!("x {:.1}  y {:.1} · {}", pixel.x, pixel.y, hint(state)), theme::accent());
    };
    (format!("{} · x {:.1}  y {:.1}", words(&cell), pixel.x, pixel.y), theme::trackability(cell.verdict))
}

/// The sentence with its first letter capitalised and a full stop.
fn closed(sentence: &str) -> String {
    let mut letters = sentence.trim_end_matches('.').chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

/// The possible actions, and the progress of the map.
fn hint(state: &State) -> String {
    let hint = "Click the target, or aim with the arrows and press Enter. Esc cancels.";
    if let Some(name) = state.camera() {
        return format!(
            "{hint} The target is tracked in {name}; only the main pair has a map of trackability."
        );
    }
    let Some(progress) = &state.trackability.progress else {
        return format!("{hint} Map: requested …");
    };
    match (&progress.failed, progress.ended) {
        (Some(why), _) => format!("{hint} No map of trackability: {why}."),
        (None, true) => match state.trackability_map() {
            Some(map) if !map.limits.is_empty() => format!("{hint} {}.", made_with(state)),
            _ => hint.to_owned(),
        },
        (None, false) if progress.n == 0 => format!("{hint} Map: measuring ranges …"),
        (None, false) => format!("{hint} Map: {} of {} rows.", progress.k, progress.n),
    }
}

/// The limits with which the map was computed.
pub(super) fn made_with(state: &State) -> String {
    let limits = state.trackability_map().map(|map| &map.limits).filter(|limits| !limits.is_empty());
    let table = TrackabilityLimits::table();
    let unit = |key: &str| table.iter().find(|info| info.key == key).map_or("", |info| info.unit.as_str());
    let one = |(key, value): (&String, &serde_json::Value)| {
        format!("{key} {value} {}", unit(key)).trim_end().to_owned()
    };
    match limits {
        Some(limits) => format!("Map made with {}", limits.iter().map(one).collect::<Vec<_>>().join(", ")),
        None => "Map made with the default limits".to_owned(),
    }
}

/// Shows a button for the nearest good pixel, and one for the position itself if only the map advises against it.
fn choices(ui: &mut Ui, refusal: &Refusal, out: &mut Vec<Command>) {
    let mut button = |words: &str, help: &str, aim: Aim| {
        let button = Button::new(egui::RichText::new(words).size(11.5)).min_size(vec2(0.0, ROW));
        if ui.add(button).on_hover_text(help).clicked() {
            out.push(Command::Aim(aim));
        }
    };
    if refusal.is_advice {
        button("Pick anyway", "Designates this pixel. Such targets are lost more often.", Aim::Insist);
    }
    if let Some(pixel) = refusal.nearest {
        let words = format!("Use ({:.0}, {:.0})", pixel.x, pixel.y);
        button(&words, "Designates the nearest good pixel (Enter).", Aim::TakeNearest);
    }
}

/// The legend of the trackability map.
pub(crate) fn entries() -> [Entry; 3] {
    let entry = |verdict: Verdict, mark: Mark| {
        Entry::new(Layer::Trackability, mark, theme::trackability(verdict), verdict.word())
    };
    // From right to left.
    [
        entry(Verdict::Bad, Mark::Stroke(StrokeStyle::Dotted)),
        entry(Verdict::Risky, Mark::Square),
        entry(Verdict::Good, Mark::Dot),
    ]
}

fn legend_and_limits(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if state.trackability_map().is_none() {
        return;
    }
    let button = Button::new(egui::RichText::new("Limits …").size(11.5)).min_size(vec2(0.0, ROW));
    let button = ui.add(button).accessible_name("limits of trackability");
    if button.on_hover_text(made_with(state)).clicked() {
        out.push(Command::Limits(limits::LimitsCommand::Open));
    }
    let entries = entries();
    let widths = entries.each_ref().map(|entry| legend::width_of(ui, entry));
    if !state.marks || ui.available_width() - widths.iter().sum::<f32>() < SENTENCE_MIN {
        return;
    }
    for (number, (entry, width)) in entries.iter().zip(widths).enumerate() {
        let (place, _) = ui.allocate_exact_size(vec2(width, ROW), egui::Sense::hover());
        let row = Rect::from_min_size(place.left_top() + vec2(0.0, (ROW - 15.0) / 2.0), vec2(width, 15.0));
        ui.push_id(("trackability", number), |ui| legend::row(ui, row, entry, state, out));
    }
}
