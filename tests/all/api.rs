//! Sessions over HTTP: pick, run, step back, fork, cancel, restart.

use std::collections::BTreeMap;
use std::time::Duration;

use axum::http::{Method, header};
use serde_json::{Value, json};
use sightline_api::wire::StopDetail;
use sightline_tests::server::{PIXEL, TestServer, request, small_drive, small_recording};
use sightline_vision::image::{npy, npz};

/// The path of a step of a run.
fn step(session: &str, run: u64, step: u64) -> String {
    format!("sessions/{session}/targets/0/runs/{run}/steps/{step}")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picked_target_is_tracked_to_the_last_stop() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    assert_eq!(server.pick(&session).await, 0);
    let run = server.ended(&session, 0, 0).await;
    let rows = run["rows"].as_array().unwrap();
    assert_eq!((rows.len(), &run["complete"]), (5, &json!(true)));
    assert_eq!(run["summary"]["run_tracked"], json!(true), "{run}");
    let view = server.get(&format!("sessions/{session}")).await.expect(200);
    assert_eq!(view["targets"][0]["runs"][0], run);
    assert_eq!(view["cursor"], json!({ "target": 0, "run": 0, "step": 0 }));
    let list = server.get("sessions").await.expect(200);
    assert_eq!(list[0]["target_count"], json!(1));
}

#[tokio::test(flavor = "multi_thread")]
async fn pixel_rover_point_and_site_point_name_the_same_target() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let picked = server.ended(&session, 0, 0).await;
    let in_rover = &picked["rows"][0]["position_in_rover"];
    let pose = server.state.traverses()[0].traverse.site_from_rover(0);
    let coordinates = [0, 1, 2].map(|k| in_rover[k].as_f64().unwrap());
    let in_site = pose * sightline_geometry::frames::Point3::from(coordinates);
    let path = format!("sessions/{session}/targets");
    for place in [json!({ "point_in_rover": in_rover }), json!({ "point_in_site": in_site })] {
        let mut new = place.clone();
        new["step"] = json!(0);
        let made = server.post(&path, &new).await.expect(201);
        let designation =
            &made["session"]["targets"][made["target"].as_u64().unwrap() as usize]["designation"];
        for (axis, expected) in [("x", PIXEL[0]), ("y", PIXEL[1])] {
            let found = designation["pixel"][axis].as_f64().unwrap();
            assert!((found - expected).abs() < 0.05, "{place}: {designation}");
        }
        assert!(made["gap_m"].as_f64().unwrap() < 0.02, "{made}");
    }
    let nothing = json!({ "step": 0 });
    server.post(&path, &nothing).await.problem(422, "target");
    let elsewhere = json!({ "step": 0, "pixel": { "x": 10.0, "y": 10.0 },
        "mast": { "azimuth_rad": 3.0, "elevation_rad": 0.0 } });
    server.post(&path, &elsewhere).await.problem(422, "target");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_target_keeps_its_new_name_over_a_restart() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let path = format!("sessions/{session}/targets/0/label");
    let name = |label: &str| json!({ "label": label });
    let renamed = server.json(Method::PUT, &path, &name("  tall ridge ")).await.expect(200);
    assert_eq!(renamed["targets"][0]["label"], "tall ridge");
    let long = server.json(Method::PUT, &path, &name(&"x".repeat(101))).await.problem(422, "field");
    assert!(long.contains("label"), "{long}");
    let none = format!("sessions/{session}/targets/7/label");
    assert_eq!(server.json(Method::PUT, &none, &name("a")).await.status, 404);
    drop(server);
    let server = TestServer::open(drive.path(), folder.path());
    let view = server.get(&format!("sessions/{session}")).await.expect(200);
    assert_eq!(view["targets"][0]["label"], "tall ridge");
    let blank = server.json(Method::PUT, &path, &name(" ")).await.expect(200);
    assert_eq!(blank["targets"][0]["label"], "target 1");
}

