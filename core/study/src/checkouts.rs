//! Kim et al.'s four checkouts on Mars (K§7) as commanded drives, compared with the paper.
//!
//! | checkout | phases | compared with |
//! |---|---|---|
//! | 1 | the motions of the scenario, not towards the target | Table III; the turn centre that fits its rows 7 and 8 best |
//! | 2 | to within 2 m, pose by wheels and IMU | 15 updates, magnification, 19 minutes: too few for navigator updates |
//! | 3 | turn, back up, return with visual odometry, return with hazard avoidance | Table IV |
//! | 4 | to the target, hand-off to the hazcams, the contact point of the arm | 8 mm |
//!
//! ```text
//! turn about c:   C₇ = c + R(θ)(C₆ − c)      straight:   C₈ = C₇ + R(θ) (1 m, 0)
//! magnification   D_before / D_after         azimuth     change of the direction target − C
//! residual²       mean over both rows of ((Δmagnification)/0.04)² and ((Δazimuth)/1°)²
//! ```
//! | symbol | meaning | unit, frame |
//! |---|---|---|
//! | C₆, C₇, C₈ | left camera, horizontal, at positions 6 to 8 | m, rover at position 6 |
//! | c | centre of the turn; θ = 20° | m, rover at position 6 |
//!
//! Source: R130–R150.

use std::path::Path;

use serde::Serialize;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{ArrivalAction, DriveCommand, Motion, NavigatorKind};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::OdometryMode;
use sightline_session::driving::DriveSummary;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::locate::shape_tracker::placement::Placement;
use sightline_track::presets::preset;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::scenario::{CameraRig, FurtherRig, Move};
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, choose_targets, library};

use super::paper::TABLE_III;
use super::step_record::StepRecord;

/// World and image settings of the drives.
#[derive(Clone, Copy, Debug)]
pub struct Images {
    /// Seed of the world.
    pub seed: u64,
    /// Side of the images, px.
    pub size: u32,
    /// Samples along each side of a pixel.
    pub samples_per_axis: u32,
}

/// A step of a checkout.
#[derive(Clone, Debug, Serialize)]
pub struct CheckoutStep {
    /// Action of the rover in this phase.
    pub phase: &'static str,
    /// Record of the update.
    #[serde(flatten)]
    pub record: StepRecord,
    /// Row of Table III: magnification, roll (deg), change of azimuth (deg), score; null for other steps.
    pub paper: Option<[f64; 4]>,
}

/// A phase of a checkout, with its line of Table IV.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CheckoutPhase {
    /// Action of the rover.
    pub phase: &'static str,
    /// Number of updates of the target, of visual odometry and of the navigator.
    pub updates: [usize; 3],
    /// Time on Mars, min.
    pub minutes: f64,
    /// Printed updates and time (min); null if the paper has none.
    pub paper: Option<([usize; 3], f64)>,
}

/// Centre of a turn in place.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TurnCentre {
    /// Ahead and to the right of the rover's origin, m.
    pub centre_m: [f64; 2],
    /// Magnification and change of azimuth (deg) in rows 7 and 8 for a turn about this centre.
    pub rows: [[f64; 2]; 2],
    /// RMS over those four, in units of 4 % and 1°.
    pub residual: f64,
}

/// Result of a checkout.
#[derive(Clone, Debug, Serialize)]
pub struct Checkout {
    /// Number of the checkout, 1 to 4.
    pub number: u32,
    /// Steps, the designation first.
    pub steps: Vec<CheckoutStep>,
    /// Phases, in order.
    pub phases: Vec<CheckoutPhase>,
    /// Outcome of the drive.
    pub summary: DriveSummary,
    /// Change of the target's position in the site frame since the designation, m.
    pub total_correction_m: f64,
    /// Centre of checkout 1's turn that fits Table III best; null for the others.
    pub turn_centre: Option<TurnCentre>,
    /// Instrument-placement target; null without a hand-off.
    pub placement: Option<Placement>,
}

/// The turn of checkout 1, rad, and the straight motion after it, m (R131).
const TURN_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;
const STRAIGHT_M: f64 = 1.0;
/// Largest distance from the target at the end of checkout 2, m (R137).
const WITHIN_M: f64 = 2.0;
/// Lines of Table IV (R143): updates of target, odometry and navigator; minutes.
const TABLE_IV: [([usize; 3], f64); 4] =
    [([7, 0, 0], 10.0), ([10, 0, 0], 11.0), ([4, 6, 0], 15.0), ([4, 0, 4], 23.0)];

