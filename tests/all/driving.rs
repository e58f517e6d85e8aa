//! Drives on commands by REST: the same bits as on the command line, pausing, changing settings, branching, and continuing
//! after a kill.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use axum::http::Method;
use serde_json::{Value, json};
use sightline_tests::server::{PIXEL, TestServer, small_drive, small_recording};

use crate::cli::program;
use crate::persistence::ServerProcess;

/// Maximum time of a drive of a few small stops.
const PATIENCE: Duration = Duration::from_secs(120);

pub(crate) fn command() -> Value {
    json!({ "standoff_m": 3.0, "tolerance_m": 0.05, "stops_max": 7 })
}

/// Polls until the drive is as wanted.
pub(crate) fn wait(mut ask: impl FnMut() -> Value, wanted: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    loop {
        let drive = ask();
        if wanted(&drive) {
            return drive;
        }
        assert!(begun.elapsed() < PATIENCE, "the drive does not come so far: {drive}");
        std::thread::sleep(Duration::from_millis(30));
    }
}

pub(crate) async fn waited(server: &TestServer, session: &str, wanted: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    loop {
        let drive = server.get(&format!("sessions/{session}/drive")).await.expect(200);
        if wanted(&drive) {
            return drive;
        }
        assert!(begun.elapsed() < PATIENCE, "the drive does not come so far: {drive}");
        tokio::time::sleep(Duration::from_millis(30)).await;
    }
}

fn last_cycle(drive: &Value) -> Value {
    drive["cycles"].as_array().and_then(|cycles| cycles.last()).cloned().unwrap_or_default()
}

pub(crate) fn has_ended(drive: &Value) -> bool {
    last_cycle(drive)["ending"] != json!(null) && drive["is_driving"] == json!(false)
}

/// Whether the rover waits at a stop.
pub(crate) fn waits_at(stop: usize) -> impl Fn(&Value) -> bool {
    move |drive| last_cycle(drive)["step"] == json!(stop) && drive["is_driving"] == json!(false)
}

/// The drive by the command line in the small drive's world: rows without their cycles, cycles, and the summary.
pub(crate) fn by_command_line(drive: &Path) -> (Vec<Value>, Vec<Value>, Value) {
    let [x, y] = PIXEL;
    let mut program = Command::new(program());
    program.arg("drive").arg(drive.join("scenario.toml")).args(["--target", &format!("{x},{y}")]);
    program.args(["--standoff", "3", "--tolerance", "0.05", "--stops", "7"]);
    let output = program.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let mut rows: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let summary = rows.pop().unwrap()["summary"].take();
    let cycles = rows.iter_mut().map(|row| row.as_object_mut().unwrap().remove("cycle").unwrap()).collect();
    (rows, cycles, summary)
}

/// The rows of a run from an exported `rows.jsonl`, as the command line writes them.
pub(crate) fn rows(exported: &str) -> Vec<Value> {
    let own = |line: &str| {
        let mut row: Value = serde_json::from_str(line).unwrap();
        let fields = row.as_object_mut().unwrap();
        ["target", "label", "run"].iter().for_each(|key| drop(fields.remove(*key)));
        row
    };
    exported.lines().map(own).collect()
}

pub(crate) async fn exported(server: &TestServer, session: &str, run: u64) -> Vec<Value> {
    rows(&server.get(&format!("sessions/{session}/exports/rows.jsonl?target=0&run={run}")).await.text())
}

