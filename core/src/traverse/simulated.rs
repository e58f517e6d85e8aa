//! A simulated traverse: a native folder whose images are rendered when they are first asked for.
//!
//! The folder holds `scenario.toml` and the index that follows from it. An image that is missing is rendered
//! from the true camera, written under a temporary name and renamed; from then on the file is the image, so a
//! pair is the same whether it was rendered just now or long ago.
//!
//! Rendering makes clean radiance, which is kept ([`RenderCache`]); the image is developed from it. A scenario
//! that differs in exposure, detector or noise alone finds the radiance there, in a folder that both share
//! ([`Traverse::with_render_cache`]). What is found is believed when sixteen of its pixels, rendered anew, have
//! the same bits: a file may come from a build of this version that rendered otherwise.
//!
//! Under automatic exposure both eyes take the exposure of the left one, and each stop starts from the stop
//! before: an image needs the left radiance of all stops up to its own.
//!
//! Each stop has a lock, so that two who ask for the same stop do not render it twice. The lock is not waited
//! for inside the thread pool: a pool thread that waits for rendering may be given other work to do, and if
//! that asks for the same stop it would wait for itself. It renders the stop again instead, with the same
//! bits, and whichever file is renamed last stays. The exposures are known by a lock that is never held while
//! anything is rendered.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};

use serde::Serialize;

use super::files::{resolve, write_atomically};
use super::index_file::{self, Existing, IndexFormat};
use super::native::{Traverse, write};
use super::render_cache::{self, RenderCache};
use super::{Stop, TraverseIndex};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::image::{GrayImage, io};
use crate::sim::camera::exposure::{Rates, automatic, fixed_s};
use crate::sim::moment::{Moment, sun_at};
use crate::sim::scenario::ExposureMode;
use crate::sim::{self, Eye, NoiseSeed, Region, SCENARIO_FILE, Scenario, World, clean_radiance, develop};
use crate::traverse::StopLight;

/// Pixels of a kept picture that are rendered anew before it is believed.
const PROBES: u32 = 16;

/// The largest scenario file that is read, bytes.
const SCENARIO_LIMIT: u64 = 1 << 20;

/// What a simulated traverse has besides its index.
pub(super) struct Simulated {
    scenario: Scenario,
    world: OnceLock<World>,
    locks: Vec<Mutex<()>>,
    cache: RenderCache,
    /// Times of exposure of the first stops, as far as they are known, s.
    exposures_s: Mutex<Vec<f64>>,
    rendered: AtomicU32,
}

impl Simulated {
    /// Reads the scenario of an index that names one; the world is built when it is first needed.
    pub(super) fn open(index: &TraverseIndex, name: &str, folder: &Path) -> Result<Self, String> {
        let path = resolve(folder, name).map_err(|problem| format!("scenario: {problem}"))?;
        let scenario = read_scenario(&path).map_err(|error| format!("scenario: {error}"))?;
        check_images(index)?;
        Ok(Self {
            scenario,
            world: OnceLock::new(),
            locks: index.stops.iter().map(|_| Mutex::new(())).collect(),
            cache: RenderCache::of_traverse(folder),
            exposures_s: Mutex::new(Vec::new()),
            rendered: AtomicU32::new(0),
        })
    }

    pub(super) fn world(&self) -> &World {
        self.world.get_or_init(|| World::new(&self.scenario))
    }

    /// Renders and writes the images of a stop that are not there yet.
    pub(super) fn render_missing(&self, traverse: &Traverse, step: usize, cancel: &AtomicBool) -> Result<()> {
        let _guard = lock(&self.locks[step]);
        let stop: &Stop = &traverse.index().stops[step];
        for (eye, name) in [(Eye::Left, &stop.left.image), (Eye::Right, &stop.right.image)] {
            let folder = traverse.folder();
            let path = resolve(folder, name).map_err(|problem| Error::format(folder, problem))?;
            if !path.exists() {
                let time_s = self.exposure_s(traverse, step, cancel)?;
                let (camera, radiance) = self.radiance(traverse, step, eye, cancel)?;
                let seed = NoiseSeed { step: step as u32, eye };
                let image = develop(&radiance, &self.scenario, &camera, time_s, seed);
                write_atomically(&path, &self.encode(&image)?)?;
            }
        }
        Ok(())
    }

