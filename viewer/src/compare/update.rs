//! The user's commands about compared runs, their calls, and the replies.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{CompareRuns, ShowMetrics};
use sightline_api::location::{AtRun, AtSession};
use sightline_api::wire::Problem;
use sightline_session::Cursor;
use sightline_session::compare::{Comparison, NewComparison, RUNS_MAX, RunName};
use sightline_session::metrics::RunMetrics;

use crate::cache::{ImageSide, Key};
use crate::command::{Command, Go, Stage};
use crate::compare::{Compare, CompareCommand, ComparisonRequest};
use crate::state::{State, row_of};

/// Maximum number of concurrent requests for metrics.
const METRICS_AT_A_TIME: usize = 2;

impl State {
    /// Requests the missing comparison and metrics.
    pub(crate) fn sync_compare(&mut self, session: &str) {
        self.request_comparison(session);
        self.request_metrics(session);
    }

    fn request_comparison(&mut self, session: &str) {
        let Some(runs) = self.compared_names() else { return };
        let rows =
            runs.iter().map(|&name| self.run_named(name).map_or(0, |(_, run)| run.rows.len())).collect();
        let (align, tolerance) = (self.compare.align, self.tolerances());
        // The values are in the records: request only the alignment, the first divergence and the settings.
        let new = NewComparison { runs, align, tolerance, columns: Some(Vec::new()) };
        let request = ComparisonRequest { session: session.to_owned(), new, rows };
        let is_known = self.compare.answer.as_ref().is_some_and(|(known, _)| *known == request);
        if is_known || self.compare.pending_request.is_some() {
            return;
        }
        let call = Call::with_body::<CompareRuns>(&AtSession { session: session.to_owned() }, &request.new);
        self.compare.pending_request = Some(request.clone());
        self.call_with_problem::<CompareRuns>(call, move |state, outcome| {
            state.on_comparison_reply(&request, outcome);
        });
    }

    fn request_metrics(&mut self, session: &str) {
        if !self.compare.wants_metrics {
            return;
        }
        let missing: Vec<(RunName, usize)> = self
            .all_runs()
            .map(|(name, _, run)| (name, run.rows.len()))
            .filter(|(name, rows)| {
                let known = self.compare.metrics.get(name).is_some_and(|(known, _)| known == rows);
                *rows > 0 && !known && !self.compare.metrics_pending.contains_key(name)
            })
            .take(METRICS_AT_A_TIME.saturating_sub(self.compare.metrics_pending.len()))
            .collect();
        for (run, rows) in missing {
            self.compare.metrics_pending.insert(run, rows);
            let at = AtRun { session: session.to_owned(), target: run.target, run: run.run };
            self.call_with_problem::<ShowMetrics>(Call::to::<ShowMetrics>(&at), move |state, outcome| {
                state.on_metrics_reply(run, outcome);
            });
        }
    }

    /// Stores a comparison, or its problem.
    fn on_comparison_reply(&mut self, request: &ComparisonRequest, outcome: Result<Comparison, Problem>) {
        let Some(request) = self.compare.pending_request.take_if(|known| known == request) else { return };
        self.compare.answer = Some((request, outcome.map_err(|problem| problem.detail)));
        if std::mem::take(&mut self.compare.jumps) {
            self.go_to_first_divergence();
        }
    }

    /// Stores the metrics of a run, or their problem.
    fn on_metrics_reply(&mut self, run: RunName, outcome: Result<RunMetrics, Problem>) {
        if let Some(rows) = self.compare.metrics_pending.remove(&run) {
            self.compare.metrics.insert(run, (rows, outcome.map_err(|problem| problem.detail)));
        }
    }

    /// Discards the comparisons of another session, or those that may have changed while the server was unreachable.
    pub(crate) fn forget_comparisons(&mut self, is_other_session: bool) {
        if is_other_session {
            let (wants_metrics, view) = (self.compare.wants_metrics, self.compare.view);
            self.compare = Compare { wants_metrics, view, ..Compare::default() };
        } else {
            (self.compare.answer, self.compare.pending_request) = (None, None);
            self.compare.metrics_pending.clear();
        }
    }

    /// Keeps the comparison when the user selects a compared run: the previously selected run replaces it.
    pub(crate) fn keep_comparison(&mut self, before: Option<RunName>, now: Cursor) {
        let now = now.target.map(|target| RunName { target, run: now.run });
        let place = self.compare.others.iter().position(|&name| Some(name) == now);
        match (place, before.filter(|&name| Some(name) != now)) {
            (Some(place), Some(before)) => self.compare.others[place] = before,
            (Some(place), None) => drop(self.compare.others.remove(place)),
            (None, _) => {}
        }
    }

