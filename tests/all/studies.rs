//! Studies: a small part of one through the command line, stopped and resumed, and the same as a job over REST.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use serde_json::{Value, json};
use sightline_server::study::{Order, Progress, Seeds, carry_out};
use sightline_study::plan::Plan;
use sightline_tests::scenario::short_approach;
use sightline_tests::server::{TestServer, small_drive};
use sightline_world::Scenario;
use sightline_world::scenario::Arrangement;

use crate::cli::program;

/// A world small enough for a test: five stops of 512 pixels, three targets.
fn small() -> Scenario {
    let mut scenario = short_approach();
    scenario.drive.end_distance_m = 4.0;
    scenario.camera.samples_per_axis = 1;
    scenario.targets.count = 3;
    scenario
}

fn study(arguments: &[&str], scenario: &Path, out: &Path) -> Output {
    Command::new(program())
        .args(["study", "approach", "--scenario"])
        .arg(scenario)
        .arg("--out")
        .arg(out)
        .args(arguments)
        .output()
        .unwrap()
}

fn rows(output: &Output) -> Vec<Value> {
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document.as_object().unwrap().len(), 1, "rows alone");
    document["rows"].as_array().unwrap().clone()
}

#[test]
fn a_stopped_study_resumes_and_prints_only_its_rows() {
    let home = tempfile::tempdir().unwrap();
    let (scenario, out) = (home.path().join("small.toml"), home.path().join("out"));
    std::fs::write(&scenario, small().to_toml()).unwrap();
    let json = ["--seeds", "3", "--format", "json"];
    let one = [&json[..], &["--configurations", "sightline"]].concat();
    let first = rows(&study(&one, &scenario, &out));
    assert_eq!(
        (first.len(), &first[0]["configuration"], &first[0]["seed"]),
        (1, &json!("sightline"), &json!(3))
    );
    assert_eq!((&first[0]["targets"], &first[0]["tracked"]), (&json!(3), &json!(3)), "{first:?}");
    assert!(first[0]["err_m_median"].as_f64().unwrap() < 0.03, "{first:?}");

    // A kill while the second line is written: that line is dropped, the first is valid.
    let results = out.join("approach/results.jsonl");
    let kept = std::fs::read_to_string(&results).unwrap();
    std::fs::write(&results, format!("{kept}{}", &kept[..kept.len() / 2])).unwrap();
    let two = [&json[..], &["--configurations", "sightline,ncc+ncc_min=0.6"]].concat();
    let again = study(&two, &scenario, &out);
    let complaint = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(
        complaint.contains("line 2") && complaint.contains("2 units, 1 of them found now"),
        "{complaint}"
    );
    let second = rows(&again);
    assert_eq!((second.len(), &second[0]), (2, &first[0]));
    assert!(std::fs::read_to_string(&results).unwrap().starts_with(&kept));
    assert_eq!(std::fs::read_to_string(&results).unwrap().lines().count(), 2);

    let report = std::fs::read_to_string(out.join("approach/report.html")).unwrap();
    assert!(report.contains("<svg") && report.contains("ncc+ncc_min=0.6") && !report.contains("src="));
    assert_eq!(std::fs::read_to_string(out.join("approach/rows.csv")).unwrap().lines().count(), 3);
    assert_eq!(std::fs::read_to_string(out.join("approach/runs.csv")).unwrap().lines().count(), 7);
    assert_eq!(&std::fs::read(out.join("approach/rows.parquet")).unwrap()[..4], b"PAR1");
}

#[test]
fn a_world_with_one_central_target_counts() {
    let home = tempfile::tempdir().unwrap();
    let (scenario, out) = (home.path().join("centre.toml"), home.path().join("out"));
    let mut centre = small();
    centre.targets.count = 20;
    centre.targets.arrangement = Arrangement::Centre;
    std::fs::write(&scenario, centre.to_toml()).unwrap();
    let arguments =
        ["--worlds", "1", "--first-seed", "3", "--format", "json", "--configurations", "sightline"];
    let rows = rows(&study(&arguments, &scenario, &out));
    assert_eq!((rows.len(), &rows[0]["seed"], &rows[0]["targets"]), (1, &json!(3), &json!(1)), "{rows:?}");
}

