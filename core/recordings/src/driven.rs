//! A driven traverse: a folder whose stops are added one by one as the rover is commanded.
//!
//! The folder is an ordinary simulated traverse, which can be opened and replayed at any time. `driven.json` beside
//! the index is the state of the world ([`DrivenStop`] for each stop): [`DrivenTraverse::resume`] continues from it
//! with the same bits. The decisions that were followed are stored beside it (`followed`).
//!
//! ```text
//! scenario.toml   the world            traverse.toml   the stops driven to
//! driven.json     the world's state    images/         rendered on first use
//! decisions.json  the decisions that the rover followed
//! ```

use std::path::{Path, PathBuf};

use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_rover::driving::{ActiveWorld, DriveReport, FollowedCycle, Motion, Stall};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::target::Designation;
use sightline_world::rover::driven::{DrivenStop, index_stops};
use sightline_world::scenario::Fault;
use sightline_world::traverse::View;
use sightline_world::{SCENARIO_FILE, Scenario, World};

use crate::files::{read_text, write_atomically};
use crate::followed::{Decisions, Followed};
use crate::index_file::{Existing, IndexFormat};
use crate::native::{Traverse, write};

/// The name of the file with the world's state.
const STATE_FILE: &str = "driven.json";

/// A driven traverse.
pub struct DrivenTraverse {
    traverse: Traverse,
    scenario: Scenario,
    driven: Vec<DrivenStop>,
    decisions: Decisions,
}

impl DrivenTraverse {
    /// Creates the folder of a drive with its first stop, the mast pointed at the targets' centre.
    ///
    /// # Errors
    /// An invalid scenario, a folder that is not empty or cannot be written, or [`Error::Cancelled`].
    pub fn begin(scenario: &Scenario, folder: &Path, cancel: Cancel<'_>) -> Result<Self> {
        Self::check(scenario, folder)?;
        Self::begin_in(World::new_until(scenario, cancel)?, scenario, folder, cancel)
    }

    /// Checks that a drive can begin with this scenario in this folder.
    fn check(scenario: &Scenario, folder: &Path) -> Result<()> {
        scenario.validate()?;
        let is_empty = std::fs::read_dir(folder).map_or(true, |mut entries| entries.next().is_none());
        if !is_empty {
            return Err(Error::format(folder, "is not empty; choose a new folder"));
        }
        Ok(())
    }

    fn begin_in(world: World, scenario: &Scenario, folder: &Path, cancel: Cancel<'_>) -> Result<Self> {
        let first = DrivenStop::first(&world, scenario, cancel)?;
        let mut index = sightline_world::index::empty_index(scenario);
        index.stops = index_stops(std::slice::from_ref(&first), scenario);
        write_atomically(&folder.join(SCENARIO_FILE), scenario.to_toml().as_bytes())?;
        write(&index, folder, IndexFormat::Toml, Existing::Refuse)?;
        let traverse = Traverse::open(folder)?;
        traverse.keep_world(world);
        let driven = Self {
            traverse,
            scenario: scenario.clone(),
            driven: vec![first],
            decisions: Decisions::default(),
        };
        driven.save()?;
        Ok(driven)
    }

    /// Creates the folder of a drive in a world that already has this state, including its first stops.
    ///
    /// # Errors
    /// As [`Self::begin`], and a state without a stop.
    pub fn begin_at(
        scenario: &Scenario,
        state: Vec<DrivenStop>,
        folder: &Path,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let mut driven = Self::begin(scenario, folder, cancel)?;
        driven.restore(state)?;
        Ok(driven)
    }

    /// Creates another drive of the same world that shares the first `count` stops and continues independently, with
    /// `faults` injected at later ones.
    ///
    /// # Errors
    /// A count of 0 or above the number of stops, a fault at a shared stop, or a folder that is not empty or cannot
    /// be written.
    pub fn branch(&self, count: usize, faults: &[Fault], folder: &Path, cancel: Cancel<'_>) -> Result<Self> {
        if count == 0 || count > self.driven.len() {
            let problem =
                format!("the drive has {} stops, of which {count} cannot be shared", self.driven.len());
            return Err(Error::Request(problem));
        }
        if let Some(index) = faults.iter().position(|fault| (fault.from_stop as usize) < count) {
            let problem = format!(
                "the rover has come to stop {} already; choose stop {count} or a later one",
                count - 1
            );
            return Err(Error::setting(format!("faults[{index}].from_stop"), problem));
        }
        let mut scenario = self.scenario.clone();
        scenario.events.faults.extend_from_slice(faults);
        Self::check(&scenario, folder)?;
        let simulated = self.traverse.simulated.as_ref().ok_or_else(no_simulation)?;
        let world = simulated.world_until(cancel)?.clone();
        let mut branch = Self::begin_in(world, &scenario, folder, cancel)?;
        branch.replace(self.driven[..count].to_vec(), self.decisions.cut(count))?;
        for stop in &self.traverse.index().stops[..count] {
            for View { image: name, .. } in stop.views() {
                // A missing image is rendered again with the same bits.
                if let Ok(bytes) = std::fs::read(self.traverse.folder().join(name)) {
                    write_atomically(&folder.join(name), &bytes)?;
                }
            }
        }
        Ok(branch)
    }

