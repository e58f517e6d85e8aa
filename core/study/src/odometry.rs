//! Visual odometry in simulated drives: how often it converges, how often it is silently wrong, and how it drifts.
//!
//! A drive has no target. At every stop the mast looks at the ground ahead, one pair is taken, and the motion since the stop
//! before is measured and compared with the true one:
//!
//! ```text
//! error of an update   δ:  T_true = exp(δ) T        NEES per dof = δᵀ Σ⁻¹ δ / 6
//! silently wrong       accepted, while √(τᵀ Σ_τ⁻¹ τ) > 5 and |τ| > max(1 cm, 4 % of the step),
//!                      or the turn's error > 0.2° and > 5 σ
//! drift                distance of the last estimated position from the true one, % of the true way
//! ```
//! Steps that are refused are taken from wheels and gyro. Frames: rover frame after, site. Source: design.md, domain.md 9.

use std::path::Path;

use nalgebra::{Matrix3, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Pose};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{ActiveWorld, Motion};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::look::look;
use sightline_rover::visual_odometry::{
    OdometryInput, OdometrySettings, OdometryUpdate, OdometryView, update,
};
use sightline_track::stages::capture::StereoPair;
use sightline_world::scenario::{ForcedSlip, OdometryModel};
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, World, library};

/// Share of the view before that must be in view again for an update to count, 0 to 1.
const OVERLAP_MIN: f64 = 0.6;
/// Points along each side of the image by which the overlap is measured.
const OVERLAP_SIDE: u32 = 8;

/// Metres that are driven before the first update where the mast looks back at tracks.
const TRACKS_BEFORE: usize = 4;

/// The ground of the drives of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scene {
    /// Soil with rocks and texture; every step has a slip of 0 to 125 % that is drawn.
    Textured,
    /// The same with the slip of soil and slope: the drives whose drift counts.
    Slope,
    /// Smooth ground on which the rover looks back at its own tracks.
    OwnTracks,
    /// The same, straight on and without any texture of the ground: tracks that repeat themselves.
    PicketFence,
    /// Ground without texture.
    Featureless,
}

impl Scene {
    /// All scenes.
    pub const ALL: [Self; 5] =
        [Self::Textured, Self::Slope, Self::OwnTracks, Self::PicketFence, Self::Featureless];

    /// The name in rows and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Textured => "textured",
            Self::Slope => "slope",
            Self::OwnTracks => "own-tracks",
            Self::PicketFence => "picket-fence",
            Self::Featureless => "featureless",
        }
    }

    /// Whether the mast looks back.
    fn looks_back(self) -> bool {
        matches!(self, Self::OwnTracks | Self::PicketFence)
    }
}

/// One drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryRow {
    /// Name of the settings.
    pub configuration: String,
    /// The world's seed.
    pub seed: u64,
    /// The ground.
    pub scene: Scene,
    /// Slope of the ground, deg.
    pub slope_deg: f64,
    /// Mean slip along the motion.
    pub slip: f64,
    /// Updates whose views overlap by 60 % or more.
    pub updates: usize,
    /// Those that were accepted.
    pub converged: usize,
    /// Those that were refused.
    pub refused: usize,
    /// Accepted ones that are wrong beyond their covariance, with little overlap too.
    pub silently_wrong: usize,
    /// True way of the rover, m.
    pub distance_m: f64,
    /// Distance of the estimated end from the true one, % of the true way.
    pub drift_percent: f64,
    /// 95th percentile of the error of the slip, percentage points; null without an accepted update.
    pub slip_error_points: Option<f64>,
    /// Mean NEES per degree of freedom of the accepted updates; null without one.
    pub nees_per_dof: Option<f64>,
    /// Why the drive ended before its last step; null where it did not.
    pub problem: Option<String>,
    /// The updates, one by one.
    #[serde(skip)]
    pub steps: Vec<OdometryStep>,
}

