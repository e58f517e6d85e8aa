//! The user's questions about a step, their calls, and what the replies change.

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
use crate::why::{Ask, Part, Told};

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
    pub fn question(&self) -> Option<&Told<Question>> {
        self.why.questions.get(&self.step_key(self.cursor.step)?)
    }

    /// The value that is shown, with its tree: the last one that was asked for of the target at the cursor.
    pub fn explained(&self) -> Option<(&StepKey, &str, &Told<Explanation>)> {
        let is_of_target = |(key, _): &&(StepKey, String)| Some(key.target) == self.cursor.target;
        let (key, value) = self.why.asked.last().filter(is_of_target)?;
        let tree = self.why.trees.get(&(key.clone(), value.clone()))?;
        Some((key, value, tree))
    }

    /// The branch that left the run at the cursor's step with exactly this change.
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

    /// A setting as it is tried, else as it is in the run.
    pub(crate) fn tried_setting(&self, group: &str, key: &str) -> Option<Value> {
        let tried = self.trial().and_then(|trial| trial.what_if.settings.get(key)).cloned();
        tried.or_else(|| self.setting(group, key))
    }

    /// Applies a command about a step.
    pub(crate) fn ask_why(&mut self, ask: Ask) {
        match ask {
            Ask::Value { step, value } => {
                self.why.in_view.ask(Part::Tree);
                self.ask_value(step, value);
            }
            Ask::Back => {
                self.why.in_view.ask(Part::Tree);
                self.why.asked.pop();
            }
            Ask::Selected => self.ask_selected(),
            Ask::Saved => self.ask_what_saves(),
            Ask::CancelSaved => {
                if let Some(key) = self.step_key(self.cursor.step) {
                    self.call_question::<CancelCounterfactual>(key, false);
                }
            }
            Ask::Try(what_if) => self.try_out(what_if),
            Ask::Change { key, value } => {
                let mut what_if = self.trial().map(|trial| trial.what_if.clone()).unwrap_or_default();
                match value {
                    Some(value) => what_if.settings.insert(key, value),
                    None => what_if.settings.remove(&key),
                };
                self.try_out(what_if);
            }
            Ask::Displace(pixel) => {
                let what_if = self.trial().map(|trial| trial.what_if.clone()).unwrap_or_default();
                self.try_out(WhatIf { prediction_px: pixel, ..what_if });
            }
            Ask::Scores(shown) => self.why.scores_shown = shown,
            Ask::Discard => self.try_out(WhatIf::default()),
            Ask::Branch => {
                if let Some(what_if) = self.trial().map(|trial| trial.what_if.clone()) {
                    self.branch(&what_if);
                }
            }
            Ask::BranchWith(what_if) => self.branch(&what_if),
            Ask::RemoveRun { target, run } => self.remove_run(target, run),
            Ask::Undo => self.undo_last(),
            Ask::Redo => self.redo_last(),
        }
    }

    fn ask_value(&mut self, step: usize, value: String) {
        self.outbox.add(Effect::reveal(Pane::Why));
        let Some(key) = self.step_key(step) else { return };
        self.why.followed = self.step_key(self.cursor.step);
        self.want_tree(&key, &value);
        let place = (key, value);
        if self.why.asked.last() != Some(&place) {
            self.why.asked.push(place);
        }
        if self.why.asked.len() > REMEMBERED {
            self.why.asked.remove(0);
        }
    }

    pub(crate) fn want_tree(&mut self, key: &StepKey, value: &str) {
        let place = (key.clone(), value.to_owned());
        if matches!(self.why.trees.get(&place), Some(Told::Waiting | Told::Here(_))) {
            return;
        }
        if self.why.trees.len() >= KEPT {
            self.why.trees.pop_first();
        }
        self.why.trees.insert(place.clone(), Told::Waiting);
        let call = Call::with_query::<ShowWhy>(key, &ValueName { value: Some(value.to_owned()) });
        self.call_with_problem::<ShowWhy>(call, move |state, outcome| {
            let told = outcome.map_or_else(|problem| Told::Refused(problem.detail), Told::Here);
            state.why.trees.insert(place, told);
        });
    }

    /// Shows the card of this step and explains the last explained value where this step has it; else the gate with the
    /// smallest margin, else the state.
    fn ask_selected(&mut self) {
        self.why.in_view.ask(Part::Card);
        let last = self.why.asked.last().map(|(_, value)| value.clone());
        let last = last.filter(|value| self.has_value(value));
        let worst = || {
            let verdict = self.trace()?.verdict()?;
            gates::by_margin(&verdict.gates).first().map(|margin| format!("gate.{}", margin.gate.name))
        };
        let value = last.or_else(worst).unwrap_or_else(|| "state".to_owned());
        self.ask_value(self.cursor.step, value);
    }

    fn ask_what_saves(&mut self) {
        self.why.in_view.ask(Part::Saved);
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
            Some(Told::Waiting) => true,
            Some(Told::Here(question)) => {
                matches!(
                    question.state,
                    QuestionState::Waiting | QuestionState::Running | QuestionState::Done
                )
            }
            _ => false,
        };
        if !goes_on {
            self.why.questions.insert(key.clone(), Told::Waiting);
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
                state.why.questions.insert(key, Told::Here(question));
            }
            Err(problem) if is_refusal_shown => {
                state.why.questions.insert(key, Told::Refused(problem.detail));
            }
            // Not asked yet, or ended meanwhile.
            _ => {}
        });
    }

    /// Reads how far a question is answered.
    fn read_question(&mut self, key: StepKey) {
        self.call_question::<ShowCounterfactual>(key, false);
    }

    /// Reads a question again after an event about it.
    pub(crate) fn question_went_on(&mut self, key: StepKey) {
        if self.session.as_ref().is_some_and(|session| session.id == key.session) {
            self.read_question(key);
        }
    }

    /// Reads the unanswered questions again: the page may have missed events about them.
    pub(crate) fn follow_questions(&mut self) {
        let is_open =
            |told: &Told<Question>| matches!(told, Told::Here(question) if !question.state.is_over());
        let open = self.why.questions.iter().filter(|(_, told)| is_open(told)).map(|(key, _)| key.clone());
        for key in open.collect::<Vec<_>>() {
            self.read_question(key);
        }
    }

    /// Reads once whether the question about the cursor's step was asked before: a reloaded page finds its answer.
    pub fn want_question(&mut self) {
        let is_lost = self.row().is_some_and(|row| row.state != "tracking" || row.tracked == Some(false));
        let Some(key) = self.step_key(self.cursor.step).filter(|_| is_lost) else { return };
        if self.why.looked_for.insert(key.clone()) {
            self.read_question(key);
        }
    }
}
