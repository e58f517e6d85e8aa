//! Trackability over REST: the map in the background, a pixel, a refusal with an alternative; and the drive of a new user.

use std::time::{Duration, Instant};

use axum::http::StatusCode;
use serde_json::{Value, json};
use sightline_experiments::trackability::{Counts, Table, ground, measure};
use sightline_recordings::create_simulated;
use sightline_rover::trackability::{TrackabilityMap, Verdict};
use sightline_server::first_session;
use sightline_session::track;
use sightline_study::point::Visit;
use sightline_study::staged::Staged;
use sightline_tests::scenario::short_approach;
use sightline_tests::server::{TestServer, small_drive};
use sightline_track::settings::{Settings, parse_assignment};
use sightline_track::target::{Designation, TrackingState};
use sightline_world::{choose_targets, library};
use std::sync::atomic::AtomicBool;

/// A pixel of the sky in the first image of the small drive.
const SKY: [f64; 2] = [128.0, 20.0];

/// An approach with trackable pixels, which the small drive lacks.
fn approach() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    create_simulated(&short_approach(), folder.path()).unwrap();
    folder
}

/// Polls a map until it is complete.
async fn map_of(server: &TestServer, step: usize) -> Value {
    let path = format!("traverses/{}/steps/{step}/trackability", server.traverse);
    let begun = Instant::now();
    loop {
        let progress = server.get(&path).await.expect(200);
        if progress["ended"] == json!(true) {
            return progress;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "the map does not end: {}", progress["k"]);
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn the_nearest_good_pixel_of_a_map_can_be_designated() {
    let (drive, sessions) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), sessions.path());
    let mut events = server.state.events().subscribe();
    let progress = map_of(&server, 0).await;
    assert_eq!((&progress["k"], &progress["n"], &progress["failed"]), (&json!(32), &json!(32), &json!(null)));
    let map: TrackabilityMap = serde_json::from_value(progress["map"].clone()).unwrap();
    assert_eq!((map.columns, map.rows, map.verdicts.len(), map.ranges_m.len()), (32, 32, 1024, 1024));
    assert!(map.words.values().any(|word| word.contains("depth edge")));
    let told =
        std::iter::from_fn(|| events.try_recv().ok()).map(|event| serde_json::to_value(event).unwrap());
    let last = told.filter(|event| event["event"] == "trackability_progress").last().expect("an event");
    assert_eq!((&last["step"], &last["ended"]), (&json!(0), &json!(true)));
    // The sky has no range, and this is its reason.
    let sky = map.at(sightline_geometry::frames::Pixel::new(SKY[0], SKY[1])).unwrap();
    assert_eq!(sky.verdict, Verdict::Bad);
    // A stored map is returned immediately and is the same.
    assert_eq!(map_of(&server, 0).await, progress);
}

#[tokio::test]
async fn a_pixel_verdict_lists_gates_with_units_and_sources() {
    let (drive, sessions) = (approach(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), sessions.path());
    let path =
        |x: f64, y: f64| format!("traverses/{}/steps/0/trackability/pixel?x={x}&y={y}", server.traverse);
    let [x, y] = SKY;
    let bad = server.get(&path(x, y)).await.expect(200);
    assert_eq!(bad["verdict"], "bad", "{bad}");
    assert!(bad["reason"].as_str().unwrap().len() > 10);
    let good = &bad["nearest_good"];
    let (x, y) = (good["x"].as_f64().unwrap(), good["y"].as_f64().unwrap());
    let found = server.get(&path(x, y)).await.expect(200);
    assert_eq!(
        (&found["verdict"], &found["reason"], &found["nearest_good"]),
        (&json!("good"), &json!(null), &json!(null))
    );
    let range_m = found["range_m"].as_f64().unwrap();
    // The step length uses dense stereo, the range point stereo: they agree within 1 %.
    assert!(found["longest_step_m"].as_f64().unwrap() <= 0.101 * range_m, "{found}");
    for criterion in found["criteria"].as_array().unwrap() {
        assert!(criterion["source"].as_str().is_some_and(|source| !source.is_empty()), "{criterion}");
    }
    let outside = server.get(&path(-4.0, 900.0)).await.problem(422, "query");
    assert!(outside.contains("outside the left image"), "{outside}");
    let none = format!("traverses/{}/steps/99/trackability", server.traverse);
    assert!(server.get(&none).await.problem(404, "not_found").contains("no step 99"));
    let unknown = format!("traverses/{}/steps/0/trackability/pixel?x=1&y=2&z=3", server.traverse);
    assert_eq!(server.get(&unknown).await.status.as_u16(), 422);
}

