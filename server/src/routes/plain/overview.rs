//! The pages above a step: all sessions, and one session with its targets, runs, events and notes.

use std::fmt::Write;

use super::{page, step_path};
use crate::exports::{SessionPart, Source, note_html, run_letter};
use crate::html::{escape, table};
use crate::state::AppState;

/// The page with all sessions.
pub(super) fn all(state: &AppState) -> String {
    let mut html = "<h1>Sightline, in plain pages</h1>\n<p>Every step of every run can be read here without the viewer.</p>\n".to_owned();
    html.push_str("<h2>Sessions</h2>\n<ul>\n");
    let sessions = state.sessions();
    for live in &sessions {
        let count = live.with(|session| session.targets.iter().filter(|target| !target.removed).count());
        let name = escape(&live.traverse().traverse.index().name);
        let targets = if count == 1 { "1 target".to_owned() } else { format!("{count} targets") };
        let _ = writeln!(
            html,
            "<li><a href=\"/api/v1/sessions/{id}/page\">Session {id}</a> on {name}, {targets}</li>",
            id = live.id
        );
    }
    html.push_str("</ul>\n");
    if sessions.is_empty() {
        html.push_str(
            "<p>There is no session yet. A script begins one with <code>POST /api/v1/sessions</code>; <a \
                       href=\"/api/v1/openapi.json\">the interface</a> describes all routes.</p>\n",
        );
    }
    html.push_str("<nav aria-label=\"Elsewhere\"><ul><li><a href=\"/\">Viewer</a></li></ul></nav>\n");
    page("Sessions", &html)
}

/// The page of one session.
pub(super) fn session(source: &Source) -> String {
    let session = &source.session;
    let name = escape(&source.open.traverse.index().name);
    let mut html = format!(
        "<nav aria-label=\"Elsewhere\"><ul><li><a href=\"/api/v1/page\">All sessions</a></li><li><a \
         href=\"/#session={id}\">Viewer</a></li><li><a href=\"/api/v1/sessions/{id}/exports/report.html\">Report</a></li></ul></nav>\n\
         <h1>Session {id} on {name}</h1>\n<p>{}</p>\n",
        escape(&source.open.traverse.index().description),
        id = session.id,
    );
    let cursor = session.cursor;
    if let Some(target) = cursor.target.filter(|target| session.run(*target, cursor.run).is_ok()) {
        let path = step_path(&session.id, target, cursor.run, cursor.step);
        let _ = writeln!(html, "<p><a href=\"{path}\">Current step: step {}</a></p>", cursor.step);
    }
    let runs = source.runs(SessionPart::default());
    html.push_str("<h2>Targets and runs</h2>\n");
    if runs.is_empty() {
        html.push_str("<p>No target was picked yet.</p>\n");
    }
    for run in runs {
        let letter = run_letter(run.number);
        let _ = writeln!(html, "<h3>{}, run {letter}</h3>", escape(&run.record.label));
        if let Some(fork) = run.run.fork {
            let _ = writeln!(html, "<p>Branch of run {}, step {}.</p>", run_letter(fork.run), fork.from_step);
        }
        let rows: Vec<_> = run.run.steps.iter().map(|trace| trace.row()).collect();
        html.push_str("<nav aria-label=\"Steps\"><ul>\n");
        for row in &rows {
            let path = step_path(&session.id, run.target, run.number, row.step);
            let _ =
                writeln!(html, "<li><a href=\"{path}\">Step {}, {}</a></li>", row.step, escape(&row.state));
        }
        html.push_str("</ul></nav>\n");
        let changes = run.run.settings.changes();
        if !changes.is_empty() {
            let rows: Vec<Vec<String>> =
                changes.iter().map(|(key, value)| vec![key.clone(), value.to_string()]).collect();
            html.push_str(&table("Settings that differ from the defaults.", &["setting", "value"], &rows));
        }
    }
    html.push_str("<h2>Notes</h2>\n");
    if source.notes.list.is_empty() {
        html.push_str("<p>There are no notes.</p>\n");
    }
    for (k, note) in source.notes.list.iter().enumerate() {
        html.push_str(&note_html(k + 1, note, session));
        if let Some(target) = note.pin.target.filter(|target| session.run(*target, note.pin.run).is_ok()) {
            let path = step_path(&session.id, target, note.pin.run, note.pin.step);
            let _ = writeln!(
                html,
                "<p><a href=\"{path}\">Go to step {} of note {}</a></p>",
                note.pin.step,
                k + 1
            );
        }
    }
    page(&format!("Session {}", session.id), &html)
}
