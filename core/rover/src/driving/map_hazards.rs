//! Stage 8 in the loop, `map_hazards`: the goodness map of each stop, from the images of one pair of every stop since the designation.
//!
//! ```text
//! pair of stop k ─► range_points ─► map_hazards (map of stop k − 1, pose estimate of stop k) ─► assess ─► goodness map of stop k
//! ```
//! The map of a stop is a function of the stops up to it and of the command: a drive that is resumed or branched has the same bits.
//! [`HazardMaps`] keeps the results, so that a decision that is requested again costs no second stereo.
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
    GoodnessMap, HazardMap, HazardSettings, MapRules, Scan, assess, map_hazards, range_noise, range_points,
};
use crate::pair::FurtherCamera;
use crate::pipeline::Stops;

/// The outcome of the pair of a stop.
#[derive(Clone, Debug, PartialEq)]
pub enum RangeData {
    /// The number of its points.
    Points(usize),
    /// The reason why there are none.
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

/// The pair of the hazard map of a command, at the stop of the designation; `None` for a navigator without a map.
///
/// # Errors
/// [`Error::Setting`] for a stop without such a pair.
pub fn hazard_camera(stops: &dyn Stops, step: usize, command: &DriveCommand) -> Result<Option<CameraName>> {
    if command.navigator.needs_map() { body_pair(stops, step, command).map(Some) } else { Ok(None) }
}

/// The pair on the body that a command names, or else the first one that looks ahead, for the hazard map and the hand-off.
///
/// # Errors
/// [`Error::Setting`] for a stop without such a pair.
pub fn body_pair(stops: &dyn Stops, step: usize, command: &DriveCommand) -> Result<CameraName> {
    let cameras = stops.further_cameras(step);
    if let Some(name) = command.hazard_camera {
        if cameras.iter().any(|camera| camera.name == name && camera.right.is_some()) {
            return Ok(name);
        }
        let problem = format!("stop {step} has no pair `{name}`; {}", choices(&cameras));
        return Err(Error::setting("hazard_camera", problem));
    }
    let is_hazcam = |camera: &&FurtherCamera<'_>| {
        camera.right.is_some() && camera.mast_angles.is_none() && camera.left.model.axis().x > 0.0
    };
    if let Some(camera) = cameras.iter().find(is_hazcam) {
        return Ok(camera.name);
    }
    let add = "add one with rig mer_front_hazcam to camera.further of the scenario";
    if !command.navigator.needs_map() {
        let problem =
            format!("`hand_off` needs a pair of hazcams, and this drive has none; {add}, or leave it out");
        return Err(Error::setting("on_arrival", problem));
    }
    let problem = format!(
        "`{}` needs a pair of hazcams at every stop, and this drive has none; {add}, name another pair as hazard_camera, or \
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

/// Range data of a stop in the map.
#[derive(Clone, Debug)]
struct Mapped {
    site_from_rover: Pose,
    range: RangeData,
    /// The last goodness map that was requested, and its rules.
    assessed: Option<(MapRules, Arc<StopHazards>)>,
}

/// The hazard maps of a drive, computed stop by stop and kept.
#[derive(Clone, Debug, Default)]
pub struct HazardMaps {
    settings: HazardSettings,
    /// Pair and first stop of the map.
    source: Option<(CameraName, usize)>,
    /// By stop since the first.
    stops: Vec<Mapped>,
    /// The map of the last of them, with the distance driven, m.
    map: Option<HazardMap>,
    driven_m: f64,
}

impl HazardMaps {
    /// The hazards of the stop of a step of a drive since the designation; `None` for a navigator without a map.
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
        let camera = match hazard_camera(stops, first.step, command) {
            Ok(Some(camera)) => camera,
            // Refused at the begin of the drive; a command that was changed on the way has no range data.
            Ok(None) | Err(_) => return Ok(None),
        };
        let index = last.step - first.step;
        if self.source != Some((camera, first.step)) || !self.is_of(stops, first.step) {
            self.clear();
        }
        self.source = Some((camera, first.step));
        self.settings.exemption_radius_m = command.exemption_radius_m;
        let target = stops.site_from_rover(last.step) * last.update.target.position_in_rover;
        let rules = self.rules(stops, [first.step, last.step], [target.x, target.y]);
        if let Some((known, hazards)) = self.stops.get(index).and_then(|mapped| mapped.assessed.as_ref())
            && *known == rules
        {
            return Ok(Some(Arc::clone(hazards)));
        }
        if self.stops.len() > index + 1 {
            // The map itself is kept for the last stop alone.
            self.clear();
            self.source = Some((camera, first.step));
        }
        while self.stops.len() <= index {
            self.map_next(stops, (camera, first.step + self.stops.len()), cancel)?;
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
    fn map_next(
        &mut self,
        stops: &dyn Stops,
        (camera, step): (CameraName, usize),
        cancel: Cancel<'_>,
    ) -> Result<()> {
        cancel.check()?;
        let (points, range) = match self.points(stops, (camera, step), cancel)? {
            Ok(points) => {
                let range = RangeData::Points(points.len());
                (points, range)
            }
            Err(why) => (Vec::new(), RangeData::Missing(why)),
        };
        let site_from_rover = stops.site_from_rover(step);
        let moved = self.stops.last().map_or(0.0, |before| {
            let moved = site_from_rover.translation.vector - before.site_from_rover.translation.vector;
            moved.x.hypot(moved.y)
        });
        self.driven_m += moved;
        let noise = stops.further_pair(step, camera).ok();
        let noise = noise.and_then(|pair| range_noise([pair.left, pair.right], &self.settings));
        let scan = Scan {
            points_in_rover: &points,
            site_from_rover: &site_from_rover,
            driven_m: self.driven_m,
            noise,
        };
        self.map = Some(map_hazards(self.map.as_ref(), &scan, &self.settings));
        self.stops.push(Mapped { site_from_rover, range, assessed: None });
        Ok(())
    }

    /// The points of a stop, or why there are none.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and images that cannot be read or written: they may come at the next attempt.
    fn points(
        &self,
        stops: &dyn Stops,
        (camera, step): (CameraName, usize),
        cancel: Cancel<'_>,
    ) -> Result<Result<Vec<Point3>, String>> {
        let pair = match stops.further_pair(step, camera) {
            Ok(pair) => pair,
            Err(error) => return Ok(Err(error.to_string())),
        };
        let images = stops.capture_further(step, camera, cancel)?;
        match range_points([&images.left, &images.right], [pair.left, pair.right], &self.settings, cancel) {
            Ok(points) => Ok(Ok(points)),
            Err(Error::Cancelled) => Err(Error::Cancelled),
            Err(error) => Ok(Err(error.to_string())),
        }
    }
}