#[tokio::test]
async fn a_rejected_pick_offers_the_nearest_good_pixel() {
    let (drive, sessions) = (approach(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), sessions.path());
    let session = server.begin().await;
    let path = format!("sessions/{session}/targets");
    let pick = |x: f64, y: f64| json!({ "step": 0, "pixel": { "x": x, "y": y } });
    let refused = server.post(&path, &pick(4.0, 256.0)).await;
    assert!(!refused.problem(422, "target").is_empty());
    let problem = refused.json();
    let (x, y) =
        (problem["nearest_pixel"]["x"].as_f64().unwrap(), problem["nearest_pixel"]["y"].as_f64().unwrap());
    assert!(problem["hint"].as_str().unwrap().contains("nearest good pixel"), "{problem}");
    server.post(&path, &pick(x, y)).await.expect(201);
    // For a pixel outside the image no nearest pixel is offered.
    let outside = server.post(&path, &pick(-40.0, 128.0)).await;
    outside.problem(422, "target");
    assert_eq!(outside.json().get("nearest_pixel"), None);
}

#[tokio::test]
async fn complete_maps_cannot_be_cancelled_and_failed_ones_explain() {
    let (drive, sessions) = (small_drive(), tempfile::tempdir().unwrap());
    for eye in ["left", "right"] {
        std::fs::write(drive.path().join(format!("images/{eye}_0002.png")), b"no picture").unwrap();
    }
    let server = TestServer::open(drive.path(), sessions.path());
    map_of(&server, 1).await;
    let cancel = |step: usize| format!("traverses/{}/steps/{step}/trackability/cancel", server.traverse);
    let nothing = server.post(&cancel(1), &json!({})).await;
    assert_eq!(
        nothing.status,
        StatusCode::NO_CONTENT,
        "a complete map cannot be given up, which is no problem"
    );
    let failed = map_of(&server, 2).await;
    assert!(failed["failed"].as_str().is_some_and(|why| why.contains("left_0002.png")), "{failed}");
}

#[tokio::test]
async fn a_map_in_progress_can_be_cancelled_and_requested_again() {
    let (drive, sessions) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), sessions.path());
    let path = format!("traverses/{}/steps/0/trackability", server.traverse);
    let begun = server.get(&path).await.expect(200);
    let cancelled = server.post(&format!("{path}/cancel"), &json!({})).await;
    // On a fast machine it may be complete already; then there is nothing to cancel.
    if begun["ended"] == json!(false) && cancelled.status.as_u16() == 200 {
        let progress = cancelled.json();
        assert_eq!((&progress["ended"], &progress["failed"]), (&json!(true), &json!("cancelled")));
    }
    assert_eq!(map_of(&server, 0).await["failed"], json!(null));
}