    /// The time for which both pictures of a stop are exposed, s.
    fn exposure_s(&self, traverse: &Traverse, step: usize, cancel: &AtomicBool) -> Result<f64> {
        let settings = &self.scenario.camera;
        if settings.exposure == ExposureMode::Fixed {
            return Ok(fixed_s(self.world(), &self.scenario));
        }
        let (first, mut time_s) = {
            let known = self.exposures_s.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(time_s) = known.get(step) {
                return Ok(*time_s);
            }
            (known.len(), known.last().copied().unwrap_or(settings.auto_exposure.start_s))
        };
        for stop in first..=step {
            let (camera, radiance) = self.radiance(traverse, stop, Eye::Left, cancel)?;
            let rates = Rates::new(&radiance, &self.scenario, &camera, Eye::Left, [0, 0]);
            time_s = automatic(&rates, settings, time_s).time_s;
            let mut known = self.exposures_s.lock().unwrap_or_else(PoisonError::into_inner);
            // Whoever else was at this stop found the same.
            if known.len() == stop {
                known.push(time_s);
            }
        }
        Ok(time_s)
    }

    /// The camera of a picture in the site and its clean radiance: what was kept, or else rendered and kept.
    fn radiance(
        &self,
        traverse: &Traverse,
        step: usize,
        eye: Eye,
        cancel: &AtomicBool,
    ) -> Result<(Camera, GrayImage)> {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        let camera = camera_in_site(traverse, step, eye)?;
        let stop = &traverse.index().stops[step];
        let moment = Moment::of(step, stop).ok_or_else(|| Error::Request(needs_truth(step)))?;
        let world = self.world().at(&moment, &self.scenario);
        let render = |region: Region| clean_radiance(&world, &self.scenario, &camera, region, cancel);
        let key = render_cache::key(&self.scenario, &stop_key(stop, step), &camera);
        if let Some(kept) = self.cache.load(&key, &camera)
            && renders_alike(&kept, render)?
        {
            return Ok((camera, kept));
        }
        let radiance = render(Region::whole(&camera))?;
        self.rendered.fetch_add(1, Ordering::Relaxed);
        self.cache.store(&key, &radiance);
        Ok((camera, radiance))
    }

    /// One image as the bytes of its file.
    fn encode(&self, image: &GrayImage) -> Result<Vec<u8>> {
        let full_scale_dn = self.scenario.camera.recorded_full_scale_dn();
        if full_scale_dn <= 255.0 {
            io::encode_png_u8(image)
        } else {
            io::encode_png_u16(image, Some(full_scale_dn))
        }
    }
}

