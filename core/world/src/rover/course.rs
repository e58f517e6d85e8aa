//! The course: drives the rover move by move over the ground and records its true path.
//!
//! The rover's place is x, y of its frame's origin and its yaw; the suspension determines the rest. Each move ends in
//! stops; the path between two stops is a leg of short pieces (5 cm, 5°). In each piece the wheels advance by w (rover
//! frame, x and y), and the true motion is w reduced by slip (`slip.rs`).
//!
//! **Open-loop** (`forward`, `arc`, `turn`): the wheels advance as commanded and the motion falls short. With the body's
//! attitude A before a piece, its true rotation δ and chord t (rover frame, x and y): `(x, y) += [A Rz(δ/2) (t, 0)]_xy`,
//! `yaw += δ`; the chord of an arc is `sin(δ/2)/(δ/2)` of its length. A slope causes no loss when turning on the spot
//! (ours).
//!
//! **Until arrival** (`approach`, `crab`, `face_target`): the places are exact, and the wheels advance by more. The
//! distance D of a stop is that from the left camera's centre, with the mast pointed, to the targets' centre; the place on
//! the line with a given D is found by false position. A crab rotates the rover about the vertical through the targets'
//! centre, so that on flat ground all its cameras move on circles.
//!
//! A **forced slip** s (`rover.forced_slip`, `rover.stuck_from_stop`) overrides both: the wheels advance as commanded, the
//! rover moves by 1 − s of it. In an approach the command is the D of this stop less that of the previous one; the path to
//! the next stop starts from the rover's actual place.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | w | `wheels_m` | m, rover frame, x and y |
//! | D | `distance_m` | m |
//! | A | `site_from_rover.rotation` | – |
//!
//! Frames: site and rover. Sources: domain.md 5.4 (speeds), 5.5 (slip); papers.md R104, R118, R126.

use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Vector3;
use sightline_rover::driving::flight_time::{SPEED_M_S, TURN_RAD_S};

use crate::rover::approach::distances_m;
use crate::rover::scene::{Leg, Place, Scene, TrueDrive, TrueStop, pieces, wrapped};
use crate::rover::slip::{self, Slip};
use crate::rover::suspension::Stand;
use crate::scenario::{Course, Move};

/// Smallest and largest distance of a stop from the targets' centre, m (ours: nearer, the mast would point down at it).
const STOP_DISTANCES_M: [f64; 2] = [1.6, 60.0];

/// State of a drive in progress.
struct Driver<'a> {
    scene: &'a Scene<'a>,
    /// The setting to name in an error.
    key: String,
    place: Place,
    leg: Leg,
    drive: TrueDrive,
}

/// The first stop of a course.
pub(crate) fn first_stop(scene: &Scene<'_>) -> Result<TrueStop> {
    Driver::start(scene)?.look()
}

/// Drives the whole course; fails, naming the setting, where the rover cannot go or the mast cannot point.
pub(crate) fn drive(scene: &Scene<'_>) -> Result<TrueDrive> {
    let settings = scene.drive;
    let mut driver = Driver::start(scene)?;
    match settings.course {
        Course::Approach => {
            driver.key = "drive.end_distance_m".to_owned();
            let (start_m, end_m) = (settings.start_distance_m, settings.end_distance_m);
            driver.approach(&distances_m(start_m, end_m, settings.step_fraction))?;
        }
        Course::Moves => {
            for (index, one) in settings.moves.iter().enumerate() {
                driver.key = format!("drive.moves[{index}]");
                driver.make(one)?;
            }
        }
    }
    Ok(driver.drive)
}

impl<'a> Driver<'a> {
    /// The rover at the first stop.
    fn start(scene: &'a Scene<'a>) -> Result<Self> {
        let settings = scene.drive;
        let yaw_rad = settings.heading_deg.to_radians();
        let azimuth_rad = (settings.heading_deg + settings.start_bearing_deg).to_radians();
        let start_m = settings.start_distance_m;
        let key = "drive.start_distance_m";
        let no_place = || Error::setting(key, format!("no place is {start_m} m from the targets' centre"));
        let place = scene.place_at_distance(azimuth_rad, yaw_rad, start_m).ok_or_else(no_place)?;
        let stand = scene.settle(place).ok_or_else(no_place)?;
        let leg = Leg { stands: vec![stand], wheels_m: Vec::new(), driven_m: 0.0, duration_s: 0.0 };
        let drive = TrueDrive { stops: Vec::new(), legs: Vec::new() };
        let mut driver = Self { scene, key: key.to_owned(), place, leg, drive };
        driver.check_way(&stand)?;
        let stop = driver.look()?;
        driver.drive.stops.push(stop);
        Ok(driver)
    }

