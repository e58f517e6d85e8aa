//! Runs that steer a drive: from the last stop to the next, which all runs of the drive then track.

use std::sync::Arc;

use sightline_api::event::Event;
use sightline_geometry::error::{Error, Result};
use sightline_rover::driving::Ending;
use sightline_session::Session;
use sightline_session::driving::Steering;
use sightline_session::step::RunStep;
use sightline_track::cycle_stage::CycleStage;

use super::{Runner, every_run, progress};
use crate::cancel::CancelFlag;
use crate::commanded_drive::{self, DriveOutcome};
use crate::jobs::lock;
use crate::live_session::LiveSession;
use crate::rendering::OpenTraverse;

impl Runner {
    /// Drives to another stop; false if the drive ends at the last one.
    pub(super) fn drive(
        &self,
        live: &LiveSession,
        steering: &Steering,
        steps: &[Arc<RunStep>],
        flag: &CancelFlag,
    ) -> Result<bool> {
        let open = live.traverse();
        let count = open.traverse.stop_count();
        self.send_event(progress(live, steering.target, steering.run, format!("driving to stop {count}")));
        match commanded_drive::drive_to_next_stop(&open, steering, steps, flag)? {
            DriveOutcome::Grown(grown) => {
                self.replace_drive(&grown, (live, (steering.target, steering.run)));
                Ok(true)
            }
            DriveOutcome::Ended(ending) => {
                self.visit_next(live, &ending)?;
                Ok(false)
            }
            // If another run has driven on, there is a step to compute.
            DriveOutcome::AlreadyDriven => Ok(live.traverse().traverse.stop_count() > count),
        }
    }

    /// Records how the drive to a target ended, and continues with the run of the next target.
    fn visit_next(&self, live: &LiveSession, ending: &Ending) -> Result<()> {
        let open = live.traverse();
        let Some(drive) = &open.commanded else { return Ok(()) };
        // Computed before the session is changed, because it locks the hazard maps, which must be locked before the world.
        let why = commanded_drive::view(live).why;
        let visit = |session: &mut Session| drive.with(|world| Ok(session.visit_next(world, ending, why)?));
        let next = live.change_and(&self.store, visit, |_| ());
        let next = next.map_err(|problem| Error::Request(problem.problem().detail.clone()))?;
        let session = self.session_of(live);
        if let (Some((target, run)), Some(session)) = (next, session) {
            // If the queue is full, the run can be resumed manually.
            let _ = self.start(&session, target, run);
        }
        self.send_event(Some(Event::SessionChanged { session: live.id.clone() }));
        Ok(())
    }

    /// The shared instance of a session.
    fn session_of(&self, live: &LiveSession) -> Option<Arc<LiveSession>> {
        lock(&self.sessions).by_number.values().find(|other| other.id == live.id).cloned()
    }

    /// Performs the next stages of a paused stop in the world; false if none is left.
    pub(super) fn prepare(
        &self,
        live: &LiveSession,
        driver: (usize, usize),
        last: &RunStep,
        before: Option<CycleStage>,
        flag: &CancelFlag,
    ) -> Result<bool> {
        let steering = live.with(|session| session.steering.clone());
        let command = steering.map(|steering| steering.command).unwrap_or_default();
        let grown = commanded_drive::prepare(&live.traverse(), last, &command, before, flag)?;
        let Some(grown) = grown else { return Ok(false) };
        self.replace_drive(&grown, (live, driver));
        Ok(true)
    }

    /// Replaces a drive everywhere by its new state, and continues the other runs.
    fn replace_drive(&self, grown: &Arc<OpenTraverse>, driver: (&LiveSession, (usize, usize))) {
        commanded_drive::replace(&self.traverses, grown);
        self.send_event(Some(grown.progress(None)));
        let all: Vec<_> = lock(&self.sessions).by_number.values().cloned().collect();
        for other in all.iter().filter(|other| other.traverse().id == grown.id) {
            other.grow(Arc::clone(grown));
            self.send_event(Some(Event::SessionChanged { session: other.id.clone() }));
            self.follow(other, driver);
        }
    }

    /// Continues the other runs of a session that have something to compute at the last stop.
    pub(crate) fn follow(&self, live: &Arc<LiveSession>, (driver, driving): (&LiveSession, (usize, usize))) {
        let is_driver = |target, run| driver.id == live.id && (target, run) == driving;
        for (target, run) in live.with(|session| every_run(session)) {
            let waits = live.with(|session| matches!(session.pending(target, run), Ok(Some(_))));
            if waits && !is_driver(target, run) && !live.is_computing(target, run) {
                // If the queue is full, the run can be resumed manually.
                let _ = self.start(live, target, run);
            }
        }
    }

    /// Continues the steering run after all runs are restored.
    pub(super) fn resume_driving(&self, live: &Arc<LiveSession>) {
        if let Some(Steering { target, run, .. }) = live.with(|session| session.steering.clone()) {
            let _ = self.start(live, target, run);
        }
    }
}
