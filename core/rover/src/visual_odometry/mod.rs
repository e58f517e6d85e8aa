//! Visual odometry: the motion between two stops from their stereo pairs, or a refusal with its reason (R10, R11, R38,
//! R126).
//!
//! ```text
//! points → coarse_search → match → consistent_set → fit_motion → gates
//! ```
//! Corners of the left image before the motion become points by stereo. A search over translations in coarse images
//! tolerates wheel slip. The points are matched in both images after the motion, the matches with constant mutual
//! distances give a motion, and their full covariances its maximum-likelihood estimate. Gates reject uncertain results:
//! the estimate of wheels and gyro remains, and the reason names the failed gate with value and margin.
//!
//! The update is a function of two stereo pairs, their cameras and the motion by wheels and gyro. It uses no target.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | T | `after_from_before` | m; from the rover frame before to that after |
//! | Σ | `covariance` of a small motion (τ, ω) about the rover's origin after T | m², m rad, rad²; rover frame after |
//!
//! Sources: Maimone, Cheng & Matthies 2007; Howard 2008; domain.md 9.

mod coarse;
mod corner_fates;
mod outcome;
mod gates;
pub mod look;
mod matches;
mod measured;
mod motion;
mod points;
pub(crate) mod reduce;
mod repetition;
mod rigidity;
pub mod settings;
pub(crate) mod windows;

pub use coarse::{CoarseSearch, Translation};
pub use gates::gate_kinds;
#[cfg(test)]
pub(crate) use measured::accepted;
pub(crate) use measured::pose_change_error;
pub use measured::{MeasuredMotion, OdometryMode};
pub use outcome::{Fate, OdometryCorner, OdometryUpdate, Slip};
pub use settings::{OdometryPreset, OdometrySettings};

use nalgebra::{Matrix3, Matrix6};

use sightline_geometry::camera::{Camera, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pose, PoseRecord, Vector3};
use sightline_track::stages::capture::StereoPair;
use sightline_vision::corners::{CornerSettings, corners};

use self::corner_fates::CornerFates;
use self::gates::Judged;
use self::matches::{Match, NoMatch};
use self::motion::Fitted;
use self::points::{Eyes, Point};
use self::reduce::Reduced;
use self::windows::Eye;

/// Half the side of the second search window, px.
const SECOND_REACH_PX: u32 = 3;
/// Smallest distance between the translations of distinct motions, m.
const OTHER_MOTION_M: f64 = 0.015;
/// Smallest motion of the wheels with a defined slip ratio, m.
const SLIP_MIN_M: f64 = 0.02;

/// The stereo pair of a stop with its cameras.
#[derive(Clone, Copy)]
pub struct OdometryView<'a> {
    /// The images.
    pub pair: &'a StereoPair,
    /// The left camera in the rover frame of the stop.
    pub left: &'a Camera,
    /// The right camera.
    pub right: &'a Camera,
    /// The mast angles of the cameras; `None` for cameras on the body, or if unknown.
    pub mast_angles: Option<MastAngles>,
}

/// Inputs of an update.
#[derive(Clone, Copy)]
pub struct OdometryInput<'a> {
    /// The stop before.
    pub before: OdometryView<'a>,
    /// The stop after.
    pub after: OdometryView<'a>,
    /// The motion by wheels, gyro and accelerometers: from the rover frame before to that after.
    pub predicted_after_from_before: &'a Pose,
    /// The mast with the 1σ error of each angle, rad; `None` without one.
    pub mast: Option<(&'a Mast, f64)>,
    /// The settings.
    pub settings: &'a OdometrySettings,
    /// Request to stop early.
    pub cancel: Cancel<'a>,
}

