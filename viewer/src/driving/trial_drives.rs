//! Trial drives in the background: a change suggested by *Why* is driven again in a separate session, while the page stays
//! on its own.

use egui::{Label, RichText, Ui};
use sightline_api::endpoint::Call;
use sightline_api::endpoints::{BeginDrive, RemoveSession, ShowDrive};
use sightline_api::location::{AtRun, AtSession};
use sightline_api::wire::NewDrive;
use sightline_rover::driving::{DriveCommand, StopReason};
use sightline_session::driving::DriveView;
use sightline_session::stop_cause::DecisionChange;

use crate::command::Command;
use crate::driving::{DrivingCommand, words};
use crate::files;
use crate::state::State;
use crate::state::calls::Notice;
use crate::theme;

/// A trial drive.
#[derive(Clone, Debug)]
pub struct TrialDrive {
    /// The session of the stopped drive.
    origin: String,
    /// Description of the change, as in *Why*.
    change: String,
    /// The session of the trial drive; `None` while its world is being built.
    session: Option<String>,
    /// The drive as last read.
    view: Option<DriveView>,
    is_pending: bool,
    is_stale: bool,
}

impl TrialDrive {
    /// Whether the drive has ended, before or at its goal.
    fn has_ended(&self) -> bool {
        let last = self.view.as_ref().and_then(|view| view.cycles.last());
        last.is_some_and(|cycle| cycle.ending.is_some())
    }

    /// A description of its state, and whether it has arrived; `None` until it has ended.
    fn status(&self) -> (String, Option<bool>) {
        let Some(view) = &self.view else { return ("making its world …".to_owned(), None) };
        let last = view.cycles.last();
        match (last.and_then(|cycle| cycle.ending.as_ref()), last) {
            (Some(ending), _) => {
                let outcome = view.summary.as_ref().map(words::summary).unwrap_or_default();
                (format!("{}; {outcome}", words::ending(ending)), Some(ending.reason == StopReason::Arrived))
            }
            (None, Some(cycle)) => (format!("drives, stop {}", cycle.step), None),
            (None, None) => ("drives".to_owned(), None),
        }
    }
}

impl State {
    /// Repeats the whole drive under another command, from the stop at which the original command began.
    pub(super) fn begin_trial_drive(&mut self, command: DriveCommand, change: String) {
        let begun = self.drive().and_then(|drive| {
            let steering = drive.steering.as_ref()?;
            let since = steering.command.since.unwrap_or(0);
            let first = drive.cycles.iter().find(|cycle| cycle.step >= since)?;
            Some((steering.target, steering.run, steering.then.clone(), first.step))
        });
        let (Some((target, run, then, from_step)), Some(origin)) = (begun, self.session_id()) else { return };
        if self.trial_drive(&change).is_some() {
            return;
        }
        let new = NewDrive {
            command,
            then,
            faults: Vec::new(),
            from_step: Some(from_step),
            pause_at: None,
            pause: None,
        };
        let call = Call::with_body::<BeginDrive>(&AtRun { session: origin.clone(), target, run }, &new);
        let key = (origin.clone(), change.clone());
        self.driving.trials.push(TrialDrive {
            origin,
            change,
            session: None,
            view: None,
            is_pending: false,
            is_stale: true,
        });
        let failed = key.clone();
        self.call_or::<BeginDrive>(
            call,
            move |state, view| {
                state.read_traverses();
                match state.trial_drive_mut(&key) {
                    Some(trial) => trial.session = Some(view.id),
                    None => state.remove_trial_session(view.id),
                }
            },
            move |state, _| {
                state.forget_trial_drive(&failed);
                Notice::Card
            },
        );
    }

    /// The trial drive of the open session with this change.
    fn trial_drive(&self, change: &str) -> Option<&TrialDrive> {
        let origin = &self.session.as_ref()?.id;
        self.driving.trials.iter().find(|trial| trial.origin == *origin && trial.change == change)
    }

    fn trial_drive_mut(&mut self, (origin, change): &(String, String)) -> Option<&mut TrialDrive> {
        let mut all = self.driving.trials.iter_mut();
        all.find(|trial| trial.origin == *origin && trial.change == *change)
    }

    fn forget_trial_drive(&mut self, (origin, change): &(String, String)) {
        self.driving.trials.retain(|trial| trial.origin != *origin || trial.change != *change);
    }

    /// Ends a trial drive and removes its session.
    pub(super) fn cancel_trial_drive(&mut self, change: String) {
        let Some(origin) = self.session_id() else { return };
        let key = (origin, change);
        let session = self.trial_drive_mut(&key).and_then(|trial| trial.session.clone());
        self.forget_trial_drive(&key);
        if let Some(session) = session {
            self.remove_trial_session(session);
        }
    }

