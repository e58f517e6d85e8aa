//! A simulated traverse: a native folder whose images are rendered when they are first asked for.
//!
//! The folder holds `scenario.toml` and the index that follows from it. An image that is missing is rendered
//! from the true camera, written under a temporary name and renamed; from then on the file is the image, so a
//! pair is the same whether it was rendered just now or long ago.
//!
//! Each stop has a lock, so that two who ask for the same stop do not render it twice. The lock is not waited
//! for inside the thread pool: a pool thread that waits for rendering may be given other work to do, and if
//! that asks for the same stop it would wait for itself. It renders the stop again instead, with the same
//! bits, and whichever file is renamed last stays.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};

use super::check::StopCameras;
use super::files::{resolve, write_atomically};
use super::index_file::{self, Existing, IndexFormat};
use super::native::{Traverse, write};
use super::{Stop, TraverseIndex};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::image::io;
use crate::sim::camera::noise::expose;
use crate::sim::{self, Eye, NoiseSeed, Region, SCENARIO_FILE, Scenario, World, render_region};

/// The largest scenario file that is read, bytes.
const SCENARIO_LIMIT: u64 = 1 << 20;

/// What a simulated traverse has besides its index.
pub(super) struct Simulated {
    scenario: Scenario,
    world: OnceLock<World>,
    locks: Vec<Mutex<()>>,
}

impl Simulated {
    /// Reads the scenario of an index that names one; the world is built when it is first needed.
    pub(super) fn open(index: &TraverseIndex, name: &str, folder: &Path) -> Result<Self, String> {
        let path = resolve(folder, name).map_err(|problem| format!("scenario: {problem}"))?;
        let scenario = read_scenario(&path).map_err(|error| format!("scenario: {error}"))?;
        check_images(index)?;
        let locks = index.stops.iter().map(|_| Mutex::new(())).collect();
        Ok(Self { scenario, world: OnceLock::new(), locks })
    }

    pub(super) fn world(&self) -> &World {
        self.world.get_or_init(|| World::new(&self.scenario))
    }

    /// Renders and writes the images of a stop that are not there yet.
    pub(super) fn render_missing(
        &self,
        step: usize,
        stop: &Stop,
        cameras: &StopCameras,
        folder: &Path,
        cancel: &AtomicBool,
    ) -> Result<()> {
        let _guard = lock(&self.locks[step]);
        let truth = stop.truth.as_ref().ok_or_else(|| Error::Request(needs_truth(step)))?;
        let site_from_rover = truth.site_from_rover.to_pose();
        let left = (Eye::Left, &stop.left.image, cameras.true_left.as_ref().unwrap_or(&cameras.left));
        let right = (Eye::Right, &stop.right.image, cameras.true_right.as_ref().unwrap_or(&cameras.right));
        for (eye, name, camera_in_rover) in [left, right] {
            let path = resolve(folder, name).map_err(|problem| Error::format(folder, problem))?;
            if !path.exists() {
                let seed = NoiseSeed { step: step as u32, eye };
                let file = self.render(&camera_in_rover.moved(&site_from_rover), seed, cancel)?;
                write_atomically(&path, &file)?;
            }
        }
        Ok(())
    }

    /// One image as the bytes of its file.
    fn render(&self, camera_in_site: &Camera, seed: NoiseSeed, cancel: &AtomicBool) -> Result<Vec<u8>> {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        let region = Region::whole(camera_in_site);
        let clean = render_region(self.world(), &self.scenario, camera_in_site, region, cancel)?;
        let image = expose(&clean, &self.scenario, seed, [0, 0]);
        if self.scenario.camera.bit_depth == 8 {
            io::encode_png_u8(&image)
        } else {
            io::encode_png_u16(&image, Some(sim::camera::noise::FULL_SCALE_DN))
        }
    }
}

/// Waits for a stop's lock, except inside the thread pool (header).
fn lock(stop: &Mutex<()>) -> Option<MutexGuard<'_, ()>> {
    match stop.try_lock() {
        Ok(guard) => Some(guard),
        Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) if rayon::current_thread_index().is_some() => None,
        Err(TryLockError::WouldBlock) => Some(stop.lock().unwrap_or_else(PoisonError::into_inner)),
    }
}

fn read_scenario(path: &Path) -> Result<Scenario> {
    let unreadable = |source| Error::Read { path: path.to_owned(), source };
    if std::fs::metadata(path).map_err(unreadable)?.len() > SCENARIO_LIMIT {
        return Err(Error::format(path, "is too large for a scenario"));
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    Scenario::from_toml(&text, path).map_err(|error| match error {
        Error::Setting { .. } => Error::format(path, error.to_string()),
        other => other,
    })
}

fn needs_truth(step: usize) -> String {
    format!("stops[{step}].truth: is missing, but a simulated stop is rendered from it")
}

/// Whether all images of an index can be rendered into files of their own.
fn check_images(index: &TraverseIndex) -> Result<(), String> {
    let mut names = std::collections::HashSet::new();
    for (step, stop) in index.stops.iter().enumerate() {
        if stop.truth.is_none() {
            return Err(needs_truth(step));
        }
        for (side, view) in [("left", &stop.left), ("right", &stop.right)] {
            if !view.image.ends_with(".png") {
                return Err(format!("stops[{step}].{side}.image: must end in .png, because it is rendered"));
            }
            if !names.insert(view.image.as_str()) {
                let name = &view.image;
                return Err(format!(
                    "stops[{step}].{side}.image: {name} is the image of another view already"
                ));
            }
        }
    }
    Ok(())
}

/// Makes the folder of a simulated traverse, without images; opens it where it holds this scenario already.
///
/// # Errors
/// A scenario that no world can be made of, a folder that holds another traverse or images without one, or a
/// folder that cannot be written.
pub fn create_simulated(scenario: &Scenario, folder: &Path) -> Result<Traverse> {
    scenario.validate()?;
    let scenario_path = folder.join(SCENARIO_FILE);
    if folder.is_dir() && index_file::find(folder).is_ok() {
        if scenario_path.is_file() && read_scenario(&scenario_path)? == *scenario {
            return Traverse::open(folder);
        }
        return Err(Error::format(folder, "holds another traverse already; choose another folder"));
    }
    let world = World::new(scenario);
    let index = sim::index(scenario, &world)?;
    for view in index.stops.iter().flat_map(|stop| [&stop.left, &stop.right]) {
        let path = folder.join(&view.image);
        if path.exists() {
            return Err(Error::format(path, "is there without a traverse; choose an empty folder"));
        }
    }
    write_atomically(&scenario_path, scenario.to_toml().as_bytes())?;
    write(&index, folder, IndexFormat::Toml, Existing::Refuse)?;
    let traverse = Traverse::open(folder)?;
    traverse.keep_world(world);
    Ok(traverse)
}

impl Traverse {
    /// Saves building the world again; one that is there already is the same.
    fn keep_world(&self, world: World) {
        if let Some(simulated) = &self.simulated {
            let _ = simulated.world.set(world);
        }
    }
}

#[cfg(test)]
#[path = "simulated_tests.rs"]
mod tests;
