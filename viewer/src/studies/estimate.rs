//! The duration of a study: before its start from its size, while it runs from the completed fraction.

use sightline_study::wire::{NewStudy, StudyInfo, StudyJob, StudyState};

use crate::panels::numbers::counted as count;
use crate::studies::WORLDS;

/// Time for a world with its images on two cores, s; replaced by measured jobs of this server.
const WORLD_S: f64 = 15.0;
/// Time for one configuration at one point in one world on two cores, s.
const UNIT_S: f64 = 5.0;
/// Minimum completed fraction for which the remaining time is shown.
const SHARE_MIN: f64 = 0.03;

/// Size and duration of a study that has not been started.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    /// Number of configurations.
    pub configurations: usize,
    /// Number of points of the grid.
    pub points: usize,
    /// Number of worlds of each scenario.
    pub worlds: usize,
    /// Expected duration, s.
    pub seconds: f64,
}

impl Estimate {
    /// The estimate for a request; `jobs` are the earlier studies on this server.
    pub(super) fn of(new: &NewStudy, info: &StudyInfo, jobs: &[StudyJob]) -> Self {
        let values = if new.grid.is_empty() { info.grid.len() } else { new.grid.len() };
        let worlds =
            if new.seeds.is_empty() { new.worlds.unwrap_or(WORLDS) as usize } else { new.seeds.len() };
        let points = values.max(1) * info.points_per_value.max(1);
        let units = (new.configurations.len() * points * worlds) as f64;
        let scenarios = if new.grid.is_empty() { info.scenarios.len().max(1) } else { 1 };
        let seconds = measured(jobs, &info.name).map_or_else(
            || (worlds * scenarios) as f64 * WORLD_S + units * UNIT_S,
            |seconds_per_unit| units * seconds_per_unit,
        );
        Self { configurations: new.configurations.len(), points, worlds, seconds }
    }

    /// Number of runs; one run covers all targets of a world.
    pub(super) fn units(&self) -> usize {
        self.configurations * self.points * self.worlds
    }

    /// The estimate on one line.
    pub(super) fn words(&self) -> String {
        format!(
            "{} × {} × {} = {}, about {} if nothing else is computed",
            count(self.configurations, "configuration"),
            count(self.points, "point"),
            count(self.worlds, "world"),
            count(self.units(), "run"),
            duration(self.seconds)
        )
    }
}

/// Time per unit of the latest completed study with this name, s.
fn measured(jobs: &[StudyJob], study: &str) -> Option<f64> {
    let is_done = |job: &&StudyJob| job.study == study && job.state == StudyState::Done && job.n > 0;
    let done = jobs.iter().rev().find(is_done)?;
    // Units of an earlier study are reused: a study of a few seconds only read them.
    (done.seconds > 10.0).then(|| done.seconds / done.n as f64)
}

/// Remaining time of a running study; `None` if too little is completed.
pub(super) fn left(job: &StudyJob) -> Option<String> {
    let is_known = job.state == StudyState::Running && job.share >= SHARE_MIN && job.share < 1.0;
    is_known.then(|| format!("about {} left", duration(job.seconds * (1.0 - job.share) / job.share)))
}

fn duration(seconds: f64) -> String {
    if seconds < 55.0 {
        format!("{:.0} s", (seconds / 5.0).ceil() * 5.0)
    } else if seconds < 90.0 * 60.0 {
        format!("{:.0} min", (seconds / 60.0).ceil())
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}

/// The settings of a job for its title, from its command line.
pub(super) fn settings(job: &StudyJob) -> String {
    let mut words = job.command.split_whitespace().skip(3).peekable();
    let mut parts = Vec::new();
    while let Some(name) = words.next() {
        let name = name.trim_start_matches('-').replace('-', " ");
        let value = words.next_if(|word| !word.starts_with("--")).unwrap_or_default();
        let values: Vec<&str> = value.split(',').collect();
        let is_long = name == "configurations" && values.len() > 4;
        parts.push(if is_long {
            count(values.len(), "configuration")
        } else {
            format!("{name} {}", values.join(", "))
        });
    }
    parts.join(" · ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(state: StudyState, share: f64, seconds: f64) -> StudyJob {
        StudyJob {
            id: "j".to_owned(),
            study: "straight".to_owned(),
            state,
            k: 0,
            n: 40,
            share,
            seconds,
            revision: 1,
            doing: String::new(),
            notices: Vec::new(),
            command: "sightline study straight --worlds 2 --configurations a,b,c,d,e --grid 0,1".to_owned(),
        }
    }

    #[test]
    fn the_time_left_follows_the_share_that_is_done() {
        assert_eq!(left(&job(StudyState::Running, 0.25, 60.0)).as_deref(), Some("about 3 min left"));
        assert_eq!(left(&job(StudyState::Running, 0.0, 60.0)), None);
        assert_eq!(left(&job(StudyState::Cancelled, 0.25, 60.0)), None);
    }

    #[test]
    fn an_estimate_uses_the_rate_of_an_earlier_study() {
        let info = StudyInfo {
            name: "straight".to_owned(),
            question: String::new(),
            variable: "n_skip".to_owned(),
            unit: String::new(),
            grid: vec!["0".to_owned(); 5],
            configurations: vec!["ncc".to_owned()],
            scenarios: vec!["approach-5".to_owned()],
            points_per_value: 1,
        };
        let new = crate::studies::StudyForm::default().request(&info).unwrap();
        let first = Estimate::of(&new, &info, &[]);
        assert_eq!(first.units(), 10);
        assert_eq!(
            first.words(),
            "1 configuration × 5 points × 2 worlds = 10 runs, about 2 min if nothing else is computed"
        );
        let again = Estimate::of(&new, &info, &[job(StudyState::Done, 1.0, 400.0)]);
        assert_eq!(again.seconds, 100.0, "10 s a unit");
    }

    #[test]
    fn the_title_of_a_job_names_its_settings() {
        let words = settings(&job(StudyState::Running, 0.0, 0.0));
        assert_eq!(words, "worlds 2 · 5 configurations · grid 0, 1");
    }
}