    /// Fails if a wheel is against a rock that it cannot climb.
    fn check_way(&self, stand: &Stand) -> Result<()> {
        self.scene.blocked(stand).map_or(Ok(()), |(at, height_m)| {
            let problem = format!(
                "a wheel meets a rock {height_m:.2} m high at x {:.2} m, y {:.2} m; it climbs {} m (rover.climb_m)",
                at.x, at.y, self.scene.rover.climb_m
            );
            Err(self.wrong(problem))
        })
    }

    fn wrong(&self, problem: impl Into<String>) -> Error {
        Error::setting(self.key.clone(), problem)
    }

    fn stand(&self) -> Stand {
        // A leg always has its start.
        self.leg.stands[self.leg.stands.len() - 1]
    }

    /// The slip forced on the current leg.
    fn forced_slip(&self) -> Option<f64> {
        self.scene.rover.forced_slip_to(self.drive.stops.len())
    }

    /// The stop at the rover's current place.
    fn look(&self) -> Result<TrueStop> {
        let stand = self.stand();
        let number = self.drive.stops.len();
        let (angles, distance_m) = self.scene.look(&stand.site_from_rover).ok_or_else(|| {
            self.wrong(format!("the mast cannot look at the targets' centre at stop {number}"))
        })?;
        let [least_m, most_m] = STOP_DISTANCES_M;
        if !(least_m..=most_m).contains(&distance_m) {
            let problem = format!(
                "stop {number} would be {distance_m:.2} m from the targets' centre, outside {least_m} to {most_m}"
            );
            return Err(self.wrong(problem));
        }
        Ok(TrueStop { site_from_rover: stand.site_from_rover, angles, suspension: stand.angles })
    }

    /// Ends the leg with a stop.
    fn stop(&mut self) -> Result<()> {
        let stop = self.look()?;
        let stand = self.stand();
        let next = Leg { stands: vec![stand], wheels_m: Vec::new(), driven_m: 0.0, duration_s: 0.0 };
        self.drive.stops.push(stop);
        self.drive.legs.push(std::mem::replace(&mut self.leg, next));
        Ok(())
    }

    /// Ends a piece at a place; the wheels have advanced along its chord and turned it by `turn_rad`.
    fn advance(&mut self, place: Place, wheels_m: [f64; 2], turn_rad: f64) -> Result<()> {
        self.scene.cancel.check()?;
        let stand = self.scene.settle(place).ok_or_else(|| {
            self.wrong(format!(
                "the rover has no stable footing at x {:.2} m, y {:.2} m",
                place.x_m, place.y_m
            ))
        })?;
        self.check_way(&stand)?;
        let length_m = wheels_m[0].hypot(wheels_m[1]);
        self.leg.stands.push(stand);
        self.leg.wheels_m.push(wheels_m);
        self.leg.driven_m += length_m;
        self.leg.duration_s += (length_m / SPEED_M_S).max(turn_rad.abs() / TURN_RAD_S);
        self.place = place;
        Ok(())
    }

    /// Open-loop: the wheels advance by `length_m` while the rover is commanded to turn by `turn_rad`.
    fn roll(&mut self, length_m: f64, turn_rad: f64) -> Result<()> {
        let pieces = pieces(length_m, turn_rad);
        let forced = self.forced_slip();
        let (length_m, turn_rad) = (length_m / f64::from(pieces), turn_rad / f64::from(pieces));
        let half = 0.5 * turn_rad;
        let chord_m = if half == 0.0 { length_m } else { length_m * half.sin() / half };
        for _ in 0..pieces {
            let attitude = self.stand().site_from_rover.rotation;
            let slip = forced.map_or_else(
                || slip::on_slope(self.scene.rover, &attitude, [chord_m.signum(), 0.0]),
                |along| Slip { along, aside: 0.0 },
            );
            let turned_rad = turn_rad * (1.0 - forced.unwrap_or(0.0));
            let place = self.place.rolled(&attitude, slip, chord_m, turned_rad);
            self.advance(place, [chord_m, 0.0], turn_rad)?;
        }
        Ok(())
    }

    /// Until arrival: follows a path whose places are reached exactly, unless slip is forced.
    fn follow(&mut self, way: &[Place]) -> Result<()> {
        let (start, mut before) = (self.place, self.place);
        let forced = self.forced_slip();
        for &next in way {
            let turn_rad = wrapped(next.yaw_rad - before.yaw_rad);
            if let Some(slip) = forced {
                self.advance(start.towards(next, 1.0 - slip), before.motion_to(next), turn_rad)?;
            } else {
                let wheels_m = self.wheels_to(next)?;
                self.advance(next, wheels_m, turn_rad)?;
            }
            before = next;
        }
        Ok(())
    }

