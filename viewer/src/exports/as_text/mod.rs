//! Any action of the page as a shell command: with `curl`, and with `sightline …` if the command line supports it.

mod calls;

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{CancelRun, DesignateTarget, ForkRun, MoveCursor, ShowStep};
use sightline_api::location::{AtRun, AtSession, AtTarget};
use sightline_api::wire::{NewRun, NewTarget};
use sightline_session::exports::ExportEntry;
use sightline_session::shell::{self, Curl};
use sightline_session::view::{RunView, TargetView};
use sightline_track::settings::Changes;
use sightline_track::target::Designation;

use crate::state::{State, run_letter};

/// An action that the user can repeat in a shell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Action {
    /// A description of the action.
    pub words: String,
    /// The `sightline` command; `None` if the command line does not support the action.
    pub command: Option<String>,
    /// The `curl` command.
    pub http: String,
}

impl Action {
    /// An action without a `sightline` command.
    fn of(state: &State, words: String, call: Call) -> Self {
        Self { words, command: None, http: http(&state.origin, call) }
    }
}

/// A call as a `curl` command.
pub(crate) fn http(origin: &str, call: Call) -> String {
    let body = call.body.and_then(|body| String::from_utf8(body).ok());
    let url = format!("{origin}/api/v1/{}", call.path);
    let (method, revision) = (call.method.name(), call.revision);
    Curl { method, url: &url, body: body.as_deref(), revision, file: None }.text()
}

/// The download of an exported file as a `curl` command.
pub(crate) fn download(origin: &str, entry: &ExportEntry) -> String {
    let url = format!("{origin}/api/v1/{}", entry.path);
    Curl { method: "GET", url: &url, body: None, revision: None, file: Some(&entry.file) }.text()
}

/// An endless reply as a `curl` command that outputs every part at once.
pub(crate) fn stream(origin: &str, path: &str) -> String {
    let url = format!("{origin}/api/v1/{path}");
    let text = Curl { method: "GET", url: &url, body: None, revision: None, file: None }.text();
    text.replacen("curl ", "curl -N ", 1)
}

/// A designation as an action.
fn designate(state: &State, words: String, session: &str, target: &NewTarget) -> Action {
    let call = Call::with_body::<DesignateTarget>(&AtSession { session: session.to_owned() }, target);
    Action { command: track(state, target), ..Action::of(state, words, call) }
}

/// A fork of a run as an action. The command line supports it only at the designation; a later fork's steps belong to two
/// runs.
fn fork(state: &State, words: String, session: &str, target: &TargetView, new: &NewRun) -> Action {
    let at = AtTarget { session: session.to_owned(), target: target.number };
    let parent = target.runs.iter().find(|run| run.number == new.run);
    let command = parent.filter(|_| new.from_step <= target.designation.step).and_then(|parent| {
        let mut changes = parent.changes.clone();
        changes.extend(new.settings.clone());
        track(state, &target_of(target, changes))
    });
    Action { command, ..Action::of(state, words, Call::with_body::<ForkRun>(&at, new)) }
}

/// The designation of a target, as a request.
fn target_of(target: &TargetView, settings: Changes) -> NewTarget {
    let designation = target.designation;
    NewTarget {
        settings,
        camera: designation.camera,
        ..NewTarget::at_pixel(designation.step, designation.pixel)
    }
}

fn track(state: &State, target: &NewTarget) -> Option<String> {
    let drive = &state.traverse.as_ref()?.source;
    let designation = Designation { step: target.step, pixel: target.pixel?, camera: target.camera };
    Some(shell::track(drive, designation, &target.settings))
}

/// The actions of the current view, and those that led to it.
pub(crate) fn actions(state: &State) -> Vec<Action> {
    let Some(session) = state.session.as_ref().map(|session| session.id.clone()) else { return Vec::new() };
    let call = Call::with_body::<MoveCursor>(&AtSession { session: session.clone() }, &state.cursor);
    let mut actions = vec![Action::of(state, format!("go to step {}", state.cursor.step), call)];
    if let (Some(target), Some(run)) = (state.target(), state.run()) {
        actions.extend(of_run(state, &session, target, run));
    }
    if let Some(key) = state.step_key(state.cursor.step).filter(|_| state.row().is_some()) {
        actions.push(Action::of(state, format!("read step {}", key.step), Call::to::<ShowStep>(&key)));
    }
    let calls = calls::calls(state, &session).into_iter();
    actions.extend(calls.map(|(words, call)| Action::of(state, words, call)));
    actions
}

