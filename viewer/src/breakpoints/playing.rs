//! Lets time pass: plays the steps until the end of the drive, or until a breakpoint hits.
//!
//! Nothing plays by itself. The clock comes in with every frame; a step that is still being loaded is waited for, a
//! little, while it plays at single speed, so that what was asked for is seen.

use crate::breakpoints::play::{RATES, Shuttle};
use crate::cache::Slot;
use crate::state::State;

/// The fastest that repeated presses lead to.
const FASTEST: i32 = 64;
/// How long a step that is being loaded is waited for, s.
const PATIENCE_S: f64 = 1.0;
/// How often it is looked for meanwhile, s.
const GLANCE_S: f64 = 0.03;
/// Steps that are made up for in one frame; what is later than that is let go.
const AT_ONCE: usize = 64;

impl State {
    pub(crate) fn shuttle(&mut self, shuttle: Shuttle) {
        let step = self.cursor.step;
        let play = &mut self.ask.play;
        match shuttle {
            Shuttle::Toggle if play.is_playing() => play.stop(),
            Shuttle::Toggle => self.begin_to_play(),
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
        // A new speed counts from now on.
        self.ask.play.due_s = None;
    }

    /// Plays; at the end of the drive from its beginning.
    fn begin_to_play(&mut self) {
        let (first, last) = self.range();
        if self.cursor.step >= last && !self.is_looping() {
            self.cursor.step = first;
        }
        self.ask.play.speed = 1;
    }

    fn is_looping(&self) -> bool {
        self.ask.play.loop_in.is_some() || self.ask.play.loop_out.is_some()
    }

    /// The first and the last step that are played: the loop's, or the drive's as far as the run has come.
    fn range(&self) -> (usize, usize) {
        let last = self.stop_count().saturating_sub(1);
        let computed = self.run().and_then(|run| run.rows.last()).map(|row| row.step);
        let end = computed.filter(|step| *step >= self.cursor.step).unwrap_or(last);
        let play = &self.ask.play;
        (play.loop_in.unwrap_or(0).min(last), play.loop_out.unwrap_or(end).min(last))
    }

    /// Lets the time pass until `now_s`. Returns when the next step is due.
    pub fn tick(&mut self, now_s: f64) -> Option<f64> {
        if !self.ask.play.is_playing() {
            return None;
        }
        let period_s = 1.0 / (self.ask.play.rate * f64::from(self.ask.play.speed.abs()));
        let mut due_s = self.ask.play.due_s.unwrap_or(now_s + period_s);
        for _ in 0..AT_ONCE {
            if due_s > now_s {
                break;
            }
            if self.waits_for_step(now_s) {
                due_s = now_s + GLANCE_S;
                break;
            }
            self.play_step();
            if !self.ask.play.is_playing() {
                return None;
            }
            due_s += period_s;
        }
        due_s = due_s.max(now_s);
        self.ask.play.due_s = Some(due_s);
        Some(due_s)
    }

    /// Whether the step that is shown is not loaded yet and worth waiting for.
    fn waits_for_step(&mut self, now_s: f64) -> bool {
        let is_loading = self.row().is_some()
            && matches!(self.trace_at(self.cursor.step), Slot::Absent | Slot::Loading)
            && self.ask.play.speed.abs() == 1;
        let play = &mut self.ask.play;
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

    /// One step in the direction of play.
    fn play_step(&mut self) {
        let (first, last) = self.range();
        let (step, is_forward) = (self.cursor.step, self.ask.play.speed > 0);
        let at_end = if is_forward { step >= last } else { step <= first };
        let next = match (at_end, is_forward) {
            (true, _) if !self.is_looping() || first == last => {
                self.ask.play.stop();
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
            self.ask.play.stop();
            self.messages.note(format!("Stopped at step {next}: `{hit}`."));
        }
    }
}
