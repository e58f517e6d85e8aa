//! The validation experiments: which there are, which were started, and what is to be started next.

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

/// What is known of studies.
#[derive(Clone, Debug, Default)]
pub struct Studies {
    /// Those that can be started; none before the server has said.
    pub infos: Option<Vec<StudyInfo>>,
    /// Those that were started, in the server's order.
    pub jobs: Vec<StudyJob>,
    /// The tables that were asked for, by job.
    pub rows: BTreeMap<String, Vec<Row>>,
    /// The job whose table is looked at.
    pub looked: Option<String>,
    /// What the next study is made of.
    pub order: Order,
    /// The jobs whose end was requested and is not here yet: a unit of work that has begun is completed first.
    pub cancelling: BTreeSet<String>,
    is_asked: bool,
}

/// What the next study is made of, as the person types it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Order {
    /// The study's name; empty stands for the first.
    pub study: String,
    /// Seeds with commas between them; empty: [`WORLDS`] worlds from seed 1 on.
    pub seeds: String,
    /// Configurations with commas between them; empty: [`Order::proposed`].
    pub configurations: String,
    /// Values of the study's variable with commas between them; empty: its own.
    pub grid: String,
}

/// Number of worlds of a study whose seeds are not given.
pub(crate) const WORLDS: u64 = 2;

/// Configurations that a study begins with, where it has them: ours and the paper's three.
const FIRST: [&str; 4] = ["sightline", "ncc-scale-roll", "ncc-scale", "ncc"];

impl Order {
    /// The configurations that are run where none are given: few, so that the first result comes soon.
    pub(crate) fn proposed(info: &StudyInfo) -> Vec<String> {
        let has = |name: &&&str| info.configurations.iter().any(|known| known == **name);
        let first: Vec<String> = FIRST.iter().filter(has).map(|&name| name.to_owned()).collect();
        if first.is_empty() { info.configurations.iter().take(FIRST.len()).cloned().collect() } else { first }
    }

    /// The request that starts a study.
    ///
    /// # Errors
    /// A sentence that names the field, if a seed is not a whole number, a configuration is not known, or a value is no point of the
    /// grid.
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
        // The server's own check, with the names of this form.
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
    /// The study that the order names, else the first.
    pub fn chosen(&self) -> Option<&StudyInfo> {
        let infos = self.infos.as_ref()?;
        infos.iter().find(|info| info.name == self.order.study).or(infos.first())
    }

    /// Stores the state of a job, unless a newer one is known: answers and events overtake each other.
    pub(crate) fn took(&mut self, job: StudyJob) {
        match self.jobs.iter_mut().find(|known| known.id == job.id) {
            Some(known) if known.revision > job.revision => {}
            Some(known) => *known = job,
            None => self.jobs.push(job),
        }
    }

    /// Stores the server's list of jobs.
    pub(crate) fn took_all(&mut self, list: Vec<StudyJob>) {
        self.jobs.retain(|known| list.iter().any(|job| job.id == known.id));
        list.into_iter().for_each(|job| self.took(job));
    }

    /// Requests everything again from a server that may have been restarted, and so counts revisions anew.
    pub(crate) fn make_stale(&mut self) {
        self.is_asked = false;
        self.cancelling.clear();
        self.jobs.iter_mut().for_each(|job| job.revision = 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_becomes_a_request_and_a_wrong_seed_a_sentence() {
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
        let order = Order {
            seeds: "7, 8".to_owned(),
            configurations: "ncc-scale, ncc+scale=true".to_owned(),
            ..Order::default()
        };
        let new = order.request(&info).unwrap();
        assert_eq!((new.study.as_str(), new.seeds, new.worlds), ("straight", vec![7, 8], None));
        assert_eq!(new.configurations, ["ncc-scale", "ncc+scale=true"]);
        assert!(new.grid.is_empty());
        let wrong = Order { seeds: "7,x".to_owned(), ..Order::default() };
        assert!(wrong.request(&info).unwrap_err().contains("x is not a whole number"));
        let small = Order::default().request(&info).unwrap();
        assert_eq!(small.worlds, Some(WORLDS), "few worlds");
        assert_eq!(small.configurations, ["sightline", "ncc-scale", "ncc"], "few configurations");
    }
}