/// Whether sixteen pixels, spread over a kept picture, are rendered with the same bits.
fn renders_alike(kept: &GrayImage, render: impl Fn(Region) -> Result<GrayImage>) -> Result<bool> {
    for probe in 0..PROBES {
        // Multiples of these two numbers fill a square evenly (Roberts' sequence).
        let at = |step: f64, side: u32| {
            let place = (0.5 + step * f64::from(probe)).fract() * f64::from(side);
            (place as u32).min(side.saturating_sub(1))
        };
        let (x, y) = (at(0.754_877_67, kept.width()), at(0.569_840_29, kept.height()));
        let anew = render(Region { x, y, width: 1, height: 1 })?;
        if anew.get_pixel(0, 0).0[0].to_bits() != kept.get_pixel(x, y).0[0].to_bits() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// What a stop's light and scenery can depend on besides the scenario: its number, time and truth.
fn stop_key(stop: &Stop, step: usize) -> impl Serialize {
    (step, stop.time_s, stop.truth.clone())
}

/// The camera that truly takes a picture of a stop, in the site frame.
fn camera_in_site(traverse: &Traverse, step: usize, eye: Eye) -> Result<Camera> {
    let site_from_rover =
        traverse.true_site_from_rover(step).ok_or_else(|| Error::Request(needs_truth(step)))?;
    let in_rover = match eye {
        Eye::Left => traverse.true_left_camera(step),
        Eye::Right => traverse.true_right_camera(step),
    };
    Ok(in_rover.moved(&site_from_rover))
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
    Scenario::from_toml(&text, path)
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
    /// The same traverse with its clean radiance in another cache, which several traverses may share; a
    /// recorded traverse stays as it is.
    #[must_use]
    pub fn with_render_cache(mut self, cache: RenderCache) -> Self {
        if let Some(simulated) = &mut self.simulated {
            simulated.cache = cache;
        }
        self
    }

    /// How many pictures of a simulated traverse were rendered since it was opened; those that were developed
    /// from kept radiance do not count.
    pub fn rendered_count(&self) -> u32 {
        self.simulated.as_ref().map_or(0, |simulated| simulated.rendered.load(Ordering::Relaxed))
    }

    /// The time for which the pictures of a simulated stop are exposed, s; `None` for a recorded traverse.
    ///
    /// Under automatic exposure it renders the left pictures up to this stop that are not kept.
    ///
    /// # Errors
    /// No such stop, or [`Error::Cancelled`] soon after `cancel` is set.
    pub fn exposure_s(&self, step: usize, cancel: &AtomicBool) -> Result<Option<f64>> {
        let Some(simulated) = &self.simulated else { return Ok(None) };
        if step >= self.stop_count() {
            return Err(Error::Request(format!("there is no step {step}")));
        }
        simulated.exposure_s(self, step, cancel).map(Some)
    }

    /// How a stop was lit and exposed: as recorded, or as the scenario says; nothing where neither is known.
    ///
    /// # Errors
    /// As [`Traverse::exposure_s`].
    pub fn light(&self, step: usize, cancel: &AtomicBool) -> Result<Option<StopLight>> {
        let exposure_s = self.exposure_s(step, cancel)?;
        let stop = self.index().stops.get(step);
        let stop = stop.ok_or_else(|| Error::Request(format!("there is no step {step}")))?;
        let Some(simulated) = &self.simulated else { return Ok(stop.light) };
        let scenario = &simulated.scenario;
        let to_sun = sun_at(&scenario.sun, &scenario.events, stop.time_s);
        Ok(Some(StopLight {
            sun_azimuth_deg: to_sun.y.atan2(to_sun.x).to_degrees(),
            sun_elevation_deg: (-to_sun.z).asin().to_degrees(),
            exposure_s,
        }))
    }

    /// The world as it is when the rover stands at a stop: sun, what is in the way, the rover itself.
    ///
    /// # Errors
    /// No such stop, or a recorded traverse, whose world nobody knows.
    pub fn world_at(&self, step: usize) -> Result<World> {
        let simulated = self.simulated.as_ref();
        let simulated = simulated
            .ok_or_else(|| Error::Request("a recorded traverse has no simulated world".to_owned()))?;
        let stop = self.index().stops.get(step);
        let stop = stop.ok_or_else(|| Error::Request(format!("there is no step {step}")))?;
        let moment = Moment::of(step, stop).ok_or_else(|| Error::Request(needs_truth(step)))?;
        Ok(simulated.world().at(&moment, &simulated.scenario))
    }

    /// Whether something stands in the way at some of the stops.
    pub(super) fn has_occluders(&self) -> bool {
        self.simulated.as_ref().is_some_and(|simulated| !simulated.scenario.events.occluders.is_empty())
    }

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
