//! Errors of the shape tracker in a run (R213, R215).
//!
//! ```text
//! drift          │ x_features − T_true x_0 │            added by feature tracking, at the last stop of the mast's pair
//! tracker        │ x_features − x_true │                 total error there, with the designation's range error
//! first view     │ x_registered − x_true │               the same after the registration to the first view
//! hand-off       │ x_handed − T_true x_before │          added by the transfer to the other pair
//! ```
//! All in the rover frame of their stop, m. *Tracker accuracy* and *hand-off accuracy* are the paper's terms; it
//! measured them against the 3-D models of the current pair, replaced here by the simulator's truth.
//!
//! Source: D§4, R209–R215.

use serde::{Deserialize, Serialize};

use sightline_geometry::frames::Point3;
use sightline_session::step::RunStep;
use sightline_world::target_truth::TruthSource;

/// Errors of one run, m; null if a step was not reached.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandOver {
    /// Error added by feature tracking.
    pub drift_m: Option<f64>,
    /// Total error of feature tracking.
    pub tracker_m: Option<f64>,
    /// Registration to the first view.
    pub first_view: Option<Transfer>,
    /// Registration at the hand-off.
    pub hand_off: Option<Transfer>,
}

/// One registration compared with the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transfer {
    /// Error of the start, m.
    pub start_error_m: f64,
    /// Error of the result, m; null if it was rejected.
    pub error_m: Option<f64>,
    /// Squared Mahalanobis distance of the total error; null if the result was rejected.
    pub nees: Option<f64>,
    /// Largest 1σ axis of the target afterwards, m; null if the result was rejected.
    pub sigma_m: Option<f64>,
    /// 1σ of the registration alone along the axes of its ellipsoid, m, largest first: the observability of the rock.
    pub sigmas_m: Option<[f64; 3]>,
    /// Half the width of the registered surface, m.
    pub half_width_m: f64,
    /// Reason of the rejection.
    pub failure: Option<String>,
}

impl HandOver {
    /// Adds a step after the designation: `first` is the designation, `before` the step before `trace`.
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
        // The hand-off starts with an error of its own, which its covariance includes: NEES uses the total error.
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