    /// Opens the folder of a drive to continue it from its last stop.
    ///
    /// # Errors
    /// A folder without a drive, or with a state that does not match its index.
    pub fn resume(folder: &Path) -> Result<Self> {
        let traverse = Traverse::open(folder)?;
        let path = folder.join(STATE_FILE);
        let text = read_text(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
        let driven: Vec<DrivenStop> =
            serde_json::from_str(&text).map_err(|error| Error::format(&path, error.to_string()))?;
        let Some(simulated) = &traverse.simulated else {
            return Err(Error::format(folder, "is no simulated drive, which alone can be continued"));
        };
        let scenario = simulated.scenario.clone();
        let decisions = Decisions::read(folder, driven.len())?;
        let mut resumed = Self { traverse, scenario, driven: Vec::new(), decisions: Decisions::default() };
        if driven.is_empty() {
            return Err(Error::format(&path, "holds no stop"));
        }
        resumed.replace(driven, decisions)?;
        Ok(resumed)
    }

    /// The injected faults.
    pub fn faults(&self) -> &[Fault] {
        &self.scenario.events.faults
    }

    /// The stops so far as a traverse.
    pub fn traverse(&self) -> &Traverse {
        &self.traverse
    }

    /// The complete state of the world.
    pub fn state(&self) -> &[DrivenStop] {
        &self.driven
    }

    /// Sets the world to a state that it, or another one with the same scenario, had.
    ///
    /// # Errors
    /// A state without a stop, or files that cannot be written.
    pub fn restore(&mut self, state: Vec<DrivenStop>) -> Result<()> {
        // A decision is kept if the drive that followed it is the same; images taken and pointings at the stop may differ.
        let is_driven_alike = |(one, other): &(&DrivenStop, &DrivenStop)| {
            one.time_s == other.time_s && one.true_site_from_rover == other.true_site_from_rover
        };
        let alike = self.driven.iter().zip(&state).take_while(is_driven_alike).count();
        self.replace(state, self.decisions.cut(alike))
    }

    fn replace(&mut self, state: Vec<DrivenStop>, decisions: Decisions) -> Result<()> {
        if state.is_empty() {
            return Err(Error::Request("a state of the world must have at least one stop".to_owned()));
        }
        for (number, stop) in state.iter().enumerate() {
            let named = |problem| Error::Request(format!("driven[{number}].{problem}"));
            stop.check().map_err(named)?;
        }
        let common = self.driven.iter().zip(&state).take_while(|(a, b)| a == b).count();
        self.forget_images(common, |_| true)?;
        self.traverse.truncate(common);
        self.driven = state;
        self.decisions = decisions;
        for (number, stop) in index_stops(&self.driven, &self.scenario).into_iter().enumerate().skip(common) {
            self.traverse.put_stop(number, stop)?;
        }
        self.save()
    }

    /// The rover's report of the drive to a stop; `None` at the first stop, or without such a stop.
    pub fn report(&self, number: usize) -> Option<DriveReport> {
        self.driven.get(number).filter(|_| number > 0).map(report)
    }

    /// The decision at a stop that was followed to the next one; `None` at the last stop, or if unknown.
    pub fn followed(&self, number: usize) -> Option<&Followed> {
        self.decisions.at(number)
    }

    /// The stops so far as a separate traverse, which later stops do not change.
    ///
    /// # Errors
    /// An index that cannot be read.
    pub fn snapshot(&self) -> Result<Traverse> {
        let mut copy = self.traverse.reopened()?;
        copy.awaits = self.awaits();
        Ok(copy)
    }

    /// As [`Self::snapshot`], with the images of the last stop even if put off: vision measures the motion in them first.
    ///
    /// # Errors
    /// As [`Self::snapshot`].
    pub fn snapshot_with_images(&self) -> Result<Traverse> {
        let mut copy = self.snapshot()?;
        copy.awaits = None;
        Ok(copy)
    }

    /// The first stage that was put off at the last stop: `point_mast` or `capture`; `None` if none was.
    pub fn awaits(&self) -> Option<CycleStage> {
        self.driven.last().and_then(|last| last.awaits)
    }

    /// Puts off a stage at the last stop, `point_mast` or `capture`: a [`Self::snapshot`] then has no images of it.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    pub fn put_off(&mut self, stage: Option<CycleStage>) -> Result<()> {
        let number = self.driven.len() - 1;
        let before = std::mem::replace(&mut self.driven[number].awaits, stage);
        if before == stage { Ok(()) } else { self.save() }
    }

    /// Collisions so far: motions ended by a rock, and stops at which a rock reaches into the rover's body.
    pub fn collisions(&self) -> u32 {
        self.driven
            .iter()
            .map(|stop| u32::from(stop.completed < 1.0) + u32::from(stop.touched_rocks > 0))
            .sum()
    }

