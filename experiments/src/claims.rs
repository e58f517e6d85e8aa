//! Whether the covariance of tracked targets says how far off they are, in worlds with pointing error.
//!
//! Each world is one of the study `claim`: distance, direction, heading and light are drawn by the seed, and each mast angle
//! has an error (`sightline_study::randomised`). All targets that the scenario's rule chooses are tracked to the last stop.
//! There the NEES of the tracked ones is compared with its 3 degrees of freedom, with the pointing error in the covariance
//! and without it. Targets of one world share the errors of its last stop, so that worlds are the independent sample.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | eᵀ P⁻¹ e / 3 | `nees_per_dof`: mean over the tracked targets of a world; 1 where P is right | – |
//!
//! Sources: papers.md R116, R127; `core/study/src/calibration.rs` (NEES).

use std::path::Path;

use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::Serialize;

use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_recordings::{Traverse, create_simulated};
use sightline_session::step::RunStep;
use sightline_session::track::{self, NextStep};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{Scenario, choose_targets};

/// Degrees of freedom of a position.
const DEGREES_OF_FREEDOM: f64 = 3.0;

/// The targets of one world.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WorldClaim {
    /// The world's seed.
    pub seed: u64,
    /// Targets that the rule chooses.
    pub targets: usize,
    /// Targets that were tracked at the last stop (R116).
    pub tracked: usize,
    /// Mean NEES per degree of freedom of the tracked ones; `None` without any.
    pub nees_per_dof: Option<f64>,
    /// The same with the covariance that takes the mast angles as exact.
    pub nees_per_dof_angles_exact: Option<f64>,
    /// Root mean square error of the tracked ones, m.
    pub rms_error_m: Option<f64>,
    /// Why the world has no drive, so that its targets are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// The worlds together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Claims {
    /// Worlds without a drive, which are left out.
    pub without_drive: usize,
    /// Targets in all worlds.
    pub targets: usize,
    /// Targets that were tracked at the last stop.
    pub tracked: usize,
    /// Mean over worlds of `nees_per_dof`, its standard deviation between worlds, the least and the largest.
    pub nees_per_dof: [f64; 4],
    /// The same of `nees_per_dof_angles_exact`.
    pub nees_per_dof_angles_exact: [f64; 4],
}

/// The end of one target.
struct End {
    is_tracked: bool,
    nees: f64,
    nees_angles_exact: f64,
    error_m: f64,
}

/// Tracks all targets of a world; its images are below `folder`.
///
/// # Errors
/// Images that cannot be written, or a stage that fails.
pub(crate) fn world_claim(scenario: &Scenario, settings: &Settings, folder: &Path) -> Result<WorldClaim> {
    let traverse = match create_simulated(scenario, folder) {
        // The scenario is valid: the rover cannot drive it in this world.
        Err(error @ Error::Setting { .. }) => {
            let problem = Some(error.to_string());
            return Ok(WorldClaim { seed: scenario.seed, problem, ..WorldClaim::default() });
        }
        traverse => traverse?,
    };
    let world = traverse.world().ok_or_else(|| Error::Request("the drive is not simulated".to_owned()))?;
    let pixels = choose_targets(world, scenario, traverse.index());
    let ends: Vec<Option<End>> =
        pixels.par_iter().map(|pixel| end_of(&traverse, *pixel, settings)).collect::<Result<_>>()?;
    let tracked: Vec<&End> = ends.iter().flatten().filter(|end| end.is_tracked).collect();
    let mean = |of: &dyn Fn(&End) -> f64| {
        let sum: f64 = tracked.iter().map(|end| of(end)).sum();
        (!tracked.is_empty()).then(|| sum / tracked.len() as f64)
    };
    Ok(WorldClaim {
        seed: scenario.seed,
        targets: pixels.len(),
        tracked: tracked.len(),
        nees_per_dof: mean(&|end| end.nees / DEGREES_OF_FREEDOM),
        nees_per_dof_angles_exact: mean(&|end| end.nees_angles_exact / DEGREES_OF_FREEDOM),
        rms_error_m: mean(&|end| end.error_m * end.error_m).map(f64::sqrt),
        problem: None,
    })
}

/// Tracks one target to the last stop; `None` if it was refused.
fn end_of(traverse: &Traverse, pixel: Pixel, settings: &Settings) -> Result<Option<End>> {
    let Ok(first) = track::designate(traverse, Designation::new(0, pixel), settings) else {
        return Ok(None);
    };
    let mut last = first.clone();
    while last.step + 1 < traverse.stop_count() {
        let next = NextStep {
            first: &first,
            last: &last,
            settings,
            prediction_px: None,
            before: None,
            ended: None,
            cancel: Default::default(),
        };
        last = next.compute(traverse)?;
    }
    Ok(end(&last))
}

fn end(last: &RunStep) -> Option<End> {
    let truth = last.truth.as_ref()?;
    let exact = last.located().and_then(|located| located.covariance_in_rover);
    let error = last.update.target.position_in_rover - truth.position_in_rover;
    let nees_angles_exact = exact.and_then(Matrix3::try_inverse);
    Some(End {
        is_tracked: truth.tracked == Some(true),
        nees: truth.nees.unwrap_or(f64::NAN),
        nees_angles_exact: nees_angles_exact.map_or(f64::NAN, |inverse| error.dot(&(inverse * error))),
        error_m: truth.err_m,
    })
}

/// Sums up worlds.
pub fn claims(worlds: &[WorldClaim]) -> Claims {
    let spread = |of: fn(&WorldClaim) -> Option<f64>| {
        let values: Vec<f64> = worlds.iter().filter_map(of).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        [mean, variance.sqrt(), least, values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    };
    Claims {
        without_drive: worlds.iter().filter(|world| world.problem.is_some()).count(),
        targets: worlds.iter().map(|world| world.targets).sum(),
        tracked: worlds.iter().map(|world| world.tracked).sum(),
        nees_per_dof: spread(|world| world.nees_per_dof),
        nees_per_dof_angles_exact: spread(|world| world.nees_per_dof_angles_exact),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worlds_count_alike_however_many_targets_they_have() {
        let world = |targets: usize, nees_per_dof: Option<f64>| WorldClaim {
            seed: 1,
            targets,
            tracked: targets / 2,
            nees_per_dof,
            nees_per_dof_angles_exact: nees_per_dof.map(|nees| 2.0 * nees),
            ..WorldClaim::default()
        };
        let impossible = WorldClaim { problem: Some("no drive".to_owned()), ..WorldClaim::default() };
        let summed = claims(&[world(20, Some(0.5)), world(4, Some(1.5)), world(0, None), impossible]);
        assert_eq!((summed.targets, summed.tracked, summed.without_drive), (24, 12, 1));
        let [mean, spread, least, most] = summed.nees_per_dof;
        assert!((mean - 1.0).abs() < 1e-12 && (spread - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!((least, most, summed.nees_per_dof_angles_exact[0]), (0.5, 1.5, 2.0));
    }
}