    fn remove_trial_session(&mut self, session: String) {
        let call = Call::to::<RemoveSession>(&AtSession { session });
        self.call::<RemoveSession>(call, |_, _| {});
    }

    /// Records that a session advanced, which may be the one of a trial drive.
    pub(crate) fn mark_trial_drive_stale(&mut self, session: &str) {
        let all = self.driving.trials.iter_mut();
        all.filter(|trial| trial.session.as_deref() == Some(session)).for_each(|trial| trial.is_stale = true);
    }

    /// Records that trial drives may have advanced while the server was unreachable.
    pub(crate) fn mark_trial_drives_stale(&mut self) {
        self.driving.trials.iter_mut().for_each(|trial| (trial.is_stale, trial.is_pending) = (true, false));
    }

    /// Discards the trial drive whose session was removed.
    pub(crate) fn trial_drive_removed(&mut self, session: &str) {
        self.driving.trials.retain(|trial| trial.session.as_deref() != Some(session));
    }

    /// Reads the trial drives that have advanced.
    pub(crate) fn sync_trial_drives(&mut self) {
        let mut stale = Vec::new();
        for trial in &mut self.driving.trials {
            let Some(session) = trial.session.clone().filter(|_| trial.is_stale && !trial.is_pending) else {
                continue;
            };
            (trial.is_pending, trial.is_stale) = (true, false);
            stale.push(session);
        }
        for session in stale {
            let call = Call::to::<ShowDrive>(&AtSession { session: session.clone() });
            let answered = session.clone();
            let read = move |state: &mut Self, view: Option<DriveView>| {
                let all = state.driving.trials.iter_mut();
                for trial in all.filter(|trial| trial.session.as_deref() == Some(&answered)) {
                    trial.is_pending = false;
                    trial.view = view.clone().or(trial.view.take());
                }
            };
            let failed = read.clone();
            self.call_or::<ShowDrive>(
                call,
                move |state, view| read(state, Some(view)),
                move |state, _| {
                    failed(state, None);
                    Notice::List
                },
            );
        }
    }
}

