//! Load: many sessions, slow connections, exports, abandoned questions; reading during long computations.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::PoisonError;
use std::time::{Duration, Instant};

use serde_json::json;
use sightline_tests::server::{long_recording, small_drive};

use super::{EXCLUSIVE, Watched, begin, has_ended, p95_ms, print_row, scale, until};
use crate::persistence::ServerProcess;

/// Reads a step as the page does (record, one image, cursor move); returns the time that it took.
fn step(server: &ServerProcess, session: &str, traverse: &str, step: usize) -> Duration {
    let begun = Instant::now();
    let cursor = json!({ "target": 0, "run": 0, "step": step });
    server.json("PUT", &format!("sessions/{session}/cursor"), &cursor);
    server.get(&format!("sessions/{session}/targets/0/runs/0/steps/{step}"));
    server.bytes(&format!("traverses/{traverse}/steps/{step}/images/left.png"));
    begun.elapsed()
}

fn traverse(server: &ServerProcess) -> String {
    server.get("traverses")[0]["id"].as_str().unwrap().to_owned()
}

/// Steps through many sessions for some time and removes them; returns the time of each step.
fn step_through(server: &ServerProcess, traverse: &str, count: usize, lasting: Duration) -> Vec<Duration> {
    let sessions: Vec<String> = (0..count).map(|_| begin(server, 0)).collect();
    for session in &sessions {
        until(server, &format!("sessions/{session}/targets/0/runs/0"), has_ended);
    }
    let begun = Instant::now();
    let stepping = |session: &String| {
        let mut times = vec![step(server, session, traverse, 0)];
        while begun.elapsed() < lasting {
            times.push(step(server, session, traverse, times.len() % 5));
        }
        times
    };
    let times: Vec<Duration> = std::thread::scope(|scope| {
        let all: Vec<_> = sessions.iter().map(|session| scope.spawn(move || stepping(session))).collect();
        all.into_iter().flat_map(|one| one.join().unwrap()).collect()
    });
    assert!(times.len() >= count, "every session has stepped");
    for session in &sessions {
        server.json("DELETE", &format!("sessions/{session}"), &json!(null));
    }
    times
}

#[test]
fn drill_many_sessions_step_at_the_same_time() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let (count, lasting) = (scale(64, 6), Duration::from_secs(scale(90, 1)));
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let traverse = traverse(&server);
    // First create everything that is created only once: images, threads of the tracker.
    step_through(&server, &traverse, scale(4, 1), Duration::from_secs(scale(2, 0)));
    let mut watched = Watched::of(&server, Duration::from_secs(scale(15, 12)), || {
        step_through(&server, &traverse, count, lasting)
    });
    let (steps, p95) = (watched.value.len(), p95_ms(&mut watched.value));
    watched.print_row(
        &format!("{count} sessions step for {} s", lasting.as_secs()),
        &format!("{steps} steps, p95 {p95:.0} ms"),
    );
    watched.assert_released();
    assert_eq!(server.get("health")["notices"], json!([]));
}

/// A connection that sends the head of a request one character at a time.
struct SlowConnection {
    stream: TcpStream,
    sent: usize,
}

impl SlowConnection {
    /// Sends another character; returns whether the connection is still open.
    fn send_next(&mut self) -> bool {
        const HEAD: &[u8] = b"GET /api/v1/version HTTP/1.1\r\nX-Slow: ";
        self.stream.set_nonblocking(true).unwrap();
        let read = self.stream.read(&mut [0_u8; 512]);
        let is_open = read.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock);
        let letter = [HEAD.get(self.sent).copied().unwrap_or(b'x')];
        self.sent += 1;
        is_open && self.stream.write_all(&letter).is_ok()
    }
}

#[cfg(unix)]
#[test]
fn drill_slow_connections_leave_room_for_others() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let (count, lasting) = (scale(900, 120), Duration::from_secs(scale(75, 2)));
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    // Fewer descriptors than slow connections.
    let server = ServerProcess::start_bounded(scale(256, 128), &[], drive.path(), data.path());
    let watched = Watched::of(&server, Duration::from_secs(scale(5, 1)), || {
        // A client whose connection is closed reconnects immediately.
        let connect = || SlowConnection { stream: TcpStream::connect(&server.address).unwrap(), sent: 0 };
        let mut open: Vec<SlowConnection> = (0..count).map(|_| connect()).collect();
        let begun = Instant::now();
        let (mut times, mut closed) = (Vec::new(), 0);
        while begun.elapsed() < lasting {
            for one in &mut open {
                if !one.send_next() {
                    closed += 1;
                    *one = connect();
                }
            }
            let asked = Instant::now();
            server.get("version");
            times.push(asked.elapsed());
            std::thread::sleep(Duration::from_millis(200));
        }
        (times.len(), p95_ms(&mut times), closed)
    });
    let (answered, p95, closed) = watched.value;
    watched.print_row(
        &format!("{count} slow connections for {} s, {} descriptors", lasting.as_secs(), scale(256, 128)),
        &format!("{answered} others answered, p95 {p95:.0} ms; {closed} slow ones closed"),
    );
    watched.assert_released();
}