/// Computes the motion between two stops.
///
/// # Errors
/// [`sightline_geometry::error::Error::Cancelled`].
pub fn update(input: &OdometryInput<'_>) -> Result<OdometryUpdate> {
    let settings = input.settings;
    let reduced = Stops::new(input);
    let [before, after] = [reduced.eyes(0), reduced.eyes(1)];
    let found = corners(
        before.left.image,
        &CornerSettings {
            half_px: 3,
            count: settings.corners_max as usize,
            spacing_px: settings.corner_spacing_px,
            border_px: settings.window_px / 2 + 4,
            strength_min: settings.corner_contrast_min.powi(2) as f32,
        },
    );
    let mut fates = CornerFates::new(found.iter().map(|corner| corner.pixel), reduced.factor);
    let mut points = Vec::new();
    for (corner, found) in found.iter().enumerate() {
        input.cancel.check()?;
        match points::point(&before, found.pixel, settings) {
            Ok(point) => points.push((corner, point)),
            Err(reason) => fates.without_point(corner, reason),
        }
    }
    let all: Vec<Point> = points.iter().map(|(_, point)| *point).collect();
    let predicted = input.predicted_after_from_before;
    let coarse =
        settings.coarse_search.then(|| coarse::coarse_search(&before, &after, &all, predicted)).flatten();
    input.cancel.check()?;
    let starts = coarse.as_ref().map_or_else(|| vec![*predicted], |coarse| coarse.starts(predicted));
    let search = Search { eyes: [&before, &after], points: &all, settings, cancel: input.cancel };
    let mut found = Vec::new();
    for start in &starts {
        found.push(search.refined(start)?);
    }
    let (best, ambiguity) = chosen(found);
    let wheels = predicted.inverse().translation.vector;
    let repetition = best.fitted.as_ref().map_or(0.0, |fitted| {
        repetition::repetition([&before, &after], &all, (&best.matches, fitted), &wheels, settings)
    });
    for (point, reason) in &best.lost {
        fates.without_match(points[*point].0, *reason);
    }
    fates.add(&points, &best.matches, best.fitted.as_ref().ok());
    Ok(outcome(input, fates, points.len(), coarse, [ambiguity, repetition], best))
}

/// Matches around one start, and the motion fitted to them.
struct Refined {
    matches: Vec<Match>,
    lost: Vec<(usize, NoMatch)>,
    fitted: Result<Fitted, String>,
}

impl Refined {
    fn inliers(&self) -> usize {
        self.fitted.as_ref().map_or(0, |fitted| fitted.inliers.len())
    }
}

/// The search for matches in the full images.
struct Search<'a> {
    eyes: [&'a Eyes<'a>; 2],
    points: &'a [Point],
    settings: &'a OdometrySettings,
    cancel: Cancel<'a>,
}

impl Search<'_> {
    /// Matches around a start, then around the motion that fits them.
    fn refined(&self, start: &Pose) -> Result<Refined> {
        let mut motion = *start;
        let mut refined = Refined { matches: Vec::new(), lost: Vec::new(), fitted: Err(String::new()) };
        for reach_px in [self.settings.search_px, SECOND_REACH_PX] {
            refined.matches.clear();
            refined.lost.clear();
            for point in self.points.iter().enumerate() {
                self.cancel.check()?;
                match matches::find(self.eyes, point, &motion, reach_px, self.settings) {
                    Ok(found) => refined.matches.push(found),
                    Err(reason) => refined.lost.push((point.0, reason)),
                }
            }
            refined.fitted = motion::fit(&refined.matches, self.settings);
            match &refined.fitted {
                Ok(fitted) => motion = fitted.after_from_before,
                Err(_) => break,
            }
        }
        Ok(refined)
    }
}

/// The result with most inliers (the first of equal ones), and the inliers of the best other motion relative to its own.
fn chosen(found: Vec<Refined>) -> (Refined, f64) {
    let mut found = found.into_iter();
    let nothing =
        Refined { matches: Vec::new(), lost: Vec::new(), fitted: Err("there is no start".to_owned()) };
    let mut best = found.next().unwrap_or(nothing);
    let mut rest = Vec::new();
    for next in found {
        if next.inliers() > best.inliers() {
            rest.push(std::mem::replace(&mut best, next));
        } else {
            rest.push(next);
        }
    }
    let Ok(fitted) = &best.fitted else { return (best, 0.0) };
    let is_other = |other: &&Refined| {
        let Ok(other) = &other.fitted else { return false };
        let between = other.after_from_before * fitted.after_from_before.inverse();
        between.translation.vector.norm() > OTHER_MOTION_M
    };
    let most = rest.iter().filter(is_other).map(Refined::inliers).max().unwrap_or(0);
    let ambiguity = most as f64 / fitted.inliers.len().max(1) as f64;
    (best, ambiguity)
}

