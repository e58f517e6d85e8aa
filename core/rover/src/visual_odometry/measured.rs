//! Visual odometry's measurement of the motion to a stop, with the wheels' prediction: the result stored with a stop.

use nalgebra::Matrix6;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Point3, Pose, PoseRecord, Vector3};
use sightline_geometry::odometry_error::PoseChangeError;
use sightline_record::{Declaration, GateRecord, Record, Unit};

use super::{OdometryInput, OdometryPreset, OdometryUpdate, OdometryView, update};
use crate::pair::{self, StopPair};
use crate::pipeline::Stops;

/// Use of visual odometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OdometryMode {
    /// Off: the pose is that of wheels, gyro and accelerometers (R10).
    Off,
    /// Measures the slip, which may end the drive; the pose is that of wheels, gyro and accelerometers.
    SlipCheck,
    /// Accepted updates correct the pose as well (R11).
    #[default]
    Full,
}

/// Visual odometry's measurement of the motion to a stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredMotion {
    /// Preset of the settings.
    pub preset: OdometryPreset,
    /// The pose by wheels, gyro and accelerometers, from the estimated pose of the previous stop; site frame.
    pub wheels_site_from_rover: PoseRecord,
    /// Whether the estimated pose of the stop, and its error, are those of this motion.
    pub corrects: bool,
    /// The pair of both stops that was used; null for the main one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraName>,
    /// The motion with its gates.
    pub update: OdometryUpdate,
    /// Why it was refused in the other pair, if two were tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused_too: Option<String>,
}

impl MeasuredMotion {
    /// Measures the motion to stop `step` from the main pairs there and at the previous stop, or from further pairs. The
    /// estimated pose of the stop must be that of wheels, gyro and accelerometers.
    ///
    /// # Errors
    /// A stop without such a pair, images that cannot be read, or [`sightline_geometry::error::Error::Cancelled`].
    pub fn measure(
        stops: &dyn Stops,
        step: usize,
        camera: Option<CameraName>,
        (mode, preset): (OdometryMode, OdometryPreset),
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let by_wheels = stops.site_from_rover(step);
        let update = between(stops, (step, camera), &by_wheels, preset, cancel)?;
        let update = OdometryUpdate { table: Vec::new(), ..update };
        let corrects = mode == OdometryMode::Full && update.accepted;
        let wheels_site_from_rover = PoseRecord::from(&by_wheels);
        Ok(Self { preset, wheels_site_from_rover, corrects, camera, update, refused_too: None })
    }

    /// Repeats the update to obtain its corners, which are not stored.
    ///
    /// # Errors
    /// As [`Self::measure`].
    pub fn again(&self, stops: &dyn Stops, step: usize, cancel: Cancel<'_>) -> Result<OdometryUpdate> {
        between(stops, (step, self.camera), &self.wheels_site_from_rover.to_pose(), self.preset, cancel)
    }

    /// The estimated pose of the stop for the estimated pose `before` of the previous one; both site frame.
    pub fn pose_after(&self, before: &Pose) -> Pose {
        let accepted = self.update.accepted_motion().filter(|_| self.corrects);
        accepted.map_or_else(|| self.wheels_site_from_rover.to_pose(), |motion| before * motion.inverse())
    }

    /// Why there is no update, as one sentence; `None` for an accepted one.
    pub fn refusal(&self) -> Option<String> {
        let refusal = self.update.refusal()?;
        let too = self.refused_too.as_ref();
        Some(too.map_or_else(|| refusal.clone(), |too| format!("{refusal}; looking back, {too}")))
    }

    /// Rejects implausible values, which a file may contain.
    ///
    /// # Errors
    /// A message that begins with the field.
    pub fn check(&self) -> Result<(), String> {
        let motion = self.update.after_from_before;
        if !(self.wheels_site_from_rover.is_plausible() && motion.is_none_or(|motion| motion.is_plausible()))
        {
            return Err(
                "odometry: its poses must have positions in m and quaternions of unit length".to_owned()
            );
        }
        let is_covariance = |matrix: &Matrix6<f64>| {
            matrix.iter().all(|value| value.is_finite())
                && (matrix - matrix.transpose()).amax() <= 1e-9 * matrix.amax()
                && matrix.diagonal().iter().all(|variance| *variance >= 0.0)
        };
        if !self.update.covariance.iter().all(is_covariance) {
            return Err("odometry.update.covariance: must be a symmetric matrix without negative variances"
                .to_owned());
        }
        if self.corrects && (self.update.accepted_motion().is_none() || self.update.covariance.is_none()) {
            return Err("odometry.corrects: needs an accepted motion with its covariance".to_owned());
        }
        Ok(())
    }

    /// Number of computed updates.
    pub fn updates(&self) -> u32 {
        1 + u32::from(self.refused_too.is_some())
    }

    /// Number of additional pairs: the one of the measurement, and the one that looks back after a refusal.
    pub(crate) fn own_pairs(&self) -> u32 {
        u32::from(self.camera.is_some()) + u32::from(!self.update.accepted)
    }

    /// Displacement of the rover's origin by vision, rover frame of the previous stop, m.
    fn displacement(&self) -> Option<Vector3> {
        Some(self.update.after_from_before?.to_pose().inverse().translation.vector)
    }

    /// Distance between the positions by vision and by wheels, m.
    fn wheels_apart_m(&self) -> Option<f64> {
        Some((self.displacement()? - Vector3::from(self.update.wheels_m)).norm())
    }

