//! Comparison of runs over HTTP, and the metrics of a run.

use serde_json::{Value, json};
use sightline_tests::server::{TestServer, small_drive};

/// A session with a complete run and a fork of it from step 3 that requires a perfect match.
async fn forked(server: &TestServer) -> String {
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let new = json!({ "run": 0, "from_step": 3, "settings": { "ncc_min": 0.9999 } });
    server.post(&format!("sessions/{session}/targets/0/runs"), &new).await.expect(202);
    server.ended(&session, 0, 1).await;
    session
}

fn runs(numbers: &[usize]) -> Value {
    json!(numbers.iter().map(|run| json!({ "target": 0, "run": run })).collect::<Vec<_>>())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_comparison_finds_first_divergence_and_changed_setting() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = forked(&server).await;
    let before = server.get(&format!("sessions/{session}")).await;
    let path = format!("sessions/{session}/compare");
    let found = server.post(&path, &json!({ "runs": runs(&[0, 1]) })).await.expect(200);
    let first = &found["first"][0];
    assert_eq!(
        first["sentence"],
        json!("first differ at step 3 in judge: gates ncc limit 0.7000 and 0.9999")
    );
    assert_eq!((&first["divergence"]["step"], &first["divergence"]["stage"]), (&json!(3), &json!("judge")));
    let setting = json!({ "key": "ncc_min", "group": "limits", "unit": "", "values": [0.7, 0.9999] });
    assert_eq!(found["settings"], json!([setting]));
    let columns = found["columns"].as_array().unwrap();
    let limit = columns.iter().find(|column| column["name"] == "gates.ncc.limit").unwrap();
    assert_eq!(limit["deltas"][1].as_array().unwrap()[..3], [json!(null), json!(0.0), json!(0.0)]);
    assert!((limit["deltas"][1][3].as_f64().unwrap() - 0.2999).abs() < 1e-12);
    assert_eq!(found["words"][0]["values"][1][3], json!("lost"));
    assert_eq!(server.get(&format!("sessions/{session}")).await.bytes, before.bytes, "nothing was changed");
    let alike = json!({ "runs": runs(&[0, 1]), "align": "distance", "columns": [], "tolerance": { "1": 1.0, "px": 1e9,
        "px2": 1e9, "m": 1e9, "m2": 1e9, "rad": 9.0, "deg": 999.0, "s": 1e9 } });
    let found = server.post(&path, &alike).await.expect(200);
    assert_eq!((&found["columns"], &found["align"]), (&json!([]), &json!("distance")));
    let values = &found["first"][0]["divergence"]["values"][0];
    assert!(
        values["a"].is_string() || values["a"].is_boolean() || values["a"].is_null(),
        "only words differ: {values}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_comparisons_are_rejected_with_the_field() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = forked(&server).await;
    let path = format!("sessions/{session}/compare");
    for (body, code, words) in [
        (json!({ "runs": runs(&[0]) }), "request", "two to 4 runs"),
        (json!({ "runs": runs(&[0, 1, 2, 3, 4]) }), "request", "not 5"),
        (json!({ "runs": runs(&[0, 0]) }), "request", "named twice"),
        (json!({ "runs": runs(&[0, 7]) }), "request", "target 0 has no run 7"),
        (json!({ "runs": [{ "target": 3, "run": 0 }, { "target": 0, "run": 0 }] }), "request", "no target 3"),
        (json!({ "runs": runs(&[0, 1]), "align": "colour" }), "field", "align"),
        (json!({ "runs": runs(&[0, 1]), "tolerance": { "mm": 1.0 } }), "request", "the units are px2"),
        (json!({ "runs": runs(&[0, 1]), "tolerance": { "m": -1.0 } }), "request", "from 0 on"),
        (json!({ "runs": runs(&[0, 1]), "columns": ["nonsense"] }), "request", "no column nonsense"),
        (json!({ "runs": runs(&[0, 1]), "colour": 1 }), "field", "colour"),
        (json!({}), "field", "runs"),
    ] {
        let sentence = server.post(&path, &body).await.problem(422, code);
        assert!(sentence.contains(words), "{body}: {sentence}");
    }
    server.post("sessions/s999/compare", &json!({ "runs": runs(&[0, 1]) })).await.problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_name_their_protocol_and_their_worst_steps() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = forked(&server).await;
    let metrics = |run: usize| format!("sessions/{session}/targets/0/runs/{run}/metrics");
    let found = server.get(&metrics(0)).await.expect(200);
    assert_eq!(
        (&found["version"], &found["steps"], &found["truth"]),
        (&json!(1), &json!(5), &json!("surface"))
    );
    let of = |found: &Value, name: &str| {
        let metrics = found["metrics"].as_array().unwrap();
        metrics.iter().find(|metric| metric["name"] == name).unwrap().clone()
    };
    let view = server.ended(&session, 0, 0).await;
    let errors: Vec<f64> =
        view["rows"].as_array().unwrap()[1..].iter().filter_map(|row| row["err_px"].as_f64()).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!((of(&found, "ade_px")["value"].as_f64().unwrap() - mean).abs() < 1e-12);
    assert!(found["uncertainty"]["sentence"].as_str().unwrap().contains("for 4 steps"), "{found}");
    let forked = server.get(&metrics(1)).await.expect(200);
    assert_eq!(
        (&of(&forked, "survival_steps")["value"], &of(&forked, "survival_steps")["worst_step"]),
        (&json!(2.0), &json!(3))
    );
    assert!(server.get(&metrics(9)).await.problem(404, "not_found").contains("no run 9"));
}

#[test]
fn the_page_about_comparing_defines_every_metric_by_its_name() {
    let page = include_str!("../../docs/compare.md");
    let named: Vec<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`').map(|(name, _)| name))
        .collect();
    assert_eq!(named, sightline_session::metrics::NAMES);
}
