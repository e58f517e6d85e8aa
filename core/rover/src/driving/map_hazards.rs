//! Stage 8 in the loop, `map_hazards`: the goodness map of each stop, from the images of one or several pairs of every
//! stop since the designation.
//!
//! ```text
//! pairs of stop k ─► range_points ─► map_hazards (map of stop k − 1, pose estimate of stop k) ─► assess ─► goodness map of stop k
//! ```
//! The map of a stop is a function of the stops up to it and of the command: a resumed or branched drive has the same
//! bits. [`HazardMaps`] caches the results, so that repeating a decision requires no second stereo.
//!
//! Frame: site. Sources: domain.md 8; papers.md R9, R99–R102.

use std::sync::Arc;

use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Point3, Pose};
use sightline_track::trace::StepTrace;

use super::command::DriveCommand;
use crate::hazards::{
    GoodnessMap, HazardMap, HazardSettings, MapRules, RangeNoise, Scan, assess, map_hazards, range_noise,
    range_points,
};
use crate::pair::FurtherCamera;
use crate::pipeline::Stops;

/// The result of the pairs of a stop.
#[derive(Clone, Debug, PartialEq)]
pub enum RangeData {
    /// Total number of points.
    Points(usize),
    /// Why a pair has none.
    Missing(String),
}

/// The hazards of one stop.
#[derive(Clone, Debug, PartialEq)]
pub struct StopHazards {
    /// The stop.
    pub step: usize,
    /// Range data of the stop.
    pub range: RangeData,
    /// The goodness map.
    pub map: GoodnessMap,
}

impl StopHazards {
    /// The number of points; `None` without a pair.
    pub(super) fn point_count(&self) -> Option<usize> {
        match self.range {
            RangeData::Points(count) => Some(count),
            RangeData::Missing(_) => None,
        }
    }
}

/// The pairs for the hazard map of a command, at the stop of the designation; empty for a navigator without a map.
///
/// # Errors
/// [`Error::Setting`] for a stop without such a pair, or without one named in the command.
pub fn hazard_cameras(stops: &dyn Stops, step: usize, command: &DriveCommand) -> Result<Vec<CameraName>> {
    let cameras = stops.further_cameras(step);
    let is_pair =
        |name: CameraName| cameras.iter().any(|camera| camera.name == name && camera.right.is_some());
    if let Some(name) = command.hazard_cameras.iter().find(|name| !is_pair(**name)) {
        let problem = format!("stop {step} has no pair `{name}`; {}", choices(&cameras));
        return Err(Error::setting("hazard_cameras", problem));
    }
    match command.navigator.needs_map() {
        false => Ok(Vec::new()),
        true if command.hazard_cameras.is_empty() => Ok(vec![body_pair(stops, step, command)?]),
        true => Ok(command.hazard_cameras.clone()),
    }
}

/// The first pair on the body named in a command, or else the first forward-looking one, for the hazard map and the
/// hand-off.
///
/// # Errors
/// [`Error::Setting`] for a stop without such a pair.
pub fn body_pair(stops: &dyn Stops, step: usize, command: &DriveCommand) -> Result<CameraName> {
    let cameras = stops.further_cameras(step);
    let is_on_body = |camera: &FurtherCamera<'_>| camera.right.is_some() && camera.mast_angles.is_none();
    let is_named =
        |name: &&CameraName| cameras.iter().any(|camera| camera.name == **name && is_on_body(camera));
    if let Some(name) = command.hazard_cameras.iter().find(is_named) {
        return Ok(*name);
    }
    let looks_ahead = |camera: &&FurtherCamera<'_>| is_on_body(camera) && camera.left.model.axis().x > 0.0;
    if let Some(camera) = cameras.iter().find(looks_ahead) {
        return Ok(camera.name);
    }
    let add = "add one with rig mer_front_hazcam to camera.further of the scenario";
    if !command.navigator.needs_map() {
        let problem =
            format!("`hand_off` needs a pair of hazcams, and this drive has none; {add}, or leave it out");
        return Err(Error::setting("on_arrival", problem));
    }
    let problem = format!(
        "`{}` needs a pair of hazcams at every stop, and this drive has none; {add}, name other pairs as hazard_cameras, or \
         choose `arcs`",
        command.navigator.name()
    );
    Err(Error::setting("navigator", problem))
}

