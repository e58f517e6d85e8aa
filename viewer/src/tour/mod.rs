//! The tour: six bubbles that lead a new user from a lost target to a saved one. It never blocks the page.
//!
//! A bubble points at an anchor, which has a name; panels and bars report their rectangles in every frame ([`here`]). If
//! the anchor is not on the screen, the bubble is centred and its sentence describes where to find it.

pub(crate) mod bubbles;
pub(crate) mod update;
mod words;

use egui::{Context, Id, Rect};

/// Storage key that records that the user has seen the tour.
#[cfg(target_arch = "wasm32")]
const SEEN: &str = "sightline.tour";

/// Anchor name of the timeline.
pub(crate) const TIMELINE: &str = "timeline";
/// Anchor name of the top bar.
pub(crate) const TOP: &str = "top bar";

/// A command about the tour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Starts at the first bubble.
    Begin,
    /// Shows the next bubble; after the last one, ends the tour.
    Next,
    /// Shows the previous bubble.
    Back,
    /// Ends the tour.
    End,
}

/// State of the tour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tour {
    /// Index of the open bubble, from 0.
    pub at: Option<usize>,
    /// Whether the user has seen or skipped the tour before.
    pub is_seen: bool,
    /// Whether the loss on the first drive was shown without the tour, or the cursor was elsewhere.
    pub has_shown_loss: bool,
}

impl Tour {
    /// Carries out a command.
    pub fn turn(&mut self, turn: Turn) {
        self.at = match (turn, self.at) {
            (Turn::Begin, _) => Some(0),
            (Turn::Next, Some(at)) => Some(at + 1).filter(|next| *next < Bubble::ALL.len()),
            (Turn::Back, Some(at)) => Some(at.saturating_sub(1)),
            (Turn::End, _) | (_, None) => None,
        };
        self.is_seen |= self.at.is_none();
    }

    /// The open bubble; `None` while the tour is closed.
    pub fn bubble(&self) -> Option<Bubble> {
        self.at.and_then(|at| Bubble::ALL.get(at)).copied()
    }
}

/// The bubbles, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bubble {
    /// Step along the drive.
    Step,
    /// See the target lost.
    Lost,
    /// Why it was lost.
    Why,
    /// The counterfactuals of the loss.
    WhatIf,
    /// Compare the two runs.
    Compare,
    /// Share the findings.
    Share,
}

impl Bubble {
    /// All bubbles, in order.
    pub const ALL: [Self; 6] = [Self::Step, Self::Lost, Self::Why, Self::WhatIf, Self::Compare, Self::Share];

    /// The title of the bubble.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Step => "Step",
            Self::Lost => "See it lost",
            Self::Why => "Why",
            Self::WhatIf => "What if",
            Self::Compare => "Compare",
            Self::Share => "Share",
        }
    }

    /// The anchors of the bubble, best first.
    pub const fn anchors(self) -> &'static [&'static str] {
        match self {
            Self::Step | Self::Lost => &[TIMELINE],
            Self::Why => &["Why", "Gates", "Inspector"],
            Self::WhatIf => &["Why", "Gates", "Inspector"],
            Self::Compare => &[TOP, "Targets and runs"],
            Self::Share => &[TOP],
        }
    }
}

/// Whether the tour was seen on an earlier visit. Outside a browser this is not stored, and the tour does not start by
/// itself.
pub(crate) fn was_seen() -> bool {
    #[cfg(target_arch = "wasm32")]
    return crate::page::web::stored_item(SEEN).is_some();
    #[cfg(not(target_arch = "wasm32"))]
    true
}

/// Stores that the tour was seen.
pub(crate) fn remember_seen() {
    #[cfg(target_arch = "wasm32")]
    crate::page::web::store_item(SEEN, "yes");
}

/// Reports the rectangle of an anchor in this frame.
pub(crate) fn here(context: &Context, name: &str, rect: Rect) {
    let frame = context.cumulative_pass_nr();
    context.data_mut(|data| data.insert_temp(id(name), (frame, rect)));
}

/// The rectangle of an anchor, if it was on the screen in this frame or the previous one.
pub(crate) fn place(context: &Context, name: &str) -> Option<Rect> {
    let (frame, rect) = context.data(|data| data.get_temp::<(u64, Rect)>(id(name)))?;
    (context.cumulative_pass_nr() <= frame + 1).then_some(rect)
}

fn id(name: &str) -> Id {
    Id::unique("place").with(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tour_has_six_bubbles_and_is_seen_when_it_ends_either_way() {
        let mut tour = Tour::default();
        tour.turn(Turn::Next);
        assert_eq!((tour.at, tour.bubble()), (None, None));
        let mut tour = Tour::default();
        tour.turn(Turn::Begin);
        let mut titles = Vec::new();
        while let Some(bubble) = tour.bubble() {
            titles.push(bubble.title());
            tour.turn(Turn::Next);
        }
        assert_eq!(titles, ["Step", "See it lost", "Why", "What if", "Compare", "Share"]);
        assert!(tour.is_seen);
        tour.turn(Turn::Begin);
        tour.turn(Turn::Next);
        tour.turn(Turn::Back);
        assert_eq!(tour.bubble(), Some(Bubble::Step));
        let mut skipped = Tour { at: Some(2), ..Tour::default() };
        skipped.turn(Turn::End);
        assert!(skipped.is_seen && skipped.at.is_none());
    }
}