/// A drive in progress, phase by phase.
struct Under<'a> {
    drive: TargetedDrive,
    settings: &'a Settings,
    cancel: Cancel<'a>,
    steps: Vec<CheckoutStep>,
    phases: Vec<CheckoutPhase>,
}

/// Drives a checkout with the tracker of a preset; checkout 4, with its hand-off, uses `combined`.
///
/// # Errors
/// A number outside 1 to 4, an unknown preset, a world that cannot be driven in, or [`Error::Cancelled`].
pub fn drive(
    number: u32,
    images: Images,
    preset_name: &str,
    folder: &Path,
    cancel: Cancel<'_>,
) -> Result<Checkout> {
    let scenario = scenario(number, images)?;
    let name = if number == 4 { "combined" } else { preset_name };
    let settings = preset(name)?.settings()?;
    let world = DrivenTraverse::begin(&scenario, folder, cancel)?;
    let traverse = world.traverse();
    let targets = traverse.world().map(|world| choose_targets(world, &scenario, traverse.index()));
    let pixel = targets.and_then(|targets| targets.first().copied());
    let pixel = pixel.ok_or_else(|| Error::Target("the world offers no target".to_owned()))?;
    let motions = motions(&scenario.drive.moves);
    let blind = DriveCommand { odometry: OdometryMode::Off, ..DriveCommand::default() };
    let first = match number {
        1 => DriveCommand { motions: motions.clone(), ..blind.clone() },
        3 => DriveCommand { motions: motions[..7].to_vec(), ..blind.clone() },
        _ => DriveCommand {
            standoff_m: standoff_m(traverse, scenario.drive.end_distance_m),
            // The paper's drive ended within 2 m of the target.
            tolerance_m: if number == 2 {
                WITHIN_M - scenario.drive.end_distance_m
            } else {
                blind.tolerance_m
            },
            on_arrival: if number == 4 {
                vec![ArrivalAction::Look, ArrivalAction::HandOff]
            } else {
                Vec::new()
            },
            ..blind.clone()
        },
    };
    let drive = TargetedDrive::begin(world, Designation::new(0, pixel), first, &settings, cancel)?;
    let mut under = Under { drive, settings: &settings, cancel, steps: Vec::new(), phases: Vec::new() };
    if number == 3 {
        under.third(&motions[7..], &blind)?;
    } else {
        let phase = ["around the rock", "to the target", "", "to the target"][number as usize - 1];
        under.phase(phase, (number == 2).then_some(([15, 0, 0], 19.0)))?;
    }
    under.finish(number)
}

/// Scenario of a checkout, with hazcams at every stop.
fn scenario(number: u32, images: Images) -> Result<Scenario> {
    if !(1..=4).contains(&number) {
        return Err(Error::setting("checkout", format!("{number} is outside 1 to 4")));
    }
    let mut scenario = Scenario { seed: images.seed, ..library::scenario(&format!("checkout-{number}"))? };
    scenario.camera.image_size = images.size;
    scenario.camera.samples_per_axis = images.samples_per_axis;
    scenario.camera.further.push(FurtherRig {
        name: "front_hazcam".parse().map_err(Error::Request)?,
        rig: CameraRig::MerFrontHazcam,
        look_deg: None,
        image_size: if number == 4 { images.size.min(1024) } else { 256 },
    });
    // Only the first stop of the planned drive is used.
    scenario.validate()?;
    Ok(scenario)
}

/// Horizontal standoff of the rover's origin at which the mast's camera is `camera_m` from the target, m.
fn standoff_m(traverse: &sightline_recordings::Traverse, camera_m: f64) -> f64 {
    let camera = Stops::cameras(traverse, 0).0.model.centre();
    // The target is near the ground, the camera this high above it.
    let height_m = -camera.z;
    (camera_m * camera_m - height_m * height_m).max(0.0).sqrt() + camera.x
}

