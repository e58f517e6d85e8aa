//! Any action of the page as a text for a shell: as `curl`, and as `sightline …` where the command line has it.

mod asked;

use sightline_api::endpoint::Call;
use sightline_api::wire::{NewRun, NewTarget};
use sightline_session::exports::ExportEntry;
use sightline_session::shell::{self, Curl};
use sightline_session::view::{RunView, TargetView};
use sightline_track::settings::Changes;
use sightline_track::target::Designation;

use crate::net::request::Request;
use crate::state::{State, run_letter};

/// An action that a person may want to repeat elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Action {
    /// What it does.
    pub words: String,
    /// As a command of the program, where it has one.
    pub command: Option<String>,
    /// As `curl`.
    pub http: String,
}

/// A call as `curl`.
pub(crate) fn http(origin: &str, call: Call) -> String {
    let body = call.body.and_then(|body| String::from_utf8(body).ok());
    let url = format!("{origin}/api/v1/{}", call.path);
    let (method, revision) = (call.method.name(), call.revision);
    Curl { method, url: &url, body: body.as_deref(), revision, file: None }.text()
}

/// A file of an export as `curl`.
pub(crate) fn download(origin: &str, entry: &ExportEntry) -> String {
    let url = format!("{origin}/api/v1/{}", entry.path);
    Curl { method: "GET", url: &url, body: None, revision: None, file: Some(&entry.file) }.text()
}

/// An answer that never ends as `curl`, which hands every part of it on at once.
pub(crate) fn stream(origin: &str, path: &str) -> String {
    let url = format!("{origin}/api/v1/{path}");
    let text = Curl { method: "GET", url: &url, body: None, revision: None, file: None }.text();
    text.replacen("curl ", "curl -N ", 1)
}

/// A request as a command of the program; none where it has no such command.
pub(crate) fn command(state: &State, request: &Request) -> Option<String> {
    let drive = &state.traverse.as_ref()?.source;
    match request {
        Request::NewTarget { target, .. } => track(drive, target),
        Request::NewRun { target, new, .. } => {
            let of = state.session.as_ref()?.targets.iter().find(|known| known.number == *target)?;
            // A run that leaves another on its way has steps of both, which the command line does not do.
            if new.from_step > of.designation.step {
                return None;
            }
            let mut changes = of.runs.iter().find(|run| run.number == new.run)?.changes.clone();
            changes.extend(new.settings.clone());
            track(drive, &target_of(of, changes))
        }
        _ => None,
    }
}

/// The pick of a target, as it would be asked for.
fn target_of(target: &TargetView, settings: Changes) -> NewTarget {
    let designation = target.designation;
    NewTarget { settings, ..NewTarget::at_pixel(designation.step, designation.pixel) }
}

fn track(drive: &str, target: &NewTarget) -> Option<String> {
    let designation = Designation { step: target.step, pixel: target.pixel? };
    Some(shell::track(drive, designation, &target.settings))
}

/// What can be done where the cursor is, and what was done to come there.
pub(crate) fn actions(state: &State) -> Vec<Action> {
    let Some(session) = state.session.as_ref().map(|session| session.id.clone()) else { return Vec::new() };
    let mut requests = vec![(
        format!("go to step {}", state.cursor.step),
        Request::PutCursor { session: session.clone(), cursor: state.cursor },
    )];
    if let (Some(target), Some(run)) = (state.target(), state.run()) {
        requests.extend(of_run(state, &session, target, run));
    }
    if let Some(key) = state.step_key(state.cursor.step).filter(|_| state.row().is_some()) {
        requests.push((format!("read step {}", key.step), Request::Item(crate::cache::Key::Trace(key))));
    }
    let action = |(words, request): (String, Request)| {
        let http = http(&state.origin, request.call()?);
        Some(Action { words, command: command(state, &request), http })
    };
    let asked = asked::calls(state, &session).into_iter();
    let asked = asked.map(|(words, call)| Action { words, command: None, http: http(&state.origin, call) });
    requests.into_iter().filter_map(action).chain(asked).collect()
}

fn of_run(state: &State, session: &str, target: &TargetView, run: &RunView) -> Vec<(String, Request)> {
    let (session, number, letter) = (session.to_owned(), target.number, run_letter(run.number));
    let first = target.runs.first().map(|first| first.changes.clone()).unwrap_or_default();
    let mut pick = target_of(target, first);
    pick.label = Some(target.label.clone());
    let mut requests = vec![(
        format!("pick {}", target.label),
        Request::NewTarget { session: session.clone(), target: pick },
    )];
    if let Some(fork) = run.fork {
        let parent = target.runs.iter().find(|other| other.number == fork.run);
        let settings =
            parent.map_or_else(|| run.changes.clone(), |parent| run.settings.changes_from(&parent.settings));
        let prediction_px = fork.prediction_px;
        let new = NewRun { run: fork.run, from_step: fork.from_step, settings, prediction_px };
        requests.push((
            format!("make run {letter} of run {}", run_letter(fork.run)),
            Request::NewRun { session: session.clone(), target: number, new },
        ));
    }
    let last = run.rows.last().map_or(target.designation.step, |row| row.step + 1);
    let new = NewRun {
        run: run.number,
        from_step: state.cursor.step.clamp(target.designation.step, last),
        settings: state.draft.clone(),
        prediction_px: None,
    };
    requests.push((
        format!("run {letter} from step {} with the changed settings", new.from_step),
        Request::NewRun { session: session.clone(), target: number, new },
    ));
    let run = run.number;
    requests.push((format!("cancel run {letter}"), Request::CancelRun { session, target: number, run }));
    requests
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;
    use sightline_session::Cursor;
    use sightline_session::notes::EditNote;
    use sightline_session::shell::WITH_TOKEN;

    const ORIGIN: &str = "http://127.0.0.1:7700";

    #[test]
    fn requests_become_curl() {
        let session = || "s1".to_owned();
        let cursor = Cursor { target: Some(0), run: 1, step: 4 };
        let text = http(ORIGIN, Request::PutCursor { session: session(), cursor }.call().unwrap());
        assert_eq!(
            text,
            format!(
                "{WITH_TOKEN} | curl -fsS -H @- -X PUT http://127.0.0.1:7700/api/v1/sessions/s1/cursor -H \
                 'Content-Type: application/json' --data-raw '{{\"target\":0,\"run\":1,\"step\":4}}'"
            )
        );
        let read = http(ORIGIN, Request::Session(session()).call().unwrap());
        assert_eq!(read, format!("{WITH_TOKEN} | curl -fsS -H @- http://127.0.0.1:7700/api/v1/sessions/s1"));
        let edit = EditNote { text: Some("it's".to_owned()), place: None };
        let edited =
            http(ORIGIN, Request::EditNote { session: session(), id: 2, revision: 5, edit }.call().unwrap());
        assert!(edited.contains("-X PATCH") && edited.contains("-H 'If-Match: \"5\"'"), "{edited}");
        assert!(edited.contains("it'\\''s"), "{edited}");
        assert_eq!(Request::Reconnect.call(), None);
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