#[test]
fn a_wider_search_window_saves_the_first_drive() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = library::scenario(library::FIRST).unwrap();
    let traverse = create_simulated(&scenario, folder.path()).unwrap();
    // Every ninth stop, up to the one after the heading jump, which is at the third visited stop.
    let visit = Visit::Every(9);
    for stop in visit.stops(traverse.stop_count()).into_iter().take(4) {
        traverse.render_step(stop, &AtomicBool::new(false)).unwrap();
    }
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    let staged = Staged::new(&traverse, visit);
    let run = |changes: &[&str]| {
        let changes = changes.iter().map(|text| parse_assignment(text)).collect::<Result<_, _>>().unwrap();
        let settings = Settings::default().with(&changes).unwrap();
        let mut steps = vec![track::designate(&staged, Designation::new(0, pixel), &settings).unwrap()];
        for step in 0..3 {
            steps.push(track::advance(&staged, &steps[0], &steps[step], &settings));
        }
        steps
    };
    let lost = run(&[]);
    let states: Vec<TrackingState> = lost.iter().map(|step| step.update.state).collect();
    assert_eq!(states[..2], [TrackingState::Tracking; 2]);
    assert_eq!(states[2], TrackingState::Lost { count: 1 }, "{states:?}");
    for step in &run(&["search_window_px=201"]) {
        let truth = step.truth.as_ref().unwrap();
        let found = (step.update.state, truth.tracked);
        assert_eq!(found, (TrackingState::Tracking, Some(true)), "step {}", step.step);
    }
    // More retries alone do not find the target again: it is outside the search window.
    assert!(run(&["n_retry=50"])[3].update.state.is_lost());
}

#[tokio::test]
async fn the_first_start_creates_one_session_with_a_target() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = first_session::scenario().unwrap();
    drop(create_simulated(&scenario, &folder.path().join("drive")).unwrap());
    let server = TestServer::open(&folder.path().join("drive"), &folder.path().join("sessions"));
    first_session::begin(&server.state, &scenario).unwrap();
    let begun = Instant::now();
    let view = loop {
        let view = server.get("sessions/s1").await.expect(200);
        if view["targets"].as_array().is_some_and(|targets| !targets.is_empty()) {
            break view;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "no target: {view}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    assert_eq!(view["cursor"], json!({ "target": 0, "run": 0, "step": 0 }));
    assert_eq!(view["targets"][0]["designation"]["step"], 0);
    // On a second start there is still one session.
    first_session::begin(&server.state, &scenario).unwrap();
    assert_eq!(server.get("sessions").await.expect(200).as_array().unwrap().len(), 1);
    let stop = json!({});
    server.post("sessions/s1/targets/0/runs/0/cancel", &stop).await;
}

#[test]
fn targets_at_good_pixels_survive_more_often() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&short_approach(), folder.path()).unwrap();
    for step in 0..traverse.stop_count() {
        traverse.render_step(step, &AtomicBool::new(false)).unwrap();
    }
    let ground = ground(&traverse, &Settings::default()).unwrap();
    let map = TrackabilityMap::of(&ground);
    let outcomes = measure(&traverse, (&ground, &map), 40, 1);
    let table = Table::of(&outcomes);
    for verdict in Verdict::ALL {
        let counts = table.verdict(verdict);
        println!(
            "| {} | {} | {} | {:.0} % |",
            verdict.word(),
            counts.targets,
            counts.kept,
            100.0 * counts.kept_share()
        );
    }
    let [good, risky, bad] = Verdict::ALL.map(|verdict| table.verdict(verdict));
    assert!(good.targets >= 20 && bad.targets >= 20, "{table:?}");
    assert_eq!(good.refused, 0, "a good place can be designated");
    // The share of good places tracked to the end exceeds that of poor ones by more than 2.5 standard errors, and is not
    // significantly below that of risky ones: less than 40 targets of each cannot separate these two in one world.
    assert!(z_score(good, bad) > 2.5, "{table:?}");
    assert!(z_score(good, risky) > -2.0, "{table:?}");
}

/// Difference of two shares in standard errors of that difference (two-proportion z test, pooled).
fn z_score(first: Counts, second: Counts) -> f64 {
    let [n, m] = [first, second].map(|counts| counts.targets.max(1) as f64);
    let pooled = (first.kept + second.kept) as f64 / (n + m);
    let standard_error = (pooled * (1.0 - pooled) * (1.0 / n + 1.0 / m)).sqrt();
    (first.kept_share() - second.kept_share()) / standard_error.max(f64::MIN_POSITIVE)
}
