//! Reads the drive of the open session, and sends the user's commands.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{BeginDrive, ShowDrive, SteerDrive};
use sightline_api::location::{AtRun, AtSession};
use sightline_api::wire::NewDrive;
use sightline_rover::driving::Cycle;
use sightline_session::driving::{DriveView, Steering};
use sightline_session::pause::Halt;

use crate::driving::DrivingCommand;
use crate::driving::pause::{self, PauseForm};
use crate::state::State;
use crate::state::calls::Notice;

impl State {
    /// Whether the open session is a commanded drive.
    pub(crate) fn is_on_commands(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.steering.is_some())
    }

    /// The drive of the open session; `None` until read.
    pub(crate) fn drive(&self) -> Option<&DriveView> {
        let open = &self.session.as_ref()?.id;
        self.driving.view.as_ref().filter(|(session, _)| session == open).map(|(_, view)| view)
    }

    /// The decision at a stop.
    pub(crate) fn cycle_at(&self, step: usize) -> Option<&Cycle> {
        self.drive()?.cycles.iter().find(|cycle| cycle.step == step)
    }

    /// Distances to the goal, m: at the last decided stop, and at the start of the command. `None` unless the run drives.
    pub(crate) fn way_left_m(&self, (target, run): (usize, usize)) -> Option<[f64; 2]> {
        let drive = self.drive()?;
        let is_driver = |steering: &&Steering| (steering.target, steering.run) == (target, run);
        let since = drive.steering.as_ref().filter(is_driver)?.command.since.unwrap_or(0);
        let first = drive.cycles.iter().find(|cycle| cycle.step >= since)?;
        Some([drive.cycles.last()?.goal.distance_m, first.goal.distance_m])
    }

    /// The state of the drive as a word; `None` without a drive.
    pub(crate) fn drive_word(&self) -> Option<&'static str> {
        let drive = self.drive()?;
        Some(match drive.cycles.last().and_then(|cycle| cycle.ending.as_ref()) {
            Some(ending) => ending.reason.word(),
            None if drive.is_driving => "drives",
            None => "waits",
        })
    }

    /// Records that the drive has advanced.
    pub(crate) fn mark_drive_stale(&mut self) {
        self.driving.is_stale = true;
    }

    /// Reads the drive if it has advanced.
    pub(crate) fn sync_driving(&mut self) {
        self.follow_rover();
        let Some(session) = self.session.as_ref().filter(|session| session.steering.is_some()) else {
            return;
        };
        let is_known = self.drive().is_some();
        if self.driving.is_pending || (is_known && !self.driving.is_stale) {
            return;
        }
        (self.driving.is_pending, self.driving.is_stale) = (true, false);
        let id = session.id.clone();
        let call = Call::to::<ShowDrive>(&AtSession { session: id.clone() });
        self.call_or::<ShowDrive>(
            call,
            move |state, view| {
                state.driving.is_pending = false;
                state.on_drive_reply(id, view);
            },
            |state, _| {
                state.driving.is_pending = false;
                Notice::List
            },
        );
    }

    /// Stores the drive; a cursor at the rover's last stop follows the rover.
    pub(crate) fn on_drive_reply(&mut self, session: String, view: DriveView) {
        let newest = |view: &DriveView| {
            let paused = view.paused.map(|halt| halt.stop);
            view.cycles.last().map(|cycle| cycle.step).max(paused)
        };
        let before = self.drive().and_then(newest);
        let is_other = self.driving.view.as_ref().is_none_or(|(known, _)| *known != session);
        if is_other {
            self.driving.following = None;
        }
        let driver =
            |view: &DriveView| view.steering.as_ref().map(|steering| (steering.target, steering.run));
        let is_next = !is_other && self.drive().and_then(driver) != driver(&view);
        if let Some(steering) = view.steering.as_ref().filter(|_| is_next) {
            // The rover was sent to the next target: if its previous target was selected, select the next one.
            self.driving.command.since = steering.command.since;
            self.driving.then.clone_from(&steering.then);
            let selected = self.cursor.target.map(|target| (target, self.cursor.run));
            if selected == self.drive().and_then(driver) {
                (self.cursor.target, self.cursor.run) = (Some(steering.target), steering.run);
            }
        }
        if let Some(steering) = view.steering.as_ref().filter(|_| is_other) {
            self.driving.command = steering.command.clone();
            self.driving.then.clone_from(&steering.then);
            self.driving.pause.pause = steering.pause.unwrap_or_else(|| PauseForm::default().pause);
        }
        let now = newest(&view);
        let halt = self.halt();
        self.driving.view = Some((session, view));
        self.forget_unpointed(halt);
        let here = self.cursor.step;
        let is_with_rover = before == Some(here) || self.driving.following.is_some();
        if let Some(now) = now.filter(|now| is_with_rover && *now > here) {
            self.driving.following = Some([here, now]);
        }
        self.follow_rover();
    }

    /// Moves the cursor to the rover's stop once that is loaded, unless the user moved it elsewhere.
    fn follow_rover(&mut self) {
        let Some([from, to]) = self.driving.following else { return };
        if self.cursor.step != from {
            self.driving.following = None;
        } else if to < self.stop_count() {
            self.cursor.step = to;
            self.driving.following = None;
        }
    }

    /// Applies a command of the panel.
    pub(crate) fn apply_driving_command(&mut self, command: DrivingCommand) {
        match command {
            DrivingCommand::Form(command) => self.driving.command = command,
            DrivingCommand::Then(then) => self.driving.then = then,
            DrivingCommand::Faults(faults) => self.driving.faults = faults,
            DrivingCommand::PauseForm(form) => self.driving.pause = form,
            DrivingCommand::Begin => self.begin_drive(),
            DrivingCommand::Pause => {
                let (stop, pause) = (self.last_stop(), self.driving.pause.to_request());
                self.steer(self.steered().map(|steering| Steering { pause_at: stop, pause, ..steering }));
            }
            DrivingCommand::OneStop => {
                let next = self.last_stop().map(|stop| stop + 1);
                self.steer(self.selected_steering().map(|steering| Steering { pause_at: next, ..steering }));
            }
            DrivingCommand::Continue => {
                let form = self.driving.pause;
                let stop = self.halt().and_then(|here| form.next_stop(here));
                let pause = form.to_request().filter(|_| stop.is_some());
                self.steer(self.selected_steering().map(|steering| Steering {
                    pause_at: stop,
                    pause,
                    ..steering
                }));
            }
            DrivingCommand::NextStage => {
                let next = self.halt().map(Halt::next);
                self.steer(
                    self.selected_steering().zip(next).map(|(steering, next)| pause::until(steering, next)),
                );
            }
            DrivingCommand::GoOn => self.steer(self.selected_steering()),
            DrivingCommand::Try { command, change } => self.begin_trial_drive(command, change),
            DrivingCommand::CancelTrial(change) => self.cancel_trial_drive(change),
        }
    }

    /// The rover's current stop; the drive may be ahead of the session.
    fn last_stop(&self) -> Option<usize> {
        let listed = self.session.as_ref()?.stop_count.checked_sub(1);
        let decided = self.drive().and_then(|drive| drive.cycles.last()).map(|cycle| cycle.step);
        let halted = self.halt().map(|halt| halt.stop);
        [listed, decided, halted].into_iter().flatten().max()
    }

    fn steered(&self) -> Option<Steering> {
        self.drive()?.steering.clone()
    }

    /// The selected run as the driving one.
    fn selected_steering(&self) -> Option<Steering> {
        let (target, run) = (self.target()?.number, self.run()?.number);
        let (command, mut then) = (self.driving.command.clone(), self.driving.then.clone());
        then.retain(|later| *later != target);
        Some(Steering { target, run, command, then, pause_at: None, pause: None })
    }

    fn steer(&mut self, steering: Option<Steering>) {
        let (Some(steering), Some(session)) = (steering, self.session_id()) else {
            self.messages.problem("There is no run to drive with: pick a target first.", None);
            return;
        };
        let call = Call::with_body::<SteerDrive>(&AtSession { session: session.clone() }, &steering);
        self.call::<SteerDrive>(call, move |state, view| state.on_drive_reply(session, view));
    }

    fn begin_drive(&mut self) {
        if self.driving.is_beginning {
            self.messages.note("The world of the drive is still being made.");
            return;
        }
        let (Some(steering), Some(session)) = (self.selected_steering(), self.session_id()) else {
            self.messages.problem("There is no run to drive with: pick a target first.", None);
            return;
        };
        let from_step = self.is_on_commands().then_some(self.cursor.step);
        let new = NewDrive {
            command: steering.command,
            then: steering.then,
            faults: self.driving.faults.clone(),
            from_step,
            pause_at: None,
            pause: None,
        };
        let at = AtRun { session, target: steering.target, run: steering.run };
        let call = Call::with_body::<BeginDrive>(&at, &new);
        self.driving.is_beginning = true;
        self.messages.note("Making the world of the drive …");
        self.call_or::<BeginDrive>(
            call,
            |state, view| {
                state.driving.is_beginning = false;
                state.driving.faults.clear();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use crate::net::request::Request;
    use crate::tests::fixture;
    use serde_json::json;
    use sightline_api::event::Event;

    /// A session that drives with its only run, at a stop.
    fn driving(step: usize) -> State {
        let mut state = fixture::at_step(&egui::Context::default(), step);
        let steering = serde_json::from_value(json!({ "target": 0, "run": 0 })).unwrap();
        if let Some(session) = &mut state.session {
            session.steering = Some(steering);
        }
        state
    }

    fn view(stops: usize, is_driving: bool) -> DriveView {
        let steering = json!({ "target": 0, "run": 0, "command": { "standoff_m": 1.5 }, "pause_at": null });
        let cycles: Vec<_> = (0..stops).map(fixture::cycle).collect();
        serde_json::from_value(
            json!({ "steering": steering, "cycles": cycles, "summary": null, "is_driving": is_driving }),
        )
        .unwrap()
    }

    fn calls_of(state: &mut State) -> Vec<(String, Option<serde_json::Value>)> {
        let body = |bytes: Option<Vec<u8>>| bytes.map(|bytes| serde_json::from_slice(&bytes).unwrap());
        let requests = state.take_requests().into_iter();
        let calls = requests.filter_map(|request| match request {
            Request::Call { call, .. } => Some((call.path, body(call.body))),
            _ => None,
        });
        calls.filter(|(path, _)| path.contains("drive")).collect()
    }

    #[test]
    fn one_stop_more_counts_from_the_stop_that_the_drive_has_come_to() {
        let mut state = driving(1);
        state.on_drive_reply("s1".to_owned(), view(9, false));
        assert_eq!(state.session.as_ref().unwrap().stop_count, 6, "the session is read later");
        state.take_requests();
        state.perform(Command::Drive(DrivingCommand::OneStop));
        let (_, body) = calls_of(&mut state).remove(0);
        assert_eq!(body.unwrap()["pause_at"], 9);
    }

    #[test]
    fn the_last_stop_of_a_drive_says_whether_another_one_follows() {
        let mut state = driving(5);
        let words = |state: &State| state.next_step_words("for the next match");
        assert_eq!(words(&state), " This drive has no further stop.");
        state.on_drive_reply("s1".to_owned(), view(2, true));
        assert_eq!(words(&state), " The rover drives; its next stop is added here.");
        state.on_drive_reply("s1".to_owned(), view(2, false));
        assert_eq!(words(&state), " The rover waits; continue in the panel Drive.");
    }

    #[test]
    fn the_drive_is_read_when_it_goes_on_and_the_cursor_goes_with_the_rover() {
        let mut state = driving(1);
        assert_eq!(calls_of(&mut state), [("sessions/s1/drive".to_owned(), None)]);
        assert_eq!(calls_of(&mut state), [], "it is asked for once");
        state.driving.is_pending = false;
        state.on_drive_reply("s1".to_owned(), view(2, true));
        assert_eq!(state.driving.command.standoff_m, 1.5, "the form shows the command of the drive");
        assert_eq!(calls_of(&mut state), []);
        state.apply_event(Event::RunProgress {
            session: "s1".to_owned(),
            target: 0,
            run: 0,
            k: 3,
            n: 3,
            ended: false,
            doing: "tracking".to_owned(),
        });
        assert_eq!(calls_of(&mut state).len(), 1, "an event makes it stale");
        state.on_drive_reply("s1".to_owned(), view(3, true));
        assert_eq!(state.cursor.step, 2);
        // A cursor at an earlier stop stays there.
        state.cursor.step = 0;
        state.on_drive_reply("s1".to_owned(), view(4, true));
        assert_eq!(state.cursor.step, 0);
    }

    #[test]
    fn pausing_stepping_and_driving_on_are_one_command_to_the_server() {
        let mut state = driving(1);
        let _ = calls_of(&mut state);
        state.on_drive_reply("s1".to_owned(), view(2, true));
        let last = state.last_stop().unwrap();
        for (command, pause_at) in [
            (DrivingCommand::Pause, json!(last)),
            (DrivingCommand::OneStop, json!(last + 1)),
            (DrivingCommand::GoOn, json!(null)),
        ] {
            state.perform(Command::Drive(command));
            let (path, body) = calls_of(&mut state).pop().unwrap();
            assert_eq!(path, "sessions/s1/drive");
            assert_eq!(body.unwrap()["pause_at"], pause_at);
        }
    }

    #[test]
    fn a_drive_begins_at_the_first_stop_and_branches_at_the_one_that_is_looked_at() {
        let mut state = fixture::at_step(&egui::Context::default(), 2);
        state.perform(Command::Drive(DrivingCommand::Begin));
        let (path, body) = calls_of(&mut state).pop().unwrap();
        assert_eq!(path, "sessions/s1/targets/0/runs/0/drive");
        assert_eq!(body.unwrap().get("from_step"), None);
        state.perform(Command::Drive(DrivingCommand::Begin));
        assert_eq!(calls_of(&mut state), [], "one world at a time");

        let mut state = driving(2);
        let _ = calls_of(&mut state);
        state.on_drive_reply("s1".to_owned(), view(3, false));
        state.perform(Command::Drive(DrivingCommand::Begin));
        assert_eq!(calls_of(&mut state).pop().unwrap().1.unwrap()["from_step"], json!(2));
    }
}
