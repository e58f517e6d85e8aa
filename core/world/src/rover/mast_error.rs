//! True mast angles for commanded ones.
//!
//! ```text
//! true = play(told) + offset + noise
//! play: q_i = clamp(q_{i−1}, told_i − B/2, told_i + B/2), from q = 0 on before the first stop
//! ```
//!
//! The backlash (play) of a gear leaves the head at rest until the drive has moved beyond it: after turning to the right
//! it lags by half the play, after turning to the left it leads by as much. The tracker is given the commanded angles;
//! only the renderer uses the true ones.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | B | `drive.mast_backlash_deg` | rad here |
//! | q | the head's angle | rad |
//!
//! Frame: azimuth and elevation of the mast in the rover frame. Source: domain.md 4.2, 4.5.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::ground::texture::mix;
use crate::scenario::{DriveSettings, Scenario};
use sightline_geometry::camera::MastAngles;

/// The head's angles before the first stop.
const AHEAD: MastAngles = MastAngles { azimuth_rad: 0.0, elevation_rad: 0.0 };
/// Added to the index of a stop to seed the random error of an additional look.
const LOOK: usize = 1 << 20;

/// Whether the true mast angles differ from the measured ones.
pub(crate) fn is_present(drive: &DriveSettings) -> bool {
    drive.pointing_error_deg > 0.0 || drive.mast_backlash_deg > 0.0 || drive.mast_offset_deg != [0.0; 2]
}

/// The true mast angles for the commands `told`, in order, starting from straight ahead.
pub(crate) fn true_angles(told: &[MastAngles], scenario: &Scenario) -> Vec<MastAngles> {
    let mut head = AHEAD;
    told.iter()
        .enumerate()
        .map(|(stop, told)| {
            head = turned(head, *told, &scenario.drive);
            with_noise(head, scenario, stop)
        })
        .collect()
}

/// The head's angles after a command, without offset and noise.
fn turned(head: MastAngles, told: MastAngles, drive: &DriveSettings) -> MastAngles {
    let half_play_rad = 0.5 * drive.mast_backlash_deg.to_radians();
    let follow =
        |head_rad: f64, told_rad: f64| head_rad.max(told_rad - half_play_rad).min(told_rad + half_play_rad);
    MastAngles {
        azimuth_rad: follow(head.azimuth_rad, told.azimuth_rad),
        elevation_rad: follow(head.elevation_rad, told.elevation_rad),
    }
}

/// The true angles for the additional pair of visual odometry at a stop: the mast turns to it from straight ahead.
pub(crate) fn true_angles_of_look(told: MastAngles, scenario: &Scenario, stop: usize) -> MastAngles {
    with_noise(turned(AHEAD, told, &scenario.drive), scenario, stop | LOOK)
}

/// The angles of the head with the offset and the random error of one stop.
fn with_noise(head: MastAngles, scenario: &Scenario, stop: usize) -> MastAngles {
    let [azimuth_rad, elevation_rad] = scenario.drive.mast_offset_deg.map(f64::to_radians);
    let sigma_rad = scenario.drive.pointing_error_deg.to_radians();
    let mut random = Pcg64::new(u128::from(mix(scenario.seed ^ mix(stop as u64 ^ 0x9a57))), 0x9a57_9a57);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    MastAngles {
        azimuth_rad: head.azimuth_rad + azimuth_rad + sigma_rad * normal(),
        elevation_rad: head.elevation_rad + elevation_rad + sigma_rad * normal(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_lags_by_half_the_play_and_rests_when_the_drive_turns_back() {
        let mut scenario = Scenario::default();
        scenario.drive.mast_backlash_deg = 0.2;
        scenario.drive.mast_offset_deg = [0.5, -0.3];
        let told = [10.0, 20.0, 19.9, 19.7, -5.0f64]
            .map(|deg| MastAngles { azimuth_rad: deg.to_radians(), elevation_rad: -deg.to_radians() });
        let expected_deg = [9.9, 19.9, 19.9, 19.8, -4.9];
        for (angles, deg) in true_angles(&told, &scenario).iter().zip(expected_deg) {
            assert!((angles.azimuth_rad.to_degrees() - (deg + 0.5)).abs() < 1e-9, "{angles:?}");
            assert!((angles.elevation_rad.to_degrees() - (-deg - 0.3)).abs() < 1e-9, "{angles:?}");
        }
    }

    #[test]
    fn a_further_look_has_an_error_of_its_own() {
        let mut scenario = Scenario::default();
        scenario.drive.pointing_error_deg = 0.1;
        let told = MastAngles { azimuth_rad: 0.3, elevation_rad: -0.4 };
        let looks: Vec<_> = (0..3).map(|stop| true_angles_of_look(told, &scenario, stop)).collect();
        let main = true_angles(&[told; 3], &scenario);
        for (k, look) in looks.iter().enumerate() {
            assert!((look.azimuth_rad - told.azimuth_rad).abs() < 5.0 * 0.1f64.to_radians(), "{look:?}");
            assert!(!main.contains(look) && !looks[..k].contains(look), "{look:?}");
        }
        assert_eq!(true_angles_of_look(told, &scenario, 1), looks[1]);
    }

    #[test]
    fn a_perfect_mast_looks_where_it_is_told() {
        let scenario = Scenario::default();
        let told = [MastAngles { azimuth_rad: 0.123, elevation_rad: -0.456 }];
        assert_eq!(true_angles(&told, &scenario), told);
        assert!(!is_present(&scenario.drive));
    }
}
