//! Actions that were copied as `curl` are run in a shell against a real server, and do what they say.

use std::process::Command;

use serde_json::{Value, json};
use sightline_tests::server::{PIXEL, small_drive};

#[tokio::test(flavor = "multi_thread")]
async fn what_is_copied_as_curl_does_what_it_says() {
    use sightline_core::session::shell::Curl;
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let origin = format!("http://{}", listener.local_addr().unwrap());
    let traverse = sightline_core::traverse::Traverse::open(drive.path()).unwrap();
    let hosts = sightline_server::guard::Hosts::new(listener.local_addr().unwrap().port(), &[]);
    let state = sightline_server::state::AppState::new(vec![traverse], folder.path(), hosts).unwrap();
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
        tokio::task::spawn_blocking(move || Command::new("sh").args(["-c", &text]).output().unwrap())
    };
    let said = |output: std::process::Output| {
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).unwrap_or(Value::Null)
    };
    let begun = said(shell("POST", "sessions", Some(json!({ "traverse": id })), None, None).await.unwrap());
    assert_eq!(begun["id"], json!("s1"));
    let [x, y] = PIXEL;
    let target = json!({ "step": 0, "pixel": { "x": x, "y": y }, "label": "it's $HOME `x` \"@\"" });
    let made = said(shell("POST", "sessions/s1/targets", Some(target.clone()), None, None).await.unwrap());
    assert_eq!(made["session"]["targets"][0]["label"], target["label"]);
    let cursor = json!({ "target": 0, "run": 0, "step": 1 });
    assert_eq!(
        said(shell("PUT", "sessions/s1/cursor", Some(cursor.clone()), None, None).await.unwrap()),
        cursor
    );
    let note = json!({ "step": 1, "text": "@file 'quoted'" });
    assert_eq!(
        said(shell("POST", "sessions/s1/notes", Some(note.clone()), None, None).await.unwrap())["text"],
        note["text"]
    );
    let edit = json!({ "text": "changed" });
    let edited = shell("PATCH", "sessions/s1/notes/1", Some(edit.clone()), Some(1), None).await.unwrap();
    assert_eq!(said(edited)["revision"], json!(2));
    let late = shell("PATCH", "sessions/s1/notes/1", Some(edit), Some(1), None).await.unwrap();
    assert!(!late.status.success(), "a problem makes the command fail");
    let file = folder.path().join("it's rows.csv").to_str().unwrap().to_owned();
    said(
        shell("GET", "sessions/s1/exports/rows.csv?target=0", None, None, Some(file.clone())).await.unwrap(),
    );
    assert!(std::fs::read_to_string(file).unwrap().starts_with("target,label,run,step,state,"));
}
