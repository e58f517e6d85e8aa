//! Picking a target in the left image: the trackability over it, the loupe, the aim, and what a refusal offers.
//!
//! Verdicts are told apart by pattern and word, not by colour alone: good is plain, risky is hatched, bad is crossed.

pub(crate) mod aim;

use egui::{Button, CursorIcon, Mesh, Pos2, Rect, Shape, Stroke, Ui, UiBuilder, pos2, vec2};
use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::map::Cell;
use sightline_rover::trackability::{TrackabilityLimits, TrackabilityMap, Verdict};
use sightline_session::marks::square;
use sightline_vision::image::PixelRect;

use crate::command::{Command, Layer, Mode};
use crate::drawing::overlay;
use crate::drawing::overlay::{Line, Mark, Overlay, paint_words};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::{Canvas, Transform};
use crate::panels::legend;
use crate::panels::legend::Entry;
use crate::picking::aim::Aim;
use crate::state::State;
use crate::theme;
use crate::trackability::limits;

/// Distance between the strokes of the pattern, points.
const PITCH: f64 = 9.0;
/// Height of a row of the legend, points.
const ROW: f32 = 24.0;
/// The loupe's magnification, and its side in pixels of the image.
const LOUPE: (f32, f32) = (4.0, 37.0);

/// What the legend of the map lists.
fn entries() -> [Entry; 3] {
    let entry = |verdict: Verdict, mark: Mark, word: &str| {
        Entry::new(Layer::Trackability, mark, theme::trackability(verdict), word)
    };
    [
        entry(Verdict::Good, Mark::Dot, "good place, plain"),
        entry(Verdict::Risky, Mark::Stroke(Line::Dashed), "risky place, hatched"),
        entry(Verdict::Bad, Mark::Cross, "bad place, crossed"),
    ]
}

/// The legend of the map. It lies on the image, in a corner: what is about to be clicked must not move when the map comes.
fn legend(ui: &mut Ui, canvas: &Canvas, state: &State, out: &mut Vec<Command>) {
    if state.trackability_map().is_none() || !state.marks {
        return;
    }
    let entries = entries();
    let width = entries.iter().map(|entry| legend::width_of(ui, entry)).fold(0.0, f32::max);
    let corner = canvas.transform.rect.left_top() + vec2(6.0, 6.0);
    let area = Rect::from_min_size(corner, vec2(width, ROW * entries.len() as f32));
    canvas.painter.rect_filled(area.expand(3.0), 3.0, theme::scrim());
    for (number, entry) in (0_u8..).zip(&entries) {
        let top = corner + vec2(0.0, ROW * f32::from(number));
        let place = Rect::from_min_size(top, vec2(width, ROW));
        // A child leaves the cursor of the panel where it is, below the image.
        let child = ui.new_child(UiBuilder::new().max_rect(place).id_salt(("trackability", number)));
        legend::row(&child, place, entry, state, out);
    }
    let below = Rect::from_min_size(corner + vec2(0.0, area.height() + 4.0), vec2(width, ROW));
    let mut child = ui.new_child(UiBuilder::new().max_rect(below).id_salt("limits"));
    let button = child.add_sized(below.size(), Button::new("Limits …"));
    let button = button.accessible_name("limits of trackability");
    if button.on_hover_text(made_with(state)).clicked() {
        out.push(Command::Limits(limits::Ask::Open));
    }
}

/// The map over the image, under all marks.
pub(crate) fn paint_map(canvas: &Canvas, state: &State) {
    if state.mode != Mode::Pick || !state.shows(Layer::Trackability) {
        return;
    }
    if let Some(map) = state.trackability_map() {
        let painter = canvas.painter.with_clip_rect(canvas.transform.rect);
        painter.add(Shape::mesh(fills(map, &canvas.transform)));
        painter.extend(strokes(map, &canvas.transform));
    }
}

/// One quad for every run of equal cells in a row.
fn fills(map: &TrackabilityMap, transform: &Transform) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..map.rows_done() {
        let letters = &map.verdicts.as_bytes()[row * map.columns..(row + 1) * map.columns];
        let mut first = 0;
        while first < letters.len() {
            let length = letters[first..].iter().take_while(|letter| **letter == letters[first]).count();
            if let Some(verdict) = Verdict::of_letter(letters[first]) {
                let area = area(map, transform, [first, row], [length, 1]);
                mesh.add_colored_rect(area, theme::trackability_fill(verdict));
            }
            first += length;
        }
    }
    mesh
}

