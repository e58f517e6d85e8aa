//! A moment of the drive: the sun's position, the light that clouds leave, the occluders, and the rover's body.
//!
//! The scenery is shared between moments; only the shadow grid is rebuilt when the sun has moved. Directions: azimuth
//! clockwise from above, 0 along the site's x axis; elevation up (domain.md 1.5).
//!
//! An occluder is upright on the line from the left camera to the targets' centre and faces the camera, so that `at`,
//! `width_m` and `aside_m` define the part of the view that it covers, wherever the rover is.
//!
//! Frames: site. Sources: papers.md R88, R126 (cloud), R181 (fiducials), R208 (failures on purpose), R214 (the
//! rover's own shadow); domain.md 11.1.

use std::sync::Arc;

use crate::camera::picture::Eye;
use crate::culling::SunGrid;
use crate::ground::imprint::{Imprint, Laid};
use crate::ground::level::MEAN_GROUND_Z_M;
use crate::index::true_camera_in_site;
use crate::light::reflection::{Light, to_sun};
use crate::rover::body::{BodyPart, parts};
use crate::rover::drive::true_drive;
use crate::rover::suspension::settle;
use crate::rover::tracks::Tracks;
use crate::scenario::{EventSettings, Fault, FaultKind, Fiducial, Occluder, Scenario, SunSettings};
use crate::solids::{Look, Shape, Solid, SolidKind};
use crate::traverse::{Stop, WheelPlaces};
use crate::world::World;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Pose, Vector3};

/// Albedo of occluders.
const OCCLUDER_ALBEDO: f32 = 0.25;
/// Albedo of the rover.
const ROVER_ALBEDO: f32 = 0.4;
/// Half the thickness of boards and occluders, m.
const HALF_THICKNESS_M: f64 = 0.005;
/// Width and height of the block of an injected occluder, and of the one that shades a target, m.
const FAULT_OCCLUDER_M: f64 = 0.6;
const FAULT_SHADE_M: f64 = 0.8;
/// Distance of the shading block from the target, m.
const FAULT_SHADE_AWAY_M: f64 = 2.0;
/// Lower limit of the sun's elevation, deg; the light model is defined above it.
const LOWEST_SUN_DEG: f64 = 5.0;

/// State of the drive at a stop, as input of the simulator.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Index of the stop.
    pub stop: u32,
    /// Time since the first stop, s.
    pub time_s: f64,
    /// True pose of the rover.
    pub site_from_rover: Pose,
    /// Centre of the left camera, site frame, m.
    pub left_camera: Point3,
    /// Wheel positions up to this stop, one list a stop; `None` if the scenario plans the drive.
    pub wheel_places_m: Option<Vec<Vec<WheelPlaces>>>,
}

impl Moment {
    /// Returns the moment of a stop of a simulated traverse; `None` if the stop does not exist or has no truth.
    pub fn of(number: usize, stops: &[Stop]) -> Option<Self> {
        let stop = stops.get(number)?;
        let places = |stop: &Stop| stop.truth.as_ref()?.wheel_places_m.clone();
        let wheel_places_m = stops[..=number].iter().map(places).collect();
        let site_from_rover = stop.truth.as_ref()?.site_from_rover.to_pose();
        let left_camera = true_camera_in_site(stop, Eye::Left)?.model.centre();
        Some(Self { stop: number as u32, time_s: stop.time_s, site_from_rover, left_camera, wheel_places_m })
    }
}

impl World {
    /// Returns this scenery at a moment of the drive. `scenario` must be the one from which the world was built.
    pub fn at(&self, moment: &Moment, scenario: &Scenario) -> Self {
        let events = &scenario.events;
        let to_sun = sun_at(&scenario.sun, events, moment.time_s);
        let direct = events.clouds.iter().filter(|cloud| covers(cloud.from_stop, cloud.to_stop, moment.stop));
        let direct: f64 = direct.map(|cloud| cloud.direct).product();
        let light = Light::under(&scenario.sun, scenario.texture.soil_albedo, to_sun, direct);
        let moved = (light.to_sun - self.light.to_sun).norm() > 0.0;
        let sun_grid = if moved {
            Arc::new(SunGrid::new(self.rocks(), &light.to_sun))
        } else {
            Arc::clone(&self.sun_grid)
        };
        let mut solids = self.solids.clone();
        if events.rover_body {
            solids.extend(self.rover_at(&moment.site_from_rover));
        }
        let present = events.occluders.iter().filter(|o| covers(o.from_stop, o.to_stop, moment.stop));
        solids.extend(present.map(|o| occluder(o, &moment.left_camera, &self.targets_centre())));
        let faults = events.faults.iter().filter(|fault| fault.covers(moment.stop));
        solids.extend(
            faults.filter_map(|fault| of_fault(fault, moment, &light.to_sun, &self.targets_centre())),
        );
        let imprint = self.imprint_at(moment, scenario);
        Self { scenery: Arc::clone(&self.scenery), light, sun_grid, solids, imprint, exposure: self.exposure }
    }

    /// The parts of the rover at its true pose, with its suspension settled.
    fn rover_at(&self, site_from_rover: &Pose) -> Vec<Solid> {
        let place = site_from_rover.translation.vector;
        let yaw_rad = site_from_rover.rotation.euler_angles().2;
        let ground_z_m = |x_m: f64, y_m: f64| self.footing_z_at(x_m, y_m);
        // A drive has no stop where the suspension does not settle.
        let angles =
            settle(&ground_z_m, place.x, place.y, yaw_rad).map_or_else(Default::default, |s| s.angles);
        let solid = |part: BodyPart| Solid {
            kind: SolidKind::Rover,
            middle: site_from_rover * part.centre,
            shape: Shape::Box(part.half_axes.map(|axis| site_from_rover * axis)),
            look: Look::Plain(ROVER_ALBEDO),
            is_seen: part.is_seen,
        };
        parts(&angles).into_iter().map(solid).collect()
    }

