//! Pauses between the stages of a drive on commands by REST: the same bits as without pauses, actions of the world deferred
//! with the stages, another setting on the same inputs, and the same pause after a kill.

use std::path::{Path, PathBuf};
use std::process::Command;

use axum::http::Method;
use serde_json::{Value, json};
use sightline_tests::server::{PIXEL, TestServer, small_drive};

use crate::cli::program;
use crate::driving::{
    begin, by_command_line, command, exported, has_ended, rows, traverse_of, wait, waited, waits_at,
};
use crate::persistence::ServerProcess;

/// The stages of a stop, in the order of execution.
const STAGES: [&str; 9] =
    ["predict", "point_mast", "capture", "locate", "judge", "update", "set_goal", "select_path", "drive"];

/// Whether the drive is paused before a stage of a stop.
fn is_paused(stop: usize, before: &str) -> impl Fn(&Value) -> bool {
    move |drive| {
        drive["paused"] == json!({ "stop": stop, "before": before }) && drive["is_driving"] == json!(false)
    }
}

/// A command to pause before or after a stage.
fn steering(run: usize, pause_at: usize, when: &str, stage: &str) -> Value {
    let pause = json!({ "when": when, "stage": stage });
    json!({ "target": 0, "run": run, "command": command(), "pause_at": pause_at, "pause": pause })
}

/// The pause before a stage, also expressible as the pause after the previous one.
fn pause_before(stop: usize, stage: usize, is_after: bool) -> Value {
    match (is_after, stage) {
        (false, _) => steering(0, stop, "before", STAGES[stage]),
        (true, 0) => steering(0, stop - 1, "after", "drive"),
        (true, _) => steering(0, stop, "after", STAGES[stage - 1]),
    }
}

fn step_path(session: &str, run: usize, step: usize) -> String {
    format!("sessions/{session}/targets/0/runs/{run}/steps/{step}")
}

/// The stored states of a world, from its folder.
fn world(folder: &Path) -> Vec<Value> {
    serde_json::from_slice(&std::fs::read(folder.join("driven.json")).unwrap()).unwrap()
}

/// A drive that is never paused, or the one that is compared with it.
struct ComparedDrive {
    session: String,
    traverse: String,
    folder: PathBuf,
}

impl ComparedDrive {
    async fn drive(server: &TestServer, data: &Path) -> Self {
        let session = begin(server, &json!({ "command": command() })).await;
        waited(server, &session, has_ended).await;
        let traverse = traverse_of(server, &session).await;
        Self { folder: data.join("driven").join(&traverse), session, traverse }
    }
}

/// Checks which data of a stop exist while the drive is paused before a stage of it.
async fn check_pause(
    server: &TestServer,
    unpaused: &ComparedDrive,
    paused: &ComparedDrive,
    (stop, stage): (usize, usize),
) {
    let place = format!("stop {stop}, before {}", STAGES[stage]);
    let expected = server.get(&step_path(&unpaused.session, 0, stop)).await.expect(200);
    let found = server.get(&step_path(&paused.session, 0, stop)).await;
    match stage {
        0 => drop(found.problem(404, "not_found")),
        1..=5 => {
            let found = found.expect(200);
            assert_eq!(found["begun"]["before"], json!(STAGES[stage]), "{place}");
            for (k, name) in STAGES[..6].iter().enumerate() {
                match (k < stage, stage) {
                    (false, _) => assert_eq!(found[name], json!(null), "{place}: {name}"),
                    // Vision corrects the pose once the images are taken; before, it is that of wheels and gyro.
                    (true, 1 | 2) => assert_ne!(found[name], expected[name], "{place}: {name}"),
                    (true, _) => assert_eq!(found[name], expected[name], "{place}: {name}"),
                }
            }
            assert_eq!(found["truth"], json!(null), "{place}");
        }
        _ => assert_eq!(found.expect(200), expected, "{place}"),
    }
    let (state, wanted) = (world(&paused.folder), world(&unpaused.folder));
    assert_eq!(state.len(), stop + 1, "{place}");
    let pointed = if stage < 2 { &state[stop - 1] } else { &wanted[stop] };
    assert_eq!(state[stop]["mast_angles"], pointed["mast_angles"], "{place}");
    assert_ne!(
        wanted[stop]["mast_angles"],
        wanted[stop - 1]["mast_angles"],
        "the mast moves from stop to stop"
    );
    let image = |traverse: &str| format!("traverses/{traverse}/steps/{stop}/images/left.png");
    let taken = server.get(&image(&paused.traverse)).await;
    if stage < 3 {
        assert_eq!(taken.status, 202, "{place}: it is to be asked for again");
        assert!(
            taken.text().contains(&format!("stop {stop} has no images yet")),
            "{place}: {}",
            taken.text()
        );
        let images = std::fs::read_dir(paused.folder.join("images")).map_or(0, Iterator::count);
        assert_eq!(images, 2 * stop, "{place}: nothing is rendered");
    } else {
        assert!(taken.bytes == server.get(&image(&unpaused.traverse)).await.bytes, "{place}: the image");
    }
}

