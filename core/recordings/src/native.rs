//! The native folder of a traverse: one index, one PNG per image, and optionally camera files.
//!
//! The index is `traverse.toml` or `traverse.json` with the same fields ([`TraverseIndex`]); unknown fields are
//! rejected. All names in it are relative to the folder, with `/` and without `..`.
//!
//! ```toml
//! format = 1                                # version of this format
//! name = "two stops"
//! description = "an example"                # optional
//! full_scale_dn = 4095.0                    # grey value of full scale; default 255 or 65535 by PNG depth
//! stereo = "lateral"                        # or "convergent": two freely placed views; default lateral
//! # pointing_error_deg = 0.05               # 1σ error of each mast angle; default 0
//! # scenario = "scenario.toml"              # simulated: missing images are rendered from this file
//!
//! [odometry_error]                          # 1σ error of the pose estimates; these are the defaults
//! along_fraction = 0.02                     # of the distance driven
//! across_fraction = 0.02
//! attitude_deg = 0.2                        # per step and axis
//!
//! [[stops]]                                 # in driving order, at least one
//! time_s = 0.0                              # since the first stop
//! [stops.site_from_rover]                   # the pose estimate for the tracker
//! position_m = [0.0, 0.0, 0.0]              # origin of the rover frame in the site frame
//! quaternion_sxyz = [1.0, 0.0, 0.0, 0.0]    # scalar first, rotates rover vectors into the site frame
//! [stops.left]
//! image = "images/0000_left.png"            # 8 or 16 bits, grey (colour becomes luma)
//! [stops.left.camera]                       # in the rover frame, as JPL prints it; O is made unit on opening
//! model = "CAHVOR"                          # CAHV (no O, R), CAHVOR, CAHVORE (also E, T, P)
//! size = [1024, 1024]                       # width and height of the image
//! C = [0.442604, -0.0611635, -1.25106]
//! A = [0.93995, -0.338133, 0.0464979]
//! H = [884.72, 981.763, 24.1472]
//! V = [418.579, -152.039, 1245.75]
//! O = [0.946551, -0.315595, 0.0666419]
//! R = [0.00096, -0.002183, 0.018547]
//! [stops.right]
//! image = "images/0000_right.png"
//! camera = { file = "right.cahvor" }        # or a file in JPL's text form
//!
//! [stops.truth.site_from_rover]             # optional: the true pose, and true cameras if they differ
//! position_m = [0.0, 0.0, 0.0]
//! quaternion_sxyz = [1.0, 0.0, 0.0, 0.0]
//! ```
//!
//! Further optional fields: `[mast]` (origin and head cameras), `stops.mast_angles` (azimuth and elevation, rad),
//! `stops.metered_px` (`x`, `y`: centre of the exposure subframe in the left image, px) and `stops.light`
//! (`sun_azimuth_deg`, `sun_elevation_deg` in the site frame, `exposure_s` of the left image). The truth of a
//! simulated stop may have `wheel_places_m`, the positions of the wheels on the way to it (site frame, m).
//!
//! A simulated folder also gets `cache/`, whose removal costs only time, and on demand `truth/`, the truth of every
//! pixel (`truth_files.rs` documents it).
//!
//! A stop may have up to 16 cameras beside its main pair, each with its own name (`a` to `z`, `0` to `9` and `_`, at
//! most 32 characters). The same name at another stop is the same camera; a stop may lack it.
//!
//! ```toml
//! [[stops.cameras]]                         # after the other fields of the stop
//! name = "front_hazcam"
//! mast_angles = { azimuth_rad = 0.0, elevation_rad = 0.0 }  # left out: fixed to the body
//! [stops.cameras.left]                      # as stops.left
//! image = "images/0000_front_hazcam_left.png"
//! camera = { file = "front_hazcam_left.cahvore" }
//! [stops.cameras.right]                     # left out: a single camera, in which nothing can be tracked
//! image = "images/0000_front_hazcam_right.png"
//! camera = { file = "front_hazcam_right.cahvore" }
//! # true_left_camera, true_right_camera: optional, as the cameras of stops.truth
//! ```
//!
//! Opening reads the index and the cameras, never an image: a traverse with missing images opens, and the
//! stops that have theirs can be used. `images.rs` reads the images.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::check::{self, StopCameras};
use super::images::Stores;
use super::index_file::{self, Existing, IndexFormat};
use super::simulated::{Simulated, Stops};
use sightline_geometry::camera::Camera;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pose;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate::store::Cache;
use sightline_world::World;
use sightline_world::traverse::{Stop, TraverseIndex};

/// An opened traverse.
pub struct Traverse {
    pub(super) folder: PathBuf,
    pub(super) index_path: PathBuf,
    pub(super) index: TraverseIndex,
    pub(super) cameras: Vec<StopCameras>,
    warnings: Vec<String>,
    /// Stores of earlier images, features, surfaces and motions.
    pub(super) stores: Stores,
    pub(super) simulated: Option<Simulated>,
    /// The first stage that a paused drive put off at the last stop.
    pub(super) awaits: Option<CycleStage>,
}

