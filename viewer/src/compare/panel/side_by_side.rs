//! The surroundings of the target in each run, side by side at the same magnification.

use egui::{Rect, Ui, UiBuilder, vec2};
use sightline_session::compare::RunName;
use sightline_session::step::RunStep;
use sightline_session::view::RunView;
use sightline_vision::image::PixelRect;

use crate::command::{Command, Zoomable};
use crate::compare::panel::marks;
use crate::compare::state::{RunStyle, place_of_target, scale_of};
use crate::drawing::overlay::{Overlay, paint_words};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::{Canvas, View2d};
use crate::layout::left_image::LeftImage;
use crate::panels::status_line::STATUS;
use crate::state::State;
use crate::theme;

/// Gap between two runs, points.
const GAP: f32 = 4.0;

/// One run's part of the panel.
struct Tile<'a> {
    name: RunName,
    run: &'a RunView,
    style: RunStyle,
    trace: Option<&'a RunStep>,
    raster: Option<&'a Raster>,
}

/// Shows the parts. Returns the screen area of the selected run's image.
pub(crate) fn show(ui: &mut Ui, state: &State, raster: &Raster, out: &mut Vec<Command>) -> LeftImage {
    let (own, run) = state.own_name().zip(state.run())?;
    let mut tiles =
        vec![Tile { name: own, run, style: state.own_style(), trace: state.trace(), raster: Some(raster) }];
    tiles.extend(state.others().into_iter().map(|other| Tile {
        name: other.name,
        run: other.run,
        style: other.style,
        trace: state.other_trace(other.name).ready(),
        raster: state.other_image(other.name).ready(),
    }));
    let area = ui.available_rect_before_wrap();
    let count = tiles.len() as f32;
    let width = (area.width() - GAP * (count - 1.0)) / count;
    let mut shown = None;
    for (i, tile) in tiles.iter().enumerate() {
        let left = area.left() + (width + GAP) * i as f32;
        let frame = Rect::from_min_size(egui::pos2(left, area.top()), vec2(width, area.height()));
        let mut inside = ui.new_child(UiBuilder::new().max_rect(frame).id_salt(("side", i)));
        let canvas = show_tile(&mut inside, state, tile, out);
        if i == 0 {
            shown = canvas.map(|canvas| (canvas.transform, raster.size()));
        }
    }
    ui.advance_cursor_after_rect(area);
    shown
}

fn show_tile(ui: &mut Ui, state: &State, tile: &Tile<'_>, out: &mut Vec<Command>) -> Option<Canvas> {
    let label = state.run_label(tile.name);
    let Some(raster) = tile.raster else {
        let sentence = match state.aligned_step(tile.name, state.cursor.step) {
            Some(step) => format!("{label}: the image of step {step} is being loaded."),
            None => format!("{label} has no stop aligned with this one; align by step to see it."),
        };
        crate::panels::missing(ui, "", &sentence);
        return None;
    };
    raster.stretch(state.stretch);
    let [width, height] = raster.size();
    let region = PixelRect::whole(width, height);
    let view = state.view(Zoomable::Left);
    let centre = tile.trace.and_then(place_of_target).unwrap_or_else(|| region.centre());
    let canvas = Canvas::new(ui, View2d::At { centre, scale: scale_of(view) }, region, STATUS);
    canvas.texture(&raster.texture, region);
    canvas.pixel_grid(region);
    if let Some(trace) = tile.trace.filter(|_| state.marks) {
        let overlay = Overlay::new(&canvas.painter, &canvas.transform);
        marks::paint(&overlay, trace, tile.run, tile.style, state);
    }
    let words = words(tile, &label, state.cursor.step);
    paint_words(
        &canvas.painter,
        canvas.transform.rect.left_top() + vec2(8.0, 12.0),
        &words,
        tile.style.colour,
    );
    canvas
        .response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("left image, {words}")));
    ui.label(theme::note(format!("about the target, ×{:.1}", canvas.transform.scale)));
    // Each part remains centred on its own target; only the magnification is shared.
    if let Some(moved @ View2d::At { .. }) = canvas.moved
        && scale_of(moved) != scale_of(view)
    {
        out.push(Command::View(Zoomable::Left, moved));
    } else if canvas.moved == Some(View2d::Fit) {
        out.push(Command::View(Zoomable::Left, View2d::Fit));
    }
    Some(canvas)
}

fn words(tile: &Tile<'_>, label: &str, step: usize) -> String {
    match tile.trace {
        None => format!("{label}: this step is not loaded or not computed"),
        Some(trace) => {
            let score = trace.row().ncc.map_or_else(String::new, |ncc| format!(", ncc {ncc:.2}"));
            let at = if trace.step == step { String::new() } else { format!(", step {}", trace.step) };
            format!("{label}{at}: {}{score}", trace.update.state.word())
        }
    }
}
