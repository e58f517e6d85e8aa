//! One drive of the study: a stereo pair at every stop, the motion since the previous stop, and its comparison with the
//! truth.

use std::path::Path;

use nalgebra::{Matrix3, Vector3, Vector6};

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::estimate::quantile::quantile;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{ActiveWorld, Motion};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::look::look;
use sightline_rover::visual_odometry::{OdometryInput, OdometryUpdate, OdometryView, update};
use sightline_track::stages::capture::StereoPair;
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, World};

use super::row::{OVERLAP_MIN, OdometryRow, OdometryStep};
use super::{Commanded, OdometryDrives, TRACKS_BEFORE};

/// Points along each side of the image at which the overlap is sampled.
const OVERLAP_SIDE: u32 = 8;

/// A drive in progress.
pub(super) struct OdometryDrive<'a> {
    study: &'a OdometryDrives<'a>,
    world: DrivenTraverse,
    pair: StereoPair,
    /// Azimuth of the last pair as commanded by the predicted motion, without the half turn of a backward view, rad.
    azimuth_rad: f64,
    estimated: Pose,
    way_m: f64,
    steps: Vec<OdometryStep>,
}

impl<'a> OdometryDrive<'a> {
    pub(super) fn begin(
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

    /// Drives some metres straight ahead, so that the backward view shows tracks, and captures the first pair there.
    pub(super) fn lay_tracks(&mut self, cancel: Cancel<'_>) -> Result<()> {
        for _ in 0..TRACKS_BEFORE {
            self.world.drive(&Motion::Arc { length_m: 1.0, curvature_per_m: 0.0 }, cancel)?;
        }
        let stop = self.world.traverse().stop_count() - 1;
        self.look(None, &Pose::identity())?;
        self.pair = Stops::capture(self.world.traverse(), stop, cancel)?;
        self.estimated = self.true_pose(stop)?;
        Ok(())
    }

    /// Points the mast at the last stop.
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

    /// Drives, captures and measures a step; returns whether a rock stalled the wheels.
    pub(super) fn step(&mut self, commanded: Commanded, cancel: Cancel<'_>) -> Result<bool> {
        let Commanded { length_m, turn_rad } = commanded;
        let motion = if length_m != 0.0 {
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

    /// Compares an update with the true motion.
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
        let by_shift = shift_m.is_some_and(|error| error > f64::max(0.01, 0.04 * commanded.length_m.abs()))
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
            repetition: found.repetition,
        })
    }

    /// Fraction of the ground in the left image before that is in the left image after, by the true poses.
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

    pub(super) fn row(self, scenario: &Scenario, seed: u64, problem: Option<String>) -> OdometryRow {
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
            slip_error_points: quantile(&slips, 0.95),
            nees_per_dof: mean(accepted().filter_map(|step| step.nees_per_dof).collect()),
            problem,
            steps: self.steps,
        }
    }
}

/// Returns whether a point is not occluded for a camera; both in the site frame.
fn is_visible(world: &World, camera: &Camera, point: &Point3) -> bool {
    world.is_visible(&camera.model.centre(), point)
}

/// Mahalanobis distance of a vector; `None` if the covariance is not positive definite.
fn distance(covariance: &Matrix3<f64>, vector: &Vector3<f64>) -> Option<f64> {
    covariance.cholesky().map(|factor| vector.dot(&factor.solve(vector)).max(0.0).sqrt())
}
