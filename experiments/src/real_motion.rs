//! The motion that features find between recorded frames, against the motion that is known of them.
//!
//! ```text
//! T = now_from_world · then_from_world⁻¹         from the recording's poses
//! T̂ = motion between the two frames              from their features alone (`locate::features`), or by `odometry`
//! rotation error       ∠(R⁻¹ R̂)                  deg
//! translation error    | T̂ a − T a |             m, and as a share of | T a − a |
//! ```
//! The point a, in the frame before, is where the rig's own frame has its origin; for the board, which moves while the
//! cameras stand still, it is the board's centre, so that a turn about the distant camera does not count as a way.
//! Nothing is expected of the motion: it is looked for as if the rig stood still, which only matters with a prior radius.
//! Visual odometry is given a prediction, which `odometry` states.
//!
//! | recording | file | true pose by | rig frame |
//! |---|---|---|---|
//! | KITTI, a car | `kitti` | its `poses.txt` | camera 0, axes as a rover's |
//! | EuRoC, a helicopter | `euroc` | Vicon; or it stands | camera 0: x right, y down, z forward |
//! | chessboard in a hand | `chessboard` | its corners in the left image | left camera, likewise; the world is the board |
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | T, T̂ | `now_from_then`, `MotionFit::motion` | m, rig frames of the two times |
//! | a | `Frame::about_in_rig` | m, rig frame then |

mod chessboard;
mod euroc;
mod kitti;
mod lens;
pub(crate) mod odometry;
mod odometry_matches;

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::estimate::quantile::{median, quantile};
use sightline_geometry::frames::{Pixel, Point3, Pose, PoseRecord};
use sightline_track::locate::features::FeatureSettings;
use sightline_track::locate::features::detect::{StopFeatures, detect};
use sightline_track::locate::features::motion::{MotionInput, motion};
use sightline_track::stages::capture::StereoPair;
use sightline_vision::image::GrayImage;

/// What is measured together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Set {
    /// KITTI, from each frame to the next.
    KittiEveryFrame,
    /// KITTI, three frames at a time.
    KittiEveryThird,
    /// EuRoC, two frames half a second apart.
    EurocPair,
    /// EuRoC, from frame to frame of a helicopter that stands.
    EurocStill,
    /// The same frames, by odometry whose wheels spin.
    EurocSpinning,
    /// The chessboard from frame to frame, by features.
    Chessboard,
    /// The same by its corners, triangulated: what these images allow.
    ChessboardCorners,
}

impl Set {
    /// What people call it.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::KittiEveryFrame => "KITTI, every frame",
            Self::KittiEveryThird => "KITTI, every third frame",
            Self::EurocPair => "EuRoC, AprilGrid pair",
            Self::EurocStill => "EuRoC, standing still",
            Self::EurocSpinning => "EuRoC, wheels spinning",
            Self::Chessboard => "chessboard, features",
            Self::ChessboardCorners => "chessboard, corners",
        }
    }

    /// What the description of the recording says is possible.
    pub(crate) const fn possible(self) -> &'static str {
        match self {
            Self::KittiEveryFrame => "0.16°, 1 to 1.5 %",
            Self::KittiEveryThird => "not said",
            Self::EurocPair => "0.25°, 4 cm",
            Self::EurocStill | Self::EurocSpinning => "no motion",
            Self::Chessboard => "ambiguous: a hard case",
            Self::ChessboardCorners => "corners within 0.15 to 0.25 px",
        }
    }
}

/// One motion, true and found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    /// The set it belongs to.
    pub set: Set,
    /// The two frames, for example `0 to 1`.
    pub pair: String,
    /// Matches between the points of the two frames.
    pub matches: usize,
    /// Those that agree with the motion found.
    pub inliers: usize,
    /// Angle of the true turn, deg.
    pub rotation_deg: f64,
    /// Length of the true way, m.
    pub translation_m: f64,
    /// The motion that was found, in the frames of the rig; null where none was.
    pub now_from_then: Option<PoseRecord>,
    /// How far it is from the true one.
    pub error: Option<MotionError>,
}

/// How far a motion that was found is from the true one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct MotionError {
    /// Angle between the turns, deg.
    pub rotation_deg: f64,
    /// Distance between the ends of the way, m.
    pub translation_m: f64,
    /// The same as a share of the true way, %; null where there is none.
    pub translation_percent: Option<f64>,
}

impl Row {
    fn new(set: Set, pair: String, now_from_then: &Pose, about: &Point3, found: Option<Pose>) -> Self {
        let (end, translation_m) = (now_from_then * about, (now_from_then * about - about).norm());
        let error = |found: Pose| {
            let error_m = (found * about - end).norm();
            MotionError {
                rotation_deg: now_from_then.rotation.angle_to(&found.rotation).to_degrees(),
                translation_m: error_m,
                translation_percent: (translation_m > 0.0).then(|| 100.0 * error_m / translation_m),
            }
        };
        Self {
            set,
            pair,
            matches: 0,
            inliers: 0,
            rotation_deg: now_from_then.rotation.angle().to_degrees(),
            translation_m,
            now_from_then: found.as_ref().map(PoseRecord::from),
            error: found.map(error),
        }
    }
}

