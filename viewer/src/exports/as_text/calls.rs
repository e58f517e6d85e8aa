//! The calls behind the current view, which the user can repeat: explanation, trial, counterfactual, comparison, metrics,
//! breakpoints, columns, trackability, studies, live stream.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    AddBreakpoint, AskCounterfactual, CompareRuns, QuerySession, ShowMetrics, ShowTrackability, ShowWhy,
    TryStep,
};
use sightline_api::location::{AtRun, AtSession};
use sightline_api::query::ValueName;
use sightline_session::breakpoints::NewBreakpoint;
use sightline_session::compare::NewComparison;
use sightline_session::query::Query;

use crate::exports::update::stream_to_rerun;
use crate::state::State;
use crate::studies::update::start_study;
use crate::trackability::update::map_call;

/// The calls about the current view, each with its description.
pub(crate) fn calls(state: &State, session: &str) -> Vec<(String, Call)> {
    let mut calls = of_step(state);
    calls.extend(of_runs(state, session));
    calls.extend(of_expressions(state, session));
    if let Some(traverse) = &state.traverse {
        let (step, limits) = (state.cursor.step, state.trackability.limits.clone());
        let call = map_call::<ShowTrackability>(&(traverse.id.clone(), step, limits));
        calls.push((format!("map of trackability at step {step}"), call));
    }
    if let Some(new) = state.studies.chosen().and_then(|info| state.studies.form.request(info).ok()) {
        calls.push((format!("start the study {}", new.study), start_study(&new)));
    }
    if state.target().is_some() {
        calls.push(("stream to Rerun".to_owned(), stream_to_rerun(session.to_owned())));
    }
    calls
}

/// The calls about the cursor's step.
fn of_step(state: &State) -> Vec<(String, Call)> {
    let Some(at) = state.step_key(state.cursor.step).filter(|_| state.row().is_some()) else {
        return Vec::new();
    };
    let step = at.step;
    let mut calls = Vec::new();
    if let Some((of, value, _)) = state.explained() {
        let call = Call::with_query::<ShowWhy>(of, &ValueName { value: Some(value.to_owned()) });
        calls.push((format!("why {value} at step {}", of.step), call));
    }
    if let Some(trial) = state.trial() {
        calls.push((format!("what if, at step {step}"), Call::with_body::<TryStep>(&at, &trial.what_if)));
    }
    if state.row().is_some_and(|row| row.state != "tracking" || row.tracked == Some(false)) {
        calls.push((format!("what would have saved step {step}"), Call::to::<AskCounterfactual>(&at)));
    }
    calls
}

/// The calls about the selected run and the compared ones.
fn of_runs(state: &State, session: &str) -> Vec<(String, Call)> {
    let session = session.to_owned();
    let mut calls = Vec::new();
    if let Some(name) = state.own_name() {
        let at = AtRun { session: session.clone(), target: name.target, run: name.run };
        calls.push((format!("metrics of {}", state.run_label(name)), Call::to::<ShowMetrics>(&at)));
    }
    if let Some(runs) = state.compared_names() {
        let labels: Vec<String> = runs.iter().map(|&run| state.run_label(run)).collect();
        let (align, tolerance) = (state.compare.align, state.tolerances());
        let new = NewComparison { runs, align, tolerance, columns: None };
        let call = Call::with_body::<CompareRuns>(&AtSession { session }, &new);
        calls.push((format!("compare {}", labels.join(", ")), call));
    }
    calls
}

/// The calls for breakpoints and plotted expressions.
fn of_expressions(state: &State, session: &str) -> Vec<(String, Call)> {
    let at = AtSession { session: session.to_owned() };
    let breakpoints = state.breakpoints.list.iter().map(|known| {
        let new = NewBreakpoint { expression: Some(known.expression.clone()), step: None };
        (format!("break when {}", known.expression), Call::with_body::<AddBreakpoint>(&at, &new))
    });
    let columns = state.breakpoints.derived.iter().map(|derived| {
        let query =
            Query { expression: derived.expression.clone(), target: state.cursor.target, values: true };
        (format!("column {}", derived.expression), Call::with_body::<QuerySession>(&at, &query))
    });
    breakpoints.chain(columns).collect()
}

#[cfg(test)]
mod tests {
    use crate::command::Command;
    use crate::exports::as_text::actions;
    use crate::tests::fixture;
    use crate::why::WhyCommand;

    #[test]
    fn every_request_has_an_http_equivalent() {
        let mut state = fixture::at_step(&egui::Context::default(), 3);
        state.perform(Command::Why(WhyCommand::Value { step: 3, value: "ncc".to_owned() }));
        state.perform(Command::Breakpoints(crate::breakpoints::BreakpointCommand::Plot(
            "stereo_score - ncc".to_owned(),
        )));
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
