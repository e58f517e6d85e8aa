//! The drive: a straight approach, or a list of moves.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::range::within;
use crate::rover::approach::distances_m;
use sightline_geometry::error::{Error, Result};

/// Largest number of stops of a list of moves: a server reads the index of every drive when it starts.
const STOP_LIMIT: usize = 2000;

/// Largest distance from the targets' centre at which a drive may begin, m.
const FARTHEST_M: f64 = 50.0;

/// How the drive is defined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// Straight towards the targets' centre: distances follow `start · (1 − step)^i` until `end` is reached
    /// (R104, R106).
    #[default]
    Approach,
    /// The moves of `drive.moves`, one after the other.
    Moves,
}

/// One move of the rover; it ends in one or more stops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Move {
    /// Straight ahead.
    Forward {
        /// How far the wheels advance, m; negative: backwards (−50 to 50).
        distance_m: f64,
        /// Number of equal steps, each with a stop at its end (1).
        #[serde(default = "one")]
        stops: u32,
    },
    /// Along a circle.
    Arc {
        /// Radius of the circle that the rover's origin follows, m; positive: its centre is to the right (0.2 to
        /// 1000, either sign).
        radius_m: f64,
        /// Angle along the circle, deg; negative: backwards (−360 to 360).
        angle_deg: f64,
        /// Number of equal steps (1).
        #[serde(default = "one")]
        stops: u32,
    },
    /// A turn on the spot.
    Turn {
        /// Angle, deg, positive to the right (−360 to 360; Kim09 §5.4).
        angle_deg: f64,
        /// Number of equal steps (1).
        #[serde(default = "one")]
        stops: u32,
    },
    /// Around the targets' centre on the circle of the current radius, always facing it (Kim09 §5.2).
    Crab {
        /// Angle around the centre, deg, positive clockwise seen from above (−360 to 360).
        angle_deg: f64,
        /// Number of equal steps (1).
        #[serde(default = "one")]
        stops: u32,
    },
    /// A turn on the spot until the targets' centre is straight ahead.
    FaceTarget,
    /// Towards the targets' centre along the straight line from the rover.
    Approach {
        /// The last stop is the first one at this distance or nearer, m (1.8 to 50; less than the current one).
        to_distance_m: f64,
        /// Fraction of the remaining distance that a step covers (0.005 to 0.5).
        step_fraction: f64,
    },
}

/// A move of one step.
fn one() -> u32 {
    1
}

/// The drive. Distances are those from the centre of the left camera, with the mast pointed at it, to the targets'
/// centre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriveSettings {
    /// How the drive is defined (`approach`).
    pub course: Course,
    /// Distance from the centre of the left camera to the targets' centre at the first stop, m (10: Kim09 §5.1).
    pub start_distance_m: f64,
    /// Course `approach`: the last stop is the first one at this distance or nearer, m (2: Kim09 §5.4).
    pub end_distance_m: f64,
    /// Course `approach`: fraction of the remaining distance that a step covers (0.10: Kim09 §5.4).
    pub step_fraction: f64,
    /// Bearing of the targets' centre from the rover frame's origin at the first stop, deg, 0 ahead, positive to the
    /// right (0; the course `approach` allows only 0).
    pub start_bearing_deg: f64,
    /// Heading of the rover at the first stop, deg, 0 along x of the site, positive to the right (0).
    pub heading_deg: f64,
    /// 1σ error of each mast angle, deg; the index contains the measured angles, its truth the true cameras (0 by
    /// default; 0.05 is plausible: domain.md 4.5).
    pub pointing_error_deg: f64,
    /// Calibration error of the mast: true minus measured azimuth and elevation, deg, constant along the drive (0, 0;
    /// raw angles of real masts are off by 0.2 and 3.6: domain.md 4.2).
    pub mast_offset_deg: [f64; 2],
    /// Backlash of each mast axis, deg: the head follows only after the drive has moved by more than this (0;
    /// domain.md 4.5 gives no value).
    pub mast_backlash_deg: f64,
    /// Course `moves`: the moves, in order.
    pub moves: Vec<Move>,
}

impl Default for DriveSettings {
    fn default() -> Self {
        Self {
            course: Course::Approach,
            start_distance_m: 10.0,
            end_distance_m: 2.0,
            step_fraction: 0.10,
            start_bearing_deg: 0.0,
            heading_deg: 0.0,
            pointing_error_deg: 0.0,
            mast_offset_deg: [0.0; 2],
            mast_backlash_deg: 0.0,
            moves: Vec::new(),
        }
    }
}

