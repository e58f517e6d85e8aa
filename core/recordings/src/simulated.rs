//! A simulated traverse: a native folder whose images are rendered on first use.
//!
//! The folder contains `scenario.toml` and the index derived from it. A missing image is rendered from the true
//! camera, written under a temporary name and renamed; from then on the file is the image, so a pair is the same
//! whether it was rendered just now or long ago.
//!
//! Rendering computes clean radiance, which is stored ([`RenderCache`]); the image is developed from it. A scenario
//! that differs only in exposure, detector or noise reuses the radiance, in a folder that both share
//! (`Traverse::with_render_cache`). Stored radiance is used if sixteen of its pixels, rendered again, have the same
//! bits: the same sources may give other bits on another processor.
//!
//! Under automatic exposure both cameras use the exposure of the left one, and each stop starts from that of the
//! previous stop: an image needs the left radiance of all stops up to its own.
//!
//! A further camera is exposed independently: under fixed exposure its first left image has the mean level, and
//! automatic exposure starts anew at each stop, so that no earlier image needs to be rendered. Its noise and pixel
//! response are those that the same rig would have as the main pair.
//!
//! Each stop has a lock, so that concurrent requests do not render it twice. Threads of the pool do not wait for the
//! lock: a pool thread that waits for rendering may be given other work, and if that requests the same stop it would
//! wait for itself. It renders the stop again instead, with the same bits, and the file that is renamed last remains.
//! The exposures have a lock of their own that is never locked during rendering.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};

use serde::Serialize;

use super::check::StopCameras;
use super::files::{read_text, resolve, write_atomically};
use super::images::{no_camera, views};
use super::render_cache::{self, RenderCache};
use sightline_geometry::camera::{Camera, CameraName};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_vision::image::{GrayImage, io};
use sightline_world::camera::exposure::{Rates, automatic, fixed_of_further_s, fixed_s};
use sightline_world::moment::Moment;
use sightline_world::scenario::{ExposureMode, FaultKind};
use sightline_world::traverse::{Stop, TraverseIndex, View};
use sightline_world::{
    Eye, NoiseSeed, Region, Scenario, World, add_dust, add_ghosts, clean_radiance, develop_until,
};

/// Number of pixels of a stored image that are rendered again for comparison.
const PROBES: u32 = 16;

/// The largest scenario file that is read, bytes.
const SCENARIO_LIMIT: u64 = 1 << 20;

/// The stops whose images are rendered, each with its cameras, and the folder of the images.
pub(super) struct Stops<'a> {
    pub(super) folder: &'a Path,
    pub(super) index: &'a TraverseIndex,
    pub(super) cameras: &'a [StopCameras],
}

/// The data of a simulated traverse besides its index.
pub(super) struct Simulated {
    pub(super) scenario: Scenario,
    pub(super) world: OnceLock<World>,
    locks: Vec<Mutex<()>>,
    pub(super) cache: RenderCache,
    /// Exposure times of the first stops, as far as computed, s.
    exposures_s: Mutex<Vec<f64>>,
    pub(super) rendered: AtomicU32,
}

impl Simulated {
    /// Reads the scenario of an index that names one; the world is built on first use.
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

    /// Adds the lock of one more stop.
    pub(super) fn add_stop(&mut self) {
        self.locks.push(Mutex::new(()));
    }

    /// Removes the exposures of the stops from `count` on.
    pub(super) fn truncate(&mut self, count: usize) {
        self.locks.truncate(count);
        self.exposures_s.get_mut().unwrap_or_else(PoisonError::into_inner).truncate(count);
    }

    pub(super) fn world(&self) -> &World {
        self.world.get_or_init(|| World::new(&self.scenario))
    }

    /// As [`Simulated::world`], but ends soon after `cancel` is requested. Concurrent callers may both build the world.
    pub(super) fn world_until(&self, cancel: Cancel<'_>) -> Result<&World> {
        if let Some(world) = self.world.get() {
            return Ok(world);
        }
        let world = World::new_until(&self.scenario, cancel)?;
        Ok(self.world.get_or_init(|| world))
    }

