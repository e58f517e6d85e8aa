//! Visual odometry of a stop by REST: the stored motion with its corners, or the reason if there is none.

use serde_json::{Value, json};
use sightline_tests::server::{TestServer, small_drive};

use crate::driving::{begin, command, has_ended, traverse_of, waited};

/// The command of the small drive with a mode of visual odometry.
fn with(odometry: &str) -> Value {
    let mut command = command();
    command["odometry"] = json!(odometry);
    command
}

/// The number of corners with one of these fates.
fn count(corners: &[Value], fates: &[&str]) -> usize {
    corners.iter().filter(|corner| fates.contains(&corner["fate"].as_str().unwrap())).count()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_odometry_of_a_stop_has_the_stored_motion_and_its_corners() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let pause = json!({ "when": "before", "stage": "capture" });
    let new = json!({ "command": with("full"), "pause_at": 2, "pause": pause });
    let session = begin(&server, &new).await;
    let halt = json!({ "stop": 2, "before": "capture" });
    waited(&server, &session, |drive| drive["paused"] == halt).await;
    let traverse = traverse_of(&server, &session).await;
    let path = |step: usize| format!("traverses/{traverse}/steps/{step}/odometry");

    let found = server.get(&path(1)).await.expect(200);
    let stop = server.get(&format!("traverses/{traverse}/steps/1")).await.expect(200);
    let measured = &found["measured"];
    assert_eq!(measured, &stop["stop"]["odometry"]);
    assert_eq!(found["settings"]["inliers_min"], json!(25));
    let (corners, update) = (found["corners"].as_array().unwrap(), &measured["update"]);
    assert_eq!(json!(corners.len()), update["corners"]);
    assert_eq!(json!(count(corners, &["inlier"])), update["inliers"]);
    assert_eq!(json!(count(corners, &["inlier", "outlier", "unused"])), update["matches"]);
    assert!(count(corners, &["inlier"]) > 20, "{update}");
    for corner in corners.iter().filter(|corner| corner["fate"] == "inlier") {
        assert!(corner["range_m"].as_f64().unwrap() > 0.5 && corner["after_px"].is_array(), "{corner}");
        assert!(corner["residual_sigmas"].as_f64().unwrap() < 5.0, "{corner}");
    }
    assert_eq!(server.get(&path(1)).await.expect(200), found, "the same from memory");

    // Without odometry, one sentence states the reason.
    let refused = |step, status, code| {
        let (server, path) = (&server, path(step));
        async move { server.get(&path).await.problem(status, code) }
    };
    assert!(refused(0, 404, "not_found").await.contains("no stop is before it"));
    assert!(refused(2, 409, "conflict").await.contains("images are not taken"));
    assert!(refused(9, 404, "not_found").await.contains("no step 9"));
    let planned = server.get(&format!("traverses/{}/steps/1/odometry", server.traverse)).await;
    assert!(planned.problem(404, "not_found").contains("the traverse stores none"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_without_odometry_is_reported_as_such() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = begin(&server, &json!({ "command": with("off") })).await;
    waited(&server, &session, has_ended).await;
    let traverse = traverse_of(&server, &session).await;
    let problem = server.get(&format!("traverses/{traverse}/steps/1/odometry")).await;
    assert!(problem.problem(404, "not_found").contains("visual odometry off"));
}
