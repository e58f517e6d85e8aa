//! What the shape tracker's part of a run was worth (R213, R215).
//!
//! ```text
//! drift          │ x_features − T_true x_0 │            what following the features added, at the last stop of the mast's pair
//! tracker        │ x_features − x_true │                 the whole error there, the designation's own range error included
//! first view     │ x_registered − x_true │               the same after the registration to the first view
//! hand-off       │ x_handed − T_true x_before │          what the transfer to the other pair added
//! ```
//! All in the rover frame of their stop, m. *Tracker accuracy* and *hand-off accuracy* are the paper's words; it measured
//! them against the 3-D models of the pair in use, here the simulator's truth stands for those.
//!
//! Source: D§4, R209–R215.

use serde::{Deserialize, Serialize};

use sightline_geometry::frames::Point3;
use sightline_session::step::RunStep;
use sightline_world::target_truth::TruthSource;

/// The errors of one run, m; null where a step was not reached.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandOver {
    /// What following the features added.
    pub drift_m: Option<f64>,
    /// The whole error by features.
    pub tracker_m: Option<f64>,
    /// At the registration to the first view.
    pub first_view: Option<Transfer>,
    /// At the hand-off.
    pub hand_off: Option<Transfer>,
}

/// One registration against the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transfer {
    /// How far off it started, m.
    pub start_error_m: f64,
    /// How far off it ended, m; null where it was not used.
    pub error_m: Option<f64>,
    /// Squared Mahalanobis distance of that error.
    pub nees: Option<f64>,
    /// Largest 1σ axis of the target afterwards, m.
    pub sigma_m: Option<f64>,
    /// 1σ by the registration alone along the axes of its ellipsoid, m, largest first: how observable the rock was.
    pub sigmas_m: Option<[f64; 3]>,
    /// Half the width of the recognised surface, m.
    pub half_width_m: f64,
    /// Why it was not used.
    pub failure: Option<String>,
}

impl HandOver {
    /// Adds what a step after the designation tells; `before` is the step before it, `first` the designation.
    pub fn add<T: TruthSource + ?Sized>(
        &mut self,
        source: &T,
        [first, before, trace]: [&RunStep; 3],
    ) -> Option<()> {
        let evidence = trace.shape()?;
        let registration = evidence.registration.as_ref()?;
        let truth = trace.truth.as_ref()?.position_in_rover;
        let carried = |from: &RunStep| -> Option<Point3> {
            let site = source.true_site_from_rover(from.step)? * from.update.target.position_in_rover;
            Some(source.true_site_from_rover(trace.step)?.inverse() * site)
        };
        let expected = if registration.is_hand_off { carried(before)? } else { truth };
        let covariance = trace.update.target.covariance_in_rover;
        let accepted = trace.verdict().is_some_and(|verdict| verdict.accepted);
        let is_used = accepted && registration.failure.is_none();
        let error = trace.update.target.position_in_rover - expected;
        // The hand-off starts from an error of its own, which its covariance holds as well.
        let whole = trace.update.target.position_in_rover - truth;
        let transfer = Transfer {
            start_error_m: (Point3::from(registration.start_in_rover) - truth).norm(),
            error_m: is_used.then(|| error.norm()),
            nees: covariance.try_inverse().filter(|_| is_used).map(|inverse| whole.dot(&(inverse * whole))),
            sigma_m: is_used.then(|| covariance.symmetric_eigenvalues().max().max(0.0).sqrt()),
            sigmas_m: registration.sigmas_m,
            half_width_m: registration.half_width_m,
            failure: registration.reason.clone(),
        };
        if registration.is_hand_off {
            self.hand_off = Some(transfer);
        } else {
            self.tracker_m = Some(transfer.start_error_m);
            self.drift_m =
                carried(first).map(|from| (Point3::from(registration.start_in_rover) - from).norm());
            self.first_view = Some(transfer);
        }
        Some(())
    }
}
