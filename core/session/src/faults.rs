//! Faults that a person injects into a drive (R208): as they are asked for, and as the world has them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::error::{Error, Result};
use sightline_track::target::Designation;
use sightline_world::scenario::{Fault, FaultKind};
use sightline_world::target_truth::{TargetTruth, TruthSource};

/// A fault to be injected into a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewFault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// The first stop at which it does; later than the one from which is driven.
    pub from_stop: u32,
    /// The last stop at which it does.
    pub to_stop: u32,
    /// The number of the target that it concerns; left out: the one that is driven to first. Of no effect for a fault that concerns
    /// no single target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<usize>,
}

/// The faults as the world has them: each with the true position of the target that it concerns, `driver` by default.
///
/// # Errors
/// [`Error::Setting`] for a target that does not exist.
pub fn placed(
    source: &dyn TruthSource,
    faults: &[NewFault],
    designation: impl Fn(usize) -> Option<Designation>,
    driver: usize,
) -> Result<Vec<Fault>> {
    let placed = |(index, fault): (usize, &NewFault)| {
        let NewFault { kind, from_stop, to_stop, target } = *fault;
        let number = target.unwrap_or(driver);
        let missing =
            || Error::setting(format!("faults[{index}].target"), format!("there is no target {number}"));
        let target = designation(number).ok_or_else(missing)?;
        let truth = TargetTruth::new(source, target, None).filter(|_| kind.is_of_target());
        let target_m = truth.map(|truth| truth.position_in_site().into());
        Ok(Fault { kind, from_stop, to_stop, target_m })
    };
    faults.iter().enumerate().map(placed).collect()
}
