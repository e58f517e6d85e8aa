//! The tour: six bubbles that lead a new user from a lost target to a saved one. It never blocks the page.
//!
//! A bubble points at a place by its name; panels and bars say in every frame where they are ([`here`]). Where the place is not
//! on the screen, the bubble stands in the middle, and its sentence still says what to look for.

pub(crate) mod bubbles;
pub(crate) mod update;
mod words;

use egui::{Context, Id, Rect};

/// Under which name the browser remembers that the tour was seen.
#[cfg(target_arch = "wasm32")]
const SEEN: &str = "sightline.tour";

/// What the place of the timeline is called.
pub(crate) const TIMELINE: &str = "timeline";
/// What the place of the top bar is called.
pub(crate) const TOP: &str = "top bar";

/// What a person asks of the tour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// From the first bubble on.
    Begin,
    /// The next bubble; after the last it ends.
    Next,
    /// The bubble before.
    Back,
    /// Ends it.
    End,
}

/// Where the tour is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tour {
    /// The bubble that is open, from 0.
    pub at: Option<usize>,
    /// Whether it was seen or skipped before.
    pub is_seen: bool,
    /// Whether the loss of the first drive was shown without the tour, or the cursor was elsewhere.
    pub has_shown_loss: bool,
}

impl Tour {
    /// Goes on as asked.
    pub fn turn(&mut self, turn: Turn) {
        self.at = match (turn, self.at) {
            (Turn::Begin, _) => Some(0),
            (Turn::Next, Some(at)) => Some(at + 1).filter(|next| *next < Bubble::ALL.len()),
            (Turn::Back, Some(at)) => Some(at.saturating_sub(1)),
            (Turn::End, _) | (_, None) => None,
        };
        self.is_seen |= self.at.is_none();
    }

    /// The open bubble.
    pub fn bubble(&self) -> Option<Bubble> {
        self.at.and_then(|at| Bubble::ALL.get(at)).copied()
    }
}

/// The bubbles in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bubble {
    /// Step along the drive.
    Step,
    /// See the target lost.
    Lost,
    /// Why it was lost.
    Why,
    /// What would have saved it.
    WhatIf,
    /// Compare the two runs.
    Compare,
    /// Share what was found.
    Share,
}

impl Bubble {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Step, Self::Lost, Self::Why, Self::WhatIf, Self::Compare, Self::Share];

    /// Its title.
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

    /// The places it points at, the best first.
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

/// Whether the tour was seen on an earlier visit; outside a browser nothing remembers it, and it waits to be asked for.
pub(crate) fn was_seen() -> bool {
    #[cfg(target_arch = "wasm32")]
    return crate::page::web::kept(SEEN).is_some();
    #[cfg(not(target_arch = "wasm32"))]
    true
}

/// Remembers that the tour was seen.
pub(crate) fn remember_seen() {
    #[cfg(target_arch = "wasm32")]
    crate::page::web::keep(SEEN, "yes");
}

/// A place says where it is in this frame.
pub(crate) fn here(context: &Context, name: &str, rect: Rect) {
    let frame = context.cumulative_pass_nr();
    context.data_mut(|data| data.insert_temp(id(name), (frame, rect)));
}

/// Where a place is, if it was on the screen in this frame or the one before.
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
