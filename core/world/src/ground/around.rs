//! The ground that the cameras see and the wheels cover on a drive that is more than a straight line, for placing rocks.
//!
//! A point gets rocks if it is in the view wedge of either camera of some stop. The wedge starts at the camera's centre C
//! and opens along its axis in the horizontal plane: points a ahead and s aside with a > 0 and `s ≤ 2 m + w a`, where 2 m
//! is for rocks that cast shadows into the image. For a camera that looks down the wedge also extends beside and behind C
//! as far as the image shows ground. The widening w is the smallest for which the wedge contains the flat-ground
//! intersections of all rays of the image's border, up to `FARTHEST_M`, with the head rotated to either side by the
//! largest pointing error; it is at least 0.46 (tan 25°). Beyond `FISHEYE_M` the wedge of a fisheye has w ≤ 0.6. Rocks
//! keep clear of the wheel paths on flat ground, and high ones of the belly.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | C | `from_m` | m, site |
//! | a, s | `ahead_m`, `aside_m` | m, site |
//! | w | `widening` | m/m |
//!
//! Frame: site, m. Sources: domain.md 2.6 (field of view), 4.2 (pointing), 5.4 (wheels).

use crate::camera::rig::Rig;
use crate::ground::level::MEAN_GROUND_Z_M;
use crate::rover::plan::{goal_m, planned};
use crate::rover::scene::{TrueDrive, TrueStop};
use crate::scenario::{CameraSettings, Course, DriveSettings};
use sightline_geometry::camera::{Camera, MastAngles};
use sightline_geometry::frames::{Pixel, Point3, Pose};

/// Half of a wheel's width and a margin, m.
const WHEEL_M: f64 = 0.13;
/// Distance from the rover's origin within which a rock can touch the belly, m (ours).
const BELLY_REACH_M: f64 = 0.6;
/// Distance beside the visible ground within which a rock may shade it, m.
const ASIDE_M: f64 = 2.0;
/// Smallest widening of a wedge, m aside per m ahead.
const WIDENING: f64 = 0.46;
/// Largest distance up to which the field of view is followed, m.
const FARTHEST_M: f64 = 100.0;
/// Distance up to which rocks fill the sides of a fisheye's view, m (ours: beyond it, a rock of 0.25 m spans four of its
/// pixels), and the widening of the middle part that continues beyond.
const FISHEYE_M: f64 = 30.0;
const FISHEYE_WIDENING: f64 = 0.6;
/// Rays along each side of an image's border.
const BORDER_RAYS: u32 = 16;
/// Largest difference of the viewing direction between plan and drive due to uneven ground under the wheels, rad (ours).
const UNEVEN_RAD: f64 = 0.03;

/// Largest pointing error for which the wedge of a straight approach contains the view, rad: 0.46 less the 0.41 of half an
/// image.
const STRAIGHT_POINTING_RAD: f64 = 0.04;

/// The ground that one camera sees at one stop.
#[derive(Clone, Debug, PartialEq)]
struct Wedge {
    from_m: [f64; 2],
    /// Unit direction of the optical axis in the horizontal plane.
    along: [f64; 2],
    widening: f64,
    /// Distance behind the centre up to which the image of a camera that looks down shows ground, m.
    behind_m: f64,
}

/// View wedges, wheel positions and rover positions of a planned drive.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Around {
    goal_m: [f64; 2],
    wedges: Vec<Wedge>,
    wheels_m: Vec<[f64; 2]>,
    middles_m: Vec<[f64; 2]>,
}

