//! Termination of the program during work.

use std::io::Write;
use std::process::Command;
use std::sync::PoisonError;
use std::time::{Duration, Instant};

use serde_json::json;
use sightline_tests::server::{long_recording, small_drive};

use super::{EXCLUSIVE, begin, has_ended, print_row, scale, until};
use crate::persistence::ServerProcess;
use crate::shutdown::crowded;

/// Maximum time for the program to end, s; much less than its work takes, also on a busy machine.
const PATIENCE_S: [u64; 2] = [2, 20];

/// A load, with its name.
type Load = (&'static str, fn(&ServerProcess));

/// Sends SIGTERM to a server and waits for its end; returns the time that it took.
fn terminate(mut server: ServerProcess) -> Duration {
    let id = server.id().to_string();
    let signalled = Instant::now();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    loop {
        if let Some(status) = server.process().try_wait().unwrap() {
            assert!(status.success(), "{status}");
            return signalled.elapsed();
        }
        let patience = Duration::from_secs(scale(PATIENCE_S[0], PATIENCE_S[1]));
        assert!(signalled.elapsed() < patience, "the program does not end");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn drill_the_program_ends_under_any_load() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let stops = scale(4805, 1205);
    let drive = long_recording(stops);
    let loads: [Load; 5] = [
        ("nothing", |_| {}),
        ("two long runs and a study", |server| {
            begin(server, 0);
            begin(server, 0);
            server.json("POST", "studies/jobs", &json!({ "study": "straight", "seeds": [1, 2, 3] }));
        }),
        ("questions (what_if)", |server| {
            let session = begin(server, 0);
            until(server, &format!("sessions/{session}/targets/0/runs/0"), |run| !run["rows"][2].is_null());
            let path = format!("sessions/{session}/targets/0/runs/0/steps/1/what_if");
            let body = json!({ "settings": { "tracker": "combined" } }).to_string();
            for _ in 0..20 {
                drop(server.open("POST", &path, "", &body));
            }
        }),
        ("exports", |server| {
            let session = begin(server, 0);
            until(server, &format!("sessions/{session}/targets/0/runs/0"), |run| !run["rows"][2].is_null());
            for file in ["recording.rrd", "report.html", "rows.parquet"] {
                drop(server.open("GET", &format!("sessions/{session}/exports/{file}"), "", ""));
            }
        }),
        ("a world of 1,000 rocks", |server| {
            let body = json!({ "scenario": crowded() }).to_string();
            let mut stream = server.open("POST", "traverses", "", &body);
            stream.flush().unwrap();
            // Reading the scenario takes less time.
            std::thread::sleep(Duration::from_secs(4));
        }),
    ];
    let mut times = Vec::new();
    for (name, load) in loads {
        let data = tempfile::tempdir().unwrap();
        let server = ServerProcess::start(drive.path(), data.path());
        load(&server);
        std::thread::sleep(Duration::from_millis(300));
        times.push(format!("{name} {:.2} s", terminate(server).as_secs_f64()));
    }
    print_row("SIGTERM under load", &times.join(", "));
}

#[test]
fn drill_what_was_acknowledged_survives_kills_during_runs() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let rounds: u64 = scale(20, 2);
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let mut rows = None;
    for round in 0..rounds {
        let server = ServerProcess::start(drive.path(), data.path());
        assert_eq!(server.get("health")["notices"], json!([]), "round {round}");
        for before in 1..=round {
            let path = format!("sessions/s{before}/targets/0/runs/0");
            until(&server, &path, has_ended);
            let text = server.raw("GET", &format!("sessions/s{before}/exports/rows.jsonl"), "", "");
            let first = rows.get_or_insert_with(|| text.clone());
            assert_eq!(&text, first, "a run that was interrupted has the same numbers");
        }
        assert_eq!(begin(&server, 0), format!("s{}", round + 1));
        std::thread::sleep(Duration::from_millis(17 * round));
        server.kill();
    }
    print_row(
        "kill −9 during runs",
        &format!("{rounds} kills, every session is there and its rows are the same bits"),
    );
}