    /// Applies a command about compared runs.
    pub(crate) fn apply_compare_command(&mut self, command: CompareCommand) {
        match command {
            CompareCommand::With { place, run } => self.compare_with(place, run),
            CompareCommand::Toggle(name) => match self.compare.others.iter().position(|&other| other == name)
            {
                Some(place) => self.compare_with(place, None),
                None => self.compare_with(self.compare.others.len(), Some(name)),
            },
            CompareCommand::View(view) => self.compare.view = view,
            CompareCommand::NextView if self.is_comparing() => {
                self.compare.view = self.compare.view.next();
                let view = self.compare.view;
                self.messages.note(format!("Comparison “{}”: {}.", view.word(), view.help()));
            }
            CompareCommand::NextView => self.explain_how_to_compare(),
            CompareCommand::Align(align) => self.compare.align = align,
            CompareCommand::Tolerance(tolerance) => self.compare.tolerance = tolerance,
            CompareCommand::FirstDivergence => self.go_to_first_divergence(),
            CompareCommand::Blink(is_blinking) => self.compare.is_blinking = is_blinking,
            CompareCommand::Wipe(at) => self.compare.wipe = Some(at.clamp(0.0, 1.0)),
            CompareCommand::Stabilise => self.compare.is_stabilised = !self.compare.is_stabilised,
            CompareCommand::OnionSkin => self.compare.has_onion_skin = !self.compare.has_onion_skin,
            CompareCommand::Baseline(name) => {
                let is_baseline = self.compare.baseline == Some(name);
                self.compare.baseline = (!is_baseline).then_some(name);
            }
            CompareCommand::Sort(sort) => self.compare.sort = sort,
            CompareCommand::Filter(words) => self.compare.filter = words,
            CompareCommand::Visit { run, step } => {
                self.perform(Command::SelectRun { target: run.target, run: run.run });
                self.perform(Command::Go(Go::Step(step)));
            }
        }
    }

    fn explain_how_to_compare(&mut self) {
        let hint =
            "Choose a run beside “vs” in the top bar. A second run comes from “Run from here” in Settings.";
        self.messages.problem("There is no run to compare with yet.", Some(hint.to_owned()));
    }

    fn compare_with(&mut self, place: usize, run: Option<RunName>) {
        let others = &mut self.compare.others;
        match run {
            None if place < others.len() => drop(others.remove(place)),
            None => {}
            Some(name) => {
                let was = others.iter().position(|&other| other == name);
                if let Some(was) = was.filter(|&was| was != place) {
                    others.remove(was);
                }
                let place = place.min(others.len());
                if place < others.len() {
                    others[place] = name;
                } else if others.len() + 1 < RUNS_MAX {
                    others.push(name);
                } else {
                    let hint = Some("Take one of them out first.".to_owned());
                    self.messages.problem(format!("At most {RUNS_MAX} runs can be compared."), hint);
                }
            }
        }
    }

    fn go_to_first_divergence(&mut self) {
        if !self.is_comparing() {
            self.explain_how_to_compare();
            return;
        }
        if let Some(problem) = self.comparison_problem().map(str::to_owned) {
            self.messages.problem(problem, None);
            return;
        }
        let other = self.others().first().map(|other| other.name);
        let found = self
            .comparison()
            .and_then(|found| found.first.iter().find(|first| Some(first.run) == other))
            .cloned();
        let Some(found) = found else {
            self.compare.jumps = true;
            self.messages.note("Comparing the runs …");
            return;
        };
        let labels =
            [self.own_name(), other].map(|name| name.map_or_else(String::new, |name| self.run_label(name)));
        let [own, other] = labels;
        self.messages.note(format!("{own} and {other} {}.", found.sentence));
        let Some(divergence) = found.divergence else { return };
        self.cursor.step = divergence.step.min(self.stop_count().saturating_sub(1));
        let word = divergence.part.unwrap_or(divergence.stage);
        self.stage = Stage::of(self.tracker()).find(|stage| stage.word() == word).unwrap_or(Stage::LOCATE);
    }

    /// Adds the items that the compared runs need at a step: their records and arrays.
    pub(crate) fn add_compared_items(&self, keys: &mut Vec<Key>) {
        let step = self.cursor.step;
        for other in self.others() {
            // The records of the neighbouring steps are small; arrays are loaded only for the cursor's step.
            for near in [Some(step), step.checked_add(1), step.checked_sub(1)].into_iter().flatten() {
                let there =
                    self.aligned_step(other.name, near).filter(|&step| row_of(other.run, step).is_some());
                let Some(there) = there else { continue };
                keys.extend(self.other_key(other.name, there).map(Key::Trace));
                if near == step {
                    keys.extend(self.image_key_in(there, self.camera_of(other.name), ImageSide::Left));
                    keys.extend(self.other_key(other.name, there).map(Key::Arrays));
                }
            }
        }
    }
}