    /// Renders and writes the missing images of a stop's main pair, or of a further camera.
    pub(super) fn render_missing(
        &self,
        stops: &Stops<'_>,
        step: usize,
        camera: Option<CameraName>,
        cancel: &AtomicBool,
    ) -> Result<()> {
        if camera.is_none_or(|name| name == CameraName::ODOMETRY)
            && self.scenario.events.has_fault(FaultKind::CameraDropOut, step as u32)
        {
            return Err(Error::Request(format!(
                "the cameras gave no images at stop {step} (injected drop-out)"
            )));
        }
        let _guard = lock(&self.locks[step]);
        let (left, right) = views(&stops.index.stops[step], camera).ok_or_else(|| no_camera(step, camera))?;
        for (eye, view) in [(Eye::Left, Some(left)), (Eye::Right, right)] {
            let Some(View { image, .. }) = view else { continue };
            let path =
                resolve(stops.folder, image).map_err(|problem| Error::format(stops.folder, problem))?;
            if !path.exists() {
                let time_s = match camera {
                    None => self.exposure_s(stops, step, cancel)?,
                    Some(name) => self.exposure_of_further_s(stops, step, name, cancel)?,
                };
                let (camera, radiance) = self.radiance(stops, step, (camera, eye), cancel)?;
                let seed = NoiseSeed { step: step as u32, eye };
                let image = develop_until(&radiance, &self.scenario, &camera, time_s, seed, cancel.into())?;
                write_atomically(&path, &self.encode(&image)?)?;
            }
        }
        Ok(())
    }

    /// The exposure time of both images of a stop, s.
    pub(super) fn exposure_s(&self, stops: &Stops<'_>, step: usize, cancel: &AtomicBool) -> Result<f64> {
        let settings = &self.scenario.camera;
        if settings.exposure == ExposureMode::Fixed {
            return Ok(fixed_s(self.world_until(cancel.into())?, &self.scenario));
        }
        let (first, mut time_s) = {
            let known = self.exposures_s.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(time_s) = known.get(step) {
                return Ok(*time_s);
            }
            (known.len(), known.last().copied().unwrap_or(settings.auto_exposure.start_s))
        };
        for stop in first..=step {
            let (camera, radiance) = self.radiance(stops, stop, (None, Eye::Left), cancel)?;
            let rates = Rates::new(&radiance, &self.scenario, &camera, Eye::Left, [0, 0]);
            let centre = stops.index.stops[stop].metered_px;
            time_s = automatic(&rates, settings, centre, time_s).time_s;
            let mut known = self.exposures_s.lock().unwrap_or_else(PoisonError::into_inner);
            // A concurrent call at this stop computed the same.
            if known.len() == stop {
                known.push(time_s);
            }
        }
        Ok(time_s)
    }

    /// The exposure time of both images of a further camera, s.
    fn exposure_of_further_s(
        &self,
        stops: &Stops<'_>,
        step: usize,
        name: CameraName,
        cancel: &AtomicBool,
    ) -> Result<f64> {
        let settings = &self.scenario.camera;
        if settings.exposure == ExposureMode::Fixed {
            let world = self.world_until(cancel.into())?;
            let time_s = fixed_of_further_s(world, &self.scenario, name, cancel.into());
            Cancel::from(cancel).check()?;
            // An index may name a camera that the scenario does not have.
            return Ok(time_s.unwrap_or_else(|| fixed_s(world, &self.scenario)));
        }
        let (camera, radiance) = self.radiance(stops, step, (Some(name), Eye::Left), cancel)?;
        let rates = Rates::new(&radiance, &self.scenario, &camera, Eye::Left, [0, 0]);
        Ok(automatic(&rates, settings, None, settings.auto_exposure.start_s).time_s)
    }

