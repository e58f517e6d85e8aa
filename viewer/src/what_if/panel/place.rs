//! The position of the what-if card: the corner of the image with most room, never over the target or the search window. If
//! no corner is free, a flat strip along the edge that covers less. The image keeps its position and size, and the card
//! does not move while a handle is dragged.

use egui::{Pos2, Rect, Ui, Vec2, pos2, vec2};
use sightline_geometry::frames::Pixel;
use sightline_track::trace::StepTrace;

use crate::drawing::view2d::Transform;
use crate::state::State;
use crate::what_if::Trial;

/// Margin around the areas that must not be covered, points.
const ROOM: f32 = 14.0;
/// Margin between the card and the edge of the image, points.
const RIM: f32 = 8.0;
/// Assumed size of the card before it is first painted, points.
const FIRST: Vec2 = vec2(230.0, 170.0);
/// Minimum height of a strip, points.
pub(crate) const STRIP: f32 = 84.0;

/// The position of the card.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum CardPlacement {
    /// Over the image, with the card's upper left corner here.
    Over(Pos2),
    /// A strip along the upper edge of the image, or along the lower one.
    Strip(Edge),
}

/// An edge of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Edge {
    /// The upper one.
    Top,
    /// The lower one.
    Bottom,
}

/// The position of the card of the current trial; `None` without a trial.
pub(crate) fn of(ui: &Ui, state: &State, transform: &Transform) -> Option<CardPlacement> {
    let trial = state.trial()?;
    let trace = state.trace()?;
    let known = ui.data(|data| data.get_temp::<CardPlacement>(id().with("place")));
    if let Some(known) = known.filter(|_| ui.input(|input| input.pointer.any_down())) {
        return Some(known);
    }
    let to_avoid = areas_to_avoid(trial, trace, transform);
    let image = transform.rect;
    let place = match corner(image.shrink(RIM), last_size(ui, FIRST), &to_avoid) {
        Some(at) => CardPlacement::Over(at),
        None => CardPlacement::Strip(edge(image, &to_avoid)),
    };
    ui.data_mut(|data| data.insert_temp(id().with("place"), place));
    Some(place)
}

/// The edge along which a strip covers less of the areas to keep free.
fn edge(image: Rect, to_avoid: &[Rect]) -> Edge {
    let covered = |strip: Rect| {
        let shared = to_avoid.iter().map(|avoided| avoided.intersect(strip)).filter(Rect::is_positive);
        shared.map(|shared| shared.area()).sum::<f32>()
    };
    let above = covered(image.with_max_y(image.top() + STRIP));
    let below = covered(image.with_min_y(image.bottom() - STRIP));
    if above < below { Edge::Top } else { Edge::Bottom }
}

/// The screen areas that the card must not cover.
fn areas_to_avoid(trial: &Trial, trace: &StepTrace, transform: &Transform) -> Vec<Rect> {
    let ghost = trial.ghost.as_ref();
    let matched = trace.template().and_then(|e| e.match_template.as_ref());
    let windows = [matched.map(|m| m.search_window), ghost.and_then(|ghost| ghost.search_window)];
    let located = trace.located().and_then(|located| located.left_pixel);
    let pointing = trace.point_mast.predicted_left;
    let places: [Option<Pixel>; 4] =
        [located, pointing, trial.what_if.prediction_px, ghost.and_then(|ghost| ghost.left_pixel)];
    let windows = windows.into_iter().flatten().map(|window| transform.area(window).expand(2.0));
    let places = places.into_iter().flatten();
    windows
        .chain(
            places.map(|place| Rect::from_center_size(transform.to_screen(place), Vec2::splat(2.0 * ROOM))),
        )
        .collect()
}