    /// The wheel advance that moves the rover to a nearby place on its slope and soil.
    fn wheels_to(&self, next: Place) -> Result<[f64; 2]> {
        let level_m = self.place.motion_to(next);
        let level_length_m = level_m[0].hypot(level_m[1]);
        if level_length_m == 0.0 {
            return Ok([0.0; 2]);
        }
        let direction = level_m.map(|component| component / level_length_m);
        let attitude = self.stand().site_from_rover.rotation;
        // On a slope the path is longer than its horizontal projection.
        let rise = (attitude * Vector3::new(direction[0], direction[1], 0.0)).xy().norm();
        slip::on_slope(self.scene.rover, &attitude, direction)
            .wheels_from_true(direction, level_length_m / rise)
            .ok_or_else(|| {
                let number = self.drive.stops.len();
                let problem = format!("the wheels slip by 100 % on the way to stop {number}");
                Error::setting("rover.slip_scale", problem)
            })
    }

    /// Makes one move.
    fn make(&mut self, one: &Move) -> Result<()> {
        match *one {
            Move::Forward { distance_m, stops } => self.roll_to_stops(distance_m, 0.0, stops),
            Move::Arc { radius_m, angle_deg, stops } => {
                let turn_rad = angle_deg.to_radians() * radius_m.signum();
                self.roll_to_stops(radius_m.abs() * angle_deg.to_radians(), turn_rad, stops)
            }
            Move::Turn { angle_deg, stops } => self.roll_to_stops(0.0, angle_deg.to_radians(), stops),
            Move::Crab { angle_deg, stops } => {
                (0..stops).try_for_each(|_| self.crab(angle_deg.to_radians() / f64::from(stops)))
            }
            Move::FaceTarget => {
                self.follow(&self.facing())?;
                self.stop()
            }
            Move::Approach { to_distance_m, step_fraction } => {
                let now_m = self.scene.look(&self.stand().site_from_rover).map_or(0.0, |(_, now_m)| now_m);
                if now_m <= to_distance_m {
                    let key = format!("{}.to_distance_m", self.key);
                    let problem =
                        format!("{to_distance_m} is outside 1.8 to {now_m:.3}, where it starts from");
                    return Err(Error::setting(key, problem));
                }
                self.approach(&distances_m(now_m, to_distance_m, step_fraction))
            }
        }
    }

    fn roll_to_stops(&mut self, length_m: f64, turn_rad: f64, stops: u32) -> Result<()> {
        let part = 1.0 / f64::from(stops.max(1));
        for _ in 0..stops {
            self.roll(length_m * part, turn_rad * part)?;
            self.stop()?;
        }
        Ok(())
    }

    /// The turn in place that brings the targets' centre straight ahead; empty if it already is.
    fn facing(&self) -> Vec<Place> {
        let facing = Place { yaw_rad: self.scene.azimuth_rad(self.place), ..self.place };
        let is_turned = wrapped(facing.yaw_rad - self.place.yaw_rad).abs() > 1e-12;
        if is_turned { self.place.way_to(facing).collect() } else { Vec::new() }
    }

    /// Drives to a stop at each distance D but the first, which is that of the current place.
    fn approach(&mut self, distances_m: &[f64]) -> Result<()> {
        for pair in distances_m.windows(2) {
            let azimuth_rad = self.scene.azimuth_rad(self.place);
            let facing = Place { yaw_rad: azimuth_rad, ..self.place };
            let goal = if self.forced_slip().is_some() {
                let (sine, cosine) = azimuth_rad.sin_cos();
                let ahead_m = pair[0] - pair[1];
                Place { x_m: facing.x_m + ahead_m * cosine, y_m: facing.y_m + ahead_m * sine, ..facing }
            } else {
                self.scene.place_at_distance(azimuth_rad, azimuth_rad, pair[1]).ok_or_else(|| {
                    let wanted_m = pair[1];
                    self.wrong(format!("no place on the line is {wanted_m:.3} m from the targets' centre"))
                })?
            };
            let way: Vec<Place> = self.facing().into_iter().chain(facing.way_to(goal)).collect();
            self.follow(&way)?;
            self.stop()?;
        }
        Ok(())
    }

    /// Drives around the targets' centre to the next stop.
    fn crab(&mut self, angle_rad: f64) -> Result<()> {
        let centre = self.scene.centre;
        let (dx, dy) = (self.place.x_m - centre.x, self.place.y_m - centre.y);
        let pieces = pieces(dx.hypot(dy) * angle_rad, angle_rad);
        let around = (1..=pieces).map(|k| {
            let (sine, cosine) = (angle_rad * f64::from(k) / f64::from(pieces)).sin_cos();
            let place = Place {
                x_m: centre.x + cosine * dx - sine * dy,
                y_m: centre.y + sine * dx + cosine * dy,
                yaw_rad: 0.0,
            };
            Place { yaw_rad: self.scene.azimuth_rad(place), ..place }
        });
        let way: Vec<Place> = self.facing().into_iter().chain(around).collect();
        self.follow(&way)?;
        self.stop()
    }
}