/// Assembles the outcome from the results.
fn outcome(
    input: &OdometryInput<'_>,
    fates: CornerFates,
    points: usize,
    coarse: Option<CoarseSearch>,
    [ambiguity, repetition]: [f64; 2],
    Refined { matches, fitted, .. }: Refined,
) -> OdometryUpdate {
    let matches = matches.as_slice();
    let matched = matches.len();
    let predicted = input.predicted_after_from_before;
    let motion = fitted.as_ref().ok();
    let covariance = motion.map(|motion| covariance(input, motion, matches));
    let judged = Judged {
        predicted,
        fitted: motion,
        covariance: covariance.as_ref(),
        matches: matched,
        ambiguity,
        repetition,
    };
    let gates = gates::judge(&judged, input.settings);
    let accepted = motion.is_some() && gates.iter().all(|gate| gate.passed);
    let slip = motion
        .zip(covariance.as_ref())
        .and_then(|(motion, covariance)| slip(&motion.after_from_before, covariance, predicted));
    OdometryUpdate {
        corners: fates.count(),
        points,
        matches: matched,
        consistent: motion.map_or(0, |motion| motion.consistent),
        inliers: motion.map_or(0, |motion| motion.inliers.len()),
        coarse_search: coarse,
        after_from_before: motion.map(|motion| PoseRecord::from(&motion.after_from_before)),
        wheels_m: predicted.inverse().translation.vector.into(),
        covariance,
        chi2_per_dof: motion.map(|motion| motion.chi2_per_dof),
        change: motion.map(|motion| motion.change(matches)),
        slip,
        ambiguity,
        repetition,
        gates,
        missing: fitted.as_ref().err().cloned(),
        accepted,
        table: fates.table(),
    }
}

/// The complete covariance of a motion.
fn covariance(input: &OdometryInput<'_>, fitted: &Fitted, matches: &[Match]) -> Matrix6<f64> {
    let [always_px, by_change_px] = input.settings.common_px;
    let common_px = always_px.hypot(by_change_px * fitted.change(matches));
    let common = motion::by_common_shift(matches, fitted) * common_px.powi(2);
    let angles = input.before.mast_angles.zip(input.after.mast_angles);
    let mast = input.mast.zip(angles).map_or_else(Matrix6::zeros, |((mast, error_rad), (before, after))| {
        motion::by_mast(mast, [before, after], &fitted.after_from_before) * (error_rad * error_rad)
    });
    fitted.covariance + common + mast
}

/// The slip ratio of a motion relative to that of the wheels.
fn slip(motion: &Pose, covariance: &Matrix6<f64>, predicted: &Pose) -> Option<Slip> {
    let (wheels, seen) = (predicted.inverse().translation.vector, motion.inverse().translation.vector);
    let length_m = wheels.norm();
    if length_m < SLIP_MIN_M {
        return None;
    }
    let along = wheels / length_m;
    let aside = Vector3::z().cross(&along).normalize();
    let turn = motion.rotation.to_rotation_matrix();
    let translation: Matrix3<f64> = covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let displacement = turn.transpose() * translation * turn;
    Some(Slip {
        along: 1.0 - seen.dot(&along) / length_m,
        aside: seen.dot(&aside) / length_m,
        along_sigma: along.dot(&(displacement * along)).max(0.0).sqrt() / length_m,
    })
}

/// The preprocessed images of both stops.
struct Stops {
    eyes: [[Reduced; 2]; 2],
    factor: u32,
}

impl Stops {
    fn new(input: &OdometryInput<'_>) -> Self {
        let factor = input.before.left.width().div_ceil(input.settings.width_max_px);
        let compared = |eye: Eye<'_>| match factor {
            1 => Reduced::smoothed(eye),
            _ => Reduced::new(eye, factor),
        };
        let eyes = [input.before, input.after].map(|view| {
            [
                compared(Eye { camera: view.left, image: &view.pair.left }),
                compared(Eye { camera: view.right, image: &view.pair.right }),
            ]
        });
        Self { eyes, factor }
    }

    fn eyes(&self, stop: usize) -> Eyes<'_> {
        let [left, right] = &self.eyes[stop];
        Eyes { left: left.eye(), right: right.eye() }
    }
}