impl Around {
    /// For a drive with its cameras. `None` for a straight approach along x with the main pair on the mast, a small pointing
    /// error and no pair turned elsewhere: its wedge and lane follow from constants.
    pub(crate) fn new(drive: &DriveSettings, camera: &CameraSettings) -> Option<Self> {
        let is_straight = drive.course == Course::Approach && drive.heading_deg == 0.0;
        let is_narrow = !camera.rig.is_on_body() && pointing_rad(drive) <= STRAIGHT_POINTING_RAD;
        let turned: Vec<(Rig, MastAngles)> = camera
            .further
            .iter()
            .filter_map(|pair| Some((Rig::of(pair.rig, pair.image_size), pair.look()?)))
            .collect();
        if is_straight && is_narrow && turned.is_empty() {
            return None;
        }
        let TrueDrive { stops, legs } = planned(drive).ok()?;
        let stands = || legs.iter().flat_map(|leg| &leg.stands);
        let (rig, [x_m, y_m]) = (Rig::new(camera), goal_m(drive));
        let goal = Point3::new(x_m, y_m, MEAN_GROUND_Z_M);
        Some(Self {
            goal_m: [x_m, y_m],
            wedges: stops
                .iter()
                .flat_map(|stop| {
                    let off_by_rad = pointing_rad(drive) + UNEVEN_RAD;
                    let turned = turned.iter().flat_map(move |(rig, look)| {
                        seen(rig, Some(*look), &stop.site_from_rover, off_by_rad)
                    });
                    wedges(&rig, stop, &goal, off_by_rad).into_iter().chain(turned)
                })
                .collect(),
            wheels_m: stands()
                .flat_map(|stand| stand.contacts_in_site.map(|point| [point.x, point.y]))
                .collect(),
            middles_m: stands()
                .map(|stand| [stand.site_from_rover.translation.x, stand.site_from_rover.translation.y])
                .collect(),
        })
    }

    /// Largest distance of a camera from the targets' centre, with a margin, m.
    pub(crate) fn reach_m(&self) -> f64 {
        let [x_m, y_m] = self.goal_m;
        let off_m = |wedge: &Wedge| (wedge.from_m[0] - x_m).hypot(wedge.from_m[1] - y_m);
        self.wedges.iter().map(off_m).fold(0.0, f64::max) + ASIDE_M
    }

    /// Whether a point is in the view of some stop.
    pub(crate) fn sees(&self, x_m: f64, y_m: f64) -> bool {
        self.wedges.iter().any(|wedge| wedge.holds(x_m, y_m))
    }

    /// Whether a rock of this radius (m) would be under a wheel or, if `touches_belly`, under the rover.
    pub(crate) fn is_in_the_way(&self, x_m: f64, y_m: f64, reach_m: f64, touches_belly: bool) -> bool {
        let near = |places: &[[f64; 2]], by_m: f64| {
            places.iter().any(|place| (place[0] - x_m).powi(2) + (place[1] - y_m).powi(2) < by_m * by_m)
        };
        near(&self.wheels_m, reach_m + WHEEL_M)
            || touches_belly && near(&self.middles_m, reach_m + BELLY_REACH_M)
    }
}

/// Largest difference between true and commanded azimuth of the head, rad.
fn pointing_rad(drive: &DriveSettings) -> f64 {
    let off_deg =
        3.0 * drive.pointing_error_deg + 0.5 * drive.mast_backlash_deg + drive.mast_offset_deg[0].abs();
    off_deg.to_radians()
}

/// View wedges of both cameras at a stop of the plan, with the mast pointed at the targets' centre.
fn wedges(rig: &Rig, stop: &TrueStop, goal: &Point3, off_by_rad: f64) -> Vec<Wedge> {
    let site_from_rover: &Pose = &stop.site_from_rover;
    let Ok(angles) = rig.point_at(&site_from_rover.inverse_transform_point(goal)) else { return Vec::new() };
    seen(rig, angles, site_from_rover, off_by_rad).to_vec()
}

/// View wedges of both cameras of a rig at mast angles.
fn seen(rig: &Rig, angles: Option<MastAngles>, site_from_rover: &Pose, off_by_rad: f64) -> [Wedge; 2] {
    let (left, right) = rig.cameras_in_rover(angles);
    [left, right].map(|eye| Wedge::of(&eye.moved(site_from_rover), off_by_rad))
}

