//! The user's commands about compared runs, their calls, and what the replies change.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{CompareRuns, ShowMetrics};
use sightline_api::location::{AtRun, AtSession};
use sightline_api::wire::Problem;
use sightline_session::Cursor;
use sightline_session::compare::{Comparison, NewComparison, RUNS_MAX, RunName};
use sightline_session::metrics::RunMetrics;

use crate::cache::{Eye, Key};
use crate::command::{Command, Go, Stage};
use crate::compare::{Ask, Asked, Compare};
use crate::state::{State, row_of};

/// Requests for metrics that are under way at a time.
const METRICS_AT_A_TIME: usize = 2;

impl State {
    /// Reads the comparison and the metrics that are missing.
    pub(crate) fn sync_compare(&mut self, session: &str) {
        self.ask_for_comparison(session);
        self.ask_for_metrics(session);
    }

    fn ask_for_comparison(&mut self, session: &str) {
        let Some(runs) = self.compared_names() else { return };
        let rows =
            runs.iter().map(|&name| self.run_named(name).map_or(0, |(_, run)| run.rows.len())).collect();
        let (align, tolerance) = (self.compare.align, self.tolerances());
        // Values are in the records: request only the alignment, the first divergence and the settings.
        let new = NewComparison { runs, align, tolerance, columns: Some(Vec::new()) };
        let asked = Asked { session: session.to_owned(), new, rows };
        let is_known = self.compare.answer.as_ref().is_some_and(|(known, _)| *known == asked);
        if is_known || self.compare.under_way.is_some() {
            return;
        }
        let call = Call::with_body::<CompareRuns>(&AtSession { session: session.to_owned() }, &asked.new);
        self.compare.under_way = Some(asked.clone());
        self.call_with_problem::<CompareRuns>(call, move |state, outcome| {
            state.took_comparison(&asked, outcome);
        });
    }

    fn ask_for_metrics(&mut self, session: &str) {
        if !self.compare.wants_metrics {
            return;
        }
        let missing: Vec<(RunName, usize)> = self
            .all_runs()
            .map(|(name, _, run)| (name, run.rows.len()))
            .filter(|(name, rows)| {
                let known = self.compare.metrics.get(name).is_some_and(|(known, _)| known == rows);
                *rows > 0 && !known && !self.compare.metrics_asked.contains_key(name)
            })
            .take(METRICS_AT_A_TIME.saturating_sub(self.compare.metrics_asked.len()))
            .collect();
        for (run, rows) in missing {
            self.compare.metrics_asked.insert(run, rows);
            let at = AtRun { session: session.to_owned(), target: run.target, run: run.run };
            self.call_with_problem::<ShowMetrics>(Call::to::<ShowMetrics>(&at), move |state, outcome| {
                state.took_metrics(run, outcome);
            });
        }
    }

    /// Takes a comparison, or its problem.
    fn took_comparison(&mut self, asked: &Asked, outcome: Result<Comparison, Problem>) {
        let Some(asked) = self.compare.under_way.take_if(|known| known == asked) else { return };
        self.compare.answer = Some((asked, outcome.map_err(|problem| problem.detail)));
        if std::mem::take(&mut self.compare.jumps) {
            self.go_to_first_divergence();
        }
    }

    /// Takes the metrics of a run, or their problem.
    fn took_metrics(&mut self, run: RunName, outcome: Result<RunMetrics, Problem>) {
        if let Some(rows) = self.compare.metrics_asked.remove(&run) {
            self.compare.metrics.insert(run, (rows, outcome.map_err(|problem| problem.detail)));
        }
    }

    /// Forgets the comparisons of another session, or those that may have changed while the server was unreachable.
    pub(crate) fn forget_comparisons(&mut self, is_other_session: bool) {
        if is_other_session {
            let (wants_metrics, view) = (self.compare.wants_metrics, self.compare.view);
            self.compare = Compare { wants_metrics, view, ..Compare::default() };
        } else {
            (self.compare.answer, self.compare.under_way) = (None, None);
            self.compare.metrics_asked.clear();
        }
    }

    /// Keeps the comparison when the cursor moves to a compared run: the run before takes its place.
    pub(crate) fn looked_elsewhere(&mut self, before: Option<RunName>, now: Cursor) {
        let now = now.target.map(|target| RunName { target, run: now.run });
        let place = self.compare.others.iter().position(|&name| Some(name) == now);
        match (place, before.filter(|&name| Some(name) != now)) {
            (Some(place), Some(before)) => self.compare.others[place] = before,
            (Some(place), None) => drop(self.compare.others.remove(place)),
            (None, _) => {}
        }
    }

    /// Applies a command about compared runs.
    pub(crate) fn ask_compare(&mut self, ask: Ask) {
        match ask {
            Ask::With { place, run } => self.compare_with(place, run),
            Ask::Toggle(name) => match self.compare.others.iter().position(|&other| other == name) {
                Some(place) => self.compare_with(place, None),
                None => self.compare_with(self.compare.others.len(), Some(name)),
            },
            Ask::View(view) => self.compare.view = view,
            Ask::NextView if self.is_comparing() => {
                self.compare.view = self.compare.view.next();
                let view = self.compare.view;
                self.messages.note(format!("Comparison “{}”: {}.", view.word(), view.help()));
            }
            Ask::NextView => self.say_how_to_compare(),
            Ask::Align(align) => self.compare.align = align,
            Ask::Closeness(closeness) => self.compare.closeness = closeness,
            Ask::FirstDivergence => self.go_to_first_divergence(),
            Ask::Blink(is_blinking) => self.compare.is_blinking = is_blinking,
            Ask::Wipe(at) => self.compare.wipe = Some(at.clamp(0.0, 1.0)),
            Ask::Stabilise => self.compare.is_held = !self.compare.is_held,
            Ask::OnionSkin => self.compare.has_onion_skin = !self.compare.has_onion_skin,
            Ask::Baseline(name) => {
                let is_baseline = self.compare.baseline == Some(name);
                self.compare.baseline = (!is_baseline).then_some(name);
            }
            Ask::Sort(sort) => self.compare.sort = sort,
            Ask::Filter(words) => self.compare.filter = words,
            Ask::Visit { run, step } => {
                self.perform(Command::Look { target: run.target, run: run.run });
                self.perform(Command::Go(Go::Step(step)));
            }
        }
    }

    fn say_how_to_compare(&mut self) {
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
            self.say_how_to_compare();
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
    pub(crate) fn want_compared(&self, keys: &mut Vec<Key>) {
        let step = self.cursor.step;
        for other in self.others() {
            // The records of the neighbours are small; arrays are fetched for the cursor's step alone.
            for near in [Some(step), step.checked_add(1), step.checked_sub(1)].into_iter().flatten() {
                let there = self.beside(other.name, near).filter(|&step| row_of(other.run, step).is_some());
                let Some(there) = there else { continue };
                keys.extend(self.other_key(other.name, there).map(Key::Trace));
                if near == step {
                    keys.extend(self.image_key_in(there, self.camera_of(other.name), Eye::Left));
                    keys.extend(self.other_key(other.name, there).map(Key::Arrays));
                }
            }
        }
    }
}