    /// The wheel tracks on the ground at a stop.
    fn imprint_at(&self, moment: &Moment, scenario: &Scenario) -> Option<Imprint> {
        if !scenario.rover.tracks || moment.stop == 0 {
            return None;
        }
        if let Some(places_m) = &moment.wheel_places_m {
            let laid = Laid::new(&Tracks::through(places_m, &scenario.rover));
            return Imprint::at_stop(&Arc::new(laid), moment.stop as usize);
        }
        let laid = self.scenery.laid.get_or_init(|| {
            // An impossible drive has no stops, so this is never reached for one.
            let drive = true_drive(self, scenario, Cancel::default()).ok()?;
            Some(Arc::new(Laid::new(&Tracks::new(&drive, &scenario.rover))))
        });
        Imprint::at_stop(laid.as_ref()?, moment.stop as usize)
    }
}

/// Unit direction to the sun, site frame, `time_s` seconds after the first stop.
pub fn sun_at(sun: &SunSettings, events: &EventSettings, time_s: f64) -> Vector3 {
    let hours = time_s / 3600.0;
    let azimuth_deg = sun.azimuth_deg + events.sun_azimuth_deg_per_h * hours;
    let elevation_deg = sun.elevation_deg + events.sun_elevation_deg_per_h * hours;
    to_sun(azimuth_deg, elevation_deg.clamp(LOWEST_SUN_DEG.min(sun.elevation_deg), 90.0))
}

fn covers(from_stop: u32, to_stop: u32, stop: u32) -> bool {
    (from_stop..=to_stop).contains(&stop)
}

/// The block of an occluder in front of the camera.
fn occluder(settings: &Occluder, left_camera: &Point3, targets_centre: &Point3) -> Solid {
    let sight = targets_centre - left_camera;
    let ahead = Vector3::new(sight.x, sight.y, 0.0).normalize();
    let right = Vector3::z().cross(&ahead);
    Solid {
        kind: SolidKind::Occluder,
        middle: left_camera + settings.at * sight + settings.aside_m * right,
        shape: Shape::Box([
            -HALF_THICKNESS_M * ahead,
            -0.5 * settings.width_m * right,
            -0.5 * settings.height_m * Vector3::z(),
        ]),
        look: Look::Plain(OCCLUDER_ALBEDO),
        is_seen: true,
    }
}

/// The block of an injected fault: in front of the target, or (casting only its shadow) between it and the sun.
fn of_fault(fault: &Fault, moment: &Moment, to_sun: &Vector3, targets_centre: &Point3) -> Option<Solid> {
    let target = fault.target_m.map_or(*targets_centre, Point3::from);
    match fault.kind {
        FaultKind::Occluder => {
            let (from_stop, to_stop, at, aside_m) = (fault.from_stop, fault.to_stop, 1.0 / 3.0, 0.0);
            let (width_m, height_m) = (FAULT_OCCLUDER_M, FAULT_OCCLUDER_M);
            let block = Occluder { from_stop, to_stop, at, width_m, height_m, aside_m };
            Some(occluder(&block, &moment.left_camera, &target))
        }
        FaultKind::Shadow => {
            let across = to_sun.cross(&Vector3::z()).normalize();
            let half_m = 0.5 * FAULT_SHADE_M;
            Some(Solid {
                kind: SolidKind::Occluder,
                middle: target + FAULT_SHADE_AWAY_M * to_sun,
                shape: Shape::Box([
                    HALF_THICKNESS_M * to_sun,
                    half_m * across,
                    half_m * to_sun.cross(&across),
                ]),
                look: Look::Plain(OCCLUDER_ALBEDO),
                is_seen: false,
            })
        }
        FaultKind::FeatureStarvation | FaultKind::PoseJump | FaultKind::CameraDropOut => None,
    }
}

/// The fiducials of a scenario.
pub(crate) fn fiducials(settings: &[Fiducial], targets_centre: &Point3) -> Vec<Solid> {
    let place = |x_m: f64, y_m: f64, height_m: f64| {
        Point3::new(targets_centre.x + x_m, targets_centre.y + y_m, MEAN_GROUND_Z_M - height_m)
    };
    let solid = |middle: Point3, shape: Shape, look: Look| Solid {
        kind: SolidKind::Fiducial,
        middle,
        shape,
        look,
        is_seen: true,
    };
    let made = settings.iter().map(|fiducial| match *fiducial {
        Fiducial::Checkerboard { x_m, y_m, height_m, yaw_deg, tilt_deg, square_m, columns, rows } => {
            let [width_m, height] = [columns, rows].map(|squares| 0.5 * square_m * f64::from(squares));
            let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), yaw_deg.to_radians())
                * nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), -tilt_deg.to_radians());
            let axes = [
                turn * -Vector3::x() * HALF_THICKNESS_M,
                turn * -Vector3::y() * width_m,
                turn * -Vector3::z() * height,
            ];
            let look = Look::Checkerboard { square_m, first: 0.05, second: 0.7 };
            solid(place(x_m, y_m, height_m), Shape::Box(axes), look)
        }
        Fiducial::Sphere { x_m, y_m, height_m, radius_m } => {
            solid(place(x_m, y_m, height_m), Shape::Sphere(radius_m), Look::Plain(0.7))
        }
    });
    made.collect()
}
