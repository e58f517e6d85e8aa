//! Derived columns: expressions over the steps of the selected target, read again while its runs grow.

use sightline_session::query::QueryAnswer;

/// A plotted expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Derived {
    /// The expression.
    pub expression: String,
    /// The last received values at every step.
    pub answer: Option<QueryAnswer>,
    /// The server's explanation, if it refused the expression.
    pub problem: Option<String>,
    /// The target of the last request, and how many steps its runs had.
    pub(super) requested_rows: Option<(usize, usize)>,
    pub(super) is_pending: bool,
    pub(super) is_stale: bool,
}

impl Derived {
    pub(crate) fn new(expression: String) -> Self {
        Self {
            expression,
            answer: None,
            problem: None,
            requested_rows: None,
            is_pending: false,
            is_stale: true,
        }
    }

    pub(crate) fn make_stale(&mut self) {
        self.is_stale = true;
    }

    pub(crate) fn forget(&mut self) {
        *self = Self::new(std::mem::take(&mut self.expression));
    }
}
