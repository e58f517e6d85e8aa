//! Parses the destination of “Go to step”: a number, an offset, a time, or the name of an event.

use crate::state::{State, events};

/// The named events, in the order of the list.
pub(crate) const EVENTS: [&str; 8] = ["lost", "failed", "tracking", "fault", "pick", "event", "hit", "worst"];

/// Description of the accepted input.
pub(crate) const FORMS: &str =
    "12, +5, -3, first, last, t=3.5, or lost, failed, tracking, fault, pick, event, hit, worst";

impl State {
    /// The step that `text` describes.
    ///
    /// # Errors
    /// A sentence that explains why `text` describes no step.
    pub fn step_meant(&self, text: &str) -> Result<usize, String> {
        let last = self.stop_count().checked_sub(1).ok_or_else(|| self.missing_target())?;
        let text = text.trim().to_lowercase();
        let by = |digits: &str| digits.trim().parse::<usize>().map_err(|_| not_a_step(&text));
        if let Some(on) = text.strip_prefix('+') {
            return Ok(self.cursor.step.saturating_add(by(on)?).min(last));
        }
        if let Some(back) = text.strip_prefix(['-', '−']) {
            return Ok(self.cursor.step.saturating_sub(by(back)?));
        }
        if let Some(time) =
            text.strip_prefix('t').map(str::trim_start).and_then(|rest| rest.strip_prefix('='))
        {
            return self.step_at_time(time);
        }
        match text.as_str() {
            "first" => Ok(0),
            "last" | "end" => Ok(last),
            word if EVENTS.contains(&word) => self.step_of_event(word),
            number => match number.parse::<usize>() {
                Ok(step) if step <= last => Ok(step),
                Ok(step) => Err(format!("Step {step} does not exist: the last one is {last}.")),
                Err(_) => Err(not_a_step(&text)),
            },
        }
    }

    /// The stop nearest to a time after the first one, s.
    fn step_at_time(&self, text: &str) -> Result<usize, String> {
        let number = text.trim().trim_end_matches('s').trim();
        let time_s: f64 =
            number.parse().map_err(|_| format!("`{number}` is not a time in seconds, as in t=3.5."))?;
        let stops = self.traverse.as_ref().map(|traverse| traverse.stops.as_slice()).unwrap_or_default();
        let gap = |step: &usize| (stops[*step].time_s - time_s).abs();
        let nearest = (0..stops.len()).min_by(|a, b| gap(a).total_cmp(&gap(b)));
        nearest.filter(|_| time_s.is_finite()).ok_or_else(|| not_a_step(text))
    }

    /// The next step after the cursor at which an event occurs; if there is none, the first one at all.
    fn step_of_event(&self, word: &str) -> Result<usize, String> {
        let run = self.run().ok_or_else(|| self.missing_target())?;
        let step = self.cursor.step;
        let at = |row: &sightline_session::step::StepRow| row.step;
        let mut steps: Vec<usize> = match word {
            "pick" => run.rows.first().map(at).into_iter().collect(),
            "fault" => run.rows.iter().filter(|row| row.fault).map(at).collect(),
            "event" => events(run),
            "hit" => {
                let next = self.hit_from(step, true).or_else(|| self.hit_from(0, true));
                next.into_iter().collect()
            }
            "worst" => {
                let errors = run.rows.iter().filter_map(|row| Some((row.step, row.err_px?)));
                errors.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(step, _)| step).into_iter().collect()
            }
            state => {
                let enters =
                    run.rows.windows(2).filter(|pair| pair[1].state == state && pair[0].state != state);
                enters.map(|pair| pair[1].step).collect()
            }
        };
        let next = steps.iter().position(|found| *found > step).unwrap_or(0);
        if steps.is_empty() {
            return Err(match word {
                "fault" => "No stop of this run has damaged files.".to_owned(),
                "hit" => "No breakpoint is hit in this run.".to_owned(),
                "worst" => "The worst step needs the truth, which this drive does not have.".to_owned(),
                "pick" | "event" => "This run has no step yet.".to_owned(),
                state => format!("This run is never in the state {state}."),
            });
        }
        Ok(steps.swap_remove(next))
    }
}

fn not_a_step(text: &str) -> String {
    if text.is_empty() { format!("Type {FORMS}.") } else { format!("`{text}` is not a step: type {FORMS}.") }
}