#[tokio::test(flavor = "multi_thread")]
async fn photometry_has_a_row_per_accepted_update() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let run = server.ended(&session, 0, 0).await;
    let answer = server.get(&format!("sessions/{session}/targets/0/runs/0/photometry.csv")).await;
    let text = String::from_utf8(answer.bytes.to_vec()).unwrap();
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let accepted = run["rows"].as_array().unwrap().iter().filter(|row| row["state"] == "tracking").count();
    assert_eq!((lines.len(), lines[0][7]), (accepted + 1, "phase_deg"));
    let open = server.state.traverses().remove(0);
    let index = &open.traverse;
    for line in &lines[1..] {
        let number = |column: usize| line[column].parse::<f64>().unwrap();
        let light = index.light(line[0].parse().unwrap(), &std::sync::atomic::AtomicBool::new(false));
        let exposure_s = light.unwrap().unwrap().exposure_s.unwrap();
        assert!((number(4) * exposure_s - number(1)).abs() < 1e-9, "{line:?}");
        // Incidence, emission and phase angles are the sides of a spherical triangle.
        let (incidence, emission, phase) = (number(5), number(6), number(7));
        assert!(phase <= incidence + emission + 1e-6 && phase >= (incidence - emission).abs() - 1e-6);
        assert!(emission < 90.0, "the surface is seen from in front: {line:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn going_back_is_a_read_of_the_same_bytes() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let first = server.get(&step(&session, 0, 2)).await;
    let arrays = server.get(&format!("{}/arrays.npz", step(&session, 0, 2))).await;
    // Nothing can be computed again without images.
    std::fs::remove_dir_all(drive.path()).unwrap();
    for number in [4, 3, 2] {
        let cursor = json!({ "target": 0, "run": 0, "step": number });
        server.json(Method::PUT, &format!("sessions/{session}/cursor"), &cursor).await.expect(200);
    }
    assert_eq!(server.get(&step(&session, 0, 2)).await, first);
    assert_eq!(server.get(&format!("{}/arrays.npz", step(&session, 0, 2))).await, arrays);
    let trace = first.expect(200);
    for stage in ["predict", "point_mast", "capture", "locate", "judge", "update"] {
        assert!(trace[stage].is_object(), "{stage}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn new_rows_and_cursor_moves_are_sent_without_the_session() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let whole = server.ended(&session, 0, 0).await;
    let run = format!("sessions/{session}/targets/0/runs/0");
    let rows = |view: &Value| view["rows"].as_array().unwrap().clone();
    let tail = server.get(&format!("{run}?from_row=3")).await.expect(200);
    assert_eq!(rows(&tail), rows(&whole)[3..]);
    assert_eq!((&tail["summary"], &tail["complete"]), (&whole["summary"], &whole["complete"]));
    assert!(rows(&server.get(&format!("{run}?from_row=99")).await.expect(200)).is_empty());
    server.get(&format!("{run}?from_row=-1")).await.problem(422, "query");
    server.get(&format!("{run}?rows=3")).await.problem(422, "query");

    let mut events = server.state.events().subscribe();
    let (path, cursor) = (format!("sessions/{session}/cursor"), json!({ "target": 0, "run": 0, "step": 2 }));
    server.json(Method::PUT, &path, &cursor).await.expect(200);
    assert_eq!(server.get(&path).await.expect(200), cursor);
    let told = serde_json::to_value(events.try_recv().unwrap()).unwrap();
    assert_eq!(told, json!({ "event": "cursor_moved", "session": session, "cursor": cursor }));
    assert!(events.try_recv().is_err(), "and nothing of the session");
    server.get("sessions/s99/cursor").await.problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_array_is_a_numpy_file_of_the_declared_size() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let trace = server.get(&step(&session, 0, 1)).await.expect(200);
    let together = server.get(&format!("{}/arrays.npz", step(&session, 0, 1))).await;
    let mut together: BTreeMap<_, _> = npz::decode(&together.bytes, "arrays").unwrap().into_iter().collect();
    for name in ["reference", "scaled", "rolled", "matched", "difference", "right_window", "surface"] {
        let image = npy::decode(&together.remove(name).unwrap(), name).unwrap();
        // The score map has a score wherever the whole template is inside the search window.
        let window = &trace["locate"]["evidence"]["match_template"]["search_window"];
        let positions = |key: &str| window[key].as_u64().map(|side| side - 20);
        let said = |key: &str| if name == "surface" { positions(key) } else { Some(21) };
        let (width, height) = image.dimensions();
        assert_eq!((Some(width.into()), Some(height.into())), (said("width"), said("height")), "{name}");
    }
    assert!(together.is_empty(), "{together:?}");
    let of_pick = server.get(&format!("{}/arrays.npz", step(&session, 0, 0))).await;
    let of_pick = npz::decode(&of_pick.bytes, "arrays").unwrap();
    let of_pick: Vec<&str> = of_pick.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        of_pick,
        ["right_window"],
        "a designation is found in the right image, and compared with nothing before"
    );
    server.get(&format!("{}/arrays.npz", step(&session, 0, 99))).await.problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_view_of_a_step_is_compared_with_the_earlier_templates() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let earlier = |number: u64| format!("{}/earlier_templates", step(&session, 0, number));
    let rows = server.get(&step(&session, 0, 4)).await.expect(200);
    assert!(rows["locate"]["left_pixel"].is_object(), "the step found a position");
    let found = server.get(&earlier(4)).await.expect(200);
    let found = found.as_array().unwrap();
    assert_eq!(found[0]["template_step"], 0, "the designated template comes first: {found:?}");
    for one in found {
        assert!(one["template_step"].as_u64().unwrap() < 4, "{one}");
        let offset = |i: usize| one["offset_px"][i].as_f64().unwrap();
        assert!(one["score"].as_f64().unwrap() > 0.7 && offset(0).hypot(offset(1)) < 3.0, "{one}");
    }
    assert_eq!(server.get(&earlier(0)).await.expect(200), json!([]), "there is none before the designation");
    server.get(&earlier(99)).await.problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fork_shares_the_steps_before_it_and_changes_none_of_them() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let parent = server.ended(&session, 0, 0).await;
    let new = json!({ "run": 0, "from_step": 3, "settings": { "ncc_min": 0.999 } });
    let fork = server.post(&format!("sessions/{session}/targets/0/runs"), &new).await.expect(202);
    assert_eq!((&fork["number"], &fork["changes"]), (&json!(1), &json!({ "ncc_min": 0.999 })));
    let fork = server.ended(&session, 0, 1).await;
    for number in 0..3 {
        let (a, b) =
            (server.get(&step(&session, 0, number)).await, server.get(&step(&session, 1, number)).await);
        assert_eq!(a.bytes, b.bytes, "step {number}");
    }
    assert_eq!(fork["rows"][3]["state"], json!("lost"), "{fork}");
    assert_eq!(server.ended(&session, 0, 0).await, parent);
    // A fork from the designation's own step designates the target again.
    let again = json!({ "run": 1, "from_step": 0 });
    server.post(&format!("sessions/{session}/targets/0/runs"), &again).await.expect(202);
    let again = server.ended(&session, 0, 2).await;
    assert_eq!(again["fork"], json!({ "run": 1, "from_step": 0 }));
    assert_eq!(again["rows"].as_array().unwrap().len(), 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_without_its_image_is_a_fault_of_that_step_alone() {
    let (drive, folder) = (small_recording(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let view = server.get(&format!("traverses/{}", server.traverse)).await.expect(200);
    assert_eq!(view["simulated"], json!(false));
    let index = server.state.traverses()[0].traverse.index().clone();
    std::fs::remove_file(drive.path().join(&index.stops[2].right.image)).unwrap();
    let session = server.begin().await;
    server.pick(&session).await;
    let run = server.ended(&session, 0, 0).await;
    assert_eq!(run["complete"], json!(true));
    let fault = run["rows"][2]["reason"].as_str().unwrap();
    assert!(fault.contains(&index.stops[2].right.image) && fault.contains("step 2"), "{fault}");
    assert!(run["rows"][4]["ncc"].as_f64().unwrap() > 0.8, "{run}");
    let image = format!("traverses/{}/steps/2/images/right.png", server.traverse);
    assert!(server.get(&image).await.problem(422, "file").contains("step 2"));
    // The other image of that stop and the next stop exist.
    for there in ["2/images/left.png", "3/images/right.png"] {
        let path = format!("traverses/{}/steps/{there}", server.traverse);
        assert_eq!(server.get(&path).await.status, 200, "{there}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_contains_its_camera_models() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let path = format!("traverses/{}/steps", server.traverse);
    let detail: StopDetail =
        serde_json::from_value(server.get(&format!("{path}/1")).await.expect(200)).unwrap();
    let view = server.get(&format!("traverses/{}", server.traverse)).await.expect(200);
    assert_eq!(serde_json::to_value(&detail.stop).unwrap(), view["stops"][1]);
    let open = &server.state.traverses()[0].traverse;
    assert_eq!((&detail.left, &detail.right), (open.left_camera(1), open.right_camera(1)));
    // The baseline is about 15 cm, and the mast angles are known.
    let apart_m = (detail.left.model.centre() - detail.right.model.centre()).norm();
    assert!((0.05..0.5).contains(&apart_m) && detail.mast.is_some(), "{apart_m} m");
    assert!(server.get(&format!("{path}/99")).await.problem(404, "not_found").contains("no step 99"));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_image_is_sent_once_and_then_known_by_its_tag() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    std::fs::remove_dir_all(drive.path().join("images")).unwrap();
    let server = TestServer::open(drive.path(), folder.path());
    let path = format!("traverses/{}/steps/3/images/left.png", server.traverse);
    let rendered = server.get(&path).await;
    let image = image::load_from_memory(&rendered.bytes).unwrap();
    assert_eq!((image.width(), image.height(), image.color()), (256, 256, image::ColorType::L8));
    let tag = rendered.headers[header::ETAG].clone();
    let again = request(Method::GET, &path).header(header::IF_NONE_MATCH, tag);
    let again = server.send(again.body(axum::body::Body::empty()).unwrap()).await;
    assert_eq!((again.status.as_u16(), again.bytes.len()), (304, 0));
    let deep = server.get(&format!("{path}?bits=16")).await;
    assert_eq!(image::load_from_memory(&deep.bytes).unwrap().color(), image::ColorType::L16);
    server.get(&format!("{path}?bits=12")).await.problem(422, "query");
    server.get(&format!("{path}?colour=red")).await.problem(422, "query");
}

#[tokio::test(flavor = "multi_thread")]
async fn stops_ahead_of_the_cursor_are_rendered_unasked() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    std::fs::remove_dir_all(drive.path().join("images")).unwrap();
    let server = TestServer::open(drive.path(), folder.path());
    let mut events = server.state.events().subscribe();
    let path = format!("traverses/{}/prefetch?from=3", server.traverse);
    assert_eq!(server.post(&path, &json!({})).await.status, 204);
    let mut order = Vec::new();
    while order.len() < 5 {
        let event = tokio::time::timeout(Duration::from_secs(60), events.recv()).await.unwrap().unwrap();
        let event = serde_json::to_value(event).unwrap();
        order.extend(event["ready"].as_u64().filter(|_| event["event"] == json!("render_progress")));
    }
    // Stops 0 and 1 may have been in progress already.
    let place = |step: u64| order.iter().position(|done| *done == step);
    assert!(place(3) < place(4) && place(4) < place(2), "{order:?}");
    let view = server.get(&format!("traverses/{}", server.traverse)).await.expect(200);
    assert!(view["stops"].as_array().unwrap().iter().all(|stop| stop["ready"] == json!(true)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_run_gains_no_step_until_it_is_resumed() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    // Without images each step has to be rendered first, so the run is still in progress.
    std::fs::remove_dir_all(drive.path().join("images")).unwrap();
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let cancelled =
        server.post(&format!("sessions/{session}/targets/0/runs/0/cancel"), &json!({})).await.expect(200);
    assert_eq!(cancelled["stopped"], json!("cancelled"));
    assert!(cancelled["rows"].as_array().unwrap().len() < 5, "{cancelled}");
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let path = format!("sessions/{session}/targets/0/runs/0");
    assert_eq!(server.get(&path).await.expect(200), cancelled);
    server.post(&format!("{path}/cancel"), &json!({})).await.problem(409, "conflict");

    drop(server);
    let server = TestServer::open(drive.path(), folder.path());
    let rows = cancelled["rows"].as_array().unwrap().len();
    assert_eq!(server.ended(&session, 0, 0).await["rows"].as_array().unwrap().len(), rows);

    server.post(&format!("{path}/resume"), &json!({})).await.expect(202);
    let run = server.ended(&session, 0, 0).await;
    assert_eq!((run["rows"].as_array().unwrap().len(), &run["stopped"]), (5, &Value::Null));
    server.post(&format!("{path}/resume"), &json!({})).await.problem(409, "conflict");
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_survive_the_server() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let (session, before) = {
        let server = TestServer::open(drive.path(), folder.path());
        let session = server.begin().await;
        for _ in 0..2 {
            let target = server.pick(&session).await;
            server.ended(&session, target, 0).await;
        }
        let new = json!({ "run": 0, "from_step": 2, "settings": { "search_window_px": 81 } });
        server.post(&format!("sessions/{session}/targets/1/runs"), &new).await.expect(202);
        server.ended(&session, 1, 1).await;
        let path = format!("sessions/{session}/targets/0");
        let removed = request(Method::DELETE, &path).body(axum::body::Body::empty()).unwrap();
        server.send(removed).await.expect(200);
        let cursor = json!({ "target": 1, "run": 1, "step": 4 });
        server.json(Method::PUT, &format!("sessions/{session}/cursor"), &cursor).await.expect(200);
        (session.clone(), server.get(&format!("sessions/{session}")).await.expect(200))
    };
    std::fs::write(folder.path().join("s5.json"), "{").unwrap();
    let server = TestServer::open(drive.path(), folder.path());
    server.get(&format!("sessions/{session}")).await.expect(200);
    server.ended(&session, 1, 0).await;
    server.ended(&session, 1, 1).await;
    assert_eq!(server.get(&format!("sessions/{session}")).await.expect(200), before);
    let notices = server.get("health").await.expect(200)["notices"].to_string();
    assert!(notices.contains("s5.json") && folder.path().join("s5.damaged").is_file(), "{notices}");
    assert_eq!(server.begin().await, "s6", "no name is used twice");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_number_of_a_removed_target_is_not_reused() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let remove =
        || request(Method::DELETE, &format!("sessions/{session}/targets/0")).body(axum::body::Body::empty());
    let view = server.send(remove().unwrap()).await.expect(200);
    assert_eq!((&view["targets"], &view["cursor"]["target"]), (&json!([]), &Value::Null));
    server.send(remove().unwrap()).await.problem(404, "not_found");
    server.get(&step(&session, 0, 0)).await.problem(404, "not_found");
    assert_eq!(server.pick(&session).await, 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_becomes_a_recording() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let answer = server.get(&format!("sessions/{session}/exports/recording.rrd")).await;
    assert_eq!((answer.status.as_u16(), &answer.bytes[..4]), (200, &b"RRF2"[..]));
    assert!(
        answer.headers[header::CONTENT_DISPOSITION].to_str().unwrap().contains("sightline-s1-recording.rrd")
    );
    let csv = server.get(&format!("sessions/{session}/exports/rows.csv?target=0&run=0")).await.text();
    let header = csv.lines().next().unwrap();
    assert_eq!((csv.lines().count(), header.starts_with("target,label,run,step,state,")), (6, true));
    let [x, _] = PIXEL;
    assert!(csv.lines().nth(1).unwrap().contains(&format!(",{x},")), "{csv}");
}
