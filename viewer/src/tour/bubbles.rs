//! The bubble of the tour, placed beside its anchor.

use egui::{Area, Frame, Id, Margin, Order, Pos2, Rect, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};

use crate::command::Command;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::theme;
use crate::tour::{Bubble, Turn, place};

/// Width of a bubble, points.
const WIDTH: f32 = 320.0;
/// Maximum size of a bubble, points; used only to place it.
const SIZE: Vec2 = vec2(WIDTH + 28.0, 190.0);
/// Distance between a bubble and its anchor, points.
const GAP: f32 = 10.0;

/// Shows the open bubble, if one is open.
pub(crate) fn show(ui: &Ui, state: &State, out: &mut Vec<Command>) {
    let (Some(at), Some(bubble)) = (state.tour.at, state.tour.bubble()) else { return };
    // A dialog is in front; the bubble reappears once it is closed.
    if state.files.is_open || state.exports.is_open {
        return;
    }
    let context = ui.ctx();
    let screen = context.content_rect();
    let shown = bubble.anchors().iter().filter(|name| has_content(state, name));
    let anchor = shown.into_iter().find_map(|name| place(context, name));
    if let Some(anchor) = anchor {
        let layer = egui::LayerId::new(Order::Foreground, Id::unique("tour outline"));
        let painter = context.layer_painter(layer);
        painter.rect_stroke(anchor.shrink(1.0), 4.0, Stroke::new(2.0, theme::accent()), StrokeKind::Inside);
    }
    Area::new(Id::unique("tour")).order(Order::Foreground).fixed_pos(corner(anchor, screen)).show(
        context,
        |ui| {
            let frame = Frame::new()
                .fill(theme::bar())
                .stroke(Stroke::new(1.0, theme::accent()))
                .corner_radius(6.0)
                .inner_margin(Margin::same(12));
            frame.show(ui, |ui| contents(ui, at, bubble, state, out));
        },
    );
}

/// Whether an anchor has content: an empty panel shows only what it lacks.
fn has_content(state: &State, name: &str) -> bool {
    let pane = Pane::ALL.into_iter().find(|pane| pane.title() == name);
    pane.is_none_or(|pane| pane.panel().missing(state).is_none())
}

fn contents(ui: &mut Ui, at: usize, bubble: Bubble, state: &State, out: &mut Vec<Command>) {
    let count = Bubble::ALL.len();
    ui.set_width(WIDTH.min(ui.ctx().content_rect().width() - 40.0));
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new(bubble.title()).heading().color(theme::accent()));
        ui.label(theme::note(format!("{} of {count}", at + 1)));
    });
    ui.add(egui::Label::new(bubble.words(state)).wrap());
    ui.add_space(6.0);
    ui.horizontal(|ui| {
        let button = |ui: &mut Ui, words: &str, help: &str| {
            ui.add(egui::Button::new(words).min_size(vec2(56.0, 26.0))).on_hover_text(help).clicked()
        };
        let is_last = at + 1 == count;
        if button(ui, if is_last { "Done" } else { "Next" }, "Enter") {
            out.push(Command::Tour(Turn::Next));
        }
        if at > 0 && button(ui, "Back", "Backspace") {
            out.push(Command::Tour(Turn::Back));
        }
        if !is_last && button(ui, "Skip", "Esc; the sheet behind the question mark begins it again") {
            out.push(Command::Tour(Turn::End));
        }
    });
}

/// The bubble's corner: above, below or beside the anchor, where there is room; otherwise the bubble is centred on the
/// screen.
fn corner(anchor: Option<Rect>, screen: Rect) -> Pos2 {
    let middle = screen.center() - SIZE / 2.0;
    let Some(anchor) = anchor else { return middle };
    let along_x = (anchor.center().x - SIZE.x / 2.0)
        .clamp(screen.left() + GAP, (screen.right() - SIZE.x - GAP).max(screen.left()));
    let along_y = (anchor.center().y - SIZE.y / 2.0)
        .clamp(screen.top() + GAP, (screen.bottom() - SIZE.y - GAP).max(screen.top()));
    if anchor.top() - SIZE.y - GAP > screen.top() {
        pos2(along_x, anchor.top() - SIZE.y - GAP)
    } else if anchor.bottom() + SIZE.y + GAP < screen.bottom() {
        pos2(along_x, anchor.bottom() + GAP)
    } else if anchor.left() - SIZE.x - GAP > screen.left() {
        pos2(anchor.left() - SIZE.x - GAP, along_y)
    } else if anchor.right() + SIZE.x + GAP < screen.right() {
        pos2(anchor.right() + GAP, along_y)
    } else {
        middle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_places_with_content_are_pointed_at() {
        let without = crate::tests::fixture::without_target();
        let with = crate::tests::fixture::at_step(&egui::Context::default(), 3);
        assert!(!has_content(&without, "Gates") && has_content(&with, "Gates"));
        assert!(has_content(&without, crate::tour::TIMELINE));
    }

    #[test]
    fn a_bubble_never_covers_its_place_where_there_is_room_and_never_leaves_the_screen() {
        let screen = Rect::from_min_size(Pos2::ZERO, vec2(1280.0, 720.0));
        for anchor in [
            Rect::from_min_size(pos2(0.0, 600.0), vec2(1280.0, 80.0)),
            Rect::from_min_size(pos2(0.0, 0.0), vec2(1280.0, 34.0)),
            Rect::from_min_size(pos2(1020.0, 34.0), vec2(260.0, 560.0)),
            Rect::from_min_size(pos2(0.0, 34.0), vec2(220.0, 560.0)),
        ] {
            let bubble = Rect::from_min_size(corner(Some(anchor), screen), SIZE);
            assert!(screen.contains_rect(bubble), "{bubble:?}");
            assert!(!bubble.intersects(anchor), "{anchor:?}: {bubble:?}");
        }
        assert_eq!(corner(None, screen), screen.center() - SIZE / 2.0);
    }
}