impl Wedge {
    /// The wedge of a camera in the site frame.
    fn of(camera: &Camera, off_by_rad: f64) -> Self {
        let (centre, axis) = (camera.model.centre(), camera.model.axis());
        let level = axis.xy().normalize();
        let mut wedge =
            Self { from_m: [centre.x, centre.y], along: [level.x, level.y], widening: 0.0, behind_m: 0.0 };
        for place in border_on_ground(camera) {
            let [ahead_m, aside_m] = wedge.split(place);
            wedge.behind_m = wedge.behind_m.max(-ahead_m);
            if ahead_m > 0.0 {
                let [sine, cosine] = [off_by_rad.sin(), off_by_rad.cos()];
                let turned_ahead_m = (ahead_m * cosine - aside_m * sine).max(0.1 * ahead_m);
                let turned_aside_m = aside_m * cosine + ahead_m * sine;
                wedge.widening = wedge.widening.max((turned_aside_m - ASIDE_M) / turned_ahead_m);
            }
        }
        wedge.widening = wedge.widening.max(WIDENING);
        wedge
    }

    /// Distance of a point ahead and to either side, m.
    fn split(&self, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x_m - self.from_m[0], y_m - self.from_m[1]);
        let [ux, uy] = self.along;
        [dx * ux + dy * uy, (dy * ux - dx * uy).abs()]
    }

    fn holds(&self, x_m: f64, y_m: f64) -> bool {
        let [ahead_m, aside_m] = self.split([x_m, y_m]);
        let widening = if ahead_m > FISHEYE_M { self.widening.min(FISHEYE_WIDENING) } else { self.widening };
        ahead_m > -self.behind_m && aside_m <= ASIDE_M + widening * ahead_m.max(0.0)
    }
}

