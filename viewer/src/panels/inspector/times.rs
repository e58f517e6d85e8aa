//! The times of the selected stage and of the whole stop, on the flight processor and on this server.

use sightline_session::times::StageTime;
use sightline_track::cycle_stage::CycleStage;

use crate::state::State;

/// The help of the line.
pub(super) const HELP: &str = "On Mars: by the model of the flown processor of 20 MHz, with the transfer of the images and the drive. Here: \
     as measured when this server computed the step.";

/// The line for the cursor's step; `None` until the times are loaded.
pub(super) fn line(state: &State) -> Option<String> {
    let times = state.step_key(state.cursor.step).and_then(|key| state.cache.times(&key))?;
    Some(words(times, state.stage().in_cycle()))
}

fn words(times: &[StageTime], stage: CycleStage) -> String {
    let of_stage = times.iter().find(|time| time.stage == stage);
    let flight_s: f64 = times.iter().map(|time| time.flight_s).sum();
    let own_s: Vec<f64> = times.iter().filter_map(|time| time.own_s).collect();
    let here = |own_s: Option<f64>| {
        own_s.map_or_else(String::new, |own_s| format!(", {} here", milliseconds(own_s)))
    };
    let whole_s = (!own_s.is_empty()).then(|| own_s.iter().sum());
    let whole = format!("the stop: {} s on Mars{}", short(flight_s), here(whole_s));
    match of_stage {
        Some(time) => format!("this stage: {} s on Mars{}; {whole}", short(time.flight_s), here(time.own_s)),
        None => whole,
    }
}

fn milliseconds(time_s: f64) -> String {
    format!("{} ms", short(1e3 * time_s))
}

/// One decimal below ten, none from there on.
fn short(value: f64) -> String {
    if value < 9.95 { format!("{value:.1}") } else { format!("{value:.0}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_the_stage_and_the_sum_of_all() {
        let time = |stage, flight_s, own_s| StageTime { stage, flight_s, own_s };
        let times = [
            time(CycleStage::Predict, 0.0, Some(0.000_02)),
            time(CycleStage::Capture, 7.5, Some(0.040)),
            time(CycleStage::Locate, 5.0, Some(0.010_98)),
            time(CycleStage::Drive, 20.4, None),
        ];
        let line = words(&times, CycleStage::Capture);
        assert_eq!(line, "this stage: 7.5 s on Mars, 40 ms here; the stop: 33 s on Mars, 51 ms here");
        assert!(words(&times, CycleStage::Drive).starts_with("this stage: 20 s on Mars; "));
        assert!(words(&times, CycleStage::SetGoal).starts_with("the stop: 33 s"));
    }
}
