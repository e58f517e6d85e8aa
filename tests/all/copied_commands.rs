//! Actions copied as `curl` commands or as commands of the program are run in a shell and have the same effect.

use std::process::Command;

use serde_json::{Value, json};
use sightline_session::shell;
use sightline_session::view::SessionView;
use sightline_tests::server::{PIXEL, TOKEN, TestServer, access, rows_of_run, small_drive};

use crate::cli::program;

#[tokio::test(flavor = "multi_thread")]
async fn copied_curl_commands_have_the_described_effect() {
    use sightline_session::shell::Curl;
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let origin = format!("http://{}", listener.local_addr().unwrap());
    let traverse = sightline_recordings::Traverse::open(drive.path()).unwrap();
    let access = access(listener.local_addr().unwrap().port());
    let state = sightline_server::state::AppState::new(vec![traverse], folder.path(), access).unwrap();
    let id = state.traverses()[0].id.clone();
    let app = sightline_server::app(state);
    tokio::spawn(async move { axum::serve(listener, app).await });
    let shell = |method: &'static str,
                 path: &str,
                 body: Option<Value>,
                 revision: Option<u64>,
                 file: Option<String>| {
        let (url, body) = (format!("{origin}/api/v1/{path}"), body.map(|body| body.to_string()));
        let curl = Curl { method, url: &url, body: body.as_deref(), revision, file: file.as_deref() };
        let text = curl.text();
        tokio::task::spawn_blocking(move || {
            Command::new("sh").args(["-c", &text]).env("SIGHTLINE_TOKEN", TOKEN).output().unwrap()
        })
    };
    let json_of = |output: std::process::Output| {
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).unwrap_or(Value::Null)
    };
    let session =
        json_of(shell("POST", "sessions", Some(json!({ "traverse": id })), None, None).await.unwrap());
    assert_eq!(session["id"], json!("s1"));
    let [x, y] = PIXEL;
    let target = json!({ "step": 0, "pixel": { "x": x, "y": y }, "label": "it's $HOME `x` \"@\"" });
    let made = json_of(shell("POST", "sessions/s1/targets", Some(target.clone()), None, None).await.unwrap());
    assert_eq!(made["session"]["targets"][0]["label"], target["label"]);
    let cursor = json!({ "target": 0, "run": 0, "step": 1 });
    assert_eq!(
        json_of(shell("PUT", "sessions/s1/cursor", Some(cursor.clone()), None, None).await.unwrap()),
        cursor
    );
    let note = json!({ "step": 1, "text": "@file 'quoted'" });
    assert_eq!(
        json_of(shell("POST", "sessions/s1/notes", Some(note.clone()), None, None).await.unwrap())["text"],
        note["text"]
    );
    let edit = json!({ "text": "changed" });
    let edited = shell("PATCH", "sessions/s1/notes/1", Some(edit.clone()), Some(1), None).await.unwrap();
    assert_eq!(json_of(edited)["revision"], json!(2));
    let late = shell("PATCH", "sessions/s1/notes/1", Some(edit), Some(1), None).await.unwrap();
    assert!(!late.status.success(), "a problem makes the command fail");
    let file = folder.path().join("it's rows.csv").to_str().unwrap().to_owned();
    json_of(
        shell("GET", "sessions/s1/exports/rows.csv?target=0", None, None, Some(file.clone())).await.unwrap(),
    );
    assert!(std::fs::read_to_string(file).unwrap().starts_with("target,label,run,step,state,"));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_copied_command_tracks_the_same_rows() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let run = server.ended(&session, 0, 0).await;
    let view: SessionView =
        serde_json::from_value(server.get(&format!("sessions/{session}")).await.json()).unwrap();
    let traverse = server.get(&format!("traverses/{}", view.traverse)).await.json();
    let source = traverse["source"].as_str().unwrap();
    let command = shell::track(source, view.targets[0].designation, &view.targets[0].runs[0].changes);
    let programs = program().parent().unwrap().to_owned();
    let output = Command::new("/bin/sh")
        .args(["-c", &command])
        .env("PATH", programs)
        .env("SIGHTLINE_HOME", folder.path().join("home"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    let tracked = String::from_utf8(output.stdout).unwrap();
    let rows = server.get(&format!("sessions/{session}/exports/rows.jsonl?target=0&run=0")).await.text();
    let rows = rows_of_run(&rows);
    assert_eq!(rows.lines().count(), run["rows"].as_array().unwrap().len());
    assert_eq!(
        tracked.lines().take(rows.lines().count()).collect::<Vec<_>>(),
        rows.lines().collect::<Vec<_>>()
    );
}