impl DriveSettings {
    /// Rejects settings out of range. Does not check that the moves are possible in sequence.
    pub(crate) fn validate(&self) -> Result<()> {
        within("drive.heading_deg", self.heading_deg, -180.0, 180.0)?;
        within("drive.pointing_error_deg", self.pointing_error_deg, 0.0, 5.0)?;
        within("drive.mast_offset_deg[0]", self.mast_offset_deg[0], -5.0, 5.0)?;
        within("drive.mast_offset_deg[1]", self.mast_offset_deg[1], -5.0, 5.0)?;
        within("drive.mast_backlash_deg", self.mast_backlash_deg, 0.0, 5.0)?;
        match self.course {
            Course::Approach => self.validate_approach(),
            Course::Moves => self.validate_moves(),
        }
    }

    fn validate_approach(&self) -> Result<()> {
        within("drive.end_distance_m", self.end_distance_m, 1.8, 50.0)?;
        within("drive.start_distance_m", self.start_distance_m, self.end_distance_m, 50.0)?;
        within("drive.step_fraction", self.step_fraction, 0.005, 0.5)?;
        within("drive.start_bearing_deg (course approach)", self.start_bearing_deg, 0.0, 0.0)?;
        let last_m = distances_m(self.start_distance_m, self.end_distance_m, self.step_fraction)
            .last()
            .copied()
            .unwrap_or(0.0);
        within("drive.end_distance_m (distance of the last stop)", last_m, 1.7, 50.0)
    }

    fn validate_moves(&self) -> Result<()> {
        within("drive.start_distance_m", self.start_distance_m, 1.8, 50.0)?;
        within("drive.start_bearing_deg", self.start_bearing_deg, -180.0, 180.0)?;
        if self.moves.is_empty() || self.moves.len() > 200 {
            let problem = format!("course moves needs 1 to 200 of them, not {}", self.moves.len());
            return Err(Error::setting("drive.moves", problem));
        }
        self.moves.iter().enumerate().try_for_each(|(index, one)| one.validate(index))?;
        let stops: usize = self.moves.iter().map(Move::most_stops).sum();
        if stops > STOP_LIMIT {
            let problem = format!("may have {stops} stops, but a drive may have at most {STOP_LIMIT}");
            return Err(Error::setting("drive.moves", problem));
        }
        Ok(())
    }
}

impl Move {
    /// Largest number of stops that the move can make, wherever the rover begins it.
    fn most_stops(&self) -> usize {
        match *self {
            Self::Forward { stops, .. }
            | Self::Arc { stops, .. }
            | Self::Turn { stops, .. }
            | Self::Crab { stops, .. } => stops as usize,
            Self::FaceTarget => 1,
            Self::Approach { to_distance_m, step_fraction } => {
                distances_m(FARTHEST_M, to_distance_m, step_fraction).len()
            }
        }
    }

    /// Rejects a move that is impossible wherever the rover is; `index` is its position in the list.
    fn validate(&self, index: usize) -> Result<()> {
        let check = |field: &str, value: f64, low: f64, high: f64| {
            within(&format!("drive.moves[{index}].{field}"), value, low, high)
        };
        let count = |stops: u32| check("stops", f64::from(stops), 1.0, 200.0);
        match *self {
            Self::Forward { distance_m, stops } => {
                check("distance_m", distance_m, -50.0, 50.0)?;
                count(stops)
            }
            Self::Arc { radius_m, angle_deg, stops } => {
                let side = if radius_m < 0.0 { -1.0 } else { 1.0 };
                check("radius_m (without sign)", radius_m * side, 0.2, 1000.0)?;
                check("angle_deg", angle_deg, -360.0, 360.0)?;
                count(stops)
            }
            Self::Turn { angle_deg, stops } | Self::Crab { angle_deg, stops } => {
                check("angle_deg", angle_deg, -360.0, 360.0)?;
                count(stops)
            }
            Self::FaceTarget => Ok(()),
            Self::Approach { to_distance_m, step_fraction } => {
                check("to_distance_m", to_distance_m, 1.8, 50.0)?;
                check("step_fraction", step_fraction, 0.005, 0.5)
            }
        }
    }
}