/// One update compared with the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryStep {
    /// The stop after.
    pub stop: usize,
    /// Length of the commanded path, m.
    pub commanded_m: f64,
    /// Commanded turn, deg.
    pub turn_deg: f64,
    /// True slip along the motion of the wheels.
    pub slip: f64,
    /// Share of the view before that is in view again.
    pub overlap: f64,
    /// Whether the update was accepted.
    pub accepted: bool,
    /// Why not, as one sentence.
    pub refusal: Option<String>,
    /// Whether it is wrong beyond its covariance although it was accepted.
    pub silently_wrong: bool,
    /// Error of the translation, m, and of the turn, deg; null without a motion.
    pub error_m: Option<f64>,
    /// Error of the turn, deg.
    pub error_deg: Option<f64>,
    /// Mahalanobis distance of the translation.
    pub distance: Option<f64>,
    /// NEES per degree of freedom.
    pub nees_per_dof: Option<f64>,
    /// Error of the slip, percentage points.
    pub slip_error_points: Option<f64>,
    /// Matches that agree with the motion.
    pub inliers: usize,
    /// χ² per degree of freedom of the residuals.
    pub chi2_per_dof: Option<f64>,
    /// Mean change of the view.
    pub change: Option<f64>,
    /// Inliers of another motion as a part of those of the motion.
    pub ambiguity: f64,
}

/// The drives of a study.
#[derive(Clone, Copy, Debug)]
pub struct OdometryDrives<'a> {
    /// Name of the settings.
    pub configuration: &'a str,
    /// The settings.
    pub settings: &'a OdometrySettings,
    /// The ground.
    pub scene: Scene,
    /// Steps of a drive.
    pub steps: usize,
    /// Side of the images, px.
    pub size: u32,
    /// Samples along each side of a pixel.
    pub samples_per_axis: u32,
}

/// A step as it is commanded.
#[derive(Clone, Copy, Debug)]
struct Commanded {
    length_m: f64,
    turn_rad: f64,
}

impl OdometryDrives<'_> {
    /// The scenario of a world; the seed draws slope, sun and slips as well.
    ///
    /// # Errors
    /// The library's scenario, or one that no world can be made of.
    pub fn scenario(&self, seed: u64) -> Result<Scenario> {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x0d0e_7291);
        let mut scenario = Scenario { seed, ..library::scenario("approach-10")? };
        scenario.terrain.slope_deg = random.random_range(0.0..31.0);
        scenario.terrain.slope_azimuth_deg = random.random_range(-180.0..180.0);
        scenario.sun.azimuth_deg = random.random_range(0.0..360.0);
        // Higher than the slope is steep, so that the ground is lit.
        scenario.sun.elevation_deg = random.random_range(35.0..70.0);
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (self.size, self.samples_per_axis);
        scenario.rover.odometry = OdometryModel::WheelsAndImu;
        match self.scene {
            Scene::Slope => (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2),
            _ => {
                let slips = (1..=(self.steps + TRACKS_BEFORE) as u32)
                    .map(|stop| ForcedSlip { stop, slip: random.random_range(0.0..1.25) });
                scenario.rover.forced_slip = slips.collect();
            }
        }
        if self.scene.looks_back() {
            scenario.rover.tracks = true;
            scenario.rover.forced_slip.iter_mut().for_each(|forced| forced.slip *= 0.4);
        }
        if self.scene != Scene::Textured && self.scene != Scene::Slope {
            smooth(&mut scenario, self.scene);
        }
        scenario.validate()?;
        Ok(scenario)
    }

    /// The steps of a drive.
    fn commanded(&self, seed: u64) -> Vec<Commanded> {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x57e9_57e9);
        let mut heading_rad = 0.0f64;
        let step = |_| {
            let length_m = random.random_range(0.25..0.75);
            let turn_deg: f64 = random.random_range(-18.0..18.0);
            // The drive keeps near its first direction.
            let turn_rad = match self.scene {
                Scene::PicketFence => 0.0,
                _ if heading_rad.abs() > 0.7 => -heading_rad.signum() * turn_deg.abs().to_radians(),
                _ => turn_deg.to_radians(),
            };
            heading_rad += turn_rad;
            Commanded { length_m, turn_rad }
        };
        (0..self.steps).map(step).collect()
    }

    /// One drive in a folder that is removed afterwards; it ends early where the rover cannot go on.
    ///
    /// # Errors
    /// A world that cannot be made, or [`Error::Cancelled`].
    pub fn drive(&self, seed: u64, folder: &Path, cancel: Cancel<'_>) -> Result<OdometryRow> {
        let scenario = self.scenario(seed)?;
        let outcome = self.driven(&scenario, seed, folder, cancel);
        // A failure to remove leaves a folder in the way of nobody.
        let _ = std::fs::remove_dir_all(folder);
        outcome
    }

    fn driven(
        &self,
        scenario: &Scenario,
        seed: u64,
        folder: &Path,
        cancel: Cancel<'_>,
    ) -> Result<OdometryRow> {
        let mut drive = OdometryDrive::begin(scenario, self, folder, cancel)?;
        if self.scene.looks_back() {
            drive.lay_tracks(cancel)?;
        }
        let (mut problem, mut stalls) = (None, 0);
        for commanded in self.commanded(seed) {
            // After a stall the rover turns away from the rock.
            let turned = |side: f64| Commanded { length_m: 0.0, turn_rad: side * 18f64.to_radians() };
            let commanded = match stalls {
                0 => commanded,
                _ => turned(if seed % 2 == 0 { 1.0 } else { -1.0 }),
            };
            match drive.step(commanded, cancel) {
                Ok(true) => stalls = 2,
                Ok(false) => stalls = i32::max(stalls - 1, 0),
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Err(error) => {
                    problem = Some(error.to_string());
                    break;
                }
            }
        }
        Ok(drive.row(scenario, seed, problem))
    }
}