impl Traverse {
    /// Opens a traverse by its folder or its index.
    ///
    /// # Errors
    /// A missing or malformed index, an unknown version, no stop, an implausible pose or camera, a camera file
    /// that cannot be read, or a name that leaves the folder; the sentence names the file and the field.
    pub fn open(path: &Path) -> Result<Self> {
        let (index_path, format) = index_file::find(path)?;
        let index = index_file::read(&index_path, format)?;
        let folder = match index_path.parent() {
            Some(folder) if folder != Path::new("") => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let problem = |problem| Error::format(&index_path, problem);
        check::check_index(&index).map_err(problem)?;
        let read_stop = |(step, stop): (usize, &Stop)| {
            check::check_stop(stop, &folder).map_err(|problem| format!("stops[{step}].{problem}"))
        };
        let cameras = index.stops.iter().enumerate().map(read_stop).collect::<Result<_, _>>();
        let cameras = cameras.map_err(problem)?;
        let read_scenario = |name: &String| Simulated::open(&index, name, &folder);
        let simulated = index.scenario.as_ref().map(read_scenario).transpose().map_err(problem)?;
        let warnings = check::warnings(&index, &folder);
        let stores = Stores::new(&Arc::default(), &index);
        Ok(Self { folder, index_path, index, cameras, warnings, stores, simulated, awaits: None })
    }

    /// Opens the same folder again, keeping a world that is already built.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub(super) fn reopened(&self) -> Result<Self> {
        let copy = Self::open(&self.folder)?;
        if let Some(world) = self.simulated.as_ref().and_then(|simulated| simulated.world.get()) {
            copy.keep_world(world.clone());
        }
        Ok(copy)
    }

    /// The same traverse with a cache shared with others.
    #[must_use]
    pub fn with_cache(mut self, cache: &Arc<Cache>) -> Self {
        self.stores = Stores::new(cache, &self.index);
        self
    }

    /// Adds a stop at the end, or replaces the last one; its images are those named in the index.
    ///
    /// # Errors
    /// A stop with implausible numbers.
    pub(super) fn put_stop(&mut self, number: usize, stop: Stop) -> Result<()> {
        let problem = |problem| Error::format(&self.index_path, format!("stops[{number}].{problem}"));
        let cameras = check::check_stop(&stop, &self.folder).map_err(problem)?;
        self.truncate(number);
        self.stores.add_cameras_of(&stop);
        self.index.stops.push(stop);
        self.cameras.push(cameras);
        self.simulated.iter_mut().for_each(Simulated::add_stop);
        Ok(())
    }

    /// Removes the stops from `count` on, with all results from their images.
    pub(super) fn truncate(&mut self, count: usize) {
        if count < self.index.stops.len() {
            self.index.stops.truncate(count);
            self.cameras.truncate(count);
            self.simulated.iter_mut().for_each(|simulated| simulated.truncate(count));
            self.stores = Stores::new(&Arc::default(), &self.index);
        }
    }

    /// The index as it was read.
    pub fn index(&self) -> &TraverseIndex {
        &self.index
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Warnings about this traverse, one sentence each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The number of stops; all functions below take a `step` smaller than this and panic otherwise, except
    /// those that return a `Result`.
    pub fn stop_count(&self) -> usize {
        self.index.stops.len()
    }

    /// The left camera in the rover frame, O made unit.
    pub fn left_camera(&self, step: usize) -> &Camera {
        &self.cameras[step].left
    }

    /// The right camera in the rover frame, O made unit.
    pub fn right_camera(&self, step: usize) -> &Camera {
        &self.cameras[step].right
    }

    /// The estimated pose of the rover in the site frame.
    pub fn site_from_rover(&self, step: usize) -> Pose {
        self.index.stops[step].site_from_rover.to_pose()
    }

    /// The true pose of the rover in the site frame; `None` if unknown.
    pub fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        Some(self.index.stops[step].truth.as_ref()?.site_from_rover.to_pose())
    }

    /// The true camera of the left image in the rover frame; the given one if the index contains no other.
    pub fn true_left_camera(&self, step: usize) -> &Camera {
        self.cameras[step].true_left()
    }

    /// The simulated world, whose surface is the truth; `None` for a recorded traverse.
    ///
    /// It is built on first use, which may take seconds.
    pub fn world(&self) -> Option<&World> {
        self.simulated.as_ref().map(Simulated::world)
    }

    /// The first stage that a paused drive put off at the last stop, `point_mast` or `capture`: the stop has no images yet.
    pub fn awaits(&self) -> Option<CycleStage> {
        self.awaits
    }

    /// Whether a stop has no images because a paused drive has not taken them.
    pub fn is_awaited(&self, step: usize) -> bool {
        self.awaits.is_some() && step + 1 == self.stop_count()
    }

    /// The stops as the renderer's input.
    pub(super) fn stops(&self) -> Stops<'_> {
        Stops { folder: &self.folder, index: &self.index, cameras: &self.cameras }
    }

    /// Returns a stop; an error if a paused drive has not taken its images yet.
    pub(super) fn stop_with_images(&self, step: usize) -> Result<&Stop> {
        let stop = self.stop(step)?;
        if self.is_awaited(step) {
            let problem = format!("stop {step} has no images yet: the drive is paused before `capture`");
            return Err(Error::Request(problem));
        }
        Ok(stop)
    }

    pub(super) fn stop(&self, step: usize) -> Result<&Stop> {
        let count = self.stop_count();
        let missing =
            || Error::Request(format!("there is no step {step}; the traverse has 0 to {}", count - 1));
        self.index.stops.get(step).ok_or_else(missing)
    }
}

/// Writes an index into `folder`, which is created if missing; images are written by the caller.
///
/// # Errors
/// An index with an implausible number, one that exists and may not be replaced, or a folder that cannot be written.
pub fn write(index: &TraverseIndex, folder: &Path, format: IndexFormat, existing: Existing) -> Result<()> {
    let problem = |problem| Error::format(folder.join(format.file_name()), problem);
    check::check_index(index).map_err(problem)?;
    for (step, stop) in index.stops.iter().enumerate() {
        let numbers = check::check_stop_numbers(stop);
        numbers.map_err(|sentence| problem(format!("stops[{step}].{sentence}")))?;
    }
    index_file::write(index, folder, format, existing)
}

#[cfg(test)]
#[path = "native_tests.rs"]
mod tests;
