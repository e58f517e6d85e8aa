//! Starts, stops and follows studies.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    CancelStudy, ListStudies, ListStudyJobs, ResumeStudy, ShowStudyRows, StartStudy,
};
use sightline_api::location::{Anywhere, AtStudyJob};
use sightline_study::wire::{NewStudy, StudyJob};

use crate::state::State;

/// Starts a study.
pub(crate) fn start_study(new: &NewStudy) -> Call {
    Call::with_body::<StartStudy>(&Anywhere {}, new)
}

impl State {
    /// Asks for the studies, once: while their panel is on the screen.
    pub fn want_studies(&mut self) {
        if !self.studies.is_asked {
            self.studies.is_asked = true;
            let infos = Call::to::<ListStudies>(&Anywhere {});
            let shown = infos.clone();
            self.call_with_problem::<ListStudies>(infos, move |state, found| match found {
                Ok(infos) => state.studies.infos = Some(infos),
                Err(problem) => {
                    state.studies.infos = Some(Vec::new());
                    state.show_refusal(&shown, &problem, false);
                }
            });
            let jobs = Call::to::<ListStudyJobs>(&Anywhere {});
            self.call::<ListStudyJobs>(jobs, |state, jobs| state.studies.took_all(jobs));
        }
    }

    /// Takes in that a study went on; the table that is looked at grows with it.
    pub(crate) fn study_went_on(&mut self, job: StudyJob) {
        let has_more =
            self.studies.jobs.iter().find(|known| known.id == job.id).is_none_or(|known| known.k < job.k);
        if has_more && self.studies.looked.as_ref() == Some(&job.id) {
            self.read_study_rows(job.id.clone());
        }
        self.studies.took(job);
    }

    /// Starts the study that the order describes.
    pub(crate) fn start_study(&mut self) {
        let Some(info) = self.studies.chosen() else { return };
        match self.studies.order.request(info) {
            Ok(new) => self.call::<StartStudy>(start_study(&new), |state, job| state.studies.took(job)),
            Err(sentence) => self.messages.problem(sentence, None),
        }
    }

    /// Stops a study.
    pub(crate) fn cancel_study(&mut self, job: String) {
        self.studies.cancelling.insert(job.clone());
        let call = Call::to::<CancelStudy>(&AtStudyJob { job });
        self.call::<CancelStudy>(call, |state, job| state.studies.took(job));
    }

    /// Lets a stopped study go on.
    pub(crate) fn resume_study(&mut self, job: String) {
        self.studies.cancelling.remove(&job);
        let call = Call::to::<ResumeStudy>(&AtStudyJob { job });
        self.call::<ResumeStudy>(call, |state, job| state.studies.took(job));
    }

    fn read_study_rows(&mut self, job: String) {
        let call = Call::to::<ShowStudyRows>(&AtStudyJob { job: job.clone() });
        self.call::<ShowStudyRows>(call, move |state, table| {
            state.studies.rows.insert(job, table.rows);
        });
    }

    /// Looks at a study's table.
    pub(crate) fn look_at_study(&mut self, job: String) {
        self.read_study_rows(job.clone());
        self.studies.looked = Some(job);
    }
}
