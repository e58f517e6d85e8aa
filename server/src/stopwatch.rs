//! Measures the duration of a step's stages; the core has no clock.

use std::cell::RefCell;
use std::time::Instant;

use sightline_session::times::Took;
use sightline_track::cycle_stage::CycleStage;

/// Measures the stages of a step, each from the end of the previous one.
pub(crate) struct Stopwatch {
    last: RefCell<Instant>,
    took: RefCell<Took>,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self { last: RefCell::new(Instant::now()), took: RefCell::default() }
    }

    /// Records the end of a stage.
    pub(crate) fn ended(&self, stage: CycleStage) {
        let now = Instant::now();
        let before = self.last.replace(now);
        self.took.borrow_mut().0.push((stage, (now - before).as_secs_f64()));
    }

    /// The durations so far.
    pub(crate) fn took(self) -> Took {
        self.took.into_inner()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_takes_the_time_from_the_end_of_the_one_before() {
        let watch = Stopwatch::start();
        watch.ended(CycleStage::Predict);
        std::thread::sleep(std::time::Duration::from_millis(20));
        watch.ended(CycleStage::Capture);
        let took = watch.took();
        let [(first, first_s), (second, second_s)] = took.0[..] else { panic!("{took:?}") };
        assert_eq!((first, second), (CycleStage::Predict, CycleStage::Capture));
        assert!(first_s >= 0.0 && second_s >= 0.02, "{took:?}");
        assert_eq!(took, Took::default(), "times make no difference");
    }
}
