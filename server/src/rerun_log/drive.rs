//! The commanded drive: goal, ground, paths and decision at every stop, and why it stopped.
//!
//! Entities in addition to those in the module's table, in the site frame:
//!
//! - `/drive/set_goal/goal`, `Points3D`: the goal, with its tolerance as radius;
//! - `/drive/map_hazards/ground`, `Mesh3D`: the known cells at their measured heights, coloured by goodness: from violet
//!   (bad) to yellow (good), blue where the target exempts them, grey where they are assumed to be good;
//! - `/drive/select_path/paths`, `LineStrips3D`: every candidate path, vetoed ones vermilion, the others coloured by their
//!   votes;
//! - `/drive/select_path/chosen`, `LineStrips3D`: the motion, from the pose estimate of the stop;
//! - `/drive/select_path/way`, `LineStrips3D`: the planned path to the goal;
//! - `/drive/decision`, `TextLog`: the motion, or why the drive ended.
//!
//! The driven path is `/rover/path`.

use std::sync::Arc;

use rerun::{
    AsComponents, Clear, LineStrips3D, Mesh3D, Points3D, Radius, RecordingStream, TextLog, TextLogLevel,
};
use sightline_geometry::frames::{Point3, Pose};
use sightline_rover::driving::{Cycle, Motion, StopHazards};
use sightline_rover::hazards::{CellBasis, GoodnessCell, GoodnessMap};
use sightline_session::stop_cause::{StopExplanation, words};

use super::Logged;
use super::convert::point_3d;
use super::palette::{CLEARED, FAILED, MEASUREMENT, PREDICTION, Rgb, TRACKING, color, of_score};

/// Points along a path.
const PATH_POINTS: u32 = 12;
/// Height of the rover's origin above the ground, m (VICAR PigMER); paths are drawn slightly above the ground.
const PATH_BELOW_M: f64 = 0.27;

/// The drive of a session.
#[derive(Clone, Debug, Default)]
pub struct DriveLog {
    /// The decisions at its stops.
    pub cycles: Vec<Cycle>,
    /// The hazard maps of these stops; empty for a navigator without one.
    pub hazards: Vec<Arc<StopHazards>>,
    /// The tolerance of the goal, m.
    pub tolerance_m: f64,
    /// Why it stopped; `None` while it is in progress, and if it has arrived.
    pub why: Option<StopExplanation>,
}

impl DriveLog {
    /// Logs the decision at a stop with the pose estimate there.
    pub(super) fn log(&self, stream: &RecordingStream, cycle: &Cycle, site_from_rover: &Pose) -> Logged {
        let ground = self.hazards.iter().find(|hazards| hazards.step == cycle.step);
        let along = |motion: &Motion| path(motion, site_from_rover);
        log(stream, "set_goal/goal", Some(self.goal(cycle, site_from_rover)))?;
        log(stream, "map_hazards/ground", ground.and_then(|hazards| mesh(&hazards.map)))?;
        let candidates = cycle.choice.as_ref().map(|choice| choice.candidates.as_slice()).unwrap_or_default();
        let paths = LineStrips3D::new(candidates.iter().map(|candidate| along(&candidate.motion)))
            .with_colors(candidates.iter().map(|candidate| {
                let is_vetoed = candidate.veto.is_some();
                color(if is_vetoed { FAILED } else { of_share(candidate.vote) })
            }))
            .with_radii([Radius::new_ui_points(0.75)]);
        log(stream, "select_path/paths", (!candidates.is_empty()).then_some(paths))?;
        let chosen = cycle.motion.as_ref().map(|motion| strip(along(motion), TRACKING, 2.5));
        log(stream, "select_path/chosen", chosen)?;
        let z = site_from_rover.translation.z + PATH_BELOW_M;
        let way = cycle.choice.as_ref().map(|choice| {
            let points = choice.route_m.iter().map(|[x, y]| point_3d(&Point3::new(*x, *y, z))).collect();
            strip(points, PREDICTION, 1.0)
        });
        log(stream, "select_path/way", way)?;
        let (text, level) = self.decision(cycle);
        stream.log("/drive/decision", &TextLog::new(text).with_level(level))
    }

