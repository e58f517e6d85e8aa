//! A request to stop a long computation: set by the caller, read by the loops that compute the result.
//!
//! An interrupted computation immediately returns any value of its type; the function that passed the flag discards
//! that value and returns [`Error::Cancelled`].

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

/// A request to stop, which another thread may make at any time; by default there is none.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cancel<'a>(Option<&'a AtomicBool>);

impl<'a> Cancel<'a> {
    /// The flag of the request; `None` if the computation cannot be cancelled.
    pub fn flag(self) -> Option<&'a AtomicBool> {
        self.0
    }
}

impl Cancel<'_> {
    /// Whether a stop was requested.
    pub fn is_requested(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Returns an error if a stop was requested.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn check(self) -> Result<()> {
        if self.is_requested() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

impl<'a> From<&'a AtomicBool> for Cancel<'a> {
    fn from(flag: &'a AtomicBool) -> Self {
        Self(Some(flag))
    }
}