/// Checks the reported decisions while the drive is paused before a stage of a stop.
fn check_decisions(drive: &Value, cycles: &[Value], (stop, stage): (usize, usize)) {
    let reported = drive["cycles"].as_array().unwrap();
    match stage {
        ..=6 => assert_eq!(reported.len(), stop, "{drive}"),
        7 => {
            assert_eq!(reported[stop]["goal"], cycles[stop]["goal"]);
            assert_eq!(reported[stop]["motion"], json!(null));
        }
        _ => {
            assert_eq!(reported[stop]["motion"], cycles[stop]["motion"]);
            assert_eq!(reported[stop]["report"], json!(null), "the rover has not moved");
        }
    }
    assert_eq!(reported[..stop], cycles[..stop]);
}

#[tokio::test(flavor = "multi_thread")]
async fn pausing_at_every_stage_does_not_change_a_drive() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let (wanted, cycles, summary) = by_command_line(drive.path());
    let server = TestServer::open(drive.path(), folder.path());
    let unpaused = ComparedDrive::drive(&server, folder.path()).await;
    let session = begin(&server, &json!({ "command": command(), "pause_at": 0 })).await;
    waited(&server, &session, is_paused(0, "drive")).await;
    let traverse = traverse_of(&server, &session).await;
    let paused = ComparedDrive { folder: folder.path().join("driven").join(&traverse), session, traverse };
    let path = format!("sessions/{}/drive", paused.session);
    for stop in 1..=2 {
        for (stage, before) in STAGES.into_iter().enumerate() {
            // Each stage is tested with one of the two forms of the same pause, in turn.
            let pause_command = pause_before(stop, stage, (stop + stage) % 2 == 0);
            server.json(Method::PUT, &path, &pause_command).await.expect(200);
            let drive = waited(&server, &paused.session, is_paused(stop, before)).await;
            check_pause(&server, &unpaused, &paused, (stop, stage)).await;
            check_decisions(&drive, &cycles, (stop, stage));
        }
    }
    server
        .json(Method::PUT, &path, &json!({ "target": 0, "run": 0, "command": command() }))
        .await
        .expect(200);
    let ended = waited(&server, &paused.session, has_ended).await;
    assert_eq!((&ended["cycles"], &ended["summary"]), (&json!(cycles), &summary));
    assert_eq!(ended["paused"], json!(null));
    assert_eq!(exported(&server, &paused.session, 0).await, wanted);
    assert_eq!(world(&paused.folder), world(&unpaused.folder));
    for stop in 0..wanted.len() {
        let image = |traverse: &str| format!("traverses/{traverse}/steps/{stop}/images/right.png");
        let [one, other] = [&paused.traverse, &unpaused.traverse].map(|traverse| image(traverse));
        assert!(server.get(&one).await.bytes == server.get(&other).await.bytes, "stop {stop}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_setting_changed_at_a_pause_is_used_on_the_same_inputs() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let (wanted, ..) = by_command_line(drive.path());
    let server = TestServer::open(drive.path(), folder.path());
    let pause = json!({ "when": "after", "stage": "locate" });
    let session = begin(&server, &json!({ "command": command(), "pause_at": 3, "pause": pause })).await;
    waited(&server, &session, is_paused(3, "judge")).await;
    let before = server.get(&step_path(&session, 0, 3)).await.expect(200);
    assert_eq!((&before["judge"], &before["begun"]["before"]), (&json!(null), &json!("judge")));

    // The step again with a limit that no match passes: it is the same up to the pause.
    let fork = json!({ "run": 0, "from_step": 3, "settings": { "ncc_min": 0.9999 } });
    server.post(&format!("sessions/{session}/targets/0/runs"), &fork).await.expect(202);
    let run = format!("sessions/{session}/targets/0/runs/1");
    let stop_3 = |run: &Value| run["rows"].as_array().is_some_and(|rows| rows.len() == 4);
    let mut view = server.get(&run).await.expect(200);
    while !stop_3(&view) {
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        view = server.get(&run).await.expect(200);
    }
    assert_eq!(view["complete"], json!(false));
    let again = server.get(&step_path(&session, 1, 3)).await.expect(200);
    assert_eq!(again, before);

    // A what-if also stops at the pause.
    let tried = json!({ "settings": { "ncc_min": 0.9999 } });
    let ghost = server.post(&format!("{}/what_if", step_path(&session, 0, 3)), &tried).await.expect(200);
    assert_eq!(ghost["verdict"], json!(null), "{ghost}");

    // Continued with the new limit, the step is rejected; with the former one it is not.
    let path = format!("sessions/{session}/drive");
    let pause_command = steering(1, 3, "after", "judge");
    server.json(Method::PUT, &path, &pause_command).await.expect(200);
    waited(&server, &session, is_paused(3, "update")).await;
    let judged = server.get(&step_path(&session, 1, 3)).await.expect(200);
    assert_eq!((&judged["judge"]["good"], &judged["update"]), (&json!(false), &json!(null)));
    assert_eq!(judged["locate"], before["locate"]);
    let whole_stop = json!({ "target": 0, "run": 1, "command": command(), "pause_at": 3 });
    server.json(Method::PUT, &path, &whole_stop).await.expect(200);
    waited(&server, &session, is_paused(3, "drive")).await;
    let rejected = server.get(&step_path(&session, 1, 3)).await.expect(200);
    assert_eq!(rejected["judge"], judged["judge"]);
    assert_ne!(rejected["update"], json!(null));
    // The run that drove before was tracked to the end, with the same result as without a pause.
    server.ended(&session, 0, 0).await;
    assert_eq!(exported(&server, &session, 0).await, wanted[..4]);
}

#[test]
fn a_drive_killed_at_a_pause_resumes_with_the_same_record() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let (wanted, cycles, _) = by_command_line(drive.path());
    let mut server = ServerProcess::start(drive.path(), data.path());
    let traverse = server.get("traverses")[0]["id"].clone();
    server.json("POST", "sessions", &json!({ "traverse": traverse }));
    let [x, y] = PIXEL;
    server.json("POST", "sessions/s1/targets", &json!({ "step": 0, "pixel": { "x": x, "y": y } }));
    server.json(
        "POST",
        "sessions/s1/targets/0/runs/0/drive",
        &json!({ "command": command(), "pause_at": 0 }),
    );
    wait(|| server.get("sessions/s2/drive"), waits_at(0));
    let rows_path = "sessions/s2/exports/rows.jsonl?target=0&run=0";
    for (stop, before) in [(1, "predict"), (1, "point_mast"), (1, "capture"), (2, "judge"), (3, "set_goal")] {
        server.json("PUT", "sessions/s2/drive", &steering(0, stop, "before", before));
        let waits = wait(|| server.get("sessions/s2/drive"), is_paused(stop, before));
        let record = (before != "predict").then(|| server.get(&step_path("s2", 0, stop)));
        let exported = server.raw("GET", rows_path, "", "");
        server.kill();
        // The command line exports the paused drive without continuing it.
        let out = data.path().join("rows.jsonl");
        let mut command = Command::new(program());
        command.args(["export", "rows.jsonl", "--session", "s2", "--data-dir"]).arg(data.path());
        let made = command.arg("--out").arg(&out).output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        assert_eq!(std::fs::read_to_string(&out).unwrap(), exported, "before {before}");
        std::fs::remove_file(out).unwrap();
        server = ServerProcess::start(drive.path(), data.path());
        assert_eq!(wait(|| server.get("sessions/s2/drive"), is_paused(stop, before)), waits);
        if let Some(record) = record {
            assert_eq!(server.get(&step_path("s2", 0, stop)), record, "before {before}");
        }
    }
    server.json("PUT", "sessions/s2/drive", &json!({ "target": 0, "run": 0, "command": command() }));
    let ended = wait(|| server.get("sessions/s2/drive"), has_ended);
    assert_eq!(ended["cycles"], json!(cycles));
    assert_eq!(rows(&server.raw("GET", rows_path, "", "")), wanted);
    server.kill();
}

#[tokio::test(flavor = "multi_thread")]
async fn pauses_that_make_no_sense_are_refused_in_a_sentence() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = begin(&server, &json!({ "command": command(), "pause_at": 0 })).await;
    let drive = waited(&server, &session, is_paused(0, "drive")).await;
    let mut no_stop = steering(0, 1, "after", "locate");
    no_stop["pause_at"] = json!(null);
    for (wrong, part) in [
        (
            steering(0, 1, "after", "stereo"),
            "`predict`, `point_mast`, `capture`, `locate`, `judge`, `update`",
        ),
        (steering(0, 1, "during", "locate"), "`before` or `after`"),
        (no_stop, "pause: a pause before or after a stage needs the stop, in `pause_at`"),
    ] {
        let refused = server.json(Method::PUT, &format!("sessions/{session}/drive"), &wrong).await;
        assert_eq!(refused.status.as_u16(), 422, "{wrong}");
        assert!(refused.text().contains(part), "{wrong}: {}", refused.text());
    }
    assert_eq!(server.get(&format!("sessions/{session}/drive")).await.expect(200), drive, "nothing changed");
}
