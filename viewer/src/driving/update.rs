//! Reads the drive of the open session, and sends what a person asks for.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{BeginDrive, ShowDrive, SteerDrive};
use sightline_api::location::{AtRun, AtSession};
use sightline_api::wire::NewDrive;
use sightline_rover::driving::Cycle;
use sightline_session::driving::{DriveView, Steering};

use crate::driving::Ask;
use crate::state::State;
use crate::state::calls::Notice;

impl State {
    /// Whether the open session drives on commands.
    pub(crate) fn is_on_commands(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.steering.is_some())
    }

    /// The drive of the open session; `None` before it was read.
    pub(crate) fn drive(&self) -> Option<&DriveView> {
        let open = &self.session.as_ref()?.id;
        self.driving.view.as_ref().filter(|(session, _)| session == open).map(|(_, view)| view)
    }

    /// The decision at a stop.
    pub(crate) fn cycle_at(&self, step: usize) -> Option<&Cycle> {
        self.drive()?.cycles.iter().find(|cycle| cycle.step == step)
    }

    /// Notes that the drive has gone on.
    pub(crate) fn drive_went_on(&mut self) {
        self.driving.is_stale = true;
    }

    /// Reads the drive when it has gone on.
    pub(crate) fn sync_driving(&mut self) {
        let Some(session) = self.session.as_ref().filter(|session| session.steering.is_some()) else {
            return;
        };
        let is_known = self.drive().is_some();
        if self.driving.is_asked || (is_known && !self.driving.is_stale) {
            return;
        }
        (self.driving.is_asked, self.driving.is_stale) = (true, false);
        let id = session.id.clone();
        let call = Call::to::<ShowDrive>(&AtSession { session: id.clone() });
        self.call_or::<ShowDrive>(
            call,
            move |state, view| {
                state.driving.is_asked = false;
                state.took_drive(id, view);
            },
            |state, _| {
                state.driving.is_asked = false;
                Notice::List
            },
        );
    }

    /// Takes the drive in; a cursor at the rover's last stop goes with the rover.
    fn took_drive(&mut self, session: String, view: DriveView) {
        let newest = |view: &DriveView| view.cycles.last().map(|cycle| cycle.step);
        let before = self.drive().and_then(newest);
        let is_other = self.driving.view.as_ref().is_none_or(|(known, _)| *known != session);
        if let Some(steering) = view.steering.filter(|_| is_other) {
            self.driving.command = steering.command;
        }
        let now = newest(&view);
        self.driving.view = Some((session, view));
        if let (Some(before), Some(now)) = (before, now)
            && self.cursor.step == before
            && now < self.stop_count()
        {
            self.cursor.step = now;
        }
    }

    /// Carries out what is asked for.
    pub(crate) fn ask_of_driving(&mut self, ask: Ask) {
        match ask {
            Ask::Form(command) => self.driving.command = command,
            Ask::Begin => self.begin_drive(),
            Ask::Pause => {
                let stop = self.last_stop();
                self.steer(self.steered().map(|steering| Steering { pause_at: stop, ..steering }));
            }
            Ask::OneStop => {
                let next = self.last_stop().map(|stop| stop + 1);
                self.steer(self.looked_at().map(|steering| Steering { pause_at: next, ..steering }));
            }
            Ask::GoOn => self.steer(self.looked_at()),
        }
    }

    /// The stop at which the rover stands.
    fn last_stop(&self) -> Option<usize> {
        self.session.as_ref()?.stop_count.checked_sub(1)
    }

    fn steered(&self) -> Option<Steering> {
        self.drive()?.steering
    }

    /// The run that is looked at as the one that drives.
    fn looked_at(&self) -> Option<Steering> {
        let (target, run) = (self.target()?.number, self.run()?.number);
        Some(Steering { target, run, command: self.driving.command, pause_at: None })
    }

    fn steer(&mut self, steering: Option<Steering>) {
        let (Some(steering), Some(session)) = (steering, self.session_id()) else {
            self.messages.problem("There is no run to drive with: pick a target first.", None);
            return;
        };
        let call = Call::with_body::<SteerDrive>(&AtSession { session: session.clone() }, &steering);
        self.call::<SteerDrive>(call, move |state, view| state.took_drive(session, view));
    }

    fn begin_drive(&mut self) {
        if self.driving.is_beginning {
            self.messages.note("The world of the drive is still being made.");
            return;
        }
        let (Some(steering), Some(session)) = (self.looked_at(), self.session_id()) else {
            self.messages.problem("There is no run to drive with: pick a target first.", None);
            return;
        };
        let from_step = self.is_on_commands().then_some(self.cursor.step);
        let new = NewDrive { command: steering.command, from_step, pause_at: None };
        let at = AtRun { session, target: steering.target, run: steering.run };
        let call = Call::with_body::<BeginDrive>(&at, &new);
        self.driving.is_beginning = true;
        self.messages.note("Making the world of the drive …");
        self.call_or::<BeginDrive>(
            call,
            |state, view| {
                state.driving.is_beginning = false;
                state.messages.note(
                    "The rover drives in a session of its own; the one from which it began is as it was.",
                );
                state.adopt(view, false);
                state.read_traverses();
            },
            |state, _| {
                state.driving.is_beginning = false;
                Notice::Card
            },
        );
    }
}
