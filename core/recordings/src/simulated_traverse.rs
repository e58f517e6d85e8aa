//! The traverse of a scenario: creates its folder, and gives access to the simulated world and its truth.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::files::write_atomically;
use super::index_file::{self, Existing, IndexFormat};
use super::native::{Traverse, write};
use super::render_cache::RenderCache;
use super::simulated::{needs_truth, read_scenario};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_world::moment::{Moment, sun_at};
use sightline_world::scenario::EventSettings;
use sightline_world::traverse::{Stop, StopLight};
use sightline_world::{SCENARIO_FILE, Scenario, World};

/// Creates the folder of a simulated traverse, without images; opens it if it already contains this scenario.
///
/// # Errors
/// An invalid scenario, a folder that contains another traverse or images without one, or a folder that cannot be written.
pub fn create_simulated(scenario: &Scenario, folder: &Path) -> Result<Traverse> {
    create_simulated_until(scenario, folder, Cancel::default())
}

/// As [`create_simulated`]; once `cancel` is requested, it ends soon and creates nothing.
///
/// # Errors
/// As [`create_simulated`], and [`Error::Cancelled`].
pub fn create_simulated_until(scenario: &Scenario, folder: &Path, cancel: Cancel<'_>) -> Result<Traverse> {
    scenario.validate()?;
    let scenario_path = folder.join(SCENARIO_FILE);
    if folder.is_dir() && index_file::find(folder).is_ok() {
        if scenario_path.is_file() && read_scenario(&scenario_path)? == *scenario {
            return Traverse::open(folder);
        }
        return Err(Error::format(folder, "holds another traverse already; choose another folder"));
    }
    let world = World::new_until(scenario, cancel)?;
    let index = sightline_world::index_until(scenario, &world, cancel);
    cancel.check()?;
    let index = index?;
    for view in index.stops.iter().flat_map(Stop::views) {
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
    /// The same traverse with its clean radiance in another cache, which several traverses may share; a recorded
    /// traverse is unchanged.
    #[must_use]
    pub fn with_render_cache(mut self, cache: RenderCache) -> Self {
        if let Some(simulated) = &mut self.simulated {
            simulated.cache = cache;
        }
        self
    }

    /// Number of images of a simulated traverse rendered since it was opened, without those developed from stored radiance.
    pub fn rendered_count(&self) -> u32 {
        self.simulated.as_ref().map_or(0, |simulated| simulated.rendered.load(Ordering::Relaxed))
    }

    /// The exposure time of the images of a simulated stop, s; `None` for a recorded traverse.
    ///
    /// Under automatic exposure it renders the left images up to this stop that are not stored.
    ///
    /// # Errors
    /// No such stop, or [`Error::Cancelled`] soon after `cancel` is set.
    pub fn exposure_s(&self, step: usize, cancel: &AtomicBool) -> Result<Option<f64>> {
        let Some(simulated) = &self.simulated else { return Ok(None) };
        if step >= self.stop_count() {
            return Err(Error::Request(format!("there is no step {step}")));
        }
        simulated.exposure_s(&self.stops(), step, cancel).map(Some)
    }

    /// Light and exposure of a stop, as recorded or by the scenario; `None` if neither is known.
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

    /// The state of the world at a stop: sun, occluding objects, and the rover.
    ///
    /// # Errors
    /// No such stop, or a recorded traverse, whose world is unknown.
    pub fn world_at(&self, step: usize) -> Result<World> {
        let simulated = self.simulated.as_ref();
        let simulated = simulated
            .ok_or_else(|| Error::Request("a recorded traverse has no simulated world".to_owned()))?;
        let stops = &self.index().stops;
        stops.get(step).ok_or_else(|| Error::Request(format!("there is no step {step}")))?;
        let moment = Moment::of(step, stops).ok_or_else(|| Error::Request(needs_truth(step)))?;
        Ok(simulated.world().at(&moment, &simulated.scenario))
    }

    /// Whether the scenario has occluders at some stops.
    pub(super) fn has_occluders(&self) -> bool {
        let events = self.simulated.as_ref().map(|simulated| &simulated.scenario.events);
        events.is_some_and(EventSettings::has_occluders)
    }

    /// Sets the world, to save building it again; a world that exists already is the same.
    pub(super) fn keep_world(&self, world: World) {
        if let Some(simulated) = &self.simulated {
            let _ = simulated.world.set(world);
        }
    }
}

#[cfg(test)]
#[path = "simulated_tests.rs"]
mod tests;
