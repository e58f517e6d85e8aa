//! Derived columns: expressions over the steps of the target that is looked at, asked again while its runs grow.

use sightline_session::query::QueryAnswer;

/// An expression that is plotted.
#[derive(Clone, Debug, PartialEq)]
pub struct Derived {
    /// The expression.
    pub expression: String,
    /// What it is at every step, as last heard.
    pub answer: Option<QueryAnswer>,
    /// What the server said instead.
    pub problem: Option<String>,
    /// The target for which it was asked, and how many steps its runs had.
    pub(super) asked_for: Option<(usize, usize)>,
    pub(super) is_asked: bool,
    pub(super) is_stale: bool,
}

impl Derived {
    pub(crate) fn new(expression: String) -> Self {
        Self { expression, answer: None, problem: None, asked_for: None, is_asked: false, is_stale: true }
    }

    pub(crate) fn make_stale(&mut self) {
        self.is_stale = true;
    }

    pub(crate) fn forget(&mut self) {
        *self = Self::new(std::mem::take(&mut self.expression));
    }
}
