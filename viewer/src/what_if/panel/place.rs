//! Where the card of a what-if lies: in the corner of the image with most room, never over the target or the search
//! window; where no corner is free, as a flat strip along the edge that covers less. The image keeps its place and size,
//! and while a handle is dragged the card keeps its own, so that nothing moves under the pointer.

use egui::{Pos2, Rect, Ui, Vec2, pos2, vec2};
use sightline_geometry::frames::Pixel;
use sightline_track::trace::StepTrace;

use crate::drawing::view2d::Transform;
use crate::state::State;
use crate::what_if::Trial;

/// Room that is left about what must not be covered, points.
const ROOM: f32 = 14.0;
/// Room between the card and the image's rim, points.
const RIM: f32 = 8.0;
/// How large the card is before it was painted, points.
const FIRST: Vec2 = vec2(230.0, 170.0);
/// How high a strip is at least, points.
pub(crate) const STRIP: f32 = 84.0;

/// Where the card lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// Over the image, with this corner of its upper left.
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

/// Where the card of the present trial lies over the image; none where nothing is tried.
pub(crate) fn of(ui: &Ui, state: &State, transform: &Transform) -> Option<Place> {
    let trial = state.trial()?;
    let trace = state.trace()?;
    let known = ui.data(|data| data.get_temp::<Place>(id().with("place")));
    if let Some(known) = known.filter(|_| ui.input(|input| input.pointer.any_down())) {
        return Some(known);
    }
    let kept = kept_free(trial, trace, transform);
    let image = transform.rect;
    let place = match corner(image.shrink(RIM), last_size(ui, FIRST), &kept) {
        Some(at) => Place::Over(at),
        None => Place::Strip(edge(image, &kept)),
    };
    ui.data_mut(|data| data.insert_temp(id().with("place"), place));
    Some(place)
}

/// The edge along which a strip covers less of what is kept free.
fn edge(image: Rect, kept: &[Rect]) -> Edge {
    let covered = |strip: Rect| {
        let shared = kept.iter().map(|kept| kept.intersect(strip)).filter(Rect::is_positive);
        shared.map(|shared| shared.area()).sum::<f32>()
    };
    let above = covered(image.with_max_y(image.top() + STRIP));
    let below = covered(image.with_min_y(image.bottom() - STRIP));
    if above < below { Edge::Top } else { Edge::Bottom }
}

/// What the card must not cover, on the screen.
fn kept_free(trial: &Trial, trace: &StepTrace, transform: &Transform) -> Vec<Rect> {
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

/// The corner of `area` in which something of that size covers nothing of what is kept free: of several the one that is
/// farthest from it. None where each covers something, or it does not fit at all.
pub(crate) fn corner(area: Rect, size: Vec2, kept: &[Rect]) -> Option<Pos2> {
    if size.x > area.width() || size.y > area.height() {
        return None;
    }
    let (right, bottom) = (area.right() - size.x, area.bottom() - size.y);
    // The first of equals is where the card has always been.
    let corners = [pos2(right, area.top()), area.min, pos2(right, bottom), pos2(area.left(), bottom)];
    let room = |at: Pos2| {
        let card = Rect::from_min_size(at, size);
        kept.iter().map(|kept| card.signed_distance(*kept)).fold(f32::INFINITY, f32::min)
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

/// How far two rectangles are from each other; negative where they share something.
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

/// How large the card was when it was painted last.
pub(crate) fn last_size(ui: &Ui, first: Vec2) -> Vec2 {
    ui.data(|data| data.get_temp(id())).unwrap_or(first)
}

/// Remembers it.
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
    fn where_every_corner_covers_something_there_is_none() {
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