/// Takes the texture from the ground.
fn smooth(scenario: &mut Scenario, scene: Scene) {
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.0, 0);
    scenario.terrain.rms_at_1m_m = 0.005;
    scenario.texture.grain_cover = 0.0;
    scenario.texture.drift_cover = 0.0;
    let part = if scene == Scene::OwnTracks { 0.2 } else { 0.02 };
    scenario.texture.albedo_std *= part;
    scenario.texture.soil_slope_std *= part;
}

/// A drive under way.
struct OdometryDrive<'a> {
    study: &'a OdometryDrives<'a>,
    world: DrivenTraverse,
    pair: StereoPair,
    /// Azimuth at which the last pair looks, as it was asked for, rad.
    azimuth_rad: f64,
    estimated: Pose,
    way_m: f64,
    steps: Vec<OdometryStep>,
}

impl<'a> OdometryDrive<'a> {
    fn begin(
        scenario: &Scenario,
        study: &'a OdometryDrives<'a>,
        folder: &Path,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let world = DrivenTraverse::begin(scenario, folder, cancel)?;
        let estimated = world.traverse().site_from_rover(0);
        let mut drive = Self {
            study,
            world,
            pair: StereoPair::default(),
            azimuth_rad: 0.0,
            estimated,
            way_m: 0.0,
            steps: Vec::new(),
        };
        drive.look(None, &Pose::identity())?;
        drive.pair = Stops::capture(drive.world.traverse(), 0, cancel)?;
        Ok(drive)
    }

    /// Drives some metres straight on, so that the view back shows tracks, and takes the first pair there.
    fn lay_tracks(&mut self, cancel: Cancel<'_>) -> Result<()> {
        for _ in 0..TRACKS_BEFORE {
            self.world.drive(&Motion::Arc { length_m: 1.0, curvature_per_m: 0.0 }, cancel)?;
        }
        let stop = self.world.traverse().stop_count() - 1;
        self.look(None, &Pose::identity())?;
        self.pair = Stops::capture(self.world.traverse(), stop, cancel)?;
        self.estimated = self.true_pose(stop)?;
        Ok(())
    }

    /// Points the mast for the last stop.
    fn look(&mut self, before: Option<f64>, predicted: &Pose) -> Result<()> {
        let mast = self.world.traverse().mast().cloned();
        let mut angles = mast.and_then(|mast| look(&mast, before, predicted));
        self.azimuth_rad = angles.map_or(0.0, |angles| angles.azimuth_rad);
        if self.study.scene.looks_back()
            && let Some(angles) = &mut angles
        {
            angles.azimuth_rad += std::f64::consts::PI;
        }
        self.world.point_mast(angles)
    }

