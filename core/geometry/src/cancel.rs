//! A request to stop a long computation: set by whoever waits for the result, read by the loops that make it.
//!
//! A computation that was interrupted returns anything of its type at once; the function that hands the flag in
//! discards that result and returns [`Error::Cancelled`].

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

/// A request to stop, which another thread may make at any time; by default nobody can.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cancel<'a>(Option<&'a AtomicBool>);

impl<'a> Cancel<'a> {
    /// The flag that requests it, if there is one.
    pub fn flag(self) -> Option<&'a AtomicBool> {
        self.0
    }
}

impl Cancel<'_> {
    /// Whether the result is not wanted any more.
    pub fn is_requested(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Ends a computation whose result is not wanted any more.
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
