//! The score maps of the compared runs side by side, over the same pixels and with the same colour map.

use egui::{Rect, Ui, UiBuilder, vec2};
use sightline_session::compare::RunName;
use sightline_session::step::RunStep;
use sightline_track::trace::ArrayName;

use crate::cache::Slot;
use crate::command::{Command, Zoomable};
use crate::compare::state::RunStyle;
use crate::drawing::overlay::{Overlay, paint_words};
use crate::drawing::raster::{ColourMap, Raster};
use crate::drawing::view2d::Canvas;
use crate::panels;
use crate::panels::score_marks::{paint_marks, region_of};
use crate::panels::status_line::STATUS;
use crate::state::State;
use crate::theme;

/// Gap between two score maps, points.
const GAP: f32 = 4.0;

/// Shows the score maps; `false` if no run is compared.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) -> bool {
    let others = state.others();
    let Some(own) = state.own_name().filter(|_| !others.is_empty()) else { return false };
    let mut parts = vec![(own, state.own_style(), state.trace(), state.array(ArrayName::SURFACE))];
    parts.extend(others.iter().map(|other| {
        let array = state.other_array(other.name, ArrayName::SURFACE);
        (other.name, other.style, state.other_trace(other.name).ready(), array)
    }));
    let area = ui.available_rect_before_wrap();
    let count = parts.len() as f32;
    let width = (area.width() - GAP * (count - 1.0)) / count;
    for (i, (name, style, trace, raster)) in parts.into_iter().enumerate() {
        let corner = area.min + vec2((width + GAP) * i as f32, 0.0);
        let frame = Rect::from_min_size(corner, vec2(width, area.height()));
        let mut inside = ui.new_child(UiBuilder::new().max_rect(frame).id_salt(("surface", i)));
        show_part(&mut inside, state, (name, style), trace, raster, out);
    }
    ui.advance_cursor_after_rect(area);
    true
}

fn show_part(
    ui: &mut Ui,
    state: &State,
    (name, style): (RunName, RunStyle),
    trace: Option<&RunStep>,
    raster: Slot<'_, Raster>,
    out: &mut Vec<Command>,
) {
    let label = state.run_label(name);
    let matched = trace.and_then(|trace| trace.template()).and_then(|e| e.match_template.as_ref());
    let (Some(trace), Some(matched)) = (trace, matched) else {
        return panels::missing(ui, "", &format!("{label} matched no template at this step."));
    };
    let raster = match raster {
        Slot::Ready(raster) => raster,
        Slot::Failed(problem) => return panels::missing(ui, "", &format!("{label}: {}", problem.detail)),
        Slot::Loading => return panels::missing(ui, "", &format!("{label}: loading the scores …")),
        Slot::Absent => return panels::missing(ui, "", &format!("{label} compared no window of positions.")),
    };
    raster.set_colour_map(ColourMap::Values(matched.measure.shown_limits()));
    let region = region_of(matched.search_window, raster.size());
    let canvas = Canvas::new(ui, state.view(Zoomable::ScoreMap), region, STATUS);
    canvas.checker(region);
    canvas.texture(&raster.texture, region);
    if state.marks {
        paint_marks(&canvas, trace, matched, style.colour);
        Overlay::new(&canvas.painter, &canvas.transform).mark(matched.pixel, style.mark, style.colour);
    }
    let [least, greatest] = matched.measure.shown_limits();
    let words = format!("{label}: peak {:.3}", matched.peak.score);
    paint_words(&canvas.painter, canvas.transform.rect.left_top() + vec2(6.0, 10.0), &words, style.colour);
    canvas.response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Image, true, format!("match scores of {words}"))
    });
    let line = format!("{} positions; colours {least:+} to {greatest:+}", matched.positions);
    ui.add(egui::Label::new(theme::note(line)).truncate());
    if let Some(view) = canvas.moved {
        out.push(Command::View(Zoomable::ScoreMap, view));
    }
}
