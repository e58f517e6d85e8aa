//! Counts and averages of runs with given verdicts.

use super::*;
use crate::point::Point;
use crate::run::Run;

fn run(group: &str, tracked: Option<bool>, state: &str, err_m: f64) -> Run {
    let mut run: Run = serde_json::from_value(serde_json::json!({
        "target": 0, "group": group, "pixel": {"x": 1.0, "y": 2.0}, "refused": null, "distance_m": null,
        "summary": sightline_session::summary::Summary::default(), "state": state, "end_pixel": null, "true_end_pixel": null,
        "drift_m": err_m, "err_range_m": null, "sigma_m": null, "nees": 3.0, "end": null,
        "end_is_false_loss": false, "fault_step": null, "at_fault": null, "false_after_fault": 0
    }))
    .unwrap();
    run.summary.run_tracked = tracked;
    run.summary.final_err_m = Some(err_m);
    run.summary.steps = 10;
    run
}

fn columns_of(runs: &[Run]) -> BTreeMap<String, Value> {
    columns(&runs.iter().collect::<Vec<_>>(), 1)
}

#[test]
fn tracked_false_and_refused_targets_are_counted_apart() {
    let mut refused = run("all", None, "", 0.0);
    (refused.refused, refused.state, refused.summary.final_err_m) = (Some("too far".to_owned()), None, None);
    let runs = [
        run("all", Some(true), "tracking", 0.01),
        run("all", Some(true), "tracking", 0.03),
        run("all", Some(false), "tracking", 0.5),
        run("all", Some(false), "failed", 0.4),
        run("all", None, "tracking", 0.2),
        refused,
    ];
    let columns = columns_of(&runs);
    let count = |name: &str| columns[name].as_u64().unwrap();
    assert_eq!(["targets", "tracked", "false_tracked", "unjudged", "refused"].map(count), [6, 2, 1, 1, 1]);
    assert_eq!((columns["err_m_n"].clone(), columns["err_all_m_n"].clone()), (2.into(), 5.into()));
    assert!((columns["err_m_median"].as_f64().unwrap() - 0.02).abs() < 1e-12);
    let rms = (0.0005_f64).sqrt();
    assert!((columns["err_m_rms"].as_f64().unwrap() - rms).abs() < 1e-12);
}

#[test]
fn a_boundary_target_stands_apart_from_the_others() {
    let runs = [run("all", Some(true), "tracking", 0.01), run(BOUNDARY, Some(false), "tracking", 0.4)];
    let columns = columns_of(&runs);
    assert_eq!((columns["targets"].clone(), columns["tracked_share"].clone()), (1.into(), 1.0.into()));
    assert_eq!(columns["boundary_false_tracked"], 1);
    let runs = [runs[0].clone(), run(PASSED, None, "lost", 0.4), run(BOUNDARY, Some(true), "tracking", 0.1)];
    let columns = columns_of(&runs);
    assert_eq!(
        ["targets", "passed_targets", "boundary_tracked"].map(|name| columns[name].as_u64()),
        [Some(1); 3]
    );
    // Without other targets they are counted as the point's own.
    assert_eq!(columns_of(&runs[1..])["targets"], 2);
}

#[test]
fn cases_of_a_fault_are_counted_at_its_step() {
    let mut runs = [run("all", Some(true), "tracking", 0.01), run("all", Some(false), "failed", 0.4)];
    for (run, at) in runs.iter_mut().zip([Fate::Tracked, Fate::Lost]) {
        (run.fault_step, run.at_fault) = (Some(5), Some(at));
    }
    let columns = columns_of(&runs);
    assert_eq!((columns["cases"].clone(), columns["fault_tracked"].clone()), (2.into(), 1.into()));
    assert_eq!((columns["failed"].clone(), columns["recovered"].clone()), (1.into(), 0.into()));
}

#[test]
fn a_row_is_flat_json() {
    let unit = Unit {
        key: "k".to_owned(),
        scenario: "approach-5".to_owned(),
        seed: 7,
        configuration: "ncc".to_owned(),
        point: Point::plain("approach-5", "n_skip", 4),
        odometry: None,
        runs: vec![run("all", Some(true), "tracking", 0.01)],
    };
    let rows = rows(Study::named("straight").unwrap(), &unit);
    let json = serde_json::to_value(&rows[0]).unwrap();
    assert_eq!(
        (json["configuration"].clone(), json["seed"].clone(), json["n_skip"].clone()),
        ("ncc".into(), 7.into(), 4.into())
    );
    assert!(json.as_object().unwrap().values().all(|value| !value.is_object() && !value.is_array()));
}
