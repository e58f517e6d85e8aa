//! Runs that drive: from the last stop to the next, which all runs of the drive then track.

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
use crate::driven::{self, DrivenOn};
use crate::jobs::lock;
use crate::live_session::LiveSession;
use crate::rendering::OpenTraverse;

impl Runner {
    /// Drives to another stop; false where the drive ends at the last one.
    pub(super) fn drive(
        &self,
        live: &LiveSession,
        steering: &Steering,
        steps: &[Arc<RunStep>],
        flag: &CancelFlag,
    ) -> Result<bool> {
        let open = live.traverse();
        let count = open.traverse.stop_count();
        self.tell(progress(live, steering.target, steering.run, format!("driving to stop {count}")));
        match driven::drive_on(&open, steering, steps, flag)? {
            DrivenOn::Grown(grown) => {
                self.put_in_place(&grown, (live, (steering.target, steering.run)));
                Ok(true)
            }
            DrivenOn::Ended(ending) => {
                self.visit_next(live, &ending)?;
                Ok(false)
            }
            // Then there is a step to compute.
            DrivenOn::Overtaken => Ok(live.traverse().traverse.stop_count() > count),
        }
    }

    /// Notes how the drive to a target ended, and lets the run of the next one drive.
    fn visit_next(&self, live: &LiveSession, ending: &Ending) -> Result<()> {
        let open = live.traverse();
        let Some(driven) = &open.driven else { return Ok(()) };
        // Found before the session is changed: it looks at the hazard maps, which are locked before the world.
        let why = driven::view(live).why;
        let visit = |session: &mut Session| driven.with(|world| Ok(session.visit_next(world, ending, why)?));
        let next = live.change_and(&self.store, visit, |_| ());
        let next = next.map_err(|problem| Error::Request(problem.problem().detail.clone()))?;
        let session = self.session_of(live);
        if let (Some((target, run)), Some(session)) = (next, session) {
            // A run that finds no place in the queue can be resumed by hand.
            let _ = self.start(&session, target, run);
        }
        self.tell(Some(Event::SessionChanged { session: live.id.clone() }));
        Ok(())
    }

    /// A session as it is shared.
    fn session_of(&self, live: &LiveSession) -> Option<Arc<LiveSession>> {
        lock(&self.sessions).by_number.values().find(|other| other.id == live.id).cloned()
    }

    /// Does the world's part of the next stages at a stop where the drive was paused; false where nothing is left to do.
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
        let grown = driven::prepare(&live.traverse(), last, &command, before, flag)?;
        let Some(grown) = grown else { return Ok(false) };
        self.put_in_place(&grown, (live, driver));
        Ok(true)
    }

    /// Puts a drive in the place of its former state everywhere, and lets the other runs track on.
    fn put_in_place(&self, grown: &Arc<OpenTraverse>, driver: (&LiveSession, (usize, usize))) {
        driven::replace(&self.traverses, grown);
        self.tell(Some(grown.progress(None)));
        let all: Vec<_> = lock(&self.sessions).by_number.values().cloned().collect();
        for other in all.iter().filter(|other| other.traverse().id == grown.id) {
            other.grow(Arc::clone(grown));
            self.tell(Some(Event::SessionChanged { session: other.id.clone() }));
            self.follow(other, driver);
        }
    }

    /// Lets the other runs of a session that have something to compute at the last stop track on.
    pub(crate) fn follow(&self, live: &Arc<LiveSession>, (driver, driving): (&LiveSession, (usize, usize))) {
        let is_driver = |target, run| driver.id == live.id && (target, run) == driving;
        for (target, run) in live.with(|session| every_run(session)) {
            let waits = live.with(|session| matches!(session.pending(target, run), Ok(Some(_))));
            if waits && !is_driver(target, run) && !live.is_computing(target, run) {
                // A run that finds no place in the queue can be resumed by hand.
                let _ = self.start(live, target, run);
            }
        }
    }

    /// Lets the run that drives go on once all runs are as they were.
    pub(super) fn go_on_driving(&self, live: &Arc<LiveSession>) {
        if let Some(Steering { target, run, .. }) = live.with(|session| session.steering.clone()) {
            let _ = self.start(live, target, run);
        }
    }
}
