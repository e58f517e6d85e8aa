//! Breakpoints: conditions that are evaluated at all steps of all runs of a session.
//!
//! Recorded steps never change, so each step is evaluated once. A condition that compares runs is evaluated at a step once
//! all of them have reached it. Breakpoints are saved with the session; their hits are not.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::expression::{Expression, Refused};
use super::{Run, Session};
use crate::step::RunStep;
use sightline_geometry::error::{Error, Result};

/// Maximum number of breakpoints of a session.
pub const BREAKPOINT_LIMIT: usize = 64;

/// A breakpoint as saved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Breakpoint {
    /// Its number in paths; not used again within the session.
    pub number: usize,
    /// The condition.
    pub expression: String,
    /// Whether it is evaluated.
    pub on: bool,
}

/// The stops of one run at which a condition is true.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RunHits {
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The stops, in order.
    pub steps: Vec<usize>,
}

/// A breakpoint with all hits so far.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct BreakpointView {
    /// Its number in paths.
    pub number: usize,
    /// The condition.
    pub expression: String,
    /// Whether it is evaluated.
    pub on: bool,
    /// Number of steps of all runs at which it is true; 0 while it is off.
    pub count: usize,
    /// These steps by run; runs without hits are left out.
    pub hits: Vec<RunHits>,
    /// The error of its expression, if this version of the program cannot read it; null otherwise.
    pub problem: Option<Refused>,
}

/// Sets a breakpoint: exactly one of `expression` and `step`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewBreakpoint {
    /// The condition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expression: Option<String>,
    /// The stop to break at; the condition becomes `step == …`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<usize>,
}

/// Changes a breakpoint; fields that are left out stay unchanged.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BreakpointChange {
    /// The new condition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expression: Option<String>,
    /// Whether it is evaluated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<bool>,
}

/// The breakpoints of a session.
#[derive(Clone, Debug, Default)]
pub struct Breakpoints {
    set: Vec<Watched>,
    last_number: Option<usize>,
}

/// A breakpoint with its hits by target and run.
#[derive(Clone, Debug)]
struct Watched {
    breakpoint: Breakpoint,
    expression: std::result::Result<Expression, Refused>,
    caught: BTreeMap<(usize, usize), Caught>,
}

/// The hits of a breakpoint in one run.
#[derive(Clone, Debug, Default)]
struct Caught {
    /// Number of steps evaluated so far.
    looked_at: usize,
    steps: Vec<usize>,
}

impl Watched {
    fn new(breakpoint: Breakpoint) -> Self {
        let expression = Expression::condition(&breakpoint.expression);
        Self { breakpoint, expression, caught: BTreeMap::new() }
    }
}

impl Breakpoints {
    /// The breakpoints of a saved session.
    pub(super) fn restored(saved: &[Breakpoint]) -> Self {
        let last_number = saved.iter().map(|breakpoint| breakpoint.number).max();
        Self { set: saved.iter().cloned().map(Watched::new).collect(), last_number }
    }

    /// The breakpoints as they are saved.
    pub fn list(&self) -> Vec<Breakpoint> {
        self.set.iter().map(|watched| watched.breakpoint.clone()).collect()
    }

    /// Sets a breakpoint; one with the same condition is switched on instead. Returns its number.
    fn add(&mut self, expression: &str) -> std::result::Result<usize, Refused> {
        let text = Expression::condition(expression)?.to_string();
        let same = |watched: &&mut Watched| {
            watched.expression.as_ref().is_ok_and(|expression| expression.to_string() == text)
        };
        if let Some(known) = self.set.iter_mut().find(same) {
            known.breakpoint.on = true;
            return Ok(known.breakpoint.number);
        }
        let number = self.last_number.map_or(0, |last| last + 1);
        self.last_number = Some(number);
        let expression = expression.trim().to_owned();
        self.set.push(Watched::new(Breakpoint { number, expression, on: true }));
        Ok(number)
    }

    /// Evaluates all conditions at the steps of a target's runs that were not evaluated yet.
    fn look(&mut self, target: usize, runs: &[&[Arc<RunStep>]]) {
        for watched in self.set.iter_mut().filter(|watched| watched.breakpoint.on) {
            let Ok(expression) = &watched.expression else { continue };
            let compared = expression.runs_compared();
            for (run, steps) in runs.iter().enumerate() {
                if !compared.is_empty() && !compared.contains(&run) {
                    continue;
                }
                let caught = watched.caught.entry((target, run)).or_default();
                let settled = settled(runs, steps, compared);
                if caught.looked_at > settled {
                    // The run was restarted.
                    *caught = Caught::default();
                }
                let hit = (caught.looked_at..settled).filter(|&index| expression.is_true(runs, run, index));
                caught.steps.extend(hit.map(|index| steps[index].step));
                caught.looked_at = settled;
            }
        }
    }