/// Starts a drive with the first run of a target at the first stop, and returns the session of the drive.
pub(crate) async fn begin(server: &TestServer, new: &Value) -> String {
    let session = server.begin().await;
    server.pick(&session).await;
    let view = server.post(&format!("sessions/{session}/targets/0/runs/0/drive"), new).await.expect(201);
    view["id"].as_str().unwrap().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_by_rest_has_the_bits_of_the_command_line() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let (wanted, cycles, summary) = by_command_line(drive.path());
    assert!(wanted.len() > 4, "a drive of some stops");
    let server = TestServer::open(drive.path(), folder.path());
    let session = begin(&server, &json!({ "command": command() })).await;
    let ended = waited(&server, &session, has_ended).await;
    assert_eq!(ended["cycles"], json!(cycles));
    assert_eq!(ended["summary"], summary);
    assert_eq!(exported(&server, &session, 0).await, wanted);
    // The session from which it started is unchanged.
    assert_eq!(server.get("sessions/s1/drive").await.expect(200)["steering"], json!(null));

    // The exported session is the same elsewhere.
    let bundle = server.get(&format!("sessions/{session}/exports/reproduce.json")).await.json();
    let elsewhere = tempfile::tempdir().unwrap();
    let other = TestServer::open(drive.path(), elsewhere.path());
    let reproduced =
        other.post("sessions/reproduced", &bundle).await.expect(201)["id"].as_str().unwrap().to_owned();
    waited(&other, &reproduced, has_ended).await;
    assert_eq!(exported(&other, &reproduced, 0).await, wanted);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_pauses_resumes_with_new_settings_and_branches() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let (wanted, ..) = by_command_line(drive.path());
    let server = TestServer::open(drive.path(), folder.path());
    let session = begin(&server, &json!({ "command": command(), "pause_at": 2 })).await;
    waited(&server, &session, waits_at(2)).await;
    assert_eq!(exported(&server, &session, 0).await, wanted[..3]);

    // One stop further, then to the end, on the estimates of a run with another setting from stop 3 on.
    let path = format!("sessions/{session}/drive");
    let steer = |run: u64, pause_at: Option<u64>| json!({ "target": 0, "run": run, "command": command(), "pause_at": pause_at });
    server.json(Method::PUT, &path, &steer(0, Some(3))).await.expect(200);
    waited(&server, &session, waits_at(3)).await;
    let fork = json!({ "run": 0, "from_step": 3, "settings": { "ncc_min": 0.65 } });
    server.post(&format!("sessions/{session}/targets/0/runs"), &fork).await.expect(202);
    server.ended(&session, 0, 1).await;
    server.json(Method::PUT, &path, &steer(1, None)).await.expect(200);
    let ended = waited(&server, &session, has_ended).await;
    let trunk = exported(&server, &session, 1).await;
    assert_eq!(ended["summary"]["stops"], json!(trunk.len()));
    assert_eq!(trunk[..3], wanted[..3]);
    // The run that drove before was tracked to the end as well.
    server.ended(&session, 0, 0).await;
    assert_eq!(exported(&server, &session, 0).await.len(), trunk.len());

    // From stop 2 the first run drives in a world of its own, with the same result as without a pause.
    let image = format!("traverses/{}/steps/4/images/left.png", traverse_of(&server, &session).await);
    let seen = server.get(&image).await.bytes;
    let new = json!({ "command": command(), "from_step": 2 });
    let begun = server.post(&format!("sessions/{session}/targets/0/runs/0/drive"), &new).await.expect(201);
    let branch = begun["id"].as_str().unwrap().to_owned();
    waited(&server, &branch, has_ended).await;
    assert_eq!(exported(&server, &branch, 0).await, wanted);
    assert_eq!(exported(&server, &session, 1).await, trunk);

    // From the same stop the second run drives with its own settings, which it uses from stop 3 on.
    let begun = server.post(&format!("sessions/{session}/targets/0/runs/1/drive"), &new).await.expect(201);
    let branch = begun["id"].as_str().unwrap().to_owned();
    let ended = waited(&server, &branch, has_ended).await;
    let own = exported(&server, &branch, 1).await;
    assert_eq!(ended["summary"]["stops"], json!(own.len()));
    assert_eq!(own[..2], wanted[..2]);
    let view = server.get(&format!("sessions/{branch}/targets/0/runs/1")).await.expect(200);
    assert_eq!((&view["fork"]["from_step"], &view["changes"]["ncc_min"]), (&json!(2), &json!(0.65)));
    assert!(server.get(&image).await.bytes == seen && !seen.is_empty());
}

pub(crate) async fn traverse_of(server: &TestServer, session: &str) -> String {
    let view = server.get(&format!("sessions/{session}")).await.expect(200);
    view["traverse"].as_str().unwrap().to_owned()
}

