//! Termination of the program: SIGTERM ends it during any computation.

use std::io::Write;
use std::net::TcpStream;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::json;
use sightline_tests::server::{TOKEN, small_drive, small_scenario};

use crate::persistence::ServerProcess;

/// Maximum time for the program to end: a fraction of the time that building the world takes.
const PATIENCE: Duration = Duration::from_secs(20);

/// Processor time of a process, hundredths of a second.
fn ticks(id: u32) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit_once(") ").unwrap().1.split(' ').collect();
    fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
}

/// A scenario with the maximum number of rocks under the wheels at the first stop: its world takes many seconds to build.
pub(crate) fn crowded() -> String {
    let mut scenario = small_scenario();
    scenario.rocks.placed.clear();
    let rock = "{x_m=-5.0,y_m=0.5,diameter_m=2.0,height_m=0.1},";
    let rocks = format!("placed = [{}]", rock.repeat(1000).trim_end_matches(','));
    let text = scenario.to_toml();
    assert!(text.contains("[rocks]\n"), "{text}");
    text.replacen("[rocks]\n", &format!("[rocks]\n{rocks}\n"), 1)
}

#[test]
#[cfg(target_os = "linux")]
fn sigterm_ends_a_server_that_builds_a_world() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let mut server = ServerProcess::start_at("0", drive.path(), data.path());
    let id = server.process().id();
    let before = ticks(id);
    let body = json!({ "scenario": crowded() }).to_string();
    let mut request = TcpStream::connect(&server.address).unwrap();
    write!(
        request,
        "POST /api/v1/traverses HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {TOKEN}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        server.address,
        body.len()
    )
    .unwrap();
    let begun = Instant::now();
    // Reading the scenario takes less time.
    while ticks(id) < before + 300 {
        assert!(begun.elapsed() < Duration::from_secs(120), "the world is not begun");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(server.process().try_wait().unwrap().is_none());
    assert!(Command::new("kill").args(["-TERM", &id.to_string()]).status().unwrap().success());
    let signalled = Instant::now();
    let status = loop {
        if let Some(status) = server.process().try_wait().unwrap() {
            break status;
        }
        assert!(signalled.elapsed() < PATIENCE, "the program does not end");
        std::thread::sleep(Duration::from_millis(20));
    };
    assert!(status.success(), "{status}");
    drop(request);
}