    /// Removes the images of the stops from `count` on, because their content will change: those of all cameras, of
    /// visual odometry's own pair, or of the others.
    fn forget_images(&self, count: usize, which: impl Fn(bool) -> bool) -> Result<()> {
        for stop in self.traverse.index().stops.iter().skip(count) {
            let own = stop.camera(CameraName::ODOMETRY);
            let is_own = |image: &str| {
                let views = own.iter().flat_map(|own| std::iter::once(&own.left).chain(&own.right));
                views.into_iter().any(|view| view.image == image)
            };
            for View { image: name, .. } in stop.views().filter(|view| which(is_own(&view.image))) {
                let path: PathBuf = self.traverse.folder().join(name);
                match std::fs::remove_file(&path) {
                    Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                        return Err(Error::Write { path, source });
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn save(&self) -> Result<()> {
        let folder = self.traverse.folder();
        write(self.traverse.index(), folder, IndexFormat::Toml, Existing::Replace)?;
        let text = serde_json::to_vec(&self.driven)
            .map_err(|error| Error::format(folder.join(STATE_FILE), error.to_string()))?;
        write_atomically(&folder.join(STATE_FILE), &text)?;
        self.decisions.write(folder)
    }

    /// Puts the last driven stop into the traverse.
    fn put_last(&mut self) -> Result<()> {
        let number = self.driven.len() - 1;
        let stop = index_stops(&self.driven, &self.scenario).pop();
        stop.map_or(Ok(()), |stop| self.traverse.put_stop(number, stop))
    }
}

fn no_simulation() -> Error {
    Error::Request("a recorded drive cannot be driven".to_owned())
}

/// The rover's report of the drive to a stop.
fn report(stop: &DrivenStop) -> DriveReport {
    DriveReport {
        wheels_m: stop.wheels_m,
        duration_s: stop.drive_s,
        tilt_deg: stop.tilt_deg(),
        stall: (stop.completed < 1.0).then_some(Stall { completed: stop.completed }),
    }
}

impl ActiveWorld for DrivenTraverse {
    fn stops(&self) -> &dyn Stops {
        &self.traverse
    }

    fn drive(&mut self, motion: &Motion, cancel: Cancel<'_>) -> Result<DriveReport> {
        let (length_m, turn_rad) = motion.length_and_turn();
        let number = self.driven.len();
        let simulated = self.traverse.simulated.as_ref().ok_or_else(no_simulation)?;
        let world = simulated.world_until(cancel)?;
        let last = &self.driven[number - 1];
        let next = last.next(world, &self.scenario, number, [length_m, turn_rad], cancel)?;
        let report = report(&next);
        self.driven.push(next);
        self.put_last()?;
        Ok(report)
    }

    fn keep_decision(&mut self, followed: &FollowedCycle<'_>) {
        self.decisions.keep(followed);
    }

    fn stay(&mut self) -> Result<()> {
        let last = &self.driven[self.driven.len() - 1];
        self.driven.push(last.stay());
        self.put_last()
    }

    fn hand_over(&mut self, to: CameraName) -> Result<()> {
        self.driven.push(DrivenStop { handed_to: Some(to), ..self.driven[self.driven.len() - 1].stay() });
        self.put_last()
    }

    fn correct(&mut self, measured: MeasuredMotion) -> Result<()> {
        let number = self.driven.len() - 1;
        let Some(before) = number.checked_sub(1).map(|before| self.driven[before].site_from_rover) else {
            return Err(Error::Request("there is no motion to the first stop".to_owned()));
        };
        self.driven[number].correct(measured, &before.to_pose());
        self.put_last()?;
        self.save()
    }

    fn leave_to_odometry(&mut self) -> Result<()> {
        let number = self.driven.len() - 1;
        self.driven[number].odometry_alone = true;
        self.put_last()
    }

    fn keep_mast_target(&mut self, target: Designation) -> Result<()> {
        let number = self.driven.len() - 1;
        self.driven[number].mast_target = Some(target);
        self.put_last()
    }

    fn point_mast(&mut self, angles: Option<MastAngles>) -> Result<()> {
        let number = self.driven.len() - 1;
        let last = &self.driven[number];
        if angles.is_some() && last.mast_angles.is_some() && last.handed_to.is_none() {
            self.forget_images(number, |is_own| !is_own)?;
            self.driven[number].mast_angles = angles;
            self.put_last()?;
        }
        self.save()
    }

    fn look(&mut self, angles: MastAngles) -> Result<()> {
        let number = self.driven.len() - 1;
        if self.driven[number].odometry_look != Some(angles) {
            self.forget_images(number, |is_own| is_own)?;
            self.driven[number].odometry_look = Some(angles);
            self.put_last()?;
        }
        self.save()
    }

    fn expose(&mut self, around: Option<Pixel>) -> Result<()> {
        let number = self.driven.len() - 1;
        if around.is_some() && around != self.driven[number].metered_px {
            self.forget_images(number, |is_own| !is_own)?;
            self.driven[number].metered_px = around;
            self.put_last()?;
        }
        self.save()
    }
}

#[cfg(test)]
#[path = "driven_tests.rs"]
mod tests;
