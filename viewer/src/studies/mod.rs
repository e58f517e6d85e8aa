//! The validation studies: those available, those started, and the form for the next one.

pub(crate) mod panel;
pub(crate) mod update;

mod chart;
mod estimate;
mod table;

use std::collections::{BTreeMap, BTreeSet};

use sightline_geometry::error::Error;
use sightline_study::plan::Plan;
use sightline_study::row::Row;
use sightline_study::wire::{NewStudy, StudyInfo, StudyJob};

/// State of the studies.
#[derive(Clone, Debug, Default)]
pub struct Studies {
    /// The available studies; `None` until received.
    pub infos: Option<Vec<StudyInfo>>,
    /// The started studies, in the server's order.
    pub jobs: Vec<StudyJob>,
    /// The tables that were read, by job.
    pub rows: BTreeMap<String, Vec<Row>>,
    /// The job whose table is shown.
    pub shown_job: Option<String>,
    /// The inputs of the next study.
    pub form: StudyForm,
    /// The jobs whose cancellation was requested and is pending; a unit of work in progress is completed first.
    pub cancelling: BTreeSet<String>,
    is_requested: bool,
}

/// The inputs of the next study, as text in the form.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StudyForm {
    /// The study's name; empty: the first study.
    pub study: String,
    /// Comma-separated seeds; empty: [`WORLDS`] worlds from seed 1 on.
    pub seeds: String,
    /// Comma-separated configurations; empty: [`StudyForm::proposed`].
    pub configurations: String,
    /// Comma-separated values of the study's variable; empty: its default values.
    pub grid: String,
}

/// Number of worlds of a study without given seeds.
pub(crate) const WORLDS: u64 = 2;

/// Configurations that a study proposes, if it has them: ours and the paper's three.
const FIRST: [&str; 4] = ["sightline", "ncc-scale-roll", "ncc-scale", "ncc"];

impl StudyForm {
    /// The default configurations: few, so that the first result arrives soon.
    pub(crate) fn proposed(info: &StudyInfo) -> Vec<String> {
        let has = |name: &&&str| info.configurations.iter().any(|known| known == **name);
        let first: Vec<String> = FIRST.iter().filter(has).map(|&name| name.to_owned()).collect();
        if first.is_empty() { info.configurations.iter().take(FIRST.len()).cloned().collect() } else { first }
    }

    /// The request that starts the study.
    ///
    /// # Errors
    /// A sentence that names the field, if a seed is not an integer, a configuration is unknown, or a value is not a point
    /// of the grid.
    pub fn request(&self, info: &StudyInfo) -> Result<NewStudy, String> {
        let words = |text: &str| -> Vec<String> {
            text.split(',').map(|word| word.trim().to_owned()).filter(|word| !word.is_empty()).collect()
        };
        let seed = |word: &String| {
            word.parse::<u64>()
                .map_err(|_| format!("seeds: {word} is not a whole number; write for example 1,2,3"))
        };
        let seeds: Vec<u64> = words(&self.seeds).iter().map(seed).collect::<Result<_, _>>()?;
        let configurations = words(&self.configurations);
        let grid = words(&self.grid);
        // The same check as on the server, with the field names of this form.
        if !(configurations.is_empty() && grid.is_empty()) {
            Plan::new(&info.name, &configurations, &grid).map_err(|error| match error {
                Error::Setting { key, problem } if key == "grid" => format!("{}: {problem}", info.variable),
                Error::Setting { problem, .. } => format!("configurations: {problem}"),
                other => other.to_string(),
            })?;
        }
        Ok(NewStudy {
            study: info.name.clone(),
            worlds: seeds.is_empty().then_some(WORLDS),
            seeds,
            first_seed: None,
            configurations: if configurations.is_empty() { Self::proposed(info) } else { configurations },
            grid,
            scenario: None,
        })
    }
}

impl Studies {
    /// The study that the order names, otherwise the first.
    pub fn chosen(&self) -> Option<&StudyInfo> {
        let infos = self.infos.as_ref()?;
        infos.iter().find(|info| info.name == self.form.study).or(infos.first())
    }

    /// Stores the state of a job, unless a newer one is stored: replies and events can overtake each other.
    pub(crate) fn store_job(&mut self, job: StudyJob) {
        match self.jobs.iter_mut().find(|known| known.id == job.id) {
            Some(known) if known.revision > job.revision => {}
            Some(known) => *known = job,
            None => self.jobs.push(job),
        }
    }

    /// Stores the server's list of jobs.
    pub(crate) fn set_jobs(&mut self, list: Vec<StudyJob>) {
        self.jobs.retain(|known| list.iter().any(|job| job.id == known.id));
        list.into_iter().for_each(|job| self.store_job(job));
    }

    /// Requests everything again from a server that may have been restarted and restarted its revision numbers.
    pub(crate) fn make_stale(&mut self) {
        self.is_requested = false;
        self.cancelling.clear();
        self.jobs.iter_mut().for_each(|job| job.revision = 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_form_becomes_a_request_or_a_sentence() {
        let info = StudyInfo {
            name: "straight".to_owned(),
            question: String::new(),
            variable: "n_skip".to_owned(),
            unit: String::new(),
            grid: vec!["0".to_owned()],
            configurations: ["ncc", "sdog", "sightline", "ncc-scale"].map(str::to_owned).to_vec(),
            scenarios: Vec::new(),
            points_per_value: 1,
        };
        let form = StudyForm {
            seeds: "7, 8".to_owned(),
            configurations: "ncc-scale, ncc+scale=true".to_owned(),
            ..StudyForm::default()
        };
        let new = form.request(&info).unwrap();
        assert_eq!((new.study.as_str(), new.seeds, new.worlds), ("straight", vec![7, 8], None));
        assert_eq!(new.configurations, ["ncc-scale", "ncc+scale=true"]);
        assert!(new.grid.is_empty());
        let wrong = StudyForm { seeds: "7,x".to_owned(), ..StudyForm::default() };
        assert!(wrong.request(&info).unwrap_err().contains("x is not a whole number"));
        let small = StudyForm::default().request(&info).unwrap();
        assert_eq!(small.worlds, Some(WORLDS), "few worlds");
        assert_eq!(small.configurations, ["sightline", "ncc-scale", "ncc"], "few configurations");
    }
}
