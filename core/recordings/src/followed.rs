//! The decisions that a driven rover followed, in `decisions.json` beside the world's state.
//!
//! Decisions can be computed again at any time, but another command would change them. The rover's actual decisions
//! are stored: the decision at stop k exists as soon as stop k + 1 does. In a folder without the file no decision is known.
//!
//! Source: papers.md R94.

use std::path::Path;

use serde::{Deserialize, Serialize};
use sightline_geometry::error::{Error, Result};
use sightline_rover::driving::{Cycle, DriveCommand, FollowedCycle};
use sightline_track::target::Designation;

use crate::files::{read_text, write_atomically};

/// The name of the file.
const FILE: &str = "decisions.json";

/// A followed decision, as it is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Followed {
    /// The target on whose estimates the rover moved.
    pub designation: Designation,
    /// The command.
    pub command: DriveCommand,
    /// The decision, with the report of the drive.
    pub cycle: Cycle,
}

/// The decisions of a drive, by stop; `None` if unknown.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Decisions(Vec<Option<Followed>>);

impl Decisions {
    /// Reads the decisions that led to the stops after the first of `stop_count`.
    ///
    /// # Errors
    /// A file that cannot be read, or with other content.
    pub(crate) fn read(folder: &Path, stop_count: usize) -> Result<Self> {
        let path = folder.join(FILE);
        let text = match read_text(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => return Err(Error::Read { path, source }),
        };
        let list = serde_json::from_str(&text).map_err(|error| Error::format(&path, error.to_string()))?;
        Ok(Self(list).cut(stop_count))
    }

    /// Writes the decisions.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(FILE);
        let text =
            serde_json::to_vec(&self.0).map_err(|error| Error::format(path.clone(), error.to_string()))?;
        write_atomically(&path, &text)
    }

    /// The decisions that led to the first `stop_count` stops.
    pub(crate) fn cut(&self, stop_count: usize) -> Self {
        Self(self.0.iter().take(stop_count.saturating_sub(1)).cloned().collect())
    }

    /// Adds the decision at a stop.
    pub(crate) fn keep(&mut self, followed: &FollowedCycle<'_>) {
        let step = followed.cycle.step;
        self.0.resize(step, None);
        self.0.push(Some(Followed {
            designation: followed.designation,
            command: followed.command.clone(),
            cycle: followed.cycle.clone(),
        }));
    }

    /// The decision at a stop.
    pub(crate) fn at(&self, step: usize) -> Option<&Followed> {
        self.0.get(step)?.as_ref()
    }
}
