//! The paths that a navigator evaluated at a stop: on the map, coloured by their votes, and as a table.

use egui::{Grid, ScrollArea, Ui};
use egui_plot::{Line, LineStyle, MarkerShape, PlotUi, Points};
use sightline_geometry::frames::Pose;
use sightline_rover::driving::{Candidate, PathChoice};

use crate::driving::{map, words};
use crate::panels::numbers::fixed;
use crate::state::State;
use crate::theme;

/// Paints the route, every evaluated path, and the first failing cell of each vetoed one.
pub(crate) fn paint(plot: &mut PlotUi<'_>, state: &State, site_from_rover: &Pose) {
    let Some(choice) = state.cycle_at(state.cursor.step).and_then(|cycle| cycle.choice.as_ref()) else {
        return;
    };
    let route: Vec<[f64; 2]> = choice.route_m.iter().map(|[north, east]| [*east, *north]).collect();
    plot.line(
        Line::new("route", route).color(theme::prediction()).style(LineStyle::dotted_dense()).width(1.5),
    );
    for (index, candidate) in choice.candidates.iter().enumerate() {
        let points = map::path(site_from_rover, &candidate.motion);
        let is_chosen = choice.chosen == Some(index);
        let line = Line::new("", points).color(colour(candidate)).width(if is_chosen { 2.5 } else { 1.0 });
        let is_vetoed = candidate.veto.is_some();
        plot.line(if is_vetoed { line.style(LineStyle::dotted_loose()) } else { line });
    }
    let failing: Vec<[f64; 2]> = choice
        .candidates
        .iter()
        .filter_map(|candidate| candidate.veto)
        .map(|veto| [veto.in_site_m[1], veto.in_site_m[0]])
        .collect();
    plot.points(Points::new("", failing).color(theme::failed()).radius(3.0).shape(MarkerShape::Cross));
}

/// The colour of a path, by its vote or its veto.
fn colour(candidate: &Candidate) -> egui::Color32 {
    if candidate.veto.is_some() { theme::failed() } else { theme::score(candidate.vote as f32) }
}

/// Shows one row per path: its vote by term, or the first failing cell.
pub(crate) fn table(ui: &mut Ui, choice: &PathChoice) {
    let count = choice.candidates.len();
    let open = count - choice.vetoed_count();
    // The rows above may be wider than the panel.
    let width = (ui.clip_rect().right() - ui.cursor().left() - 8.0).max(120.0);
    ui.scope(|ui| {
        ui.set_max_width(width);
        ui.label(theme::note(format!(
            "{open} of {count} paths are not vetoed; vote = weighted sum of goodness, goal and steering; a turn or motion backwards with \
             which the way to the goal begins is chosen without a vote"
        )));
        if let Some(blocked) = &choice.blocked_goal {
            let heads_for = match blocked.nearest_from_goal_m {
                Some(distance_m) => {
                    format!("; the nearest place that it can reach is {} m from the goal", fixed(distance_m, 2))
                }
                None => String::new(),
            };
            ui.label(theme::label(format!("{}{heads_for}", blocked.why())).color(theme::failed()));
        }
    });
    ScrollArea::horizontal().id_salt("paths").show(ui, |ui| {
        Grid::new("paths").num_columns(6).striped(true).spacing([10.0, 2.0]).show(ui, |ui| {
            for head in ["path", "vote", "goodness", "goal", "steering", "first failing cell"] {
                ui.label(theme::note(head));
            }
            ui.end_row();
            for (index, candidate) in choice.candidates.iter().enumerate() {
                row(ui, candidate, choice.chosen == Some(index));
            }
        });
    });
}

fn row(ui: &mut Ui, candidate: &Candidate, is_chosen: bool) {
    let motion = words::motion(&candidate.motion);
    let motion = if is_chosen { format!("{motion} (chosen)") } else { motion };
    ui.label(theme::label(motion).color(colour(candidate)).size(12.0));
    let terms = &candidate.terms;
    for value in [candidate.vote, terms.hazard, terms.goal, terms.steer] {
        ui.label(theme::number(fixed(value, 2)));
    }
    let veto = candidate.veto.as_ref().map(words::veto).unwrap_or_default();
    ui.label(theme::label(veto).size(12.0));
    ui.end_row();
}