fn of_run(state: &State, session: &str, target: &TargetView, run: &RunView) -> Vec<Action> {
    let (number, letter) = (target.number, run_letter(run.number));
    let first = target.runs.first().map(|first| first.changes.clone()).unwrap_or_default();
    let mut pick = target_of(target, first);
    pick.label = Some(target.label.clone());
    let mut actions = vec![designate(state, format!("pick {}", target.label), session, &pick)];
    if let Some(made) = run.fork {
        let parent = target.runs.iter().find(|other| other.number == made.run);
        let settings =
            parent.map_or_else(|| run.changes.clone(), |parent| run.settings.changes_from(&parent.settings));
        let prediction_px = made.prediction_px;
        let new = NewRun { run: made.run, from_step: made.from_step, settings, prediction_px };
        let words = format!("make run {letter} of run {}", run_letter(made.run));
        actions.push(fork(state, words, session, target, &new));
    }
    let last = run.rows.last().map_or(target.designation.step, |row| row.step + 1);
    let new = NewRun {
        run: run.number,
        from_step: state.cursor.step.clamp(target.designation.step, last),
        settings: state.draft.clone(),
        prediction_px: None,
    };
    let words = format!("run {letter} from step {} with the changed settings", new.from_step);
    actions.push(fork(state, words, session, target, &new));
    let at = AtRun { session: session.to_owned(), target: number, run: run.number };
    actions.push(Action::of(state, format!("cancel run {letter}"), Call::to::<CancelRun>(&at)));
    actions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;
    use sightline_api::endpoints::{ChangeNote, ShowSession};
    use sightline_api::location::AtNote;
    use sightline_session::Cursor;
    use sightline_session::notes::EditNote;
    use sightline_session::shell::WITH_TOKEN;

    const ORIGIN: &str = "http://127.0.0.1:7700";

    #[test]
    fn requests_become_curl() {
        let at = AtSession { session: "s1".to_owned() };
        let cursor = Cursor { target: Some(0), run: 1, step: 4 };
        let text = http(ORIGIN, Call::with_body::<MoveCursor>(&at, &cursor));
        assert_eq!(
            text,
            format!(
                "{WITH_TOKEN} | curl -fsS -H @- -X PUT http://127.0.0.1:7700/api/v1/sessions/s1/cursor -H \
                 'Content-Type: application/json' --data-raw '{{\"target\":0,\"run\":1,\"step\":4}}'"
            )
        );
        let read = http(ORIGIN, Call::to::<ShowSession>(&at));
        assert_eq!(read, format!("{WITH_TOKEN} | curl -fsS -H @- http://127.0.0.1:7700/api/v1/sessions/s1"));
        let edit = EditNote { text: Some("it's".to_owned()), place: None };
        let at = AtNote { session: "s1".to_owned(), note: 2 };
        let edited = http(ORIGIN, Call::with_body::<ChangeNote>(&at, &edit).at_revision(5));
        assert!(edited.contains("-X PATCH") && edited.contains("-H 'If-Match: \"5\"'"), "{edited}");
        assert!(edited.contains("it'\\''s"), "{edited}");
    }

    #[test]
    fn a_pick_is_a_command_and_a_fork_on_the_way_is_not() {
        let mut state = fixture::at_step(&egui::Context::default(), 2);
        state.draft.insert("ncc_min".to_owned(), serde_json::json!(0.6));
        let found = |state: &State, words: &str| {
            let all = actions(state);
            all.iter()
                .find(|action| action.words.starts_with(words))
                .cloned()
                .unwrap_or_else(|| panic!("{all:?}"))
        };
        let pick = found(&state, "pick ridge");
        assert_eq!(pick.command.as_deref(), Some("sightline track /drives/six-stops --target 512.3,480.6"));
        assert!(
            pick.http.contains("sessions/s1/targets ") && pick.http.contains("\"label\":\"ridge\""),
            "{}",
            pick.http
        );
        let from_here = found(&state, "run A from step 2");
        assert_eq!(from_here.command, None);
        assert!(
            from_here.http.contains("\"from_step\":2,\"settings\":{\"ncc_min\":0.6}"),
            "{}",
            from_here.http
        );
        state.cursor.step = 0;
        let anew = found(&state, "run A from step 0");
        let command = "sightline track /drives/six-stops --target 512.3,480.6 --set ncc_min=0.6";
        assert_eq!(anew.command.as_deref(), Some(command));
    }
}
