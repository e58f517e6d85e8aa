//! Playback: advances the cursor until the end of the drive, or until a breakpoint hits.
//!
//! The clock is passed in with every frame; nothing runs in the background. At single speed, playback waits briefly for a
//! step that is being loaded, so that it is shown.

use crate::breakpoints::play::{RATES, Shuttle};
use crate::cache::Slot;
use crate::state::State;

/// Maximum speed of repeated presses, as a multiple of the rate.
const FASTEST: i32 = 64;
/// Maximum time to wait for a step that is being loaded, s.
const PATIENCE_S: f64 = 1.0;
/// Interval between checks whether the step has been loaded, s.
const GLANCE_S: f64 = 0.03;
/// Maximum number of overdue steps per frame; further ones are dropped.
const AT_ONCE: usize = 64;

impl State {
    pub(crate) fn shuttle(&mut self, shuttle: Shuttle) {
        let step = self.cursor.step;
        let play = &mut self.breakpoints.play;
        match shuttle {
            Shuttle::Toggle if play.is_playing() => play.stop(),
            Shuttle::Toggle => self.start_playing(),
            Shuttle::Stop => play.stop(),
            Shuttle::Forward if play.speed > 0 => play.speed = (play.speed * 2).min(FASTEST),
            Shuttle::Forward => play.speed = 1,
            Shuttle::Reverse if play.speed < 0 => play.speed = (play.speed * 2).max(-FASTEST),
            Shuttle::Reverse => play.speed = -1,
            Shuttle::Rate(rate) if rate.is_finite() => play.rate = rate.clamp(*RATES.start(), *RATES.end()),
            Shuttle::Rate(_) => {}
            Shuttle::LoopIn => {
                play.loop_in = Some(step);
                play.loop_out = play.loop_out.filter(|out| *out >= step);
            }
            Shuttle::LoopOut => {
                play.loop_out = Some(step);
                play.loop_in = play.loop_in.filter(|begin| *begin <= step);
            }
            Shuttle::ClearLoop => (play.loop_in, play.loop_out) = (None, None),
        }
        // The new speed applies from the next tick.
        self.breakpoints.play.due_s = None;
    }

    /// Starts playing; at the end of the drive, from its beginning.
    fn start_playing(&mut self) {
        let (first, last) = self.range();
        if self.cursor.step >= last && !self.is_looping() {
            self.cursor.step = first;
        }
        self.breakpoints.play.speed = 1;
    }

    fn is_looping(&self) -> bool {
        self.breakpoints.play.loop_in.is_some() || self.breakpoints.play.loop_out.is_some()
    }

    /// The first and the last step to play: those of the loop, otherwise from the first stop to the last computed step.
    fn range(&self) -> (usize, usize) {
        let last = self.stop_count().saturating_sub(1);
        let computed = self.run().and_then(|run| run.rows.last()).map(|row| row.step);
        let end = computed.filter(|step| *step >= self.cursor.step).unwrap_or(last);
        let play = &self.breakpoints.play;
        (play.loop_in.unwrap_or(0).min(last), play.loop_out.unwrap_or(end).min(last))
    }

    /// Advances the playback to `now_s`. Returns the time of the next step, s; `None` while paused.
    pub fn tick(&mut self, now_s: f64) -> Option<f64> {
        if !self.breakpoints.play.is_playing() {
            return None;
        }
        let period_s = 1.0 / (self.breakpoints.play.rate * f64::from(self.breakpoints.play.speed.abs()));
        let mut due_s = self.breakpoints.play.due_s.unwrap_or(now_s + period_s);
        for _ in 0..AT_ONCE {
            if due_s > now_s {
                break;
            }
            if self.waits_for_step(now_s) {
                due_s = now_s + GLANCE_S;
                break;
            }
            self.play_step();
            if !self.breakpoints.play.is_playing() {
                return None;
            }
            due_s += period_s;
        }
        due_s = due_s.max(now_s);
        self.breakpoints.play.due_s = Some(due_s);
        Some(due_s)
    }

    /// Whether playback waits for the cursor's step, which is being loaded.
    fn waits_for_step(&mut self, now_s: f64) -> bool {
        let is_loading = self.row().is_some()
            && matches!(self.trace_at(self.cursor.step), Slot::Absent | Slot::Loading)
            && self.breakpoints.play.speed.abs() == 1;
        let play = &mut self.breakpoints.play;
        if !is_loading {
            play.waits_since_s = None;
            return false;
        }
        let since_s = *play.waits_since_s.get_or_insert(now_s);
        let waits = now_s - since_s < PATIENCE_S;
        if !waits {
            play.waits_since_s = None;
        }
        waits
    }

    /// Advances by one step in the direction of play.
    fn play_step(&mut self) {
        let (first, last) = self.range();
        let (step, is_forward) = (self.cursor.step, self.breakpoints.play.speed > 0);
        let at_end = if is_forward { step >= last } else { step <= first };
        let next = match (at_end, is_forward) {
            (true, _) if !self.is_looping() || first == last => {
                self.breakpoints.play.stop();
                return;
            }
            (true, true) => first,
            (true, false) => last,
            (false, true) => (step + 1).max(first),
            (false, false) => (step - 1).min(last),
        };
        self.cursor.step = next;
        let target = self.cursor.target;
        let hits = target.map(|target| self.hit_at(target, self.cursor.run, next)).unwrap_or_default();
        let hit = hits.join("`, `");
        if !hit.is_empty() {
            self.breakpoints.play.stop();
            self.messages.note(format!("Stopped at step {next}: `{hit}`."));
        }
    }
}