    fn goal(&self, cycle: &Cycle, site_from_rover: &Pose) -> Points3D {
        let [x, y] = cycle.goal.in_site_m;
        let at = Point3::new(x, y, site_from_rover.translation.z + PATH_BELOW_M);
        Points3D::new([point_3d(&at)])
            .with_colors([color(PREDICTION)])
            .with_radii([Radius::new_scene_units(self.tolerance_m as f32)])
            .with_labels(["goal"])
    }

    fn decision(&self, cycle: &Cycle) -> (String, TextLogLevel) {
        let why = self.why.as_ref().filter(|why| why.step == cycle.step);
        match (&cycle.motion, &cycle.ending, why) {
            (_, Some(_), Some(why)) => (why.sentence.clone(), TextLogLevel::WARN.into()),
            (_, Some(ending), None) => (ending.reason.word().to_owned(), TextLogLevel::INFO.into()),
            (Some(motion), ..) => (words::motion(motion), TextLogLevel::INFO.into()),
            (None, ..) => ("the rover stays for another look".to_owned(), TextLogLevel::INFO.into()),
        }
    }
}

fn log<A: AsComponents>(stream: &RecordingStream, part: &str, value: Option<A>) -> Logged {
    let path = format!("/drive/{part}");
    match value {
        Some(value) => stream.log(path, &value),
        None => stream.log(path, &Clear::flat()),
    }
}

fn strip(points: Vec<[f32; 3]>, rgb: Rgb, width: f32) -> LineStrips3D {
    LineStrips3D::new([points]).with_colors([color(rgb)]).with_radii([Radius::new_ui_points(width)])
}

/// Points along a motion that starts at a pose, site frame, m.
fn path(motion: &Motion, site_from_rover: &Pose) -> Vec<[f32; 3]> {
    let at = |k: u32| {
        let ([ahead, right], _) = motion.after(f64::from(k) / f64::from(PATH_POINTS));
        point_3d(&(site_from_rover * Point3::new(ahead, right, PATH_BELOW_M)))
    };
    (0..=PATH_POINTS).map(at).collect()
}

/// The known cells as squares at their heights; `None` without known cells.
fn mesh(map: &GoodnessMap) -> Option<Mesh3D> {
    let half_m = 0.5 * map.grid.cell_m;
    let (mut corners, mut colors, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for (index, cell) in map.cells.iter().enumerate() {
        let Some(height_m) = cell.height_m.filter(|_| cell.basis != CellBasis::Unknown) else { continue };
        let [x, y] = map.grid.centre_m(index);
        let first = corners.len() as u32;
        for [dx, dy] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            let corner = Point3::new(x + dx * half_m, y + dy * half_m, f64::from(height_m));
            corners.push(point_3d(&corner));
            colors.push(color(appearance(cell)));
        }
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    (!corners.is_empty())
        .then(|| Mesh3D::new(corners).with_triangle_indices(triangles).with_vertex_colors(colors))
}

fn appearance(cell: &GoodnessCell) -> Rgb {
    match cell.basis {
        CellBasis::Exempt => MEASUREMENT,
        CellBasis::Assumed => CLEARED,
        CellBasis::Measured | CellBasis::Unknown => of_share(f64::from(cell.goodness)),
    }
}

/// The colour of a value from 0 to 1.
fn of_share(share: f64) -> Rgb {
    of_score((2.0 * share - 1.0) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_begins_under_the_rover_and_ends_where_the_motion_does() {
        let pose = Pose::translation(3.0, -1.0, 0.5);
        let points = path(&Motion::Arc { length_m: 2.0, curvature_per_m: 0.0 }, &pose);
        assert_eq!(points.first(), Some(&[3.0, -1.0, 0.77]));
        assert_eq!(points.last(), Some(&[5.0, -1.0, 0.77]));
    }
}