/// Intersections of the image border's rays with flat ground up to [`FARTHEST_M`], site frame, m.
fn border_on_ground(camera: &Camera) -> impl Iterator<Item = [f64; 2]> {
    let [right, bottom] = [camera.width(), camera.height()].map(|side| f64::from(side) - 0.5);
    let pixels = (0..=BORDER_RAYS).flat_map(move |k| {
        let part = f64::from(k) / f64::from(BORDER_RAYS);
        let (x, y) = (-0.5 + part * (right + 0.5), -0.5 + part * (bottom + 0.5));
        [Pixel::new(x, -0.5), Pixel::new(x, bottom), Pixel::new(-0.5, y), Pixel::new(right, y)]
    });
    pixels.filter_map(|pixel| {
        let ray = camera.ray(pixel)?;
        let level_m = ray.direction.xy().norm();
        let to_ground_m = (MEAN_GROUND_Z_M - ray.origin.z) / ray.direction.z;
        // A ray just above the horizon shows rocks on the farthest ground.
        let is_near_horizon = ray.direction.z > -0.1 * level_m && level_m > 0.0;
        let farthest_m = FARTHEST_M / level_m.max(1e-9);
        let distance_m = if ray.direction.z > 0.0 { to_ground_m.min(farthest_m) } else { farthest_m };
        let point = ray.at(distance_m);
        is_near_horizon.then_some([point.x, point.y])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::CameraRig;
    use crate::scenario::Move;

    #[test]
    fn a_pair_that_is_turned_aside_sees_what_lies_there() {
        let scenario = crate::library::scenario("navcam-wedges").unwrap();
        let mut ahead = scenario.camera.clone();
        ahead.further.clear();
        assert_eq!(Around::new(&scenario.drive, &ahead), None);
        let around = Around::new(&scenario.drive, &scenario.camera).unwrap();
        // 35° to either side of the mast, 15 m from it; 60° is outside.
        let at = |deg: f64| {
            let [x_m, y_m] = [15.0 * deg.to_radians().cos(), 15.0 * deg.to_radians().sin()];
            around.sees(x_m + around.wedges[0].from_m[0], y_m)
        };
        assert!(at(35.0) && at(-35.0) && !at(60.0) && !at(-60.0));
    }

    #[test]
    fn a_crab_sees_behind_the_targets_from_all_its_stops_and_keeps_its_wheels_free() {
        let crab = Move::Crab { angle_deg: 70.0, stops: 14 };
        let drive = DriveSettings {
            course: Course::Moves,
            start_distance_m: 7.0,
            moves: vec![crab],
            ..DriveSettings::default()
        };
        let around = Around::new(&drive, &CameraSettings::default()).unwrap();
        let [x_m, y_m] = goal_m(&drive);
        // 40 m behind the centre in the first and in the last line of sight; beside and behind the first stop.
        let last = 70f64.to_radians();
        assert!(
            around.sees(x_m + 40.0, y_m) && around.sees(x_m + 40.0 * last.cos(), y_m + 40.0 * last.sin())
        );
        assert!(!around.sees(x_m - 40.0, y_m) && !around.sees(x_m, y_m - 40.0));
        // A front wheel of the first stop is at (0.70, 0.53) in the rover frame.
        assert!(around.is_in_the_way(0.70, 0.53, 0.05, false) && !around.is_in_the_way(1.5, 0.1, 0.05, true));
        // Between the wheels of a straight drive only rocks that touch the belly matter.
        let moves = vec![Move::Forward { distance_m: 1.0, stops: 1 }];
        let straight = Around::new(&DriveSettings { moves, ..drive }, &CameraSettings::default()).unwrap();
        assert!(
            straight.is_in_the_way(0.5, 0.1, 0.05, true) && !straight.is_in_the_way(0.5, 0.1, 0.05, false)
        );
    }

    #[test]
    fn rocks_lie_wherever_either_eye_sees_ground_from_any_stop_of_any_rig() {
        let rigs = [
            CameraRig::MerNavcam,
            CameraRig::MerPancam,
            CameraRig::MerFrontHazcam,
            CameraRig::Table1Pancam,
            CameraRig::Table1Navcam,
        ];
        for (rig, name) in rigs.into_iter().flat_map(|rig| [(rig, "checkout-1"), (rig, "checkout-3")]) {
            let mut scenario = crate::library::scenario(name).unwrap();
            (scenario.camera.rig, scenario.drive.mast_offset_deg) = (rig, [2.0, 0.0]);
            let around = Around::new(&scenario.drive, &scenario.camera).unwrap();
            let (rig, [x_m, y_m]) = (Rig::new(&scenario.camera), goal_m(&scenario.drive));
            for stop in planned(&scenario.drive).unwrap().stops {
                let goal = Point3::new(x_m, y_m, MEAN_GROUND_Z_M);
                let in_rover = stop.site_from_rover.inverse_transform_point(&goal);
                let told = rig.point_at(&in_rover).unwrap();
                for turn_deg in [-2.0, 2.0f64] {
                    let angles = told.map(|told| sightline_geometry::camera::MastAngles {
                        azimuth_rad: told.azimuth_rad + turn_deg.to_radians(),
                        ..told
                    });
                    let (left, right) = rig.cameras_in_rover(angles);
                    for eye in [left, right].map(|eye| eye.moved(&stop.site_from_rover)) {
                        let (width, height) = (f64::from(eye.width()), f64::from(eye.height()));
                        for k in 0..40 * 40u32 {
                            let part = |k: u32| f64::from(k) / 39.0;
                            let pixel =
                                Pixel::new(part(k % 40) * (width - 1.0), part(k / 40) * (height - 1.0));
                            let Some(ray) = eye.ray(pixel).filter(|ray| ray.direction.z > 0.0) else {
                                continue;
                            };
                            let at = ray.at((MEAN_GROUND_Z_M - ray.origin.z) / ray.direction.z);
                            let off_m = (at - ray.origin).xy().norm();
                            assert!(off_m > 29.0 || around.sees(at.x, at.y), "{rig:?} {name} {pixel:?} {at}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_straight_approach_needs_none() {
        assert_eq!(Around::new(&DriveSettings::default(), &CameraSettings::default()), None);
    }
}
