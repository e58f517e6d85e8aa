//! Playback of the steps: forwards or backwards at the user's rate, within a loop.

/// The allowed rates, steps/s.
pub(crate) const RATES: std::ops::RangeInclusive<f64> = 0.5..=60.0;

/// A command of the playback.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shuttle {
    /// Plays forwards, or pauses.
    Toggle,
    /// Plays backwards; repeated: twice as fast.
    Reverse,
    /// Stops.
    Stop,
    /// Plays forwards; repeated: twice as fast.
    Forward,
    /// Sets the rate at single speed, steps/s.
    Rate(f64),
    /// Starts the loop at the cursor's step.
    LoopIn,
    /// Ends the loop at the cursor's step.
    LoopOut,
    /// Removes the loop.
    ClearLoop,
}

/// The state of the playback.
#[derive(Clone, Debug, PartialEq)]
pub struct Play {
    /// Multiple of the rate, negative for backwards; 0 while paused.
    pub speed: i32,
    /// Rate at single speed, steps/s.
    pub rate: f64,
    /// First step of the loop; `None`: the first stop.
    pub loop_in: Option<usize>,
    /// Last step of the loop; `None`: the last computed step.
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
    /// Whether it is not paused.
    pub fn is_playing(&self) -> bool {
        self.speed != 0
    }

    /// Time of the next step, s; `None` while paused.
    pub(crate) fn due_s(&self) -> Option<f64> {
        self.due_s.filter(|_| self.is_playing())
    }

    /// The state as words.
    pub fn in_words(&self) -> String {
        match self.speed {
            0 => "paused".to_owned(),
            speed => {
                let way = if speed > 0 { "forward" } else { "reverse" };
                format!("{way} ×{}, {} steps/s", speed.abs(), self.rate * f64::from(speed.abs()))
            }
        }
    }

    /// Resets everything except the rate.
    pub(crate) fn forget(&mut self) {
        *self = Self { rate: self.rate, ..Self::default() };
    }

    pub(super) fn stop(&mut self) {
        (self.speed, self.due_s, self.waits_since_s) = (0, None, None);
    }
}
