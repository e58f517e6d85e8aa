//! After the kill of a server: permissions of its files, exports without a server, and counterfactual questions that
//! continue.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::json;
use sightline_tests::server::{PIXEL, small_drive};

use crate::cli::program;
use crate::persistence::{PATIENCE, ServerProcess};

#[cfg(unix)]
#[test]
fn stored_files_are_readable_by_the_owner_only() {
    use std::os::unix::fs::PermissionsExt;
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let (drive, home) = (small_drive(), tempfile::tempdir().unwrap());
    let data = home.path().join("data");
    let server = ServerProcess::start(drive.path(), &data);
    let traverse = server.get("traverses")[0]["id"].clone();
    server.json("POST", "sessions", &json!({ "traverse": traverse }));
    server.kill();
    let (folder, file) = (data.join("sessions"), data.join("sessions/sessions.redb"));
    let folders = ["sessions", "studies", "traverses", "driven", "digests"].map(|name| data.join(name));
    assert_eq!((mode(&data), mode(&file)), (0o700, 0o600));
    assert_eq!(folders.each_ref().map(|folder| mode(folder)), [0o700; 5]);
    // Permissions of an earlier version.
    for (path, wide) in [(&folder, 0o755), (&file, 0o644)] {
        std::fs::set_permissions(path, PermissionsExt::from_mode(wide)).unwrap();
    }
    let server = ServerProcess::start(drive.path(), &data);
    assert_eq!(server.get("sessions").as_array().map(Vec::len), Some(1));
    assert_eq!((mode(&folder), mode(&file)), (0o700, 0o600));
    server.kill();
}

#[test]
fn exporting_from_a_killed_server_leaves_its_file_untouched() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let traverse = server.get("traverses")[0]["id"].clone();
    server.json("POST", "sessions", &json!({ "traverse": traverse }));
    let [x, y] = PIXEL;
    server.json("POST", "sessions/s1/targets", &json!({ "step": 0, "pixel": { "x": x, "y": y } }));
    let rows = server.rows(0);
    server.kill();
    let file = data.path().join("sessions/sessions.redb");
    let before = std::fs::read(&file).unwrap();
    let out = data.path().join("rows.jsonl");
    let export = |out: &Path| {
        let mut command = Command::new(program());
        command.args(["export", "rows.jsonl", "--session", "s1"]).arg(drive.path());
        command.arg("--data-dir").arg(data.path()).arg("--out").arg(out).output().unwrap()
    };
    let made = export(&out);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(std::fs::read_to_string(&out).unwrap(), rows);
    assert!(std::fs::read(&file).unwrap() == before, "the database was changed");
    // Of a damaged file, the parts that can be verified are exported.
    let mut damaged = before;
    damaged[9..4096].fill(0);
    std::fs::write(&file, &damaged).unwrap();
    let again = data.path().join("again.jsonl");
    let made = export(&again);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(std::fs::read_to_string(&again).unwrap(), rows);
    assert!(std::fs::read(&file).unwrap() == damaged, "the database was changed");
}

#[test]
fn an_interrupted_question_is_answered_after_a_restart() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let mut answers = Vec::new();
    for is_killed in [false, true] {
        let data = data.path().join(is_killed.to_string());
        let mut server = ServerProcess::start(drive.path(), &data);
        let traverse = server.get("traverses")[0]["id"].clone();
        server.json("POST", "sessions", &json!({ "traverse": traverse }));
        let [x, y] = PIXEL;
        server.json("POST", "sessions/s1/targets", &json!({ "step": 0, "pixel": { "x": x, "y": y } }));
        server.rows(0);
        let lost = json!({ "run": 0, "from_step": 2, "settings": { "ncc_min": 0.9999 } });
        server.json("POST", "sessions/s1/targets/0/runs", &lost);
        server.rows(1);
        let path = "sessions/s1/targets/0/runs/1/steps/2/counterfactual";
        let question = server.json("POST", path, &json!({}));
        assert_ne!(question["state"], json!("done"), "too quick to be interrupted");
        if is_killed {
            server.kill();
            server = ServerProcess::start(drive.path(), &data);
        }
        let begun = Instant::now();
        let question = loop {
            let question = server.get(path);
            if question["state"] == json!("done") {
                break question;
            }
            assert!(begun.elapsed() < PATIENCE, "{question}");
            std::thread::sleep(Duration::from_millis(30));
        };
        answers.push(question["answer"].clone());
        // Once computed, the answer is returned immediately.
        server.kill();
        let server = ServerProcess::start(drive.path(), &data);
        assert_eq!(server.get(path), question);
        assert_eq!(server.get("health")["notices"], json!([]));
        server.kill();
    }
    assert_eq!(answers[0], answers[1]);
    assert!(!answers[0]["findings"].as_array().unwrap().is_empty());
}
