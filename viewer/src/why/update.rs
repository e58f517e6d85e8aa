//! The user's questions about a step, their calls, and the replies.

use serde_json::Value;
use sightline_api::endpoint::{Call, Endpoint, NoBody};
use sightline_api::endpoints::{AskCounterfactual, CancelCounterfactual, ShowCounterfactual, ShowWhy};
use sightline_api::query::ValueName;
use sightline_api::wire::NewRun;
use sightline_session::counterfactual::wire::{Question, QuestionState};
use sightline_session::view::RunView;
use sightline_session::what_if::WhatIf;
use sightline_session::why::{Explanation, gates};

use crate::cache::StepKey;
use crate::panels::pane::Pane;
use crate::state::effect::Effect;
use crate::state::{State, run_letter};
use crate::what_if::Trial;
use crate::why::{Remote, WhyCommand, WhySection};

/// Maximum number of values in the history of the panel.
const REMEMBERED: usize = 50;
/// Maximum number of stored trees.
const KEPT: usize = 400;

impl State {
    /// The trial at the cursor's step.
    pub fn trial(&self) -> Option<&Trial> {
        let key = self.step_key(self.cursor.step)?;
        self.why.trial.as_ref().filter(|trial| trial.of == key)
    }

    /// The question about the cursor's step.
    pub fn question(&self) -> Option<&Remote<Question>> {
        self.why.questions.get(&self.step_key(self.cursor.step)?)
    }

    /// The shown value with its explanation: the last one requested for the selected target.
    pub fn explained(&self) -> Option<(&StepKey, &str, &Remote<Explanation>)> {
        let is_of_target = |(key, _): &&(StepKey, String)| Some(key.target) == self.cursor.target;
        let (key, value) = self.why.history.last().filter(is_of_target)?;
        let tree = self.why.trees.get(&(key.clone(), value.clone()))?;
        Some((key, value, tree))
    }

    /// The branch that forked from the selected run at the cursor's step with exactly this change.
    pub fn branch_of(&self, what_if: &WhatIf) -> Option<&RunView> {
        let (step, parent) = (self.cursor.step, self.run()?);
        let is_it = |run: &&RunView| {
            let left_here = run.fork.is_some_and(|fork| {
                (fork.run, fork.from_step, fork.prediction_px) == (parent.number, step, what_if.prediction_px)
            });
            left_here
                && parent.settings.with(&what_if.settings).is_ok_and(|settings| settings == run.settings)
        };
        self.target()?.runs.iter().find(is_it)
    }

    /// A setting of the trial, otherwise of the run.
    pub(crate) fn trial_setting(&self, group: &str, key: &str) -> Option<Value> {
        let tried = self.trial().and_then(|trial| trial.what_if.settings.get(key)).cloned();
        tried.or_else(|| self.setting(group, key))
    }

    /// Applies a command about a step.
    pub(crate) fn apply_why_command(&mut self, command: WhyCommand) {
        match command {
            WhyCommand::Value { step, value } => {
                self.why.scroll_request.request(WhySection::Tree);
                self.explain_value(step, value);
            }
            WhyCommand::Back => {
                self.why.scroll_request.request(WhySection::Tree);
                self.why.history.pop();
            }
            WhyCommand::Selected => self.explain_selected(),
            WhyCommand::Saved => self.search_counterfactuals(),
            WhyCommand::CancelSaved => {
                if let Some(key) = self.step_key(self.cursor.step) {
                    self.call_question::<CancelCounterfactual>(key, false);
                }
            }
            WhyCommand::Try(what_if) => self.try_out(what_if),
            WhyCommand::Change { key, value } => {
                let mut what_if = self.trial().map(|trial| trial.what_if.clone()).unwrap_or_default();
                match value {
                    Some(value) => what_if.settings.insert(key, value),
                    None => what_if.settings.remove(&key),
                };
                self.try_out(what_if);
            }
            WhyCommand::Displace(pixel) => {
                let what_if = self.trial().map(|trial| trial.what_if.clone()).unwrap_or_default();
                self.try_out(WhatIf { prediction_px: pixel, ..what_if });
            }
            WhyCommand::Scores(shown) => self.why.scores_shown = shown,
            WhyCommand::Discard => self.try_out(WhatIf::default()),
            WhyCommand::Branch => {
                if let Some(what_if) = self.trial().map(|trial| trial.what_if.clone()) {
                    self.branch(&what_if);
                }
            }
            WhyCommand::BranchWith(what_if) => self.branch(&what_if),
            WhyCommand::RemoveRun { target, run } => self.remove_run(target, run),
            WhyCommand::Undo => self.undo_last(),
            WhyCommand::Redo => self.redo_last(),
        }
    }

    fn explain_value(&mut self, step: usize, value: String) {
        self.outbox.add(Effect::reveal(Pane::Why));
        let Some(key) = self.step_key(step) else { return };
        self.why.followed = self.step_key(self.cursor.step);
        self.request_explanation(&key, &value);
        let place = (key, value);
        if self.why.history.last() != Some(&place) {
            self.why.history.push(place);
        }
        if self.why.history.len() > REMEMBERED {
            self.why.history.remove(0);
        }
    }