/// Converts the moves of a scenario to motions; moves that need the truth are skipped.
fn motions(moves: &[Move]) -> Vec<Motion> {
    let mut motions = Vec::new();
    for one in moves {
        let (motion, stops) = match *one {
            Move::Forward { distance_m, stops } => {
                (Motion::Arc { length_m: distance_m / f64::from(stops), curvature_per_m: 0.0 }, stops)
            }
            Move::Arc { radius_m, angle_deg, stops } => {
                let length_m = angle_deg.to_radians() * radius_m.abs() / f64::from(stops);
                (Motion::Arc { length_m, curvature_per_m: 1.0 / radius_m }, stops)
            }
            Move::Turn { angle_deg, stops } => {
                (Motion::Turn { angle_rad: angle_deg.to_radians() / f64::from(stops) }, stops)
            }
            Move::FaceTarget | Move::Crab { .. } | Move::Approach { .. } => continue,
        };
        motions.extend(std::iter::repeat_n(motion, stops as usize));
    }
    motions
}

impl Under<'_> {
    /// Drives the phases of checkout 3; `motions` are those after the turn.
    fn third(&mut self, motions: &[Motion], blind: &DriveCommand) -> Result<()> {
        self.phase("turn", Some(TABLE_IV[0]))?;
        // The motions after backing up are replaced by a drive to the target.
        let back = motions.iter().take_while(|motion| motion.length_and_turn().0 < 0.0).copied().collect();
        self.drive.go_on(DriveCommand { motions: back, ..blind.clone() })?;
        self.phase("back up", Some(TABLE_IV[1]))?;
        for (phase, length_m, odometry, navigator, paper) in [
            ("visual odometry", 2.1, OdometryMode::Full, NavigatorKind::Arcs, TABLE_IV[2]),
            ("hazard avoidance", 1.4, OdometryMode::Off, NavigatorKind::Gestalt, TABLE_IV[3]),
        ] {
            let distance_m = self.distance_m();
            // Four steps, each the same fraction of the distance.
            let step_fraction = 1.0 - ((distance_m - length_m) / distance_m).powf(0.25) + 0.002;
            self.drive.go_on(DriveCommand {
                standoff_m: distance_m - length_m,
                step_fraction,
                odometry,
                navigator,
                ..blind.clone()
            })?;
            self.phase(phase, Some(paper))?;
        }
        Ok(())
    }

    /// Horizontal distance of the target at the last step, m.
    fn distance_m(&self) -> f64 {
        let target = self.drive.steps.last().map(|last| last.update.target.position_in_rover);
        target.map_or(f64::NAN, |target| target.x.hypot(target.y))
    }

    /// Drives to the end of the current command.
    fn phase(&mut self, phase: &'static str, paper: Option<([usize; 3], f64)>) -> Result<()> {
        let steps = self.drive.steps.len();
        let minutes: f64 = self.phases.iter().map(|phase| phase.minutes).sum();
        while self.drive.advance(self.settings, self.cancel)? {}
        let after = &self.drive.cycles[self.drive.cycles.len().min(steps.saturating_sub(1))..];
        let stops = &self.drive.steps[if self.phases.is_empty() { 0 } else { steps }..];
        let traverse = self.drive.world.traverse();
        let measured = stops.iter().filter_map(|step| Stops::measured_motion(traverse, step.step));
        let updates = [
            stops.iter().skip(usize::from(self.phases.is_empty())).count(),
            measured.map(|measured| measured.updates() as usize).sum(),
            after.iter().filter(|cycle| cycle.choice.is_some()).count(),
        ];
        self.phases.push(CheckoutPhase { phase, updates, minutes: self.minutes() - minutes, paper });
        for step in stops {
            let before = step.step.checked_sub(1).and_then(|before| self.drive.steps.get(before));
            let record = StepRecord::of(traverse, before.map(AsRef::as_ref), step);
            self.steps.push(CheckoutStep { phase, record, paper: None });
        }
        Ok(())
    }

    /// Time on Mars so far, min.
    fn minutes(&self) -> f64 {
        self.drive.cycles.last().map_or(0.0, |cycle| cycle.flight_minutes)
    }

    fn finish(mut self, number: u32) -> Result<Checkout> {
        if number == 1 {
            for (row, step) in self.steps.iter_mut().skip(1).enumerate().take(7) {
                step.paper = Some(TABLE_III.map(|(_, column)| column[row]));
            }
        }
        let last = self.drive.steps.last();
        let placement = last.and_then(|last| last.shape()?.placement);
        let total_correction_m = self.steps.last().map_or(0.0, |last| last.record.total_correction_m);
        let turn_centre = if number == 1 { turn_centre(&self.drive) } else { None };
        Ok(Checkout {
            number,
            steps: self.steps,
            phases: self.phases,
            summary: self.drive.summary(),
            total_correction_m,
            turn_centre,
            placement,
        })
    }
}

