//! Memory of the steps of a session, and its release: steps can be recomputed from the saved session.

use sightline_geometry::error::Result;
use sightline_track::locate::store::HeapBytes;

use crate::{Run, Session};

impl Session {
    /// The memory of all recorded steps, bytes, estimated from the last step of each run; an upper bound, because runs of
    /// one target share more data than the steps before their forks.
    pub fn step_bytes(&self) -> usize {
        self.targets.iter().flat_map(|target| &target.runs).map(Run::step_bytes).sum()
    }

    /// The same session without steps, as after a restart of the program; its runs are recomputed.
    ///
    /// # Errors
    /// As [`Session::restored`].
    pub fn without_steps(&self) -> Result<Self> {
        Ok(Self { awaits: self.awaits, ..Self::restored(&self.saved(), self.stop_count)? })
    }
}

impl Run {
    /// The memory of the steps that are not shared with the parent run, bytes.
    fn step_bytes(&self) -> usize {
        let Some((first, last)) = self.steps.first().zip(self.steps.last()) else { return 0 };
        let from = self.fork.map_or(0, |fork| fork.from_step).max(first.step);
        (last.step + 1).saturating_sub(from) * last.trace.heap_bytes()
    }
}
