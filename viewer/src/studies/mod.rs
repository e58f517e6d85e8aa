//! The validation experiments: which there are, which were started, and what is to be started next.

pub(crate) mod panel;
pub(crate) mod update;

use std::collections::BTreeMap;

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
    is_asked: bool,
}

/// What the next study is made of, as the person types it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Order {
    /// The study's name; empty stands for the first.
    pub study: String,
    /// Seeds with commas between them; empty: ten worlds from seed 1 on.
    pub seeds: String,
    /// Configurations with commas between them; empty: the study's own.
    pub configurations: String,
    /// Values of the study's variable with commas between them; empty: its own.
    pub grid: String,
}

impl Order {
    /// The request, for a study of that name.
    ///
    /// # Errors
    /// A sentence when a seed is no whole number.
    pub fn request(&self, study: &str) -> Result<NewStudy, String> {
        let words = |text: &str| -> Vec<String> {
            text.split(',').map(|word| word.trim().to_owned()).filter(|word| !word.is_empty()).collect()
        };
        let seed = |word: &String| {
            word.parse::<u64>()
                .map_err(|_| format!("seeds: {word} is no whole number; write for example 1,2,3"))
        };
        Ok(NewStudy {
            study: study.to_owned(),
            seeds: words(&self.seeds).iter().map(seed).collect::<Result<_, _>>()?,
            worlds: None,
            first_seed: None,
            configurations: words(&self.configurations),
            grid: words(&self.grid),
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

    /// Takes in how a job stands.
    pub(crate) fn took(&mut self, job: StudyJob) {
        match self.jobs.iter_mut().find(|known| known.id == job.id) {
            Some(known) => *known = job,
            None => self.jobs.push(job),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_becomes_a_request_and_a_wrong_seed_a_sentence() {
        let order = Order {
            seeds: "7, 8".to_owned(),
            configurations: "ncc-scale, ncc+scale=true".to_owned(),
            ..Order::default()
        };
        let new = order.request("straight").unwrap();
        assert_eq!((new.study.as_str(), new.seeds), ("straight", vec![7, 8]));
        assert_eq!(new.configurations, ["ncc-scale", "ncc+scale=true"]);
        assert!(new.grid.is_empty() && new.worlds.is_none());
        let wrong = Order { seeds: "7,x".to_owned(), ..Order::default() };
        assert!(wrong.request("straight").unwrap_err().contains("x is no whole number"));
    }
}
