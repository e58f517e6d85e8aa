//! A full disk, and missing images.

use std::path::Path;
use std::process::Command;
use std::sync::PoisonError;

use serde_json::{Value, json};
use sightline_tests::server::{small_drive, small_recording};

use super::{EXCLUSIVE, begin, has_ended, print_row, until};
use crate::cli::program;
use crate::persistence::ServerProcess;

/// A small file system in memory, which needs administrator rights.
struct SmallDisk(tempfile::TempDir);

impl SmallDisk {
    fn make() -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", "size=8m", "tmpfs"]).arg(folder.path());
        mount.output().is_ok_and(|made| made.status.success()).then(|| Self(folder))
    }

    fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        Command::new("umount").arg(self.0.path()).status().unwrap();
    }
}

#[test]
fn drill_a_full_disk_is_reported_and_later_writes_succeed() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(disk) = SmallDisk::make() else {
        print_row("full disk", "left out: only an administrator may mount a small file system");
        return;
    };
    let drive = small_drive();
    let server = ServerProcess::start(drive.path(), disk.path());
    let session = begin(&server, 0);
    until(&server, &format!("sessions/{session}/targets/0/runs/0"), has_ended);
    let filler = disk.path().join("filler");
    // Fails because the disk is full, as intended.
    assert!(std::fs::write(&filler, vec![1_u8; 16 << 20]).is_err(), "the disk is too large");
    let note = |number: usize| json!({ "step": 0, "text": format!("{number} {}", "x".repeat(3000)) });
    let notes = format!("sessions/{session}/notes");
    let mut acknowledged = 0;
    let refused = (0..500).find_map(|number| {
        let (status, body) = server.answer("POST", &notes, "", &note(number).to_string());
        acknowledged += usize::from(status == 201);
        (status != 201).then_some((status, body))
    });
    let (status, body) = refused.expect("the disk is full");
    assert_eq!(status, 507, "{body}");
    assert!(body.contains("Make room on the disk"), "{body}");
    let health = server.get("health");
    assert!(health["notices"].to_string().contains("changes cannot be saved"), "{health}");
    let in_vain = refused_changes(&server, &session);
    exports_are_whole_or_absent(disk.path(), &drive.path().join("traverse.toml"));
    std::fs::remove_file(&filler).unwrap();
    // The server detects the free space without any change by a user.
    until(&server, "health", |health| health["notices"] == json!([]));
    for number in 0..20 {
        server.json("POST", &notes, &note(number));
    }
    assert_eq!(server.get("health")["notices"], json!([]));
    let count = |server: &ServerProcess| server.get(&notes).as_array().unwrap().len();
    assert_eq!(count(&server), acknowledged + 20);
    server.kill();
    let server = ServerProcess::start(drive.path(), disk.path());
    assert_eq!(count(&server), acknowledged + 20);
    print_row(
        "full disk, and space again",
        &format!(
            "{acknowledged} + 20 changes acknowledged and kept; {in_vain} more refused with {status} and taken back; health \
             reports it until there is room"
        ),
    );
}

/// The visible state of a session.
fn shown(server: &ServerProcess, session: &str) -> Vec<Value> {
    let paths = ["", "/notes", "/breakpoints"].map(|part| format!("sessions/{session}{part}"));
    let all = paths.iter().map(String::as_str).chain(["sessions", "documents", "studies/jobs"]);
    let mut shown: Vec<Value> = all.map(|path| server.get(path)).collect();
    // The time since the last use increases.
    for entry in shown.iter_mut().filter_map(Value::as_array_mut).flatten() {
        entry.as_object_mut().and_then(|fields| fields.remove("idle_s"));
    }
    shown
}

