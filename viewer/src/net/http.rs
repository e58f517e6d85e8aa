//! Requests over HTTP and how their answers are read.

use std::sync::Arc;

use ehttp::{Headers, Method};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sightline_core::image::npz;
use sightline_core::session::compare::RunName;
use sightline_core::session::wire::{Designated, Problem};
use sightline_core::settings::Changes;
use sightline_core::study::wire::StudyRows;
use sightline_core::trace::ArrayName;
use sightline_core::trackability::TrackabilityLimits;

use super::{Arrived, Reply, Request, why};
use crate::cache::{Item, Key, StepKey};
use crate::raster::Raster;
use crate::tables::Table;

/// Sends `request` to the server at `origin` and hands the answer to `done`, perhaps on another thread.
pub(super) fn send(
    origin: &str,
    request: Request,
    context: &egui::Context,
    done: impl FnOnce(Arrived) + Send + 'static,
) {
    let (method, path, body) = describe(&request);
    let mut http = ehttp::Request::get(format!("{origin}/api/v1/{path}"));
    http.method = method;
    // Rendering an image or designating a target takes as long as it takes.
    http.timeout = None;
    if let Some(body) = body {
        http.headers = Headers::new(&[("Accept", "application/json"), ("Content-Type", "application/json")]);
        http.body = body;
    }
    if let Some(revision) = revision(&request) {
        http.headers.insert("If-Match", format!("\"{revision}\""));
    }
    let context = context.clone();
    ehttp::fetch(http, move |answer| {
        let outcome = match answer {
            Ok(response) if response.ok && response.status != 202 => read(&request, &response, &context),
            Ok(response) if response.status == 202 && !matches!(request, Request::Item(_)) => {
                read(&request, &response, &context)
            }
            Ok(response) => Err(problem(&response)),
            Err(why) => Err(unreachable(&why.to_string())),
        };
        done(Arrived { request, outcome });
    });
}

/// Method, path and body of a request.
pub(crate) fn describe(request: &Request) -> (Method, String, Option<Vec<u8>>) {
    let get = |path: String| (Method::GET, path, None);
    let order = |path: String| (Method::POST, path, json(&serde_json::json!({})));
    match request {
        Request::Traverses => get("traverses".to_owned()),
        Request::Settings => get("settings".to_owned()),
        Request::Traverse(id) => get(format!("traverses/{id}")),
        Request::Sessions => get("sessions".to_owned()),
        Request::Session(id) => get(format!("sessions/{id}")),
        Request::Cursor(session) => get(format!("sessions/{session}/cursor")),
        Request::Rows { session, target, run, from_row } => {
            get(format!("sessions/{session}/targets/{target}/runs/{run}?from_row={from_row}"))
        }
        Request::NewSession(new) => (Method::POST, "sessions".to_owned(), json(new)),
        Request::PutCursor { session, cursor } => {
            (Method::PUT, format!("sessions/{session}/cursor"), json(cursor))
        }
        Request::NewTarget { session, target } => {
            (Method::POST, format!("sessions/{session}/targets"), json(target))
        }
        Request::RemoveTarget { session, target } => {
            (Method::DELETE, format!("sessions/{session}/targets/{target}"), None)
        }
        Request::NewRun { session, target, new } => {
            (Method::POST, format!("sessions/{session}/targets/{target}/runs"), json(new))
        }
        Request::CancelRun { session, target, run } => {
            order(format!("sessions/{session}/targets/{target}/runs/{run}/cancel"))
        }
        Request::ResumeRun { session, target, run } => {
            order(format!("sessions/{session}/targets/{target}/runs/{run}/resume"))
        }
        Request::OpenRerun(session) => order(format!("sessions/{session}/rerun")),
        Request::Studies => get("studies".to_owned()),
        Request::StudyJobs => get("studies/jobs".to_owned()),
        Request::StartStudy(new) => (Method::POST, "studies/jobs".to_owned(), json(new)),
        Request::CancelStudy(job) => order(format!("studies/jobs/{job}/cancel")),
        Request::ResumeStudy(job) => order(format!("studies/jobs/{job}/resume")),
        Request::StudyRows(job) => get(format!("studies/jobs/{job}/rows")),
        Request::Item(key) => get(item_path(key)),
        Request::Reconnect => get(String::new()),
        Request::Compare { session, new } => (Method::POST, format!("sessions/{session}/compare"), json(new)),
        Request::Metrics { session, run: RunName { target, run } } => {
            get(format!("sessions/{session}/targets/{target}/runs/{run}/metrics"))
        }
        Request::Trackability { traverse, step, limits } => {
            get(format!("traverses/{traverse}/steps/{step}/trackability{}", query_of(limits)))
        }
        Request::CancelTrackability { traverse, step, limits } => {
            order(format!("traverses/{traverse}/steps/{step}/trackability/cancel{}", query_of(limits)))
        }
        Request::Why(request) => why::describe(request),
        Request::Notes(session) => get(format!("sessions/{session}/notes")),
        Request::NewNote { session, new } => (Method::POST, format!("sessions/{session}/notes"), json(new)),
        Request::EditNote { session, id, edit, .. } => {
            (Method::PATCH, format!("sessions/{session}/notes/{id}"), json(edit))
        }
        Request::RemoveNote { session, id, .. } => {
            (Method::DELETE, format!("sessions/{session}/notes/{id}"), None)
        }
        Request::RestoreNote { session, id } => order(format!("sessions/{session}/notes/{id}/restore")),
        Request::Exports { session, target, run } => {
            let target = target.map_or_else(String::new, |target| format!("?target={target}"));
            let run = run.map_or_else(String::new, |run| format!("&run={run}"));
            get(format!("sessions/{session}/exports{target}{run}"))
        }
        Request::Ask(asked) => super::ask::describe(asked),
        Request::Files(asked) => super::files::describe(asked),
    }
}

