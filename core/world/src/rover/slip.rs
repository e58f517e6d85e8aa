//! Slip: the part of the wheels' advance that the rover loses, by soil and slope.
//!
//! `slip = 1 − (true advance)/(wheel advance)`; 0 is none, 1 no progress, more than 1 sliding back. With α the
//! slope of the ground under the rover, γ the grade along the motion (positive uphill) and s the table of
//! domain.md 5.5 (interpolated between its angles, constant beyond the last):
//!
//! ```text
//! along = s(0) + sign(γ) (s(|γ|) − s(0))          downhill the rover slides ahead of its wheels
//! aside = 0.6 s(α) sin χ                          downhill, as a fraction of the wheel advance
//! true  = u (1 − along) w + n aside w
//! ```
//!
//! The downhill branch, mirrored at the slip of level ground, is ours.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | α, γ | slope, grade | rad |
//! | χ | angle between motion and fall line | rad |
//! | u, n | unit vectors along the motion and to its right | rover frame, x and y |
//! | w | wheel advance | m |
//!
//! Sources: domain.md 5.5; papers.md R126.

use nalgebra::UnitQuaternion;

use crate::scenario::{RoverSettings, Soil};
use sightline_geometry::frames::Vector3;

/// Slope angles of the table, degrees.
const ANGLES_DEG: [f64; 6] = [0.0, 5.0, 10.0, 15.0, 20.0, 25.0];
/// Fraction of the slip that acts sideways when the motion is along the contour of the hill.
const ASIDE: f64 = 0.6;
/// Smallest fraction of the wheel advance that must remain for the rover to reach a place.
const LEAST_ADVANCE: f64 = 0.02;

/// The slip of one motion, as fractions of the wheel advance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Slip {
    /// Lost along the motion; negative if the rover slides ahead of its wheels.
    pub along: f64,
    /// Gained to the right of the motion.
    pub aside: f64,
}

/// The slip straight uphill on a slope, dimensionless (domain.md 5.5).
pub(crate) fn of_slope(soil: Soil, slope_rad: f64) -> f64 {
    let table = match soil {
        Soil::LooseSand => [0.02, 0.08, 0.20, 0.45, 0.85, 1.10],
        Soil::FirmSoil => [0.01, 0.03, 0.07, 0.15, 0.30, 0.55],
        Soil::Bedrock => [0.00, 0.01, 0.02, 0.03, 0.05, 0.08],
    };
    let slope_deg = slope_rad.abs().to_degrees();
    let pairs = ANGLES_DEG.windows(2).zip(table.windows(2));
    for (angles, slips) in pairs {
        if slope_deg <= angles[1] {
            let part = (slope_deg - angles[0]) / (angles[1] - angles[0]);
            return slips[0] + part * (slips[1] - slips[0]);
        }
    }
    table[5]
}

/// The slip of a motion along `direction` (unit, rover frame x and y) of a rover with this attitude.
pub(crate) fn on_slope(
    settings: &RoverSettings,
    attitude: &UnitQuaternion<f64>,
    direction: [f64; 2],
) -> Slip {
    let gravity = attitude.inverse() * Vector3::z();
    let downhill = gravity.xy().norm();
    let grade_rad = -(gravity.x * direction[0] + gravity.y * direction[1]).clamp(-1.0, 1.0).asin();
    let level = of_slope(settings.soil, 0.0);
    let steep = of_slope(settings.soil, grade_rad) - level;
    let along = level + if grade_rad < 0.0 { -steep } else { steep };
    let across = gravity.y * direction[0] - gravity.x * direction[1];
    let sine = if downhill > 0.0 { across / downhill } else { 0.0 };
    let slope_rad = downhill.clamp(0.0, 1.0).asin();
    let aside = ASIDE * of_slope(settings.soil, slope_rad) * sine;
    Slip { along: settings.slip_scale * along, aside: settings.slip_scale * aside }
}

