//! Columns of the hand-off in a study's table (R210–R215).
//!
//! `drift_m`, `tracker_error_m`, `first_view_error_m` and `hand_off_error_m` are medians over the row's targets (one in
//! each of the K9 rover's drives). They exclude rejected registrations, which are counted instead.

use std::collections::BTreeMap;

use serde_json::Value;

use super::hand_over::{HandOver, Transfer};
use super::run::Run;
use super::spread::spread;
use sightline_geometry::estimate::quantile::median;

/// Error above which a result counts as wrong, m.
const WRONG_M: f64 = 0.05;

/// Selects one of the two registrations of a run.
type TransferOf = fn(&HandOver) -> Option<&Transfer>;

/// Columns of the hand-offs of some runs; empty if none was tried.
pub(super) fn columns(runs: &[&Run]) -> BTreeMap<String, Value> {
    let mut columns = BTreeMap::new();
    let of = |value: &dyn Fn(&HandOver) -> Option<f64>| -> Vec<f64> {
        runs.iter().filter_map(|run| value(&run.hand_over)).collect()
    };
    if !runs.iter().any(|run| run.hand_over != HandOver::default()) {
        return columns;
    }
    columns.insert("drift_m".to_owned(), median(&of(&|run| run.drift_m)).into());
    columns.insert("tracker_error_m".to_owned(), median(&of(&|run| run.tracker_m)).into());
    let transfers: [(&str, TransferOf); 2] =
        [("first_view", |run| run.first_view.as_ref()), ("hand_off", |run| run.hand_off.as_ref())];
    for (name, transfer) in transfers {
        let values = |value: &dyn Fn(&Transfer) -> Option<f64>| of(&|run| transfer(run).and_then(value));
        let errors = values(&|transfer| transfer.error_m);
        columns.insert(format!("{name}_error_m"), median(&errors).into());
        spread(&mut columns, &format!("{name}_error_m"), &errors);
        let mut put =
            |what: &str, values: &[f64]| columns.insert(format!("{name}_{what}"), median(values).into());
        put("start_error_m", &values(&|transfer| Some(transfer.start_error_m)));
        put("sigma_m", &values(&|transfer| transfer.sigma_m));
        put("nees", &values(&|transfer| transfer.nees));
        put("half_width_m", &values(&|transfer| Some(transfer.half_width_m)));
        put("weakest_sigma_m", &values(&|transfer| Some(transfer.sigmas_m?[0])));
        let found = |far: bool| {
            let off = |t: &Transfer| t.error_m.filter(|error_m| (*error_m > WRONG_M) == far);
            values(&off).len()
        };
        let (right, wrong) = (found(false), found(true));
        columns.insert(format!("{name}_right"), right.into());
        columns.insert(format!("{name}_wrong"), wrong.into());
        let tried = runs.iter().filter_map(|run| transfer(&run.hand_over));
        let reasons: Vec<&String> = tried.clone().filter_map(|transfer| transfer.failure.as_ref()).collect();
        let count = tried.count();
        columns.insert(format!("{name}_tried"), count.into());
        columns.insert(format!("{name}_found_share"), (right as f64 / count.max(1) as f64).into());
        columns.insert(format!("{name}_failed"), reasons.len().into());
        if let Some(reason) = reasons.first() {
            columns.insert(format!("{name}_failure"), Value::from(reason.as_str()));
        }
    }
    columns
}