fn choices(cameras: &[FurtherCamera<'_>]) -> String {
    let pairs = cameras.iter().filter(|camera| camera.right.is_some());
    let names: Vec<String> = pairs.map(|camera| format!("`{}`", camera.name)).collect();
    if names.is_empty() {
        return "it has no pair beside the main one: add one to camera.further of the scenario".to_owned();
    }
    format!("choose {}", names.join(" or "))
}

/// A stop that is part of the map.
#[derive(Clone, Debug)]
struct Mapped {
    site_from_rover: Pose,
    range: RangeData,
    /// The last requested goodness map, with its rules.
    assessed: Option<(MapRules, Arc<StopHazards>)>,
}

/// The points of a pair, rover frame, m, with their error model.
#[derive(Default)]
struct PairPoints {
    points: Vec<Point3>,
    noise: Option<RangeNoise>,
}

/// The hazard maps of a drive, computed stop by stop and cached.
#[derive(Clone, Debug, Default)]
pub struct HazardMaps {
    settings: HazardSettings,
    /// Pairs and first stop of the map.
    source: Option<(Vec<CameraName>, usize)>,
    /// By stop since the first.
    stops: Vec<Mapped>,
    /// The map of the last of these stops, and the distance driven, m.
    map: Option<HazardMap>,
    driven_m: f64,
}

impl HazardMaps {
    /// The hazards at the stop of a step of a drive since the designation; `None` for a navigator without a map.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and images that cannot be read or written.
    pub fn at(
        &mut self,
        stops: &dyn Stops,
        command: &DriveCommand,
        [first, last]: [&StepTrace; 2],
        cancel: Cancel<'_>,
    ) -> Result<Option<Arc<StopHazards>>> {
        // Rejected at the start of the drive; a command changed on the way has no range data.
        let cameras = hazard_cameras(stops, first.step, command).unwrap_or_default();
        if cameras.is_empty() {
            return Ok(None);
        }
        let index = last.step - first.step;
        let source = Some((cameras, first.step));
        if self.source != source || !self.is_of(stops, first.step) {
            self.clear();
        }
        self.source.clone_from(&source);
        self.settings.exemption_radius_m = command.exemption_radius_m;
        let target = stops.site_from_rover(last.step) * last.update.target.position_in_rover;
        let rules = self.rules(stops, [first.step, last.step], [target.x, target.y]);
        if let Some((known, hazards)) = self.stops.get(index).and_then(|mapped| mapped.assessed.as_ref())
            && *known == rules
        {
            return Ok(Some(Arc::clone(hazards)));
        }
        if self.stops.len() > index + 1 {
            // Only the last stop's map is stored.
            self.clear();
            self.source = source;
        }
        while self.stops.len() <= index {
            self.map_next(stops, first.step + self.stops.len(), cancel)?;
        }
        let (Some(map), Some(mapped)) = (&self.map, self.stops.get_mut(index)) else { return Ok(None) };
        let hazards = Arc::new(StopHazards {
            step: last.step,
            range: mapped.range.clone(),
            map: assess(map, &rules, &self.settings),
        });
        mapped.assessed = Some((rules, Arc::clone(&hazards)));
        Ok(Some(hazards))
    }

    fn clear(&mut self) {
        *self = Self { settings: self.settings.clone(), ..Self::default() };
    }

    /// Whether the stops are those of the map.
    fn is_of(&self, stops: &dyn Stops, first: usize) -> bool {
        let is_known = |(step, mapped): (usize, &Mapped)| {
            step < stops.stop_count() && stops.site_from_rover(step) == mapped.site_from_rover
        };
        (first..).zip(&self.stops).all(is_known)
    }

    fn rules(&self, stops: &dyn Stops, steps: [usize; 2], target_m: [f64; 2]) -> MapRules {
        let [start_m, rover_m] = steps.map(|step| {
            let origin = stops.site_from_rover(step).translation.vector;
            [origin.x, origin.y]
        });
        MapRules::at(rover_m, start_m, Some(target_m), &self.settings)
    }

    /// Adds the next stop to the map.
    fn map_next(&mut self, stops: &dyn Stops, step: usize, cancel: Cancel<'_>) -> Result<()> {
        cancel.check()?;
        let cameras = self.source.as_ref().map(|(cameras, _)| cameras.clone()).unwrap_or_default();
        let mut missing = None;
        let mut scans = Vec::with_capacity(cameras.len());
        for camera in cameras {
            match self.points(stops, (camera, step), cancel)? {
                Ok(scan) => scans.push(scan),
                Err(why) => missing = missing.or(Some(why)),
            }
        }
        let count = scans.iter().map(|scan: &PairPoints| scan.points.len()).sum();
        let range = missing.map_or(RangeData::Points(count), RangeData::Missing);
        let site_from_rover = stops.site_from_rover(step);
        let moved = self.stops.last().map_or(0.0, |before| {
            let moved = site_from_rover.translation.vector - before.site_from_rover.translation.vector;
            moved.x.hypot(moved.y)
        });
        self.driven_m += moved;
        // Without a pair the map still moves with the rover.
        scans.extend(scans.is_empty().then(PairPoints::default));
        for PairPoints { points, noise } in &scans {
            let (site_from_rover, driven_m) = (&site_from_rover, self.driven_m);
            let scan = Scan { points_in_rover: points, site_from_rover, driven_m, noise: *noise };
            self.map = Some(map_hazards(self.map.as_ref(), &scan, &self.settings));
        }
        self.stops.push(Mapped { site_from_rover, range, assessed: None });
        Ok(())
    }

    /// The points of a pair at a stop, or why there are none.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and images that cannot be read or written: a retry may succeed.
    fn points(
        &self,
        stops: &dyn Stops,
        (camera, step): (CameraName, usize),
        cancel: Cancel<'_>,
    ) -> Result<Result<PairPoints, String>> {
        let pair = match stops.further_pair(step, camera) {
            Ok(pair) => pair,
            Err(error) => return Ok(Err(error.to_string())),
        };
        let settings = match pair.mast_angles {
            Some(_) => &self.settings.of_mast(),
            None => &self.settings,
        };
        let (images, cameras) = (stops.capture_further(step, camera, cancel)?, [pair.left, pair.right]);
        match range_points([&images.left, &images.right], cameras, settings, cancel) {
            Ok(points) => Ok(Ok(PairPoints { points, noise: range_noise(cameras, settings) })),
            Err(Error::Cancelled) => Err(Error::Cancelled),
            Err(error) => Ok(Err(error.to_string())),
        }
    }
}
