//! A recorded drive is identified by its index and its images: with other images it is another drive; sessions keep theirs.

use std::path::Path;

use serde_json::json;
use sightline_recordings::Traverse;
use sightline_server::state::AppState;
use sightline_tests::server::{PORT, TestServer, access, small_drive, small_recording};

/// A server state with several drives, whose sessions are stored in `folder`.
fn state(drives: &[&Path], folder: &Path) -> AppState {
    let drives = drives.iter().map(|drive| Traverse::open(drive).unwrap()).collect();
    AppState::new(drives, folder, access(PORT)).unwrap()
}

/// Swaps the left images of two stops.
fn exchange_images(drive: &Path) {
    let [first, second, aside] =
        ["left_0001.png", "left_0002.png", "aside.png"].map(|name| drive.join("images").join(name));
    std::fs::rename(&first, &aside).unwrap();
    std::fs::rename(&second, &first).unwrap();
    std::fs::rename(&aside, &second).unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn recordings_with_other_images_are_other_drives() {
    let (a, b, folder) = (small_recording(), small_recording(), tempfile::tempdir().unwrap());
    let same = state(&[a.path(), b.path()], folder.path());
    assert_eq!(same.traverses().len(), 1);
    drop(same);
    exchange_images(b.path());
    let both = state(&[a.path(), b.path()], folder.path());
    let ids: Vec<String> = both.traverses().iter().map(|open| open.id.clone()).collect();
    assert_eq!(ids.len(), 2);
    assert_ne!(ids[0], ids[1]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_that_is_given_twice_is_listed_once_with_a_notice() {
    let (a, b, folder) = (small_recording(), small_recording(), tempfile::tempdir().unwrap());
    let state = state(&[a.path(), b.path()], folder.path());
    let (app, traverse) = (sightline_server::app(state.clone()), state.traverses()[0].id.clone());
    let server = TestServer { app, state, traverse };
    let health = server.get("health").await.expect(200);
    let notice = health["notices"][0].as_str().unwrap();
    assert!(notice.contains("the same drive") && notice.contains(&server.traverse), "{notice}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_is_not_shown_on_images_that_were_exchanged() {
    let (drive, folder) = (small_recording(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let (session, name) = (server.begin().await, server.traverse.clone());
    server.pick(&session).await;
    let rows = server.ended(&session, 0, 0).await["rows"].clone();
    drop(server);

    exchange_images(drive.path());
    let server = TestServer::open(drive.path(), folder.path());
    assert_ne!(server.traverse, name);
    assert_eq!(server.get("sessions").await.expect(200), json!([]));
    let notice = server.get("health").await.expect(200)["notices"][0].as_str().unwrap().to_owned();
    assert!(notice.contains(&name) && notice.contains(&session), "{notice}");
    assert_ne!(server.begin().await, session, "its name is not given to another session");
    drop(server);

    exchange_images(drive.path());
    let server = TestServer::open(drive.path(), folder.path());
    assert_eq!(server.traverse, name);
    assert_eq!(server.get("health").await.expect(200)["notices"].as_array().unwrap().len(), 1);
    server.get(&format!("sessions/{session}")).await.expect(200);
    assert_eq!(server.ended(&session, 0, 0).await["rows"], rows);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_named_by_the_index_alone_takes_the_new_name() {
    let (drive, folder) = (small_recording(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let (session, name) = (server.begin().await, server.traverse.clone());
    let (of_index, _) = name.rsplit_once('-').unwrap();
    let mut saved = server.state.store().load().unwrap().sessions.remove(0);
    saved.traverse = of_index.to_owned();
    server.state.store().save(&saved).unwrap();
    drop(server);
    for _ in 0..2 {
        let server = TestServer::open(drive.path(), folder.path());
        let view = server.get(&format!("sessions/{session}")).await.expect(200);
        assert_eq!(view["traverse"], json!(name));
        assert_eq!(server.get("health").await.expect(200)["notices"], json!([]));
    }
    // Unless the new name was stored, the session would be listed with the exchanged images.
    exchange_images(drive.path());
    let server = TestServer::open(drive.path(), folder.path());
    assert_eq!(server.get("sessions").await.expect(200), json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_simulated_drive_is_named_by_its_index_alone() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let before = TestServer::open(drive.path(), folder.path()).traverse;
    std::fs::remove_dir_all(drive.path().join("images")).unwrap();
    assert_eq!(TestServer::open(drive.path(), folder.path()).traverse, before);
    assert_eq!(before.rsplit_once('-').unwrap().0, "small-drive");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_reproducible_file_names_the_digest_of_the_images() {
    let (drive, folder) = (small_recording(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let file = server.get(&format!("sessions/{session}/exports/reproduce.json")).await.expect(200);
    let digest = file["traverse"]["files_sha256"].as_str().unwrap();
    assert!(digest.len() == 64 && server.traverse.ends_with(&digest[..6]), "{digest}");
    drop(server);
    exchange_images(drive.path());
    let server = TestServer::open(drive.path(), folder.path());
    let reproduction = json!({ "traverse": { "id": file["traverse"]["id"], "name": file["traverse"]["name"] },
        "session": file["session"], "notes": file["notes"] });
    let refused = server.post("sessions/reproduced", &reproduction).await.problem(422, "traverse");
    assert!(refused.contains("other images"), "{refused}");
}