#[test]
fn a_drive_continues_with_the_same_bits_after_a_kill() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let (wanted, cycles, _) = by_command_line(drive.path());
    let server = ServerProcess::start(drive.path(), data.path());
    let traverse = server.get("traverses")[0]["id"].clone();
    server.json("POST", "sessions", &json!({ "traverse": traverse }));
    let [x, y] = PIXEL;
    server.json("POST", "sessions/s1/targets", &json!({ "step": 0, "pixel": { "x": x, "y": y } }));
    server.json("POST", "sessions/s1/targets/0/runs/0/drive", &json!({ "command": command() }));
    let some = |drive: &Value| drive["cycles"].as_array().is_some_and(|cycles| cycles.len() >= 2);
    wait(|| server.get("sessions/s2/drive"), some);
    server.kill();
    let server = ServerProcess::start(drive.path(), data.path());
    let ended = wait(|| server.get("sessions/s2/drive"), has_ended);
    assert_eq!(ended["cycles"], json!(cycles));
    let exported = server.raw("GET", "sessions/s2/exports/rows.jsonl?target=0&run=0", "", "");
    assert_eq!(rows(&exported), wanted);
    server.kill();

    // The command line exports the drive without the server, and leaves its folder unchanged.
    let out = data.path().join("rows.jsonl");
    let mut command = Command::new(program());
    command.args(["export", "rows.jsonl", "--session", "s2", "--data-dir"]).arg(data.path());
    let made = command.arg("--out").arg(&out).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(std::fs::read_to_string(&out).unwrap(), exported);
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_drive_commands_are_rejected_in_one_sentence() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let path = format!("sessions/{session}/targets/0/runs/0/drive");
    for (new, part) in [
        (json!({ "command": { "standoff_m": 20.0 } }), "standoff_m: 20 m is not less than"),
        (json!({ "command": { "standoff_m": -1.0 } }), "standoff_m: -1 is outside"),
        (json!({ "command": { "tolerance_m": 0.9, "standoff_m": 0.5 } }), "tolerance_m"),
        (json!({ "command": { "speed": 3 } }), "speed"),
        (json!({ "from_step": 2 }), "from_step: the other stops of this drive were planned beforehand"),
    ] {
        let refused = server.post(&path, &new).await;
        assert_eq!(refused.status.as_u16(), 422, "{new}");
        assert!(refused.text().contains(part), "{new}: {}", refused.text());
    }
    server
        .post(&format!("sessions/{session}/targets/0/runs/7/drive"), &json!({}))
        .await
        .problem(404, "not_found");
    let steering = json!({ "target": 0, "run": 0 });
    let refused = server.json(Method::PUT, &format!("sessions/{session}/drive"), &steering).await;
    assert!(refused.problem(409, "conflict").contains("not on commands"));
    assert_eq!(std::fs::read_dir(folder.path().join("driven")).unwrap().count(), 0, "nothing is left behind");

    let (recording, folder) = (small_recording(), tempfile::tempdir().unwrap());
    let server = TestServer::open(recording.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let refused = server.post(&format!("sessions/{session}/targets/0/runs/0/drive"), &json!({})).await;
    assert!(refused.problem(409, "conflict").contains("recorded drive"));
}

#[tokio::test(flavor = "multi_thread")]
async fn decisions_that_were_followed_stay_when_the_command_changes() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let far = json!({ "standoff_m": 4.5, "on_arrival": ["look"] });
    let session = begin(&server, &json!({ "command": far, "pause_at": 2 })).await;
    let waits = waited(&server, &session, waits_at(2)).await;
    let followed = waits["cycles"].as_array().unwrap()[..2].to_vec();
    assert!(followed.iter().all(|cycle| cycle["report"] != json!(null)));

    // The rest of the drive uses shorter steps.
    let path = format!("sessions/{session}/drive");
    let short = json!({ "standoff_m": 4.5, "on_arrival": ["look"], "step_fraction": 0.07 });
    let steering = json!({ "target": 0, "run": 0, "command": short });
    server.json(Method::PUT, &path, &steering).await.expect(200);
    let arrived = waited(&server, &session, has_ended).await;
    let cycles = arrived["cycles"].as_array().unwrap();
    assert_eq!(cycles[..2], followed);
    assert_eq!(last_cycle(&arrived)["ending"]["reason"], "arrived");
    assert_eq!(last_cycle(&arrived)["arrival_actions"], 1);

    // Then a nearer goal, with a look of its own.
    let near = json!({ "standoff_m": 4.0, "on_arrival": ["look"] });
    let steering = json!({ "target": 0, "run": 0, "command": near });
    server.json(Method::PUT, &path, &steering).await.expect(200);
    let is_nearer =
        |drive: &Value| has_ended(drive) && drive["cycles"].as_array().unwrap().len() > cycles.len() + 1;
    let ended = waited(&server, &session, is_nearer).await;
    let last = last_cycle(&ended);
    assert_eq!((&last["ending"]["reason"], &last["arrival_actions"]), (&json!("arrived"), &json!(1)));
    assert_eq!(ended["cycles"].as_array().unwrap()[..cycles.len() - 1], cycles[..cycles.len() - 1]);

    // They are the same after a restart.
    drop(server);
    let server = TestServer::open(drive.path(), folder.path());
    assert_eq!(waited(&server, &session, has_ended).await["cycles"], ended["cycles"]);
}