/// The pattern: a stroke in every block of cells that is wide enough on the screen.
fn strokes(map: &TrackabilityMap, transform: &Transform) -> Vec<Shape> {
    let cells = (PITCH / (f64::from(map.cell_px) * transform.scale)).ceil().max(1.0) as usize;
    let mut shapes = Vec::new();
    for row in (0..map.rows_done()).step_by(cells) {
        for column in (0..map.columns).step_by(cells) {
            let middle = map.cell(column + cells / 2, row + cells / 2).or_else(|| map.cell(column, row));
            let Some(verdict) = middle.map(|cell| cell.verdict).filter(|v| *v != Verdict::Good) else {
                continue;
            };
            let block = area(map, transform, [column, row], [cells, cells]).shrink(1.0);
            if !block.intersects(transform.rect) {
                continue;
            }
            let stroke = Stroke::new(1.0, theme::trackability(verdict));
            shapes.push(Shape::line_segment([block.left_bottom(), block.right_top()], stroke));
            if verdict == Verdict::Bad {
                shapes.push(Shape::line_segment([block.left_top(), block.right_bottom()], stroke));
            }
        }
    }
    shapes
}

/// The screen area of some cells.
fn area(map: &TrackabilityMap, transform: &Transform, first: [usize; 2], count: [usize; 2]) -> Rect {
    let at = |cells: usize| (cells as u32 * map.cell_px) as i32;
    let side = |cells: usize| cells as u32 * map.cell_px;
    transform.area(PixelRect::new(at(first[0]), at(first[1]), side(count[0]), side(count[1])))
}

/// A cell in words: verdict and reason, range and longest safe step.
pub(crate) fn words(cell: &Cell) -> String {
    let mut words = cell.verdict.word().to_owned();
    if let Some(sentence) = cell.sentence() {
        words += &format!(": {sentence}");
    }
    if let Some(range_m) = cell.range_m {
        words += &format!(" · {range_m:.2} m away");
    }
    if let Some(step_m) = cell.longest_step_m {
        words += &format!(" · longest safe step {step_m:.2} m");
    }
    words
}

/// In pick mode: verdict, loupe and aim, the designation on a click, and what a refusal offers.
pub(crate) fn show(ui: &mut Ui, canvas: &Canvas, raster: &Raster, state: &State, out: &mut Vec<Command>) {
    let border = canvas.transform.rect.shrink(1.0);
    if state.mode != Mode::Pick {
        if state.session.as_ref().is_some_and(|session| session.targets.is_empty()) {
            paint_hint(canvas, border, "Press T, then click the rock to track.");
        }
        return;
    }
    canvas.painter.rect_stroke(border, 0.0, Stroke::new(2.0, theme::accent()), egui::StrokeKind::Inside);
    paint_hint(canvas, border, &hint(state));
    legend(ui, canvas, state, out);
    offer(ui, canvas, state, out);
    let [width, height] = raster.size();
    // On a button that lies on the image nothing is picked.
    let hovered = canvas.hovered(PixelRect::whole(width, height)).filter(|_| canvas.response.hovered());
    let described = state.trackability.aim.or(hovered);
    let text = described_words(state, described);
    canvas.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, text.clone()));
    if let Some(pixel) = state.trackability.aim {
        let overlay = Overlay::new(&canvas.painter, &canvas.transform);
        overlay.outline(
            &square(pixel, state.template_side_px(), &nalgebra::Matrix2::identity()),
            theme::accent(),
            Line::Dotted,
        );
        overlay.mark(pixel, Mark::Plus, theme::accent());
    }
    let Some(pixel) = described else { return };
    loupe(canvas, raster, pixel);
    verdict_line(canvas, state, pixel);
    if let Some(pixel) = hovered {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        if canvas.response.clicked() {
            out.push(Command::Pick(pixel));
        }
    }
}

/// Words along the lower border, in as many lines as they need.
fn paint_hint(canvas: &Canvas, border: Rect, words: &str) {
    let room = border.shrink2(vec2(10.0, 7.0));
    let galley = canvas.painter.layout(words.to_owned(), theme::image_font(), theme::accent(), room.width());
    let corner = room.left_bottom() - vec2(0.0, galley.size().y);
    canvas.painter.rect_filled(
        Rect::from_min_size(corner, galley.size()).expand2(vec2(3.0, 1.0)),
        2.0,
        theme::scrim(),
    );
    canvas.painter.galley(corner, galley, theme::accent());
}

/// What can be done, and how far the map is.
fn hint(state: &State) -> String {
    let hint = "Click the point to track, or aim with the arrows and Enter. Esc cancels.";
    if let Some(name) = state.camera() {
        return format!(
            "{hint} The target is tracked in {name}; trackability is known for the main pair alone."
        );
    }
    let Some(progress) = &state.trackability.progress else {
        return format!("{hint} Trackability is being looked at …");
    };
    match (&progress.failed, progress.ended) {
        (Some(why), _) => format!("{hint} No trackability: {why}."),
        (None, true) => match state.trackability_map() {
            Some(map) if !map.limits.is_empty() => format!("{hint} {}.", made_with(state)),
            _ => hint.to_owned(),
        },
        (None, false) if progress.n == 0 => format!("{hint} Trackability: measuring the surface …"),
        (None, false) => format!("{hint} Trackability: {} of {} rows.", progress.k, progress.n),
    }
}

