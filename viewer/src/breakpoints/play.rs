//! How the steps play: forwards and backwards at a rate that the person sets, within a loop.

/// The rates that can be set, steps a second.
pub(crate) const RATES: std::ops::RangeInclusive<f64> = 0.5..=60.0;

/// What plays, stops and loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shuttle {
    /// Plays forwards, or pauses what plays.
    Toggle,
    /// Plays backwards; again: twice as fast.
    Reverse,
    /// Stops.
    Stop,
    /// Plays forwards; again: twice as fast.
    Forward,
    /// Steps a second at single speed.
    Rate(f64),
    /// The loop begins at this step.
    LoopIn,
    /// The loop ends at this step.
    LoopOut,
    /// There is no loop any more.
    ClearLoop,
}

/// How time is travelled.
#[derive(Clone, Debug, PartialEq)]
pub struct Play {
    /// How many times the rate, and in which direction; 0 while it is paused.
    pub speed: i32,
    /// Steps a second at single speed.
    pub rate: f64,
    /// The first step of the loop.
    pub loop_in: Option<usize>,
    /// The last step of the loop.
    pub loop_out: Option<usize>,
    pub(super) due_s: Option<f64>,
    pub(super) waits_since_s: Option<f64>,
}

impl Default for Play {
    fn default() -> Self {
        Self { speed: 0, rate: 4.0, loop_in: None, loop_out: None, due_s: None, waits_since_s: None }
    }
}

impl Play {
    /// Whether it plays.
    pub fn is_playing(&self) -> bool {
        self.speed != 0
    }

    /// When the next step is due, s; none while it is paused.
    pub(crate) fn due_s(&self) -> Option<f64> {
        self.due_s.filter(|_| self.is_playing())
    }

    /// How it plays, in words.
    pub fn in_words(&self) -> String {
        match self.speed {
            0 => "paused".to_owned(),
            speed => {
                let way = if speed > 0 { "forward" } else { "reverse" };
                format!("{way} ×{}, {} steps/s", speed.abs(), self.rate * f64::from(speed.abs()))
            }
        }
    }

    /// Paused and without a loop, at the rate that was set.
    pub(crate) fn forget(&mut self) {
        *self = Self { rate: self.rate, ..Self::default() };
    }

    pub(super) fn stop(&mut self) {
        (self.speed, self.due_s, self.waits_since_s) = (0, None, None);
    }
}