/// Shows the button that tries a change, or the state of the drive with it.
pub(super) fn show(ui: &mut Ui, state: &State, change: &DecisionChange, out: &mut Vec<Command>) {
    let Some(command) = &change.command else { return };
    let Some(trial) = state.trial_drive(&change.text) else {
        let help = "Drives the whole way again with this change, in the background and in a session of its own; this page stays here";
        let name = format!("try the drive with {}", change.text);
        if ui.small_button("Try the drive").accessible_name(name).on_hover_text(help).clicked() {
            out.push(Command::Drive(DrivingCommand::Try {
                command: command.clone(),
                change: change.text.clone(),
            }));
        }
        return;
    };
    if let Some(session) = &trial.session {
        let name = format!("open the drive with {}", change.text);
        let help = "Opens the session of this drive; the current one stays in the list";
        if ui.small_button("Open").accessible_name(name).on_hover_text(help).clicked() {
            out.push(Command::Files(files::FilesCommand::Resume(session.clone())));
        }
    }
    if !trial.has_ended() {
        let name = format!("cancel the drive with {}", change.text);
        let help = "Ends this drive and removes its session";
        if ui.small_button("Cancel").accessible_name(name).on_hover_text(help).clicked() {
            out.push(Command::Drive(DrivingCommand::CancelTrial(change.text.clone())));
        }
    }
    let (text, arrived) = trial.status();
    let colour = arrived.map_or_else(theme::text, theme::verdict);
    ui.add(Label::new(RichText::new(text).size(12.0).color(colour)).wrap());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driving::why;
    use crate::net::request::Request;
    use crate::tests::{Shown, fixture};
    use serde_json::{Value, json};
    use sightline_api::event::Event;

    const CHANGE: &str = "tilt limit 17.2° instead of 16°";

    /// A drive that stopped at the cursor's stop, with one suggested change of its command.
    fn stopped(context: &egui::Context) -> State {
        let mut state = fixture::at_step(context, 2);
        let steering = json!({ "target": 0, "run": 0, "command": { "standoff_m": 1.5 } });
        if let Some(session) = &mut state.session {
            session.steering = Some(serde_json::from_value(steering.clone()).unwrap());
        }
        let command = json!({ "standoff_m": 1.5, "exemption_radius_m": 2.0 });
        let change = json!({ "text": CHANGE, "decision": "4 safe paths", "command": command });
        let why = json!({ "step": 2, "reason": "no_safe_path", "cause": "no_safe_path", "sentence": "Every path is vetoed.",
            "evidence": [], "changes": [change] });
        let mut cycles: Vec<Value> = (0..3).map(fixture::cycle).collect();
        cycles[2]["ending"] = json!({ "reason": "no_safe_path", "value": null, "limit": null });
        let view = json!({ "steering": steering, "cycles": cycles, "summary": null, "is_driving": false, "why": why });
        state.driving.view = Some(("s1".to_owned(), serde_json::from_value(view).unwrap()));
        state
    }

    fn trial(session: Option<&str>) -> State {
        let mut state = stopped(&egui::Context::default());
        state.perform(Command::Drive(DrivingCommand::Try {
            command: DriveCommand::default(),
            change: CHANGE.to_owned(),
        }));
        state.driving.trials[0].session = session.map(str::to_owned);
        let _ = calls(&mut state);
        state
    }

    fn calls(state: &mut State) -> Vec<(String, Option<Value>)> {
        let of = |request| match request {
            Request::Call { call, .. } => {
                Some((call.path, call.body.map(|body| serde_json::from_slice(&body).unwrap())))
            }
            _ => None,
        };
        let calls = state.take_requests().into_iter().filter_map(of);
        calls.filter(|(path, _): &(String, _)| !path.starts_with("sessions/s1/drive")).collect()
    }

    /// The card of the stopped drive, with these trial drives.
    fn shown(all: Vec<TrialDrive>) -> Shown<'static> {
        let state = move |context: &egui::Context| {
            let mut state = stopped(context);
            state.driving.trials = all;
            state
        };
        Shown::new([520.0, 420.0], state, why::show_here)
    }

    #[test]
    fn a_trial_drive_starts_where_its_command_started() {
        let commands = shown(Vec::new()).click(&format!("try the drive with {CHANGE}"));
        let mut state = stopped(&egui::Context::default());
        let _ = calls(&mut state);
        commands.into_iter().for_each(|command| state.perform(command));
        let (path, body) = calls(&mut state).remove(0);
        let body = body.unwrap();
        assert_eq!(path, "sessions/s1/targets/0/runs/0/drive");
        assert_eq!((&body["from_step"], &body["command"]["exemption_radius_m"]), (&json!(0), &json!(2.0)));
        shown(state.driving.trials.clone()).says("making its world");
        state.perform(Command::Drive(DrivingCommand::Try {
            command: DriveCommand::default(),
            change: CHANGE.to_owned(),
        }));
        assert_eq!(calls(&mut state), [], "one drive with a change at a time");
    }

    #[test]
    fn a_trial_drive_is_read_until_it_ends() {
        let mut state = trial(Some("s7"));
        state.driving.trials[0].is_pending = false;
        let event = Event::RunProgress {
            session: "s7".to_owned(),
            target: 0,
            run: 0,
            k: 2,
            n: 2,
            ended: false,
            doing: "tracking".to_owned(),
        };
        state.apply_event(event);
        assert_eq!(calls(&mut state), [("sessions/s7/drive".to_owned(), None)]);
        assert_eq!(calls(&mut state), [], "it is read again only when it has gone on");

        let mut cycles: Vec<Value> = (0..2).map(fixture::cycle).collect();
        let view = |cycles: &[Value]| {
            let view = json!({ "steering": null, "cycles": cycles, "summary": null, "is_driving": true });
            Some(serde_json::from_value(view).unwrap())
        };
        state.driving.trials[0].view = view(&cycles);
        let standing = shown(state.driving.trials.clone());
        standing.says("drives, stop 1");
        assert!(standing.has(&format!("cancel the drive with {CHANGE}")));
        cycles[1]["ending"] = json!({ "reason": "arrived", "value": 0.02, "limit": 0.05 });
        state.driving.trials[0].view = view(&cycles);
        let ended = shown(state.driving.trials.clone());
        ended.says("arrived: 2.0 cm from the goal");
        assert!(!ended.has(&format!("cancel the drive with {CHANGE}")));
        assert!(ended.has(&format!("open the drive with {CHANGE}")));
    }

    #[test]
    fn cancelling_a_trial_drive_removes_its_session() {
        let mut state = trial(Some("s7"));
        let commands = shown(state.driving.trials.clone()).click(&format!("cancel the drive with {CHANGE}"));
        commands.into_iter().for_each(|command| state.perform(command));
        assert!(calls(&mut state).contains(&("sessions/s7".to_owned(), None)));
        assert!(state.driving.trials.is_empty());
    }

    #[test]
    fn a_trial_drive_belongs_to_the_session_of_the_stopped_drive() {
        let mut state = trial(Some("s7"));
        assert!(state.trial_drive(CHANGE).is_some());
        if let Some(session) = &mut state.session {
            session.id = "s2".to_owned();
        }
        assert!(state.trial_drive(CHANGE).is_none());
        state.apply_event(Event::SessionRemoved { session: "s7".to_owned() });
        assert!(state.driving.trials.is_empty());
    }
}