/// Centre of the turn that fits rows 7 and 8 of Table III best, with the true position of the target at position 6.
fn turn_centre(drive: &TargetedDrive) -> Option<TurnCentre> {
    let traverse = drive.world.traverse();
    let step = drive.steps.get(5)?;
    let target = step.truth.as_ref()?.position_in_rover;
    TruthSource::true_site_from_rover(traverse, 5)?;
    let camera = Stops::cameras(traverse, 5).0.model.centre();
    Some(best_turn_centre([target.x, target.y], [camera.x, camera.y]))
}

/// The same for a target and a camera, horizontal, rover frame, m.
fn best_turn_centre(target_m: [f64; 2], camera_m: [f64; 2]) -> TurnCentre {
    // All centres on a grid of 1 cm within 1.5 m of the rover's origin in x and y.
    let places = (-150..=150).flat_map(|x| (-150..=150).map(move |y| [x, y].map(|at| 0.01 * f64::from(at))));
    let all = places.map(|centre_m| {
        let rows = rows_of_turn(centre_m, target_m, camera_m);
        let off = |row: usize| {
            let [magnification, _, azimuth_deg, _] = TABLE_III.map(|(_, column)| column[5 + row]);
            ((rows[row][0] - magnification) / 0.04).powi(2) + (rows[row][1].abs() - azimuth_deg).powi(2)
        };
        TurnCentre { centre_m, rows, residual: (0.25 * (off(0) + off(1))).sqrt() }
    });
    let first = TurnCentre { centre_m: [0.0; 2], rows: [[f64::NAN; 2]; 2], residual: f64::INFINITY };
    all.fold(first, |best, one| if one.residual < best.residual { one } else { best })
}

/// Magnification and change of azimuth (deg) of a turn about a centre, and of the following straight motion.
fn rows_of_turn(centre_m: [f64; 2], target_m: [f64; 2], camera_m: [f64; 2]) -> [[f64; 2]; 2] {
    let (sine, cosine) = TURN_RAD.sin_cos();
    let [x, y] = [camera_m[0] - centre_m[0], camera_m[1] - centre_m[1]];
    let turned = [centre_m[0] + cosine * x - sine * y, centre_m[1] + sine * x + cosine * y];
    let ahead = [turned[0] + STRAIGHT_M * cosine, turned[1] + STRAIGHT_M * sine];
    let sight = |from: [f64; 2]| [target_m[0] - from[0], target_m[1] - from[1]];
    let change = |then: [f64; 2], now: [f64; 2]| {
        let azimuth_deg = (then[0] * now[1] - then[1] * now[0]).atan2(then[0] * now[0] + then[1] * now[1]);
        [then[0].hypot(then[1]) / now[0].hypot(now[1]), azimuth_deg.to_degrees()]
    };
    let [before, then, now] = [camera_m, turned, ahead].map(sight);
    [change(before, then), change(then, now)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_about_the_camera_changes_nothing_and_the_straight_motion_does_as_geometry_says() {
        let (target, camera) = ([0.4, 3.7], [0.4, -0.1]);
        let [turn, straight] = rows_of_turn(camera, target, camera);
        assert!((turn[0] - 1.0).abs() < 1e-12 && turn[1].abs() < 1e-12, "{turn:?}");
        let (sine, cosine) = TURN_RAD.sin_cos();
        let (across, along) = (3.8 - sine, -cosine);
        assert!((straight[0] - 3.8 / across.hypot(along)).abs() < 1e-12);
        assert!((straight[1].abs() - (-along).atan2(across).to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn moves_become_motions_and_every_stop_is_one() {
        let moves = [
            Move::Forward { distance_m: -3.0, stops: 3 },
            Move::Arc { radius_m: -0.5, angle_deg: 10.0, stops: 1 },
            Move::FaceTarget,
            Move::Turn { angle_deg: 20.0, stops: 2 },
        ];
        let found: Vec<String> = motions(&moves).iter().map(ToString::to_string).collect();
        assert_eq!(found, ["-1", "-1", "-1", "0.087 turn -10", "turn 10", "turn 10"]);
    }
}