/// The errors of one set: each as median and worst.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Summary {
    /// The set.
    pub set: Set,
    /// Its motions.
    pub pairs: usize,
    /// How many of them were found.
    pub found: usize,
    /// Median share of matches that agree with the motion found, 0 to 1.
    pub agreeing: Option<f64>,
    /// Of the turn, deg.
    pub rotation_deg: Option<[f64; 2]>,
    /// Of the way, m.
    pub translation_m: Option<[f64; 2]>,
    /// Of the way, %.
    pub translation_percent: Option<[f64; 2]>,
}

/// Sums the rows up, set by set.
pub(crate) fn summarise(rows: &[Row]) -> Vec<Summary> {
    let mut sets: Vec<Set> = rows.iter().map(|row| row.set).collect();
    sets.sort_unstable();
    sets.dedup();
    let summary = |set: Set| {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.set == set).collect();
        let errors: Vec<MotionError> = rows.iter().filter_map(|row| row.error).collect();
        let of = |value: fn(&MotionError) -> Option<f64>| {
            median_and_worst(errors.iter().filter_map(value).collect())
        };
        let share = |row: &&Row| (row.matches > 0).then(|| row.inliers as f64 / row.matches as f64);
        Summary {
            set,
            pairs: rows.len(),
            found: errors.len(),
            agreeing: median_and_worst(rows.iter().filter_map(share).collect()).map(|[median, _]| median),
            rotation_deg: of(|error| Some(error.rotation_deg)),
            translation_m: of(|error| Some(error.translation_m)),
            translation_percent: of(|error| error.translation_percent),
        }
    };
    sets.into_iter().map(summary).collect()
}

/// The median and the largest value.
fn median_and_worst(values: Vec<f64>) -> Option<[f64; 2]> {
    Some([median(&values)?, quantile(&values, 1.0)?])
}

/// Measures all recordings of a data folder.
///
/// # Errors
/// A recording that is missing, incomplete or damaged.
pub(crate) fn measure(data: &Path, settings: &FeatureSettings) -> Result<Vec<Row>> {
    let mut rows = kitti::read(data, usize::MAX)?.rows(settings);
    rows.extend(euroc::read(data, Set::EurocPair)?.rows(settings));
    rows.extend(euroc::read(data, Set::EurocStill)?.rows(settings));
    rows.extend(chessboard::read(data)?.rows(settings));
    rows.extend(chessboard::corner_rows(data)?);
    Ok(rows)
}

/// Frames of one rig, and between which of them the motion is measured.
struct Recording {
    /// Left and right, in the frame of the rig.
    cameras: [Camera; 2],
    frames: Vec<Frame>,
    /// The set, and the frames then and now.
    pairs: Vec<(Set, usize, usize)>,
    /// Where features lie nearer than any that the settings are made for, m.
    range_min_m: Option<f64>,
}

/// One stereo frame and what is known of it.
struct Frame {
    name: String,
    pair: StereoPair,
    world_from_rig: Pose,
    /// The point whose way is measured, m.
    about_in_rig: Point3,
    /// The outline in the left image, in order, of what moves as a whole; without it all does.
    outline: Option<[Pixel; 4]>,
}

impl Recording {
    /// Measures all its pairs.
    fn rows(&self, settings: &FeatureSettings) -> Vec<Row> {
        let range_min_m = self.range_min_m.unwrap_or(settings.feature_range_min_m);
        let settings = &FeatureSettings { feature_range_min_m: range_min_m, ..settings.clone() };
        let features: Vec<StopFeatures> =
            self.frames.par_iter().map(|frame| self.features(frame, settings)).collect();
        let row = |&(set, then, now): &(Set, usize, usize)| {
            let motion = motion(&MotionInput {
                then: &features[then],
                now: &features[now],
                expected_now_from_then: &Pose::identity(),
                left: &self.cameras[0],
                settings,
            });
            let (then, now) = (&self.frames[then], &self.frames[now]);
            let now_from_then = now.world_from_rig.inverse() * then.world_from_rig;
            let pair = format!("{} to {}", then.name, now.name);
            Row {
                matches: motion.matches.len(),
                inliers: motion.fit.inliers.len(),
                ..Row::new(set, pair, &now_from_then, &then.about_in_rig, motion.fit.motion())
            }
        };
        self.pairs.par_iter().map(row).collect()
    }

    /// The features of a frame that belong to what moves as a whole.
    fn features(&self, frame: &Frame, settings: &FeatureSettings) -> StopFeatures {
        let cameras = [&self.cameras[0], &self.cameras[1]];
        let mut features =
            detect(&frame.pair, cameras, settings, Cancel::default()).expect("nobody cancels it");
        if let Some(outline) = &frame.outline {
            let StopFeatures { left, points, .. } = &mut features;
            let pixel = |index: u32| StopFeatures::pixel(&left.keypoints[index as usize]);
            points.retain(|point| is_inside(outline, pixel(point.stereo.left)));
        }
        features
    }
}

/// Whether a pixel lies inside a convex outline: on the same side of all its edges.
fn is_inside(outline: &[Pixel; 4], pixel: Pixel) -> bool {
    let side = |edge: usize| {
        let (from, to) = (outline[edge], outline[(edge + 1) % 4]);
        (to.x - from.x) * (pixel.y - from.y) - (to.y - from.y) * (pixel.x - from.x)
    };
    let sides = [0, 1, 2, 3].map(side);
    sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0)
}

fn pair(left: GrayImage, right: GrayImage) -> StereoPair {
    StereoPair { left: Arc::new(left), right: Arc::new(right) }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod odometry_tests;