/// Tries changes of every kind on a full disk until one of each is refused without effect; returns the number of refusals.
fn refused_changes(server: &ServerProcess, session: &str) -> usize {
    let traverse = server.get("traverses")[0]["id"].clone();
    let [x, y] = sightline_tests::server::PIXEL;
    let at = |part: &str| format!("sessions/{session}/{part}");
    let changes = [
        ("POST", "sessions".to_owned(), json!({ "traverse": traverse })),
        ("POST", at("targets"), json!({ "step": 0, "pixel": { "x": x, "y": y } })),
        ("POST", at("targets/0/runs"), json!({ "run": 0, "from_step": 2 })),
        ("POST", at("breakpoints"), json!({ "expression": "ncc < 0.5" })),
        ("PUT", "documents/large".to_owned(), json!("z".repeat(200 << 10))),
        ("POST", "studies/jobs".to_owned(), json!({ "study": "straight", "seeds": [1] })),
        ("DELETE", at("targets/0"), Value::Null),
    ];
    let mut refused = 0;
    for (method, path, body) in changes {
        let before = shown(server, session);
        let text = if body.is_null() { String::new() } else { body.to_string() };
        let (status, answer) = server.answer(method, &path, "If-Match: *\r\n", &text);
        // A small change may still fit into the file.
        if status < 300 {
            continue;
        }
        assert_eq!(status, 507, "{method} {path}: {answer}");
        assert!(answer.contains("Make room on the disk"), "{answer}");
        assert_eq!(shown(server, session), before, "{method} {path}");
        refused += 1;
    }
    assert!(refused > 0, "there is room for everything");
    refused
}

/// Exports on a full disk fail with an error and leave no file.
fn exports_are_whole_or_absent(disk: &Path, index: &Path) {
    for (kind, name) in [("report.html", "report.html"), ("recording.rrd", "run.rrd")] {
        let out = disk.join(name);
        let [x, y] = sightline_tests::server::PIXEL;
        let mut command = Command::new(program());
        command.args(["export", kind]).arg(index).args(["--target", &format!("{x},{y}"), "--out"]).arg(&out);
        let made = command.output().unwrap();
        let said = String::from_utf8_lossy(&made.stderr);
        assert_eq!(made.status.code(), Some(3), "{said}");
        assert!(said.contains("No space left"), "{said}");
        assert!(!out.exists(), "half of {kind}");
    }
    let left = std::fs::read_dir(disk).unwrap().flatten();
    let left: Vec<_> =
        left.filter(|entry| entry.path().extension().is_some_and(|e| e == "partial")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn drill_deleted_images_end_a_run_until_they_return() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let (drive, data) = (small_recording(), tempfile::tempdir().unwrap());
    let index = std::fs::read_to_string(drive.path().join("traverse.toml")).unwrap();
    let images: Vec<_> = index
        .lines()
        .filter_map(|line| line.trim().strip_prefix("image = \"")?.strip_suffix('"'))
        .map(|name| drive.path().join(name))
        .collect();
    assert!(images.len() >= 10, "{images:?}");
    let server = ServerProcess::start(drive.path(), data.path());
    let session = begin(&server, 0);
    until(&server, &format!("sessions/{session}/targets/0/runs/0"), has_ended);
    let rows = server.raw("GET", &format!("sessions/{session}/exports/rows.jsonl"), "", "");
    server.kill();

    let (hidden, data) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let place = |number: usize| hidden.path().join(number.to_string());
    for (number, image) in images.iter().enumerate().skip(4) {
        std::fs::copy(image, place(number)).unwrap();
        std::fs::remove_file(image).unwrap();
    }
    assert_eq!(begin(&server, 0), session);
    let path = format!("sessions/{session}/targets/0/runs/0");
    let damaged = until(&server, &path, has_ended);
    let traverse = server.get("traverses")[0]["id"].as_str().unwrap().to_owned();
    let image = format!("traverses/{traverse}/steps/3/images/left.png");
    let (status, body) = server.answer("GET", &image, "", "");
    assert!((400..500).contains(&status), "{status}: {body}");
    for (number, image) in images.iter().enumerate().skip(4) {
        std::fs::copy(place(number), image).unwrap();
    }
    // The steps with damaged files are stored unchanged; a fork computes them again.
    let fork = json!({ "run": 0, "from_step": 2 });
    server.json("POST", &format!("sessions/{session}/targets/0/runs"), &fork);
    until(&server, &format!("sessions/{session}/targets/0/runs/1"), has_ended);
    let again = server.raw("GET", &format!("sessions/{session}/exports/rows.jsonl?target=0&run=1"), "", "");
    let numbers = |rows: &str| rows.replace("\"run\":1", "\"run\":0");
    assert_eq!(numbers(&again), numbers(&rows));
    let reason = damaged["rows"][2]["reason"].as_str().unwrap_or_default().to_owned();
    assert!(!reason.is_empty(), "{damaged}");
    print_row(
        "images deleted and brought back",
        &format!("the image is refused with {status}, the step says why, a fork from it has the former bits"),
    );
}