/// The revision that a request says it has read.
pub(crate) fn revision(request: &Request) -> Option<u64> {
    match request {
        Request::EditNote { revision, .. } | Request::RemoveNote { revision, .. } => Some(*revision),
        _ => None,
    }
}

fn item_path(key: &Key) -> String {
    let step_path = |StepKey { session, target, run, step }: &StepKey| {
        format!("sessions/{session}/targets/{target}/runs/{run}/steps/{step}")
    };
    match key {
        Key::Image { traverse, step, eye } => {
            format!("traverses/{traverse}/steps/{step}/images/{}.png", eye.word())
        }
        Key::Stop { traverse, step } => format!("traverses/{traverse}/steps/{step}"),
        Key::Trace(step) => step_path(step),
        Key::Arrays(step) => format!("{}/arrays.npz", step_path(step)),
        Key::Array(step, name) => format!("{}/arrays/{}.npy", step_path(step), name.word()),
    }
}

pub(super) fn json(value: &impl Serialize) -> Option<Vec<u8>> {
    serde_json::to_vec(value).ok()
}

/// Reads the body of an answer to `request`.
fn read(request: &Request, response: &ehttp::Response, context: &egui::Context) -> Result<Reply, Problem> {
    let bytes = &response.bytes;
    Ok(match request {
        Request::Traverses => Reply::Traverses(parse(bytes)?),
        Request::Settings => Reply::Settings(parse(bytes)?),
        Request::Traverse(_) => Reply::Traverse(Box::new(parse(bytes)?)),
        Request::Sessions => Reply::Sessions(parse(bytes)?),
        Request::Session(_) | Request::NewSession(_) => Reply::Session(Box::new(parse(bytes)?)),
        Request::NewTarget { .. } => {
            let Designated { target, session, .. } = parse(bytes)?;
            Reply::Designated { target, session: Box::new(session) }
        }
        Request::NewRun { .. } | Request::Rows { .. } => Reply::Run(Box::new(parse(bytes)?)),
        Request::Cursor(_) => Reply::Cursor(parse(bytes)?),
        Request::OpenRerun(_) => Reply::Rerun(parse(bytes)?),
        Request::Studies => Reply::Studies(parse(bytes)?),
        Request::StudyJobs => Reply::StudyJobs(parse(bytes)?),
        Request::StartStudy(_) | Request::CancelStudy(_) | Request::ResumeStudy(_) => {
            Reply::StudyJob(parse(bytes)?)
        }
        Request::StudyRows(_) => {
            let StudyRows { rows } = parse(bytes)?;
            Reply::StudyRows(rows)
        }
        Request::Item(key) => Reply::Item(read_item(key, bytes, context)?),
        Request::Why(request) => Reply::Why(why::read(request, bytes)?),
        Request::Notes(_) => Reply::Notes(parse(bytes)?),
        Request::Exports { .. } => Reply::Exports(parse(bytes)?),
        Request::NewNote { .. }
        | Request::EditNote { .. }
        | Request::RemoveNote { .. }
        | Request::RestoreNote { .. }
        | Request::PutCursor { .. }
        | Request::RemoveTarget { .. }
        | Request::CancelRun { .. }
        | Request::ResumeRun { .. }
        | Request::CancelTrackability { .. }
        | Request::Reconnect => Reply::Done,
        Request::Compare { .. } => Reply::Compared(Box::new(parse(bytes)?)),
        Request::Metrics { .. } => Reply::Metrics(Box::new(parse(bytes)?)),
        Request::Trackability { .. } => Reply::Trackability(Box::new(parse(bytes)?)),
        Request::Ask(asked) => Reply::Ask(super::ask::read(asked, bytes)?),
        Request::Files(asked) => Reply::Files(super::files::read(asked, bytes)?),
    })
}