    fn views(&self, is_there: impl Fn(usize) -> bool) -> Vec<BreakpointView> {
        let view = |watched: &Watched| {
            let mut hits = Vec::new();
            if watched.breakpoint.on {
                for ((target, run), caught) in &watched.caught {
                    if is_there(*target) && !caught.steps.is_empty() {
                        hits.push(RunHits { target: *target, run: *run, steps: caught.steps.clone() });
                    }
                }
            }
            BreakpointView {
                number: watched.breakpoint.number,
                expression: watched.breakpoint.expression.clone(),
                on: watched.breakpoint.on,
                count: hits.iter().map(|hits| hits.steps.len()).sum(),
                hits,
                problem: watched.expression.as_ref().err().cloned(),
            }
        };
        self.set.iter().map(view).collect()
    }
}

/// Number of a run's steps at which the condition's value is final: all compared runs have reached them.
fn settled(runs: &[&[Arc<RunStep>]], steps: &[Arc<RunStep>], compared: &[usize]) -> usize {
    let end = |run: &usize| runs.get(*run).and_then(|steps| steps.last()).map_or(0, |last| last.step + 1);
    match compared.iter().map(end).min() {
        None => steps.len(),
        Some(end) => steps.partition_point(|trace| trace.step < end),
    }
}

impl Session {
    /// Sets a breakpoint and returns its number; one with the same condition is switched on instead.
    ///
    /// # Errors
    /// [`Refused`] for an invalid condition, or if there are too many breakpoints.
    pub fn add_breakpoint(&mut self, expression: &str) -> std::result::Result<usize, Refused> {
        if self.breakpoints.set.len() >= BREAKPOINT_LIMIT {
            let sentence = format!("a session may have {BREAKPOINT_LIMIT} breakpoints: remove one first");
            return Err(Refused { sentence, from: 0, to: expression.chars().count(), hint: None });
        }
        self.breakpoints.add(expression)
    }

    /// Gives a breakpoint another condition.
    ///
    /// # Errors
    /// [`Refused`] for an invalid condition; the breakpoint stays unchanged.
    pub fn change_breakpoint(&mut self, number: usize, expression: &str) -> std::result::Result<(), Refused> {
        Expression::condition(expression)?;
        if let Some(watched) = self.breakpoints.set.iter_mut().find(|w| w.breakpoint.number == number) {
            let expression = expression.trim().to_owned();
            *watched = Watched::new(Breakpoint { expression, ..watched.breakpoint.clone() });
        }
        Ok(())
    }

    /// Switches a breakpoint on or off.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no breakpoint with this number.
    pub fn switch_breakpoint(&mut self, number: usize, on: bool) -> Result<()> {
        let found = self.breakpoints.set.iter_mut().find(|watched| watched.breakpoint.number == number);
        found.ok_or_else(|| no_breakpoint(number))?.breakpoint.on = on;
        Ok(())
    }

    /// Removes a breakpoint.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no breakpoint with this number.
    pub fn remove_breakpoint(&mut self, number: usize) -> Result<()> {
        self.breakpoint(number)?;
        self.breakpoints.set.retain(|watched| watched.breakpoint.number != number);
        Ok(())
    }

    /// A breakpoint.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no breakpoint with this number.
    pub fn breakpoint(&self, number: usize) -> Result<&Breakpoint> {
        let found = self.breakpoints.set.iter().find(|watched| watched.breakpoint.number == number);
        found.map(|watched| &watched.breakpoint).ok_or_else(|| no_breakpoint(number))
    }

    /// All breakpoints with all hits so far; evaluates only the steps added since the last call.
    pub fn breakpoint_views(&mut self) -> Vec<BreakpointView> {
        for (number, target) in self.targets.iter().enumerate().filter(|(_, target)| !target.removed) {
            let runs: Vec<&[Arc<RunStep>]> = target.runs.iter().map(Run::whole_steps).collect();
            self.breakpoints.look(number, &runs);
        }
        let targets = &self.targets;
        self.breakpoints.views(|target| targets.get(target).is_some_and(|record| !record.removed))
    }
}

fn no_breakpoint(number: usize) -> Error {
    Error::Request(format!("there is no breakpoint {number}"))
}