#[test]
fn drill_exports_give_everything_back() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let count: usize = scale(1000, 12);
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let session = begin(&server, 0);
    until(&server, &format!("sessions/{session}/targets/0/runs/0"), has_ended);
    let files = ["recording.rrd", "rows.csv", "rows.parquet", "report.html"];
    let export = |number: usize| {
        let file = files[number % files.len()];
        server.bytes(&format!("sessions/{session}/exports/{file}")).len()
    };
    // First create everything that is created only once: fonts, the sources of the page, caches.
    (0..files.len()).for_each(|number| assert!(export(number) > 0));
    let watched =
        Watched::of(&server, Duration::from_secs(scale(15, 1)), || (0..count).map(export).sum::<usize>());
    watched.print_row(&format!("{count} exports"), &format!("{} MB written", watched.value / 1_000_000));
    watched.assert_released();
}

#[test]
fn drill_abandoned_questions_end() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let count = scale(100, 8);
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let session = begin(&server, 0);
    until(&server, &format!("sessions/{session}/targets/0/runs/0"), has_ended);
    let path = format!("sessions/{session}/targets/0/runs/0/steps/2/what_if");
    let body = json!({ "settings": { "tracker": "features" } });
    let ask = || {
        let begun = Instant::now();
        server.json("POST", &path, &body);
        begun.elapsed().as_secs_f64()
    };
    let alone = ask();
    let watched = Watched::of(&server, Duration::from_secs(scale(15, 1)), || {
        for _ in 0..count {
            let mut stream = server.open("POST", &path, "", &body.to_string());
            stream.flush().unwrap();
            std::thread::sleep(Duration::from_millis(20));
        }
        ask()
    });
    watched.print_row(
        &format!("{count} abandoned questions (what_if)"),
        &format!("the next one takes {:.2} s, {alone:.2} s alone", watched.value),
    );
    watched.assert_released();
}

#[test]
fn drill_steps_are_read_beside_long_work() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let (stops, reads) = (scale(4805, 2405), scale(300, 10));
    let (drive, data) = (long_recording(stops), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let traverse = traverse(&server);
    let session = begin(&server, stops - 5);
    until(&server, &format!("sessions/{session}/targets/0/runs/0"), has_ended);
    let read = || -> Vec<Duration> {
        (0..reads).map(|number| step(&server, &session, &traverse, stops - 5 + number % 5)).collect()
    };
    let idle = p95_ms(&mut read());
    let study = server.json("POST", "studies/jobs", &json!({ "study": "straight", "seeds": [1, 2, 3] }));
    let long = [begin(&server, 0), begin(&server, 0)];
    let watched = Watched::of(&server, Duration::ZERO, || {
        let beside = p95_ms(&mut read());
        let begun = Instant::now();
        let short = begin(&server, stops - 5);
        let path = format!("sessions/{short}/targets/0/runs/0");
        until(&server, &path, |run| run["rows"].as_array().is_some_and(|rows| !rows.is_empty()));
        let started = begun.elapsed();
        until(&server, &path, has_ended);
        (beside, started, begun.elapsed())
    });
    let (beside, started, ended) = watched.value;
    for session in &long {
        let path = format!("sessions/{session}/targets/0/runs/0");
        assert!(!has_ended(&server.get(&path)), "the long runs went on meanwhile");
    }
    let job = server.get(&format!("studies/jobs/{}", study["id"].as_str().unwrap_or("1")));
    watched.print_row(
        "steps beside two long runs and a study",
        &format!("p95 {idle:.1} ms alone, {beside:.1} ms beside them"),
    );
    print_row(
        "a short run beside them",
        &format!(
            "first step after {:.2} s, five after {:.2} s; the study is {}",
            started.as_secs_f64(),
            ended.as_secs_f64(),
            job["state"]
        ),
    );
}