/// Changed limits as a query; nothing where none is changed.
fn query_of(limits: &Changes) -> String {
    if limits.is_empty() {
        return String::new();
    }
    format!("?limits={}", why::escaped(&TrackabilityLimits::text(limits)))
}

fn read_item(key: &Key, bytes: &[u8], context: &egui::Context) -> Result<Item, Problem> {
    match key {
        Key::Stop { .. } => Ok(Item::Stop(Arc::new(parse(bytes)?))),
        Key::Trace(_) => Ok(Item::Trace(Arc::new(parse(bytes)?))),
        Key::Image { step, eye, .. } => {
            let name = format!("the {} image of step {step}", eye.word());
            let raster = Raster::from_png(context, &name, bytes).map_err(|why| misread(&why))?;
            Ok(Item::Raster(Arc::new(raster)))
        }
        Key::Array(_, name) => read_array(*name, bytes, context),
        Key::Arrays(step) => {
            let name = format!("the arrays of step {}", step.step);
            let files = npz::decode(bytes, name).map_err(|why| misread(&why.to_string()))?;
            // One that this page does not know is for a newer one.
            let known = files.iter().filter_map(|(word, file)| Some((ArrayName::from_word(word)?, file)));
            let read = known.map(|(name, file)| Ok((name, read_array(name, file, context)?)));
            read.collect::<Result<_, _>>().map(Item::Arrays)
        }
    }
}

fn read_array(name: ArrayName, bytes: &[u8], context: &egui::Context) -> Result<Item, Problem> {
    let item = if Table::is_table(name) {
        Table::from_npy(name, bytes).map(|table| Item::Table(Arc::new(table)))
    } else {
        Raster::from_npy(context, name, bytes).map(|raster| Item::Raster(Arc::new(raster)))
    };
    item.map_err(|why| misread(&why))
}

pub(super) fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Problem> {
    serde_json::from_slice(bytes).map_err(|why| misread(&why.to_string()))
}

/// What the server said instead of an answer.
fn problem(response: &ehttp::Response) -> Problem {
    serde_json::from_slice(&response.bytes).unwrap_or_else(|_| {
        let detail = format!("The server answered {} {}.", response.status, response.status_text);
        Problem::new(response.status, "unexpected", &response.status_text, detail)
    })
}

fn unreachable(why: &str) -> Problem {
    Problem::new(0, "unreachable", "no answer", format!("The server does not answer ({why})."))
}

fn misread(why: &str) -> Problem {
    let hint = "Page and server may be of different versions: load the page again.".to_owned();
    let detail = format!("The server's answer cannot be read: {why}.");
    Problem { hint: Some(hint), ..Problem::new(500, "misread", "unreadable answer", detail) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::Eye;

    #[test]
    fn every_thing_has_its_path() {
        let step = StepKey { session: "s1".to_owned(), target: 2, run: 3, step: 4 };
        let image = Key::Image { traverse: "t".to_owned(), step: 7, eye: Eye::Right };
        assert_eq!(item_path(&image), "traverses/t/steps/7/images/right.png");
        assert_eq!(item_path(&Key::Trace(step.clone())), "sessions/s1/targets/2/runs/3/steps/4");
        assert_eq!(
            item_path(&Key::Array(step.clone(), ArrayName::RightWindow)),
            "sessions/s1/targets/2/runs/3/steps/4/arrays/right_window.npy"
        );
        assert_eq!(item_path(&Key::Arrays(step)), "sessions/s1/targets/2/runs/3/steps/4/arrays.npz");
    }

    #[test]
    fn an_answer_without_a_problem_document_is_still_a_problem() {
        let response = ehttp::Response {
            url: String::new(),
            ok: false,
            status: 502,
            status_text: "Bad Gateway".to_owned(),
            headers: Headers::default(),
            bytes: b"<html>".to_vec(),
        };
        let problem = problem(&response);
        assert_eq!(problem.status, 502);
        assert!(problem.detail.contains("Bad Gateway"));
    }
}
