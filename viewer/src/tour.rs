//! The tour: six bubbles that lead a new user from a lost target to a saved one. It never blocks the page.
//!
//! A bubble points at a place by its name; panels and bars say in every frame where they are ([`here`]). Where the place is not
//! on the screen, the bubble stands in the middle, and its sentence still says what to look for.

use egui::{Context, Id, Key, Rect};

use crate::command::Mode;
use crate::layout::Pane;
use crate::state::{State, events};

/// Under which name the browser remembers that the tour was seen.
#[cfg(target_arch = "wasm32")]
const SEEN: &str = "sightline.tour";

/// What the place of the timeline is called.
pub const TIMELINE: &str = "timeline";
/// What the place of the top bar is called.
pub const TOP: &str = "top bar";

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
            Self::WhatIf => &["Why", "Settings", "Targets and runs"],
            Self::Compare => &["Compare", "Compare runs", "Targets and runs"],
            Self::Share => &[TOP],
        }
    }

    /// What it says of what is there.
    pub fn words(self, state: &State) -> String {
        let has = |title: &str| Pane::ALL.iter().any(|pane| pane.title() == title);
        match self {
            Self::Step => format!(
                "A rover drives towards a rock and finds one point of it again at each of {} stops. Right and Left go \
                 from stop to stop, End to the last; the band shows how each ended.",
                state.stop_count()
            ),
            Self::Lost => lost_words(state),
            Self::Why if has("Why") => "At the stop where it was lost, the panel Why goes back from the verdict to \
                what made it, and names what would have had to be otherwise. The panel Gates has every criterion with \
                its value, limit and margin."
                .to_owned(),
            Self::Why => "At the stop where it was lost, the panel Gates has every criterion with its value, limit \
                and margin. In the left image, compare the predicted point and its search window with the truth."
                .to_owned(),
            Self::WhatIf => "Would another setting have saved it? Go to the stop where it was lost, open the panel \
                Settings, give search_window_px a larger value, such as 201, and press R: a new run leaves from there. Nothing that \
                was recorded is overwritten."
                .to_owned(),
            Self::Compare if has("Compare") || has("Compare runs") => "Each run has its letter. The panel Targets and \
                runs switches between them, and the panel Compare lays two beside each other."
                .to_owned(),
            Self::Compare => "Each run has its letter. In the panel Targets and runs, a click on one shows it \
                everywhere; step through both and see where they part."
                .to_owned(),
            Self::Share => "The address of this page opens what you see now, and Export .rrd downloads the session \
                as a Rerun recording. The sheet behind the question mark has all keys, and this tour."
                .to_owned(),
        }
    }
}

/// Where the target is lost, as far as that is known.
fn lost_words(state: &State) -> String {
    let lost = state.run().and_then(|run| {
        let is_lost = |step: &usize| state.row_at(*step).is_some_and(|row| row.state == "lost");
        events(run).into_iter().find(is_lost)
    });
    match (lost, state.run_progress(), state.target()) {
        (Some(step), ..) => {
            format!(
                "The target is lost at step {step}. PgDn goes to the next event, PgUp back to the one before."
            )
        }
        (None, Some(progress), _) => format!(
            "The run is still being computed ({} of {} stops). A loss appears in the band in another colour and \
             pattern; PgDn goes to the next event.",
            progress.k, progress.n
        ),
        (None, None, Some(_)) => {
            "No loss in this run. PgDn goes from event to event, wherever a state changes.".to_owned()
        }
        (None, None, None) => {
            "Without a target there is nothing to lose: press T and click a rock in the left image."
                .to_owned()
        }
    }
}

/// What a key asks of the open tour; keys that mean something else to a panel with the focus are left to it.
pub fn of_key(key: Key, state: &State) -> Option<Turn> {
    if state.tour.at.is_none() || state.mode != Mode::Look {
        return None;
    }
    match key {
        Key::Enter => Some(Turn::Next),
        Key::Backspace => Some(Turn::Back),
        Key::Escape => Some(Turn::End),
        _ => None,
    }
}

/// Whether the tour was seen on an earlier visit; outside a browser nothing remembers it, and it waits to be asked for.
pub fn was_seen() -> bool {
    #[cfg(target_arch = "wasm32")]
    return crate::web::recall(SEEN).is_some();
    #[cfg(not(target_arch = "wasm32"))]
    true
}

/// Remembers that the tour was seen.
pub fn remember_seen() {
    #[cfg(target_arch = "wasm32")]
    crate::web::remember(SEEN, "yes");
}

/// A place says where it is in this frame.
pub fn here(context: &Context, name: &str, rect: Rect) {
    let frame = context.cumulative_pass_nr();
    context.data_mut(|data| data.insert_temp(id(name), (frame, rect)));
}

/// Where a place is, if it was on the screen in this frame or the one before.
pub fn place(context: &Context, name: &str) -> Option<Rect> {
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
        let mut skipped = Tour { at: Some(2), is_seen: false };
        skipped.turn(Turn::End);
        assert!(skipped.is_seen && skipped.at.is_none());
    }
}