/// By which limits the map was made.
fn made_with(state: &State) -> String {
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

/// The image in words, for those who do not see it.
fn described_words(state: &State, pixel: Option<Pixel>) -> String {
    let mut words = format!("left image of step {}", state.cursor.step);
    if let Some(name) = state.camera() {
        words += &format!(", camera {name}");
    }
    if let Some(map) = state.trackability_map() {
        let [good, risky, bad] = map.shares().map(|share| 100.0 * share);
        words += &format!(", trackability: {good:.0} % good, {risky:.0} % risky, {bad:.0} % bad");
        words += &format!("; {}", made_with(state));
    }
    if let Some(pixel) = pixel {
        words += &format!("; at {:.1}, {:.1}", pixel.x, pixel.y);
        if let Some(cell) = state.trackability_at(pixel) {
            words += &format!(": {}", self::words(&cell));
        }
    }
    words
}

/// The verdict beside the place.
fn verdict_line(canvas: &Canvas, state: &State, pixel: Pixel) {
    let Some(cell) = state.trackability_at(pixel) else { return };
    let (text, colour) = (words(&cell), theme::trackability(cell.verdict));
    let width = canvas.painter.layout_no_wrap(text.clone(), theme::image_font(), colour).size().x;
    let (at, area) = (canvas.transform.to_screen(pixel), canvas.transform.rect.shrink(8.0));
    let x = (at.x + 16.0).min(area.right() - width).max(area.left());
    let y = if at.y + 30.0 < area.bottom() - 24.0 { at.y + 22.0 } else { at.y - 22.0 };
    paint_words(&canvas.painter, pos2(x, y), &text, colour);
}

/// The ways on, where a pick was refused: the nearest good pixel, and to insist on what only the map speaks against.
fn offer(ui: &mut Ui, canvas: &Canvas, state: &State, out: &mut Vec<Command>) {
    let here = |refusal: &&crate::state::Refusal| refusal.place.step == state.cursor.step;
    let Some(refusal) = state.refusal.as_ref().filter(here) else { return };
    let mut choices = Vec::new();
    if let Some(pixel) = refusal.nearest {
        let overlay = Overlay::new(&canvas.painter, &canvas.transform);
        overlay.mark(pixel, Mark::Diamond, theme::trackability(Verdict::Good));
        let words = format!("Take the nearest good pixel ({:.0}, {:.0})", pixel.x, pixel.y);
        choices.push((words, "Enter does the same", Aim::TakeNearest));
    }
    if refusal.is_advice {
        let help = "A bad place often loses its target; some are kept all the same";
        choices.push(("Pick it all the same".to_owned(), help, Aim::Insist));
    }
    let area = canvas.transform.rect;
    let size = vec2(250.0_f32.min(area.width() - 20.0), 26.0);
    for (row, (words, help, aim)) in choices.into_iter().rev().enumerate() {
        let corner = area.left_bottom() + vec2(10.0, -56.0 - 30.0 * row as f32);
        let place = Rect::from_min_size(corner, size);
        let mut child = ui.new_child(UiBuilder::new().max_rect(place).id_salt(("refused", row)));
        if child.add_sized(size, Button::new(words)).on_hover_text(help).clicked() {
            out.push(Command::Aim(aim));
        }
    }
}

/// The surroundings of a place at 400 %, on the side away from it.
fn loupe(canvas: &Canvas, raster: &Raster, pixel: Pixel) {
    let (magnification, pixels) = LOUPE;
    let side = magnification * pixels;
    let area = canvas.transform.rect.shrink(8.0);
    if canvas.transform.scale > f64::from(magnification)
        || area.width() < 2.5 * side
        || area.height() < 1.5 * side
    {
        return;
    }
    let frame =
        Rect::from_min_size(loupe_corner(area, canvas.transform.to_screen(pixel), side), vec2(side, side));
    let [width, height] = raster.size().map(|v| v as f32);
    let middle = pos2((pixel.x as f32 + 0.5) / width, (pixel.y as f32 + 0.5) / height);
    let part = Rect::from_center_size(middle, vec2(pixels / width, pixels / height));
    canvas.painter.image(raster.texture.id(), frame, part, theme::UNTINTED);
    canvas.painter.rect_stroke(frame, 0.0, Stroke::new(1.0, theme::accent()), egui::StrokeKind::Outside);
    overlay::paint_mark(&canvas.painter, frame.center(), Mark::Plus, theme::accent(), 9.0);
}

fn loupe_corner(area: Rect, at: Pos2, side: f32) -> Pos2 {
    let x = if at.x > area.center().x { area.left() } else { area.right() - side };
    pos2(x, area.center().y - side / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loupe_stands_on_the_side_away_from_the_place() {
        let area = Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 300.0));
        assert_eq!(loupe_corner(area, pos2(300.0, 20.0), 148.0), pos2(0.0, 76.0));
        assert_eq!(loupe_corner(area, pos2(30.0, 20.0), 148.0), pos2(252.0, 76.0));
    }
}
