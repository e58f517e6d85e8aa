//! Starts, cancels and follows studies.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    CancelStudy, ListStudies, ListStudyJobs, ResumeStudy, ShowStudyRows, StartStudy,
};
use sightline_api::location::{Anywhere, AtStudyJob};
use sightline_study::wire::{NewStudy, StudyJob};

use crate::state::State;

/// The call that starts a study.
pub(crate) fn start_study(new: &NewStudy) -> Call {
    Call::with_body::<StartStudy>(&Anywhere {}, new)
}

impl State {
    /// Requests the list of studies once, when their panel becomes visible.
    pub fn read_studies_once(&mut self) {
        if !self.studies.is_requested {
            self.studies.is_requested = true;
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
            self.call::<ListStudyJobs>(jobs, |state, jobs| state.studies.set_jobs(jobs));
        }
    }

    /// Stores the progress of a study; the displayed table is read again when it has grown.
    pub(crate) fn update_study(&mut self, job: StudyJob) {
        let has_more =
            self.studies.jobs.iter().find(|known| known.id == job.id).is_none_or(|known| known.k < job.k);
        if has_more && self.studies.shown_job.as_ref() == Some(&job.id) {
            self.read_study_rows(job.id.clone());
        }
        self.studies.store_job(job);
    }

    /// Starts the study that the form describes.
    pub(crate) fn start_study(&mut self) {
        let Some(info) = self.studies.chosen() else { return };
        match self.studies.form.request(info) {
            Ok(new) => self.call::<StartStudy>(start_study(&new), |state, job| state.studies.store_job(job)),
            Err(sentence) => self.messages.problem(sentence, None),
        }
    }

    /// Stops a study.
    pub(crate) fn cancel_study(&mut self, job: String) {
        self.studies.cancelling.insert(job.clone());
        let call = Call::to::<CancelStudy>(&AtStudyJob { job });
        self.call::<CancelStudy>(call, |state, job| state.studies.store_job(job));
    }

    /// Resumes a stopped study.
    pub(crate) fn resume_study(&mut self, job: String) {
        self.studies.cancelling.remove(&job);
        let call = Call::to::<ResumeStudy>(&AtStudyJob { job });
        self.call::<ResumeStudy>(call, |state, job| state.studies.store_job(job));
    }

    fn read_study_rows(&mut self, job: String) {
        let call = Call::to::<ShowStudyRows>(&AtStudyJob { job: job.clone() });
        self.call::<ShowStudyRows>(call, move |state, table| {
            state.studies.rows.insert(job, table.rows);
        });
    }

    /// Shows a study's table.
    pub(crate) fn show_study(&mut self, job: String) {
        self.read_study_rows(job.clone());
        self.studies.shown_job = Some(job);
    }
}
