//! A motion of the rover: an arc of a circle or a turn in place.
//!
//! ```text
//! x(s) = sin(κ s)/κ      y(s) = (1 − cos(κ s))/κ      ψ(s) = κ s
//! ```
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | s, κ | part of `length_m`, `curvature_per_m` (positive to the right) | m, 1/m |
//! | x, y, ψ | position ahead and to the right of the start, heading | m, rad |
//!
//! Text form in a list of motions: `0.5` (m, straight; negative: back), `turn 20` (deg, positive to the right),
//! `0.5 turn 20` (an arc of 0.5 m that turns by 20°).
//!
//! Frame: rover at the start of the motion, horizontal.

use std::fmt;
use std::str::FromStr;

use sightline_geometry::error::Error;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One motion of the rover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Motion {
    /// Along a circle or straight ahead.
    Arc {
        /// Length of the path of the rover's origin, m; negative: backwards.
        length_m: f64,
        /// Curvature, 1/m; positive to the right, 0 straight ahead.
        curvature_per_m: f64,
    },
    /// A turn on the spot.
    Turn {
        /// Angle, rad, positive to the right.
        angle_rad: f64,
    },
}

impl Motion {
    /// Curvature, 1/m, positive to the right; 0 for a turn in place.
    pub(crate) fn curvature_per_m(&self) -> f64 {
        match *self {
            Self::Arc { curvature_per_m, .. } => curvature_per_m,
            Self::Turn { .. } => 0.0,
        }
    }

    /// Length of the path, m, and rotation, rad, positive to the right.
    pub fn length_and_turn(&self) -> (f64, f64) {
        match *self {
            Self::Arc { length_m, curvature_per_m } => (length_m, length_m * curvature_per_m),
            Self::Turn { angle_rad } => (0.0, angle_rad),
        }
    }

    /// The first part of the motion; `part` is 0 to 1.
    pub(super) fn part(&self, part: f64) -> Self {
        match *self {
            Self::Arc { length_m, curvature_per_m } => {
                Self::Arc { length_m: part * length_m, curvature_per_m }
            }
            Self::Turn { angle_rad } => Self::Turn { angle_rad: part * angle_rad },
        }
    }

    /// Pose after a fraction of the motion, 0 to 1, on level ground without slip: position ahead and to the right of its
    /// start, m, and rotation to the right, rad.
    pub fn after(&self, part: f64) -> ([f64; 2], f64) {
        match *self {
            Self::Turn { angle_rad } => ([0.0; 2], part * angle_rad),
            Self::Arc { length_m, curvature_per_m } => {
                let (length_m, turn_rad) = (part * length_m, part * length_m * curvature_per_m);
                // For so large a radius the difference from a straight line is below rounding.
                if turn_rad.abs() < 1e-9 {
                    return ([length_m, 0.0], turn_rad);
                }
                ([turn_rad.sin() / curvature_per_m, (1.0 - turn_rad.cos()) / curvature_per_m], turn_rad)
            }
        }
    }
}

impl FromStr for Motion {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let problem = || {
            let sentence = format!(
                "`{text}` is not a motion: write metres (0.5), `turn` and degrees (turn 20), or both (0.5 turn 20)"
            );
            Error::setting("motions", sentence)
        };
        let number =
            |word: &str| word.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(problem);
        match text.split_whitespace().collect::<Vec<_>>()[..] {
            [length] => Ok(Self::Arc { length_m: number(length)?, curvature_per_m: 0.0 }),
            ["turn", angle] => Ok(Self::Turn { angle_rad: number(angle)?.to_radians() }),
            [length, "turn", angle] => {
                let (length_m, angle_rad) = (number(length)?, number(angle)?.to_radians());
                let curvature_per_m = angle_rad / length_m;
                if length_m == 0.0 { Err(problem()) } else { Ok(Self::Arc { length_m, curvature_per_m }) }
            }
            _ => Err(problem()),
        }
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Three decimals, without trailing zeros.
        let short = |value: f64| (value * 1e3).round() / 1e3 + 0.0;
        match *self {
            Self::Turn { angle_rad } => write!(f, "turn {}", short(angle_rad.to_degrees())),
            Self::Arc { length_m, curvature_per_m: 0.0 } => write!(f, "{}", short(length_m)),
            Self::Arc { length_m, curvature_per_m } => {
                write!(f, "{} turn {}", short(length_m), short((length_m * curvature_per_m).to_degrees()))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_read_as_it_is_written_and_nonsense_is_refused() {
        for text in ["0.5", "-1.4", "turn 20", "turn -18.5", "0.1 turn -10", "-0.1 turn 10"] {
            assert_eq!(text.parse::<Motion>().unwrap().to_string(), text);
        }
        for text in ["", "ahead", "turn", "0.5 turn", "turn 20 0.5", "0 turn 5", "NaN", "1 2"] {
            let told = text.parse::<Motion>().unwrap_err().to_string();
            assert!(told.contains(&format!("`{text}` is not a motion")), "{told}");
        }
    }

    #[test]
    fn the_end_of_a_motion_is_that_of_many_small_ones() {
        for motion in [
            Motion::Arc { length_m: 2.0, curvature_per_m: 0.4 },
            Motion::Arc { length_m: -1.0, curvature_per_m: -0.3 },
            Motion::Arc { length_m: 1.5, curvature_per_m: 0.0 },
            Motion::Turn { angle_rad: -0.8 },
        ] {
            let (length_m, turn_rad) = motion.length_and_turn();
            let (mut place, mut heading_rad) = ([0.0f64; 2], 0.0f64);
            for _ in 0..100_000 {
                let half = heading_rad + 0.5e-5 * turn_rad;
                place = [place[0] + 1e-5 * length_m * half.cos(), place[1] + 1e-5 * length_m * half.sin()];
                heading_rad += 1e-5 * turn_rad;
            }
            let (end, turned_rad) = motion.after(1.0);
            assert!((end[0] - place[0]).hypot(end[1] - place[1]) < 1e-9, "{motion:?}: {end:?} {place:?}");
            assert!((turned_rad - heading_rad).abs() < 1e-9);
        }
    }
}
