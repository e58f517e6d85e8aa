//! Adds derived columns to the plots and reads their values from the server.

use sightline_session::expression::Expression;
use sightline_session::query::{Query, QueryAnswer};

use crate::breakpoints::derived::Derived;
use crate::state::State;

/// Maximum number of derived columns; each is a separate plot.
const LIMIT: usize = 8;

/// The values of a growing run are read again after a growth of 1/50: reading them at every step would take quadratic time.
const GROWTH: usize = 50;

impl State {
    pub(crate) fn plot_expression(&mut self, text: String) {
        let text = text.trim().to_owned();
        if let Err(refused) = Expression::column(&text) {
            self.messages.problem(format!("`{text}` cannot be plotted: {refused}."), refused.hint);
            return;
        }
        if self.breakpoints.derived.iter().any(|derived| derived.expression == text) {
            self.messages.note(format!("`{text}` is plotted already."));
        } else if self.breakpoints.derived.len() >= LIMIT {
            let hint = "Remove one in the panel Breakpoints.".to_owned();
            self.messages.problem(format!("There are {LIMIT} derived plots already."), Some(hint));
        } else {
            self.messages.note(format!("`{text}` is plotted over the steps."));
            self.breakpoints.derived.push(Derived::new(text));
        }
    }

    pub(crate) fn sync_derived(&mut self, session: &str) {
        let Some(target) = self.target() else { return };
        let (number, steps) = (target.number, target.runs.iter().map(|run| run.rows.len()).sum::<usize>());
        let grows = self.progress.keys().any(|(target, _)| *target == number);
        let mut queries = Vec::new();
        for derived in self.breakpoints.derived.iter_mut().filter(|derived| !derived.is_pending) {
            let enough = match derived.requested_rows {
                Some((target, before)) if target == number => {
                    derived.is_stale && steps != before && (!grows || steps >= before + before / GROWTH)
                }
                _ => true,
            };
            if enough {
                (derived.requested_rows, derived.is_pending, derived.is_stale) =
                    (Some((number, steps)), true, false);
                let query =
                    Query { expression: derived.expression.clone(), target: Some(number), values: true };
                queries.push(query);
            }
        }
        for query in queries {
            self.read_column(session, query);
        }
    }

    pub(super) fn on_column_reply(&mut self, expression: &str, outcome: Result<QueryAnswer, String>) {
        let found = self.breakpoints.derived.iter_mut().find(|derived| derived.expression == expression);
        let Some(derived) = found else { return };
        derived.is_pending = false;
        match outcome {
            Ok(answer) => (derived.answer, derived.problem) = (Some(answer), None),
            Err(problem) => derived.problem = Some(problem),
        }
    }
}