#[test]
fn a_study_that_cannot_be_is_refused_before_anything_is_made() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    for (arguments, culprit) in [
        (&["study", "straight", "--configurations", "best"][..], "ncc-scale"),
        (&["study", "straight", "--configurations", "ncc+ncc_mim=1"], "ncc_min"),
        (&["study", "straight", "--grid", "29"], "0 to 28"),
        (&["study", "faults", "--scenario", "approach-10"], "several scenarios"),
    ] {
        let output = Command::new(program()).args(arguments).arg("--out").arg(&out).output().unwrap();
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{arguments:?}: {complaint}");
        assert_eq!((complaint.trim().lines().count(), complaint.contains(culprit)), (1, true), "{complaint}");
        assert!(output.stdout.is_empty() && !out.exists(), "{arguments:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_study_over_rest_is_carried_out_cancelled_and_resumed() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let listed = server.get("studies").await.expect(200);
    assert!(listed.as_array().unwrap().iter().any(|study| study["name"] == json!("straight")));
    let wrong = json!({ "study": "approach", "configurations": ["best"] });
    assert!(server.post("studies/jobs", &wrong).await.problem(422, "setting").contains("ncc-scale"));
    let many = json!({ "study": "approach", "worlds": 101 });
    assert!(server.post("studies/jobs", &many).await.problem(422, "field").contains("100"));
    server.get("studies/jobs/study-1").await.problem(404, "not_found");

    let new =
        json!({ "study": "approach", "seeds": [3], "configurations": ["sightline"], "scenario": small() });
    let job = server.post("studies/jobs", &new).await.expect(202);
    assert_eq!(job["id"], json!("study-1"));
    server.get("studies/jobs/study-1/report.html").await.problem(409, "conflict");
    server.post("studies/jobs/study-1/cancel", &json!({})).await.expect(200);
    assert_eq!(ended(&server).await["state"], json!("cancelled"));
    server.post("studies/jobs/study-1/resume", &json!({})).await.expect(202);
    let done = ended(&server).await;
    assert_eq!((&done["state"], &done["k"], &done["n"]), (&json!("done"), &json!(1), &json!(1)), "{done}");
    let rows = server.get("studies/jobs/study-1/rows").await.expect(200);
    assert_eq!(rows["rows"][0]["tracked"], json!(3), "{rows}");
    let report = server.get("studies/jobs/study-1/report.html").await;
    assert!(report.text().contains("<svg"));
    let policy = report.headers["content-security-policy"].to_str().unwrap();
    assert!(policy.contains("default-src 'none'") && policy.contains("sandbox"), "{policy}");
    server.post("studies/jobs/study-1/cancel", &json!({})).await.problem(409, "conflict");

    let second = server.post("studies/jobs", &new).await.expect(202);
    assert_eq!(second["id"], json!("study-2"));
    let (report, rows) = (report.text(), server.get("studies/jobs/study-1/rows").await);
    drop(server);
    let server = TestServer::open(drive.path(), folder.path());
    let listed = server.get("studies/jobs").await.expect(200);
    assert_eq!((&listed[0], listed.as_array().unwrap().len()), (&done, 2), "the list outlives the server");
    assert_eq!(server.get("studies/jobs/study-1/report.html").await.text(), report);
    assert_eq!(server.get("studies/jobs/study-1/rows").await.json(), rows.json());
    let state = listed[1]["state"].as_str().unwrap();
    assert!(["cancelled", "done"].contains(&state), "nothing is under way that nobody works on: {state}");
}

#[test]
fn the_share_of_a_study_grows_while_its_world_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let order = Order {
        plan: Plan::new("approach", &["sightline".to_owned()], &[]).unwrap(),
        seeds: Seeds::Named(vec![3]),
        scenario: Some(("small".to_owned(), small())),
        folder: folder.path().to_owned(),
        command: String::new(),
    };
    let shares = Mutex::new(Vec::new());
    let tell = |progress: Progress| {
        if let Progress::Rendering { share, .. } = progress {
            shares.lock().unwrap().push(share);
        }
    };
    carry_out(order, &AtomicBool::new(false), &tell).unwrap();
    let shares = shares.into_inner().unwrap();
    assert!(shares.len() > 1 && shares.is_sorted_by(|a, b| a < b), "{shares:?}");
}

/// Waits until the first study has ended, and returns its view.
async fn ended(server: &TestServer) -> Value {
    for _ in 0..2400 {
        let job = server.get("studies/jobs/study-1").await.expect(200);
        if !["waiting", "running"].contains(&job["state"].as_str().unwrap()) {
            return job;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    panic!("the study does not end");
}
