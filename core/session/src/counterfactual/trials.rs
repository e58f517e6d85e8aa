//! Trials of a step: each computes the step with a change and classifies the outcome.

use std::sync::atomic::AtomicBool;

use super::{Finding, Goal, Moved, Outcome, SettingChange, is_accepted, wording};
use crate::step::RunStep;
use crate::track::Drive;
use crate::what_if::{Base, WhatIf, try_step};
use crate::why::gates::{self, Margin};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_track::limits::Limits;
use sightline_track::settings::Changes;
use sightline_track::stages::judge;

/// Whether a trial reached the goal; better outcomes are greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reach {
    /// The goal is not reached.
    Not,
    /// Accepted, but false against the truth.
    ButFalse,
    /// The goal is reached.
    Yes,
}

/// Computes a step with changes, and counts the computations.
pub(super) struct Trials<'a, D: Drive> {
    drive: &'a D,
    /// The recorded step, its predecessors and settings.
    pub base: Base<'a>,
    /// The goal.
    pub goal: Goal,
    /// Number of computations so far.
    pub runs: usize,
    cancel: Cancel<'a>,
}

impl<'a, D: Drive> Trials<'a, D> {
    pub(super) fn new(drive: &'a D, base: Base<'a>, goal: Goal, cancel: &'a AtomicBool) -> Self {
        Self { drive, base, goal, runs: 0, cancel: cancel.into() }
    }

    /// The drive that contains the step.
    pub(super) const fn drive(&self) -> &'a D {
        self.drive
    }

    /// Fails if the search was cancelled.
    pub(super) fn check(&self) -> Result<()> {
        self.cancel.check()
    }

    /// Computes the step with changes; `None` if a changed setting is invalid.
    pub(super) fn run(&mut self, changes: &Changes, prediction_px: Option<Pixel>) -> Result<Option<RunStep>> {
        self.check()?;
        self.runs += 1;
        let what_if = WhatIf { settings: changes.clone(), prediction_px, arrays: Vec::new() };
        match try_step(self.drive, self.base, &what_if, self.cancel) {
            Err(Error::Setting { .. }) => Ok(None),
            tried => tried.map(Some),
        }
    }

    /// The outcome of a computed step.
    pub(super) fn reach(&self, trace: &RunStep) -> Reach {
        let tracked = trace.truth.as_ref().and_then(|truth| truth.tracked);
        self.reach_of(is_accepted(trace), tracked)
    }

    /// The outcome of the recorded match under other limits, by repeating the stage `judge` alone.
    pub(super) fn rejudged(&self, limits: &Limits) -> Option<Reach> {
        let trace = self.base.recorded;
        let verdict = judge::judge(
            &self.base.last?.update.target,
            trace.prediction()?,
            &trace.point_mast,
            trace.located()?,
            &self.drive.site_from_rover(trace.step),
            trace.verdict()?.state_before,
            limits,
        );
        let truth = trace.truth.as_ref();
        let is_visible = truth.is_some_and(|truth| truth.tracked.is_some());
        let is_within = truth.is_some_and(|truth| truth.err_px.is_some_and(|e| e <= truth.tolerance_px));
        Some(self.reach_of(verdict.accepted, is_visible.then_some(verdict.accepted && is_within)))
    }

    fn reach_of(&self, is_accepted: bool, tracked: Option<bool>) -> Reach {
        match (self.goal, is_accepted, tracked) {
            (Goal::Accepted, false, _) | (Goal::NotFalse, true, Some(false)) => Reach::Not,
            (Goal::Accepted, true, Some(false)) => Reach::ButFalse,
            _ => Reach::Yes,
        }
    }

    /// The gate that failed by the largest margin in the recorded step.
    pub(super) fn worst_gate(&self) -> Option<Margin<'a>> {
        let verdict = self.base.recorded.verdict()?;
        gates::by_margin(&verdict.gates).into_iter().find(|margin| !margin.gate.passed)
    }

    /// The finding of a change and the step computed with it.
    pub(super) fn finding(
        &self,
        changes: Vec<SettingChange>,
        moved: Option<Moved>,
        relative: f64,
        (trace, runs): (&RunStep, usize),
    ) -> Finding {
        let outcome = match (is_accepted(trace), trace.truth.as_ref().and_then(|truth| truth.tracked)) {
            (false, _) => Outcome::Rejected,
            (true, Some(true)) => Outcome::Right,
            (true, Some(false)) => Outcome::False,
            (true, None) => Outcome::Unknown,
        };
        let worst = self.worst_gate().map(|margin| margin.gate);
        let after = trace.verdict().into_iter().flat_map(|verdict| &verdict.gates);
        let after = worst.and_then(|gate| after.into_iter().find(|after| after.name == gate.name));
        let mut finding = Finding {
            changes,
            moved,
            with_margin: None,
            relative,
            outcome,
            gate: worst.map(|gate| gate.name.clone()),
            gate_unit: worst.map_or_else(String::new, |gate| gate.unit.clone()),
            margin_after: after.and_then(|gate| gate.margin),
            row: trace.row(),
            runs,
            sentence: String::new(),
        };
        finding.sentence = wording::sentence(&finding, trace);
        finding
    }
}