    /// The camera of an image in the site frame and its clean radiance, from the cache or else rendered and stored.
    fn radiance(
        &self,
        stops: &Stops<'_>,
        step: usize,
        picture: (Option<CameraName>, Eye),
        cancel: &AtomicBool,
    ) -> Result<(Camera, GrayImage)> {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        let camera = camera_in_site(stops, step, picture)?;
        let moment = Moment::of(step, &stops.index.stops).ok_or_else(|| Error::Request(needs_truth(step)))?;
        let world = self.world_until(cancel.into())?.at(&moment, &self.scenario);
        let render = |region: Region| clean_radiance(&world, &self.scenario, &camera, region, cancel);
        let with_events = |mut radiance: GrayImage| {
            if let Some(name) = picture.0 {
                let at = (name, moment.stop);
                add_ghosts(&mut radiance, &self.scenario, at, &camera, &moment.site_from_rover);
            }
            add_dust(&mut radiance, &self.scenario, moment.stop);
            radiance
        };
        let key = render_cache::key(&self.scenario, &stop_key(&moment, &stops.index.stops[step]), &camera);
        if let Some(kept) = self.cache.load(&key, &camera)
            && renders_alike(&kept, render)?
        {
            let kept = with_events(kept);
            return Ok((camera, kept));
        }
        let radiance = render(Region::whole(&camera))?;
        self.rendered.fetch_add(1, Ordering::Relaxed);
        self.cache.store(&key, &radiance);
        let radiance = with_events(radiance);
        Ok((camera, radiance))
    }

    /// Encodes an image as the bytes of its file.
    fn encode(&self, image: &GrayImage) -> Result<Vec<u8>> {
        let full_scale_dn = self.scenario.camera.recorded_full_scale_dn();
        if full_scale_dn <= 255.0 {
            io::encode_png_u8(image)
        } else {
            io::encode_png_u16(image, Some(full_scale_dn))
        }
    }
}

/// Whether sixteen pixels, spread over a stored image, are rendered with the same bits.
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

/// The inputs of a stop's light and scenery besides the scenario: its number, time and truth, and the wheel tracks so far.
pub(super) fn stop_key(moment: &Moment, stop: &Stop) -> impl Serialize {
    (moment.stop, stop.time_s, stop.truth.clone(), moment.wheel_places_m.clone())
}

/// The true camera of an image of a stop, in the site frame.
pub(super) fn camera_in_site(
    stops: &Stops<'_>,
    step: usize,
    (camera, eye): (Option<CameraName>, Eye),
) -> Result<Camera> {
    let truth = stops.index.stops[step].truth.as_ref();
    let truth = truth.ok_or_else(|| Error::Request(needs_truth(step)))?;
    let cameras = &stops.cameras[step];
    let in_rover = match camera {
        None if eye == Eye::Left => Some(cameras.true_left()),
        None => Some(cameras.true_right()),
        Some(name) => cameras.named(name).and_then(|camera| match eye {
            Eye::Left => Some(camera.true_left()),
            Eye::Right => camera.true_right(),
        }),
    };
    let in_rover = in_rover.ok_or_else(|| no_camera(step, camera))?;
    Ok(in_rover.moved(&truth.site_from_rover.to_pose()))
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

pub(super) fn read_scenario(path: &Path) -> Result<Scenario> {
    let unreadable = |source| Error::Read { path: path.to_owned(), source };
    if std::fs::metadata(path).map_err(unreadable)?.len() > SCENARIO_LIMIT {
        return Err(Error::format(path, "is too large for a scenario"));
    }
    let text = read_text(path).map_err(unreadable)?;
    Scenario::from_toml(&text, path)
}

pub(super) fn needs_truth(step: usize) -> String {
    format!("stops[{step}].truth: is missing, but a simulated stop is rendered from it")
}

/// The field names of a stop's views, in order.
fn sides(stop: &Stop) -> impl Iterator<Item = String> {
    let further = stop.cameras.iter().enumerate().flat_map(|(k, camera)| {
        let right = camera.right.as_ref().map(|_| format!("cameras[{k}].right"));
        std::iter::once(format!("cameras[{k}].left")).chain(right)
    });
    ["left", "right"].map(str::to_owned).into_iter().chain(further)
}

/// Checks that all images of an index can be rendered into separate files.
fn check_images(index: &TraverseIndex) -> Result<(), String> {
    let mut names = std::collections::HashSet::new();
    for (step, stop) in index.stops.iter().enumerate() {
        if stop.truth.is_none() {
            return Err(needs_truth(step));
        }
        for (view, side) in stop.views().zip(sides(stop)) {
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
