//! A traverse that is driven: a folder whose stops are added one by one as the rover is commanded.
//!
//! The folder is an ordinary simulated traverse, which can be opened and replayed at any time. `driven.json` beside the index
//! is the state of the world ([`DrivenStop`] for each stop): [`DrivenTraverse::resume`] continues from it with the same bits.
//!
//! ```text
//! scenario.toml   the world            traverse.toml   the stops driven to
//! driven.json     the world's state    images/         rendered when first asked for
//! ```

use std::path::{Path, PathBuf};

use sightline_geometry::camera::MastAngles;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_rover::driving::{ActiveWorld, DriveReport, Motion, Stall};
use sightline_rover::pipeline::Stops;
use sightline_track::cycle_stage::CycleStage;
use sightline_world::rover::driven::{DrivenStop, index_stops};
use sightline_world::{SCENARIO_FILE, Scenario, World};

use crate::files::{read_text, write_atomically};
use crate::index_file::{Existing, IndexFormat};
use crate::native::{Traverse, write};

/// The name of the file with the world's state.
const STATE_FILE: &str = "driven.json";

/// A traverse that is driven.
pub struct DrivenTraverse {
    traverse: Traverse,
    scenario: Scenario,
    driven: Vec<DrivenStop>,
}

impl DrivenTraverse {
    /// Makes the folder of a drive with its first stop, the mast pointed at the targets' centre.
    ///
    /// # Errors
    /// A scenario that no world can be made of or that leaves wheel tracks, a folder that holds something already or cannot
    /// be written, or [`Error::Cancelled`].
    pub fn begin(scenario: &Scenario, folder: &Path, cancel: Cancel<'_>) -> Result<Self> {
        Self::check(scenario, folder)?;
        Self::begin_in(World::new_until(scenario, cancel)?, scenario, folder, cancel)
    }

    /// Refuses what no drive can be begun with.
    fn check(scenario: &Scenario, folder: &Path) -> Result<()> {
        scenario.validate()?;
        if scenario.rover.tracks {
            let problem = "a drive on commands leaves no wheel tracks yet; set it to false";
            return Err(Error::setting("rover.tracks", problem));
        }
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
        let driven = Self { traverse, scenario: scenario.clone(), driven: vec![first] };
        driven.save()?;
        Ok(driven)
    }

    /// Makes the folder of a drive in a world that has this state already, from its first stops on.
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