    pub(crate) fn request_explanation(&mut self, key: &StepKey, value: &str) {
        let place = (key.clone(), value.to_owned());
        if matches!(self.why.trees.get(&place), Some(Remote::Pending | Remote::Received(_))) {
            return;
        }
        if self.why.trees.len() >= KEPT {
            self.why.trees.pop_first();
        }
        self.why.trees.insert(place.clone(), Remote::Pending);
        let call = Call::with_query::<ShowWhy>(key, &ValueName { value: Some(value.to_owned()) });
        self.call_with_problem::<ShowWhy>(call, move |state, outcome| {
            let remote = outcome.map_or_else(|problem| Remote::Refused(problem.detail), Remote::Received);
            state.why.trees.insert(place, remote);
        });
    }

    /// Shows the card of this step, and explains the last explained value if this step has it; otherwise the gate with the
    /// smallest margin, otherwise the state.
    fn explain_selected(&mut self) {
        self.why.scroll_request.request(WhySection::Card);
        let last = self.why.history.last().map(|(_, value)| value.clone());
        let last = last.filter(|value| self.has_value(value));
        let worst = || {
            let verdict = self.trace()?.verdict()?;
            gates::by_margin(&verdict.gates).first().map(|margin| format!("gate.{}", margin.gate.name))
        };
        let value = last.or_else(worst).unwrap_or_else(|| "state".to_owned());
        self.explain_value(self.cursor.step, value);
    }

    fn search_counterfactuals(&mut self) {
        self.why.scroll_request.request(WhySection::Saved);
        self.outbox.add(Effect::reveal(Pane::Why));
        let Some(key) = self.step_key(self.cursor.step).filter(|_| self.row().is_some()) else {
            let missing = self.missing_step();
            self.messages.problem(missing, None);
            return;
        };
        if self.target().is_some_and(|target| target.designation.step == key.step) {
            self.messages.note("The target was picked at this step: nothing was judged that could be saved.");
            return;
        }
        let goes_on = match self.why.questions.get(&key) {
            Some(Remote::Pending) => true,
            Some(Remote::Received(question)) => {
                matches!(
                    question.state,
                    QuestionState::Waiting | QuestionState::Running | QuestionState::Done
                )
            }
            _ => false,
        };
        if !goes_on {
            self.why.questions.insert(key.clone(), Remote::Pending);
            self.call_question::<AskCounterfactual>(key, true);
        }
    }

    /// Forks the run at the cursor's step with a change.
    fn branch(&mut self, what_if: &WhatIf) {
        let Some((target, run)) = self.target().map(|t| t.number).zip(self.run().map(|r| r.number)) else {
            return;
        };
        let from_step = self.cursor.step;
        let (settings, prediction_px) = (what_if.settings.clone(), what_if.prediction_px);
        let new = NewRun { run, from_step, settings, prediction_px };
        if self.fork(target, &new) {
            self.messages.note(format!("Running {} from step {from_step} as a branch …", run_letter(run)));
        }
    }

    /// Calls `E` about a question: to read, begin or cancel it.
    fn call_question<E>(&mut self, key: StepKey, is_refusal_shown: bool)
    where
        E: Endpoint<At = StepKey, Body = NoBody, Reply = Question>,
    {
        self.call_with_problem::<E>(Call::to::<E>(&key), move |state, outcome| match outcome {
            Ok(question) if question.state != QuestionState::Unasked => {
                state.why.questions.insert(key, Remote::Received(question));
            }
            Err(problem) if is_refusal_shown => {
                state.why.questions.insert(key, Remote::Refused(problem.detail));
            }
            // Not asked before, or finished meanwhile.
            _ => {}
        });
    }

    /// Reads the progress of a counterfactual search.
    fn read_question(&mut self, key: StepKey) {
        self.call_question::<ShowCounterfactual>(key, false);
    }

    /// Reads a search again after an event about it.
    pub(crate) fn on_question_progress(&mut self, key: StepKey) {
        if self.session.as_ref().is_some_and(|session| session.id == key.session) {
            self.read_question(key);
        }
    }

    /// Reads the unfinished searches again: the page may have missed events about them.
    pub(crate) fn follow_questions(&mut self) {
        let is_open = |remote: &Remote<Question>| match remote {
            Remote::Received(question) => !question.state.is_over(),
            Remote::Pending | Remote::Refused(_) => false,
        };
        let open =
            self.why.questions.iter().filter(|(_, remote)| is_open(remote)).map(|(key, _)| key.clone());
        for key in open.collect::<Vec<_>>() {
            self.read_question(key);
        }
    }

    /// Reads once whether counterfactuals of the cursor's step already exist, so that a reloaded page finds them.
    pub fn read_question_once(&mut self) {
        let is_lost = self.row().is_some_and(|row| row.state != "tracking" || row.tracked == Some(false));
        let Some(key) = self.step_key(self.cursor.step).filter(|_| is_lost) else { return };
        if self.why.checked_questions.insert(key.clone()) {
            self.read_question(key);
        }
    }
}