impl Slip {
    /// The true motion (rover frame x and y, m) of wheels that advance by `wheels_m` along a unit direction.
    pub(crate) fn true_from_wheels(&self, direction: [f64; 2], wheels_m: f64) -> [f64; 2] {
        let (along_m, aside_m) = ((1.0 - self.along) * wheels_m, self.aside * wheels_m.abs());
        let [x, y] = direction;
        [x * along_m - y * aside_m, y * along_m + x * aside_m]
    }

    /// The wheel advance (rover frame x and y, m) for a true motion of `true_m` along a unit direction. Compensates
    /// lateral slip. `None` if slip makes the motion unreachable.
    pub(crate) fn wheels_from_true(&self, direction: [f64; 2], true_m: f64) -> Option<[f64; 2]> {
        let kept = 1.0 - self.along;
        if kept < LEAST_ADVANCE {
            return None;
        }
        let wheels_m = true_m / kept;
        let against_m = -self.aside * wheels_m.abs();
        let [x, y] = direction;
        Some([x * wheels_m - y * against_m, y * wheels_m + x * against_m])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::frames::attitude_from_roll_pitch_yaw;

    fn sand() -> RoverSettings {
        RoverSettings { soil: Soil::LooseSand, slip_scale: 1.0, ..RoverSettings::default() }
    }

    #[test]
    fn the_table_is_met_at_its_angles_and_halfway_between() {
        for (soil, slope_deg, slip) in [
            (Soil::LooseSand, 15.0, 0.45),
            (Soil::LooseSand, 17.5, 0.65),
            (Soil::FirmSoil, 25.0, 0.55),
            (Soil::FirmSoil, 2.5, 0.02),
            (Soil::Bedrock, 0.0, 0.0),
            (Soil::Bedrock, 60.0, 0.08),
        ] {
            assert!(
                (of_slope(soil, f64::to_radians(slope_deg)) - slip).abs() < 1e-12,
                "{soil:?} {slope_deg}"
            );
        }
    }

    #[test]
    fn uphill_loses_downhill_gains_and_across_slides_downhill() {
        // Nose up by 15°: forward is uphill.
        let attitude = attitude_from_roll_pitch_yaw(0.0, 15f64.to_radians(), 0.4);
        let up = on_slope(&sand(), &attitude, [1.0, 0.0]);
        assert!((up.along - 0.45).abs() < 1e-9 && up.aside.abs() < 1e-12, "{up:?}");
        let down = on_slope(&sand(), &attitude, [-1.0, 0.0]);
        assert!((down.along - (0.02 - 0.43)).abs() < 1e-9, "{down:?}");
        // Right side down by 15°: forward follows the contour and slides to the right, backwards too.
        let attitude = attitude_from_roll_pitch_yaw(15f64.to_radians(), 0.0, -1.0);
        let along = on_slope(&sand(), &attitude, [1.0, 0.0]);
        assert!((along.aside - 0.27).abs() < 1e-9 && (along.along - 0.02).abs() < 1e-9, "{along:?}");
        assert!(along.true_from_wheels([1.0, 0.0], 1.0)[1] > 0.26);
        assert!(on_slope(&sand(), &attitude, [-1.0, 0.0]).true_from_wheels([-1.0, 0.0], 1.0)[1] > 0.26);
    }

    #[test]
    fn wheels_steer_against_the_slide_and_turn_more_than_the_rover_moves() {
        let slip = Slip { along: 0.2, aside: 0.1 };
        let wheels = slip.wheels_from_true([1.0, 0.0], 0.8).unwrap();
        assert!((wheels[0] - 1.0).abs() < 1e-12 && (wheels[1] + 0.1).abs() < 1e-12, "{wheels:?}");
        assert_eq!(Slip { along: 1.1, aside: 0.0 }.wheels_from_true([1.0, 0.0], 0.8), None);
    }
}
