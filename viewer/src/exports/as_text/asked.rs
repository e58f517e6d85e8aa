//! What the page asks of the server for what it shows, as requests that anybody can repeat: where a number came from, what is
//! tried, what would have saved a step, the comparison, metrics, breakpoints, columns, trackability, studies, the stream.

use sightline_api::endpoint::Call;
use sightline_session::breakpoints::NewBreakpoint;
use sightline_session::compare::NewComparison;
use sightline_session::query::Query;

use crate::breakpoints::AskRequest;
use crate::exports::update::stream_to_rerun;
use crate::net::request::Request;
use crate::net::why::WhyRequest;
use crate::state::State;
use crate::studies::update::start_study;

/// What is asked where the cursor is, each with its words.
pub(crate) fn calls(state: &State, session: &str) -> Vec<(String, Call)> {
    let mut requests = of_step(state);
    requests.extend(of_runs(state, session));
    requests.extend(of_expressions(state, session));
    if let Some(traverse) = &state.traverse {
        let (step, limits) = (state.cursor.step, state.trackability.limits.clone());
        let request = Request::Trackability { traverse: traverse.id.clone(), step, limits };
        requests.push((format!("map of trackability at step {step}"), request));
    }
    let called = |(words, request): (String, Request)| Some((words, request.call()?));
    let mut calls: Vec<(String, Call)> = requests.into_iter().filter_map(called).collect();
    if let Some(new) = state.studies.chosen().and_then(|info| state.studies.order.request(&info.name).ok()) {
        calls.push((format!("start the study {}", new.study), start_study(&new)));
    }
    if state.target().is_some() {
        calls.push(("stream to Rerun".to_owned(), stream_to_rerun(session.to_owned())));
    }
    calls
}

/// About the step that is looked at.
fn of_step(state: &State) -> Vec<(String, Request)> {
    let Some(of) = state.step_key(state.cursor.step).filter(|_| state.row().is_some()) else {
        return Vec::new();
    };
    let step = of.step;
    let mut asked = Vec::new();
    if let Some((of, value, _)) = state.explained() {
        let request = WhyRequest::Explain { of: of.clone(), value: value.to_owned() };
        asked.push((format!("why {value} at step {}", of.step), request));
    }
    if let Some(trial) = state.trial() {
        let what_if = trial.what_if.clone();
        asked.push((format!("what if, at step {step}"), WhyRequest::WhatIf { of: of.clone(), what_if }));
    }
    if state.row().is_some_and(|row| row.state != "tracking" || row.tracked == Some(false)) {
        asked.push((format!("what would have saved step {step}"), WhyRequest::AskQuestion(of)));
    }
    asked.into_iter().map(|(words, request)| (words, Request::Why(request))).collect()
}

/// About the run that is looked at and those beside it.
fn of_runs(state: &State, session: &str) -> Vec<(String, Request)> {
    let mut requests = Vec::new();
    if let Some(run) = state.own_name() {
        let words = format!("metrics of {}", state.run_label(run));
        requests.push((words, Request::Metrics { session: session.to_owned(), run }));
    }
    if let Some(runs) = state.compared_names() {
        let labels: Vec<String> = runs.iter().map(|&run| state.run_label(run)).collect();
        let (align, tolerance) = (state.compare.align, state.tolerances());
        let new = Box::new(NewComparison { runs, align, tolerance, columns: None });
        let words = format!("compare {}", labels.join(", "));
        requests.push((words, Request::Compare { session: session.to_owned(), new }));
    }
    requests
}

/// Breakpoints and plotted expressions.
fn of_expressions(state: &State, session: &str) -> Vec<(String, Request)> {
    let session = || session.to_owned();
    let breakpoints = state.ask.breakpoints.iter().map(|known| {
        let new = NewBreakpoint { expression: Some(known.expression.clone()), step: None };
        (format!("break when {}", known.expression), AskRequest::Add { session: session(), new })
    });
    let columns = state.ask.derived.iter().map(|derived| {
        let query =
            Query { expression: derived.expression.clone(), target: state.cursor.target, values: true };
        (format!("column {}", derived.expression), AskRequest::Query { session: session(), query })
    });
    breakpoints.chain(columns).map(|(words, request)| (words, Request::Ask(request))).collect()
}

#[cfg(test)]
mod tests {
    use crate::command::Command;
    use crate::exports::as_text::actions;
    use crate::tests::fixture;
    use crate::why::Ask;

    #[test]
    fn whatever_is_asked_can_be_repeated_over_http() {
        let mut state = fixture::at_step(&egui::Context::default(), 3);
        state.perform(Command::Why(Ask::Value { step: 3, value: "ncc".to_owned() }));
        state.perform(Command::Ask(crate::breakpoints::Ask::Plot("stereo_score - ncc".to_owned())));
        let all = actions(&state);
        let http = |words: &str| {
            let found = all.iter().find(|action| action.words == words);
            found.map(|action| action.http.as_str()).unwrap_or_else(|| panic!("no “{words}” in {all:?}"))
        };
        assert!(
            http("why ncc at step 3").contains("/steps/3/why?value=ncc"),
            "{}",
            http("why ncc at step 3")
        );
        let saved = http("what would have saved step 3");
        assert!(saved.contains("-X POST") && saved.contains("/steps/3/"), "{saved}");
        assert!(http("metrics of run A").ends_with("/targets/0/runs/0/metrics"));
        let column = http("column stereo_score - ncc");
        assert!(column.contains("/query") && column.contains("\"values\":true"), "{column}");
        assert!(http("map of trackability at step 3").contains("/traverses/drive/steps/3/trackability"));
        assert!(http("stream to Rerun").contains("/sessions/s1/rerun"));
    }
}