    /// The covariance of the pose change, if the pose is by vision.
    fn covariance(&self) -> Option<Matrix6<f64>> {
        self.update.covariance.filter(|_| self.corrects)
    }
}

/// The error model of the pose change from the previous stop to stop `step`.
pub(crate) fn pose_change_error(stops: &dyn Stops, step: usize) -> PoseChangeError {
    let measured = stops.measured_motion(step).and_then(MeasuredMotion::covariance);
    measured.map_or_else(
        || PoseChangeError::Modelled(stops.odometry_error()),
        |covariance| PoseChangeError::Measured(Box::new(covariance)),
    )
}

fn between(
    stops: &dyn Stops,
    (step, camera): (usize, Option<CameraName>),
    by_wheels: &Pose,
    preset: OdometryPreset,
    cancel: Cancel<'_>,
) -> Result<OdometryUpdate> {
    let cameras = [pair::of_stop(stops, step - 1, camera)?, pair::of_stop(stops, step, camera)?];
    let images =
        [pair::capture(stops, step - 1, camera, cancel)?, pair::capture(stops, step, camera, cancel)?];
    let view = |number: usize| {
        let StopPair { left, right, mast_angles, .. } = cameras[number];
        OdometryView { pair: &images[number], left, right, mast_angles }
    };
    let predicted = by_wheels.inverse() * stops.site_from_rover(step - 1);
    let error_rad = stops.pointing_error_deg().to_radians();
    update(&OdometryInput {
        before: view(0),
        after: view(1),
        predicted_after_from_before: &predicted,
        mast: stops.mast().map(|mast| (mast, error_rad)),
        settings: &preset.settings(),
        cancel,
    })
}

impl Record for MeasuredMotion {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("accepted", Unit::One, |m| m.update.accepted).describe("Whether every gate is passed.");
        r.quantity("corrects", Unit::One, |m| m.corrects)
            .describe("Whether this motion corrects the estimated pose of the stop.");
        r.quantity("slip", Unit::One, |m| m.update.slip.map(|slip| slip.along))
            .describe("Slip ratio along the wheels' motion; 1: the rover did not move.");
        r.quantity("slip_aside", Unit::One, |m| m.update.slip.map(|slip| slip.aside))
            .describe("Lateral slip to the right, as a fraction of the wheels' motion.");
        r.quantity("slip_sigma", Unit::One, |m| m.update.slip.map(|slip| slip.along_sigma))
            .describe("1σ error of the slip.");
        r.quantity("motion_m", Unit::Metre, |m| m.displacement().map(Point3::from)).describe(
            "Translation of the rover's origin by vision, in the rover frame of the previous stop.",
        );
        r.quantity("wheels_apart_m", Unit::Metre, Self::wheels_apart_m)
            .describe("Distance between the rover positions by vision and by wheels.");
        r.quantity("sigma_m", Unit::Metre, |m| {
            m.update.covariance.map(|covariance| worst_sigma_m(&covariance))
        })
        .describe("1σ error of the translation in its worst direction.");
        r.quantity("corners", Unit::One, |m| m.update.corners)
            .describe("Number of corners in the previous left image.");
        r.quantity("points", Unit::One, |m| m.update.points).describe("Number of triangulated corners.");
        r.quantity("matches", Unit::One, |m| m.update.matches)
            .describe("Number of points matched in both current images.");
        r.quantity("inliers", Unit::One, |m| m.update.inliers).describe("Number of inliers.");
        r.quantity("chi2_per_dof", Unit::One, |m| m.update.chi2_per_dof)
            .describe("χ² per degree of freedom of the residuals.");
        r.quantity("change", Unit::One, |m| m.update.change)
            .describe("Mean relative change of the windows' scale; 0.1: 10 %.");
        r.quantity("ambiguity", Unit::One, |m| m.update.ambiguity)
            .describe("Inliers of the second-best hypothesis as a fraction of those of the best one.");
        r.quantity("repetition", Unit::One, |m| m.update.repetition)
            .describe("Highest other maximum of the correlation along the motion, over that at the motion; near 1: repetitive ground.");
        for kind in super::gates::KINDS {
            r.gate(kind.name, kind.unit, kind.side, "");
        }
        r.gates(|m| m.update.gates.iter().map(GateRecord::from).collect());
        r.reason(Self::refusal);
    }
}

fn worst_sigma_m(covariance: &Matrix6<f64>) -> f64 {
    covariance.fixed_view::<3, 3>(0, 0).into_owned().symmetric_eigenvalues().max().max(0.0).sqrt()
}

/// An accepted motion straight ahead.
#[cfg(test)]
pub(crate) fn accepted() -> MeasuredMotion {
    let pose = PoseRecord::from(&Pose::identity());
    let update = OdometryUpdate {
        corners: 0,
        points: 0,
        matches: 0,
        consistent: 0,
        inliers: 0,
        coarse_search: None,
        after_from_before: Some(pose),
        wheels_m: [0.0; 3],
        covariance: Some(Matrix6::identity()),
        chi2_per_dof: None,
        change: None,
        slip: None,
        ambiguity: 0.0,
        repetition: 0.0,
        gates: Vec::new(),
        missing: None,
        accepted: true,
        table: Vec::new(),
    };
    MeasuredMotion {
        preset: OdometryPreset::Sightline,
        wheels_site_from_rover: pose,
        corrects: true,
        camera: None,
        update,
        refused_too: None,
    }
}