/// The corner of `area` in which a card of this size covers no area to keep free; of several, the one farthest from these
/// areas. `None` if the card covers one in every corner, or does not fit.
pub(crate) fn corner(area: Rect, size: Vec2, to_avoid: &[Rect]) -> Option<Pos2> {
    if size.x > area.width() || size.y > area.height() {
        return None;
    }
    let (right, bottom) = (area.right() - size.x, area.bottom() - size.y);
    // Of equal corners the first is used, which is the default position of the card.
    let corners = [pos2(right, area.top()), area.min, pos2(right, bottom), pos2(area.left(), bottom)];
    let room = |at: Pos2| {
        let card = Rect::from_min_size(at, size);
        to_avoid.iter().map(|avoided| card.signed_distance(*avoided)).fold(f32::INFINITY, f32::min)
    };
    let mut best: Option<(f32, Pos2)> = None;
    for at in corners {
        let found = room(at);
        if found > 0.0 && best.is_none_or(|(known, _)| found > known + 1.0) {
            best = Some((found, at));
        }
    }
    best.map(|(_, at)| at)
}

/// Signed distance between two rectangles; negative if they overlap.
trait Apart {
    fn signed_distance(&self, other: Rect) -> f32;
}

impl Apart for Rect {
    fn signed_distance(&self, other: Rect) -> f32 {
        let gap =
            |low: f32, high: f32, other_low: f32, other_high: f32| (other_low - high).max(low - other_high);
        let x = gap(self.left(), self.right(), other.left(), other.right());
        let y = gap(self.top(), self.bottom(), other.top(), other.bottom());
        if x > 0.0 && y > 0.0 { x.hypot(y) } else { x.max(y) }
    }
}

fn id() -> egui::Id {
    egui::Id::unique("size of the what-if card")
}

/// The size of the card when it was last painted.
pub(crate) fn last_size(ui: &Ui, first: Vec2) -> Vec2 {
    ui.data(|data| data.get_temp(id())).unwrap_or(first)
}

/// Stores the size of the card.
pub(crate) fn remember(ui: &Ui, size: Vec2) {
    let before = last_size(ui, FIRST);
    ui.data_mut(|data| data.insert_temp(id(), size));
    if (before - size).length() > 1.0 {
        ui.ctx().request_repaint();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area() -> Rect {
        Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 300.0))
    }

    fn target(x: f32, y: f32) -> Rect {
        Rect::from_center_size(pos2(x, y), vec2(60.0, 60.0))
    }

    #[test]
    fn the_card_goes_to_the_corner_with_most_room() {
        let size = vec2(150.0, 100.0);
        assert_eq!(corner(area(), size, &[]), Some(pos2(250.0, 0.0)), "where it has always been");
        for (x, y) in [(330.0, 60.0), (60.0, 60.0), (60.0, 250.0), (340.0, 240.0)] {
            let at = corner(area(), size, &[target(x, y)]).unwrap();
            let card = Rect::from_min_size(at, size);
            assert!(!card.intersects(target(x, y)), "{card:?} covers the target at {x}, {y}");
            let expected = pos2(if x > 200.0 { 0.0 } else { 250.0 }, if y > 150.0 { 0.0 } else { 200.0 });
            assert_eq!(at, expected, "target at {x}, {y}");
        }
    }

    #[test]
    fn there_is_no_corner_if_each_covers_an_area_to_avoid() {
        let window = Rect::from_center_size(pos2(200.0, 150.0), vec2(380.0, 280.0));
        assert_eq!(corner(area(), vec2(150.0, 100.0), &[window]), None);
        assert_eq!(corner(area(), vec2(500.0, 20.0), &[]), None, "it does not fit at all");
    }

    #[test]
    fn a_strip_lies_along_the_edge_that_is_free() {
        assert_eq!(edge(area(), &[target(200.0, 60.0)]), Edge::Bottom);
        assert_eq!(edge(area(), &[target(200.0, 250.0)]), Edge::Top);
        let window = Rect::from_min_max(pos2(20.0, 40.0), pos2(380.0, 295.0));
        assert_eq!(edge(area(), &[window]), Edge::Top, "less of the window lies there");
    }
}