    /// Drives, looks and measures; whether a rock stopped the wheels.
    fn step(&mut self, commanded: Commanded, cancel: Cancel<'_>) -> Result<bool> {
        let Commanded { length_m, turn_rad } = commanded;
        let motion = if length_m > 0.0 {
            Motion::Arc { length_m, curvature_per_m: turn_rad / length_m }
        } else {
            Motion::Turn { angle_rad: turn_rad }
        };
        let report = self.world.drive(&motion, cancel)?;
        let stop = self.world.traverse().stop_count() - 1;
        let estimate = |stop: usize| self.world.traverse().site_from_rover(stop);
        let predicted = estimate(stop).inverse() * estimate(stop - 1);
        self.look(Some(self.azimuth_rad), &predicted)?;
        let pair = Stops::capture(self.world.traverse(), stop, cancel)?;
        let found = self.measure([&self.pair, &pair], stop, &predicted, cancel)?;
        let step = self.compared(stop, commanded, &found, &predicted)?;
        let after_from_before = found.accepted_motion().unwrap_or(predicted);
        self.estimated *= after_from_before.inverse();
        self.steps.push(step);
        self.pair = pair;
        Ok(report.stall.is_some())
    }

    fn measure(
        &self,
        [before, after]: [&StereoPair; 2],
        stop: usize,
        predicted: &Pose,
        cancel: Cancel<'_>,
    ) -> Result<OdometryUpdate> {
        let stops = self.world.traverse();
        let view = |pair, stop: usize| {
            let (left, right) = stops.cameras(stop);
            OdometryView { pair, left, right, mast_angles: stops.mast_angles(stop) }
        };
        let error_rad = stops.pointing_error_deg().to_radians();
        update(&OdometryInput {
            before: view(before, stop - 1),
            after: view(after, stop),
            predicted_after_from_before: predicted,
            mast: stops.mast().map(|mast| (mast, error_rad)),
            settings: self.study.settings,
            cancel,
        })
    }

    fn true_pose(&self, stop: usize) -> Result<Pose> {
        let pose = TruthSource::true_site_from_rover(self.world.traverse(), stop);
        pose.ok_or_else(|| Error::Request(format!("stop {stop} has no true pose")))
    }

    /// The update beside the true motion.
    fn compared(
        &mut self,
        stop: usize,
        commanded: Commanded,
        found: &OdometryUpdate,
        predicted: &Pose,
    ) -> Result<OdometryStep> {
        let [before, after] = [self.true_pose(stop - 1)?, self.true_pose(stop)?];
        let truth = after.inverse() * before;
        let moved_m = truth.inverse().translation.vector.norm();
        self.way_m += moved_m;
        let wheels = predicted.inverse().translation.vector;
        let slip_by = |motion: &Pose| {
            1.0 - motion.inverse().translation.vector.dot(&wheels) / wheels.norm_squared().max(1e-6)
        };
        let slip = slip_by(&truth);
        let error = found.after_from_before.map(|motion| {
            let wrong = truth * motion.to_pose().inverse();
            (wrong.translation.vector, wrong.rotation.scaled_axis())
        });
        let judged = error.zip(found.covariance).map(|((shift, turn), covariance)| {
            let all = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let nees = covariance.cholesky().map(|factor| all.dot(&factor.solve(&all)) / 6.0);
            let block = |at: usize| covariance.fixed_view::<3, 3>(at, at).into_owned();
            (nees, distance(&block(0), &shift), distance(&block(3), &turn))
        });
        let shift_m = error.map(|(shift, _)| shift.norm());
        let turn_deg = error.map(|(_, turn)| turn.norm().to_degrees());
        let is_far = |distance: Option<f64>| distance.is_none_or(|distance| distance > 5.0);
        let by_shift = shift_m.is_some_and(|error| error > f64::max(0.01, 0.04 * commanded.length_m))
            && is_far(judged.and_then(|judged| judged.1));
        let by_turn = turn_deg.is_some_and(|error| error > 0.2) && is_far(judged.and_then(|judged| judged.2));
        Ok(OdometryStep {
            stop,
            commanded_m: commanded.length_m,
            turn_deg: commanded.turn_rad.to_degrees(),
            slip,
            overlap: self.overlap(stop, &before, &after),
            accepted: found.accepted,
            refusal: found.refusal(),
            silently_wrong: found.accepted && (by_shift || by_turn),
            error_m: shift_m,
            error_deg: turn_deg,
            distance: judged.and_then(|judged| judged.1),
            nees_per_dof: judged.and_then(|judged| judged.0),
            slip_error_points: found.slip.map(|measured| 100.0 * (measured.along - slip).abs()),
            inliers: found.inliers,
            chi2_per_dof: found.chi2_per_dof,
            change: found.change,
            ambiguity: found.ambiguity,
        })
    }