    /// Makes another drive of the same world that shares the first `count` stops and goes its own way from there.
    ///
    /// # Errors
    /// A count of none or of more stops than there are, or a folder that holds something already or cannot be written.
    pub fn branch(&self, count: usize, folder: &Path, cancel: Cancel<'_>) -> Result<Self> {
        if count == 0 || count > self.driven.len() {
            let problem =
                format!("the drive has {} stops, of which {count} cannot be shared", self.driven.len());
            return Err(Error::Request(problem));
        }
        Self::check(&self.scenario, folder)?;
        let simulated = self.traverse.simulated.as_ref().ok_or_else(no_simulation)?;
        let world = simulated.world_until(cancel)?.clone();
        let mut branch = Self::begin_in(world, &self.scenario, folder, cancel)?;
        branch.restore(self.driven[..count].to_vec())?;
        for stop in &self.traverse.index().stops[..count] {
            for name in [&stop.left.image, &stop.right.image] {
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
    /// A folder without a drive, or one whose state does not fit its index.
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
        let mut resumed = Self { traverse, scenario, driven: Vec::new() };
        if driven.is_empty() {
            return Err(Error::format(&path, "holds no stop"));
        }
        resumed.restore(driven)?;
        Ok(resumed)
    }

    /// The stops so far as a traverse.
    pub fn traverse(&self) -> &Traverse {
        &self.traverse
    }

    /// The state of the world: all of it.
    pub fn state(&self) -> &[DrivenStop] {
        &self.driven
    }

    /// Puts the world into a state that it, or another with the same scenario, had.
    ///
    /// # Errors
    /// A state without a stop, or files that cannot be written.
    pub fn restore(&mut self, state: Vec<DrivenStop>) -> Result<()> {
        if state.is_empty() {
            return Err(Error::Request("a state of the world has one stop at least".to_owned()));
        }
        let common = self.driven.iter().zip(&state).take_while(|(a, b)| a == b).count();
        self.forget_images(common)?;
        self.traverse.truncate(common);
        self.driven = state;
        for (number, stop) in index_stops(&self.driven, &self.scenario).into_iter().enumerate().skip(common) {
            self.traverse.put_stop(number, stop)?;
        }
        self.save()
    }

    /// What the rover reports of the drive to a stop; `None` at the first stop and where there is none.
    pub fn report(&self, number: usize) -> Option<DriveReport> {
        self.driven.get(number).filter(|_| number > 0).map(report)
    }

    /// The stops so far as a traverse of its own, which later stops do not change.
    ///
    /// # Errors
    /// An index that cannot be read.
    pub fn snapshot(&self) -> Result<Traverse> {
        let mut copy = Traverse::open(self.traverse.folder())?;
        if let Some(world) = self.traverse.simulated.as_ref().and_then(|simulated| simulated.world.get()) {
            copy.keep_world(world.clone());
        }
        copy.awaits = self.awaits();
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

    /// Collisions so far: steps that a rock ended, and stops at which a rock reaches into the rover's body.
    pub fn collisions(&self) -> u32 {
        self.driven
            .iter()
            .map(|stop| u32::from(stop.completed < 1.0) + u32::from(stop.touched_rocks > 0))
            .sum()
    }

    /// Removes the images of the stops from `count` on: another drive will see something else there.
    fn forget_images(&self, count: usize) -> Result<()> {
        for stop in self.traverse.index().stops.iter().skip(count) {
            for name in [&stop.left.image, &stop.right.image] {
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
        write_atomically(&folder.join(STATE_FILE), &text)
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

/// What the rover reports of the drive to a stop.
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
        let [length_m, turn_rad] = match *motion {
            Motion::Arc { length_m, curvature_per_m } => [length_m, length_m * curvature_per_m],
            Motion::Turn { angle_rad } => [0.0, angle_rad],
        };
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

    fn stay(&mut self) -> Result<()> {
        let last = &self.driven[self.driven.len() - 1];
        self.driven.push(last.stay());
        self.put_last()
    }

    fn point_mast(&mut self, angles: Option<MastAngles>) -> Result<()> {
        let number = self.driven.len() - 1;
        if angles.is_some() && self.driven[number].mast_angles.is_some() {
            self.forget_images(number)?;
            self.driven[number].mast_angles = angles;
            self.put_last()?;
        }
        self.save()
    }

    fn expose(&mut self, around: Option<Pixel>) -> Result<()> {
        let number = self.driven.len() - 1;
        if around.is_some() && around != self.driven[number].metered_px {
            self.forget_images(number)?;
            self.driven[number].metered_px = around;
            self.put_last()?;
        }
        self.save()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario() -> Scenario {
        let mut scenario = Scenario { seed: 5, ..Scenario::default() };
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (128, 1);
        (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.02, 4);
        scenario.drive.pointing_error_deg = 0.2;
        scenario
    }

    fn arc(length_m: f64) -> Motion {
        Motion::Arc { length_m, curvature_per_m: 0.05 }
    }

    /// Drives and points the mast a little to the side.
    fn go(world: &mut DrivenTraverse, length_m: f64) {
        world.drive(&arc(length_m), Cancel::default()).unwrap();
        let angles = world.state().last().unwrap().mast_angles.unwrap();
        world.point_mast(Some(MastAngles { azimuth_rad: angles.azimuth_rad + 0.01, ..angles })).unwrap();
    }

    #[test]
    fn a_resumed_drive_continues_with_the_same_bits_and_can_be_replayed() {
        let folder = tempfile::tempdir().unwrap();
        let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
        let mut whole = DrivenTraverse::begin(&scenario(), &one, Cancel::default()).unwrap();
        [0.5, 0.4, 0.3].into_iter().for_each(|length_m| go(&mut whole, length_m));
        let mut cut = DrivenTraverse::begin(&scenario(), &two, Cancel::default()).unwrap();
        go(&mut cut, 0.5);
        drop(cut);
        let mut resumed = DrivenTraverse::resume(&two).unwrap();
        [0.4, 0.3].into_iter().for_each(|length_m| go(&mut resumed, length_m));
        assert_eq!(resumed.state(), whole.state());
        assert_eq!(resumed.traverse().index(), whole.traverse().index());
        let replayed = Traverse::open(&one).unwrap();
        assert_eq!(replayed.index(), whole.traverse().index());
        assert_eq!(replayed.capture(2).unwrap(), resumed.traverse().capture(2).unwrap());
        // The mast's error is that of its stop.
        assert!(replayed.index().stops[2].truth.as_ref().unwrap().left_camera.is_some());
    }

    #[test]
    fn a_stop_is_exposed_for_the_pixel_that_was_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let mut scenario = scenario();
        scenario.camera.exposure = sightline_world::scenario::ExposureMode::Subframe;
        scenario.camera.auto_exposure.subframe_px = 11;
        let mut world =
            DrivenTraverse::begin(&scenario, &folder.path().join("a"), Cancel::default()).unwrap();
        go(&mut world, 0.5);
        let mut level = |around: Pixel| {
            world.expose(Some(around)).unwrap();
            assert_eq!(world.traverse().index().stops[1].metered_px, Some(around));
            let left = world.traverse().capture(1).unwrap().left;
            let side = |centre: f64| (centre as u32 - 5)..(centre as u32 + 6);
            let pixels = side(around.y).flat_map(|y| side(around.x).map(move |x| (x, y)));
            f64::from(pixels.map(|(x, y)| left.get_pixel(x, y).0[0]).fold(0.0, f32::max)) * 4095.0
        };
        // One percent of 121 pixels may exceed the cut of 2000: the brightest one.
        for around in [Pixel::new(64.0, 20.0), Pixel::new(20.0, 100.0), Pixel::new(100.0, 70.0)] {
            let brightest_dn = level(around);
            assert!((1800.0..2400.0).contains(&brightest_dn), "{around:?}: {brightest_dn}");
        }
    }

    #[test]
    fn a_restored_world_forgets_what_it_saw_later() {
        let folder = tempfile::tempdir().unwrap();
        let mut world =
            DrivenTraverse::begin(&scenario(), &folder.path().join("a"), Cancel::default()).unwrap();
        go(&mut world, 0.5);
        let branch = world.state().to_vec();
        go(&mut world, 0.8);
        let trunk = world.state().to_vec();
        let seen = world.traverse().capture(2).unwrap();
        world.restore(branch).unwrap();
        assert_eq!(world.traverse().stop_count(), 2);
        go(&mut world, -0.3);
        assert_ne!(world.traverse().capture(2).unwrap().left, seen.left);
        world.restore(trunk.clone()).unwrap();
        assert_eq!(world.traverse().capture(2).unwrap(), seen);
        assert_eq!(world.state(), trunk);
    }

    #[test]
    fn a_folder_with_something_in_it_and_tracks_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("note"), "mine").unwrap();
        let refused = |scenario: &Scenario, path: &Path| {
            DrivenTraverse::begin(scenario, path, Cancel::default()).err().unwrap().to_string()
        };
        assert!(refused(&scenario(), folder.path()).contains("is not empty"));
        let mut tracks = scenario();
        tracks.rover.tracks = true;
        assert!(refused(&tracks, &folder.path().join("new")).contains("rover.tracks"));
    }
}
