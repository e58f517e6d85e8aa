//! Faults that a person injects into a drive (R208): the request, and its conversion to faults of the world.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::error::{Error, Result};
use sightline_track::target::Designation;
use sightline_world::scenario::{Fault, FaultKind};
use sightline_world::target_truth::{TargetTruth, TruthSource};

/// A fault to inject into a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewFault {
    /// The kind of fault.
    pub kind: FaultKind,
    /// The first stop of the fault; later than the stop from which the drive begins.
    pub from_stop: u32,
    /// The last stop of the fault.
    pub to_stop: u32,
    /// The number of the affected target; default: the first target of the drive. Without effect for a fault that concerns
    /// no single target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<usize>,
}

/// Converts the faults to faults of the world, with the true position of the affected target, `driver` by default.
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