    /// Share of the ground in the left image before that is in the left image after, by the true poses.
    fn overlap(&self, stop: usize, before: &Pose, after: &Pose) -> f64 {
        let stops = self.world.traverse();
        let Some(world) = stops.world() else { return 0.0 };
        let there = stops.cameras(stop - 1).0.moved(before);
        let here = stops.cameras(stop).0.moved(after);
        let (mut seen, mut all) = (0, 0);
        for (row, column) in (0..OVERLAP_SIDE).flat_map(|row| (0..OVERLAP_SIDE).map(move |c| (row, c))) {
            let at =
                |k: u32, side: u32| (f64::from(k) + 0.5) / f64::from(OVERLAP_SIDE) * f64::from(side) - 0.5;
            let pixel = Pixel::new(at(column, there.width()), at(row, there.height()));
            let Some(hit) = there.ray(pixel).and_then(|ray| world.cast(&ray)) else { continue };
            all += 1;
            let point = hit.point;
            seen += usize::from(here.sees(&point) && is_visible(world, &here, &point));
        }
        if all == 0 { 0.0 } else { seen as f64 / all as f64 }
    }

    fn row(self, scenario: &Scenario, seed: u64, problem: Option<String>) -> OdometryRow {
        let counted = || self.steps.iter().filter(|step| step.overlap >= OVERLAP_MIN);
        let accepted = || self.steps.iter().filter(|step| step.accepted);
        let mean =
            |values: Vec<f64>| (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64);
        let end = self.world.traverse().stop_count() - 1;
        let true_end = self.true_pose(end).unwrap_or_default().translation.vector;
        let off_m = (self.estimated.translation.vector - true_end).norm();
        let slips: Vec<f64> = accepted().filter_map(|step| step.slip_error_points).collect();
        let converged = counted().filter(|step| step.accepted).count();
        OdometryRow {
            configuration: self.study.configuration.to_owned(),
            seed,
            scene: self.study.scene,
            slope_deg: scenario.terrain.slope_deg,
            slip: mean(self.steps.iter().map(|step| step.slip).collect()).unwrap_or(0.0),
            updates: counted().count(),
            converged,
            refused: counted().count() - converged,
            silently_wrong: self.steps.iter().filter(|step| step.silently_wrong).count(),
            distance_m: self.way_m,
            drift_percent: 100.0 * off_m / self.way_m.max(1e-6),
            slip_error_points: sightline_geometry::estimate::quantile::quantile(&slips, 0.95),
            nees_per_dof: mean(accepted().filter_map(|step| step.nees_per_dof).collect()),
            problem,
            steps: self.steps,
        }
    }
}

/// Whether a point is not hidden from a camera; both in the site frame.
fn is_visible(
    world: &World,
    camera: &sightline_geometry::camera::Camera,
    point: &sightline_geometry::frames::Point3,
) -> bool {
    world.is_visible(&camera.model.centre(), point)
}

/// Mahalanobis distance of a vector; none where the covariance has no inverse.
fn distance(covariance: &Matrix3<f64>, vector: &Vector3<f64>) -> Option<f64> {
    covariance.cholesky().map(|factor| vector.dot(&factor.solve(vector)).max(0.0).sqrt())
}
