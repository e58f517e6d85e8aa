//! Data that survive the kill of a server, and user data: sessions, notes, documents.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use axum::http::{Method, header};
use serde_json::{Value, json};
use sightline_tests::server::{PIXEL, TOKEN, TestServer, request, small_drive};

use crate::cli::program;

/// Maximum time for a run.
pub(crate) const PATIENCE: Duration = Duration::from_secs(180);

/// The program, serving a drive.
pub(crate) struct ServerProcess {
    child: Child,
    /// Host and port.
    pub address: String,
}

impl ServerProcess {
    /// Serves on any free port.
    pub(crate) fn start(drive: &Path, data: &Path) -> Self {
        Self::start_at("0", drive, data)
    }

    /// Serves on a port; 0 is any free one.
    pub(crate) fn start_at(port: &str, drive: &Path, data: &Path) -> Self {
        Self::run(port, &[], drive, data)
    }

    /// Serves with additional environment variables.
    pub(crate) fn start_with(environment: &[(&str, &OsStr)], drive: &Path, data: &Path) -> Self {
        Self::run("0", environment, drive, data)
    }

    /// Serves with a limited number of descriptors and changed limits (`NAME=VALUE`).
    #[cfg(unix)]
    pub(crate) fn start_bounded(descriptors: u32, limits: &[&str], drive: &Path, data: &Path) -> Self {
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("ulimit -n {descriptors} && exec \"$0\" \"$@\"")).arg(program());
        shell.arg("serve").args(limits.iter().flat_map(|limit| ["--limit", limit]));
        Self::serve(shell, "0", drive, data)
    }

    fn run(port: &str, environment: &[(&str, &OsStr)], drive: &Path, data: &Path) -> Self {
        let mut program = Command::new(program());
        program.arg("serve").envs(environment.iter().copied());
        Self::serve(program, port, drive, data)
    }

    /// Starts the command `program`, completed by port and folders, and waits until it serves.
    fn serve(mut program: Command, port: &str, drive: &Path, data: &Path) -> Self {
        program.args([drive.to_str().unwrap(), "--port", port, "--data-dir", data.to_str().unwrap()]);
        program.env("SIGHTLINE_TOKEN", TOKEN);
        let mut child = program.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim().strip_prefix("Sightline is ready: http://").unwrap_or_else(|| panic!("{line}"));
        let (address, token) = url.split_once("/#token=").unwrap_or_else(|| panic!("{line}"));
        assert_eq!(token, TOKEN);
        Self { child, address: address.to_owned() }
    }

    /// The process.
    pub(crate) fn process(&mut self) -> &mut Child {
        &mut self.child
    }

    /// The process id.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// SIGKILL, as sent by the system when memory is exhausted: the program can write nothing more.
    pub(crate) fn kill(self) {
        drop(self);
    }

    /// Sends a request without waiting for its response.
    pub(crate) fn open(&self, method: &str, path: &str, headers: &str, body: &str) -> TcpStream {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        let length = body.len();
        let json =
            if body.is_empty() { String::new() } else { "Content-Type: application/json\r\n".to_owned() };
        write!(
            stream,
            "{method} /api/v1/{path} HTTP/1.0\r\nHost: {}\r\nAuthorization: Bearer {TOKEN}\r\n{json}{headers}Content-Length: {length}\r\n\r\n{body}",
            self.address
        )
        .unwrap();
        stream
    }

    /// Status, head and body of the response.
    fn whole(&self, method: &str, path: &str, headers: &str, body: &str) -> (u16, String, Vec<u8>) {
        let mut answer = Vec::new();
        self.open(method, path, headers, body).read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").expect("a head");
        let body = answer.split_off(end + 4);
        let head = String::from_utf8_lossy(&answer).into_owned();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), head, body)
    }

    /// Status and body of the response.
    pub(crate) fn answer(&self, method: &str, path: &str, headers: &str, body: &str) -> (u16, String) {
        let (status, _, body) = self.whole(method, path, headers, body);
        (status, String::from_utf8_lossy(&body).into_owned())
    }

    /// The body of a successful response.
    pub(crate) fn raw(&self, method: &str, path: &str, headers: &str, body: &str) -> String {
        let (status, head, body) = self.whole(method, path, headers, body);
        let body = String::from_utf8_lossy(&body).into_owned();
        assert!((200..300).contains(&status), "{method} {path}: {head}\n{body}");
        body
    }

    /// The bytes of a file.
    pub(crate) fn bytes(&self, path: &str) -> Vec<u8> {
        let (status, head, body) = self.whole("GET", path, "", "");
        assert_eq!(status, 200, "{path}: {head}");
        body
    }

    /// The JSON of a successful response; null without a body.
    pub(crate) fn json(&self, method: &str, path: &str, body: &Value) -> Value {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        serde_json::from_str(&self.raw(method, path, "", &body)).unwrap_or(Value::Null)
    }

    /// The JSON at a path.
    pub(crate) fn get(&self, path: &str) -> Value {
        self.json("GET", path, &Value::Null)
    }

    /// Waits until a run has ended; returns its rows as text.
    pub(crate) fn rows(&self, run: u64) -> String {
        let begun = Instant::now();
        loop {
            let view = self.get(&format!("sessions/s1/targets/0/runs/{run}"));
            if view["complete"] == json!(true) {
                return self.raw(
                    "GET",
                    &format!("sessions/s1/exports/rows.jsonl?target=0&run={run}"),
                    "",
                    "",
                );
            }
            assert!(begun.elapsed() < PATIENCE, "{view}");
            std::thread::sleep(Duration::from_millis(30));
        }
    }
}

impl Drop for ServerProcess {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

#[test]
fn a_killed_server_restores_the_same_rows_bit_for_bit() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let traverse = server.get("traverses")[0]["id"].clone();
    server.json("POST", "sessions", &json!({ "traverse": traverse }));
    let [x, y] = PIXEL;
    let target = json!({ "step": 0, "pixel": { "x": x, "y": y }, "label": "the <rock>" });
    server.json("POST", "sessions/s1/targets", &target);
    let first = server.rows(0);
    let fork = json!({ "run": 0, "from_step": 2, "settings": { "search_window_px": 81 } });
    server.json("POST", "sessions/s1/targets/0/runs", &fork);
    let second = server.rows(1);
    for text in ["first", "second, *bold*"] {
        let note = json!({ "target": 0, "run": 1, "step": 3, "stage": "judge", "pixel": { "x": 0.1, "y": 1.0 / 3.0 }, "text": text });
        server.json("POST", "sessions/s1/notes", &note);
    }
    server.raw("PUT", "documents/layout", "If-None-Match: *\r\n", &json!({ "panels": [1, 2] }).to_string());
    let notes = server.get("sessions/s1/notes");
    assert_eq!(notes.as_array().map(Vec::len), Some(2), "{notes}");
    let cursor = json!({ "target": 0, "run": 1, "step": 4 });
    server.json("PUT", "sessions/s1/cursor", &cursor);
    // A cursor move of the last second may be lost; this one was earlier.
    std::thread::sleep(Duration::from_millis(1100));
    // A third run is killed before its end.
    let third = json!({ "run": 0, "from_step": 0, "settings": { "template_size_px": 17 } });
    server.json("POST", "sessions/s1/targets/0/runs", &third);
    let before = server.get("sessions/s1");
    server.kill();

    let server = ServerProcess::start(drive.path(), data.path());
    assert_eq!(server.get("health")["notices"], json!([]));
    assert_eq!(server.rows(0), first);
    assert_eq!(server.rows(1), second);
    let after = server.get("sessions/s1");
    for key in ["cursor", "traverse", "stop_count"] {
        assert_eq!(after[key], before[key], "{key}");
    }
    for run in 0..3 {
        for key in ["fork", "settings"] {
            let path = |view: &Value| view["targets"][0]["runs"][run][key].clone();
            assert_eq!(path(&after), path(&before), "run {run}: {key}");
        }
    }
    assert_eq!(after["targets"][0]["label"], json!("the <rock>"));
    assert_eq!(server.rows(2).lines().count(), 5, "the run that was killed in the middle goes on");
    assert_eq!(server.get("sessions/s1/notes"), notes);
    assert_eq!(server.get("documents/layout")["value"], json!({ "panels": [1, 2] }));
    server.kill();
}

#[test]
fn a_server_killed_while_writing_keeps_confirmed_changes() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let mut confirmed = 0;
    for round in 0..4 {
        let server = ServerProcess::start(drive.path(), data.path());
        assert_eq!(server.get("health")["notices"], json!([]), "round {round}");
        if round == 0 {
            let traverse = server.get("traverses")[0]["id"].clone();
            server.json("POST", "sessions", &json!({ "traverse": traverse }));
            server.json("POST", "sessions/s1/notes", &json!({ "step": 0, "text": "0" }));
        }
        let note = server.get("sessions/s1/notes/1");
        let stored: u64 = note["text"].as_str().unwrap().parse().unwrap();
        assert!(stored >= confirmed, "round {round}: {stored} was kept, and {confirmed} confirmed");
        assert!(stored <= confirmed + 1, "round {round}: {stored} was never asked for");
        // Another thread writes continuously until the server is killed.
        let address = server.address.clone();
        let writer = std::thread::spawn(move || write_until_it_fails(&address, stored));
        std::thread::sleep(Duration::from_millis(400 + 90 * round));
        server.kill();
        confirmed = writer.join().unwrap();
        assert!(confirmed > stored, "round {round}: nothing was written, so that nothing is tested");
    }
}

/// Writes increasing numbers into the first note; returns the last one that was confirmed.
fn write_until_it_fails(address: &str, stored: u64) -> u64 {
    let mut confirmed = stored;
    loop {
        let body = json!({ "text": (confirmed + 1).to_string() }).to_string();
        let Ok(mut stream) = TcpStream::connect(address) else { return confirmed };
        let head = format!(
            "PATCH /api/v1/sessions/s1/notes/1 HTTP/1.0\r\nHost: {address}\r\nIf-Match: *\r\nAuthorization: Bearer {TOKEN}\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        let mut answer = Vec::new();
        let sent = stream.write_all(head.as_bytes()).and_then(|()| stream.read_to_end(&mut answer));
        if sent.is_err() || !answer.starts_with(b"HTTP/1.0 200") {
            return confirmed;
        }
        confirmed += 1;
    }
}

#[cfg(unix)]
#[test]
fn an_orderly_end_keeps_the_cursor_that_has_just_moved() {
    let drive = small_drive();
    // Shutdown of the system, a closed terminal, and Ctrl-C.
    for signal in ["-TERM", "-HUP", "-INT"] {
        let data = tempfile::tempdir().unwrap();
        let mut server = ServerProcess::start(drive.path(), data.path());
        let traverse = server.get("traverses")[0]["id"].clone();
        server.json("POST", "sessions", &json!({ "traverse": traverse }));
        server.json("PUT", "sessions/s1/cursor", &json!({ "target": null, "run": 0, "step": 3 }));
        let pid = server.child.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
        assert!(server.child.wait().unwrap().success(), "{signal}");
        let server = ServerProcess::start(drive.path(), data.path());
        assert_eq!(server.get("sessions/s1")["cursor"]["step"], json!(3), "{signal}");
        server.kill();
    }
}

#[test]
fn a_damaged_database_is_moved_aside_with_a_notice() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let folder = data.path().join("sessions");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("sessions.redb"), b"these are not the bytes of a database").unwrap();
    let server = ServerProcess::start(drive.path(), data.path());
    let notices = server.get("health")["notices"].to_string();
    assert!(
        notices.contains("sessions.redb is damaged") && notices.contains("sessions.redb.damaged"),
        "{notices}"
    );
    assert_eq!(server.get("sessions"), json!([]));
    server.kill();
    assert_eq!(
        std::fs::read(folder.join("sessions.redb.damaged")).unwrap(),
        b"these are not the bytes of a database"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn notes_are_listed_changed_moved_removed_and_brought_back() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    let path = format!("sessions/{session}/notes");
    let mut events = server.state.events().subscribe();
    let made = server.post(&path, &json!({ "step": 2, "text": "here" })).await;
    assert_eq!((made.status.as_u16(), made.headers[header::ETAG].to_str().unwrap()), (201, "\"1\""));
    assert!(made.json()["made"].as_str().unwrap().ends_with('Z'));
    let event = serde_json::to_value(events.try_recv().unwrap()).unwrap();
    assert_eq!(event, json!({ "event": "notes_changed", "session": session }));
    server.post(&path, &json!({ "step": 1, "text": "there" })).await.expect(201);
    let change = |method: Method, note: u64, revision: Option<&'static str>, body: Value| {
        let mut change =
            request(method, &format!("{path}/{note}")).header(header::CONTENT_TYPE, "application/json");
        if let Some(revision) = revision {
            change = change.header(header::IF_MATCH, revision);
        }
        let body = if body.is_null() { axum::body::Body::empty() } else { body.to_string().into() };
        server.send(change.body(body).unwrap())
    };
    change(Method::PATCH, 1, None, json!({ "text": "x" })).await.problem(428, "if_match");
    let edited =
        change(Method::PATCH, 1, Some("\"1\""), json!({ "text": "changed", "place": 1 })).await.expect(200);
    assert_eq!((&edited["revision"], &edited["text"]), (&json!(2), &json!("changed")));
    let lost =
        change(Method::PATCH, 1, Some("\"1\""), json!({ "text": "lost" })).await.problem(412, "changed");
    assert!(lost.contains("revision is 2"), "{lost}");
    change(Method::PATCH, 1, Some("*"), json!({ "colour": 3 })).await.problem(422, "field");
    let order = |list: &Value| {
        list.as_array().unwrap().iter().map(|note| note["id"].as_u64().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(order(&server.get(&path).await.expect(200)), [2, 1]);
    assert_eq!(change(Method::DELETE, 2, Some("\"1\""), Value::Null).await.status.as_u16(), 204);
    assert_eq!(order(&server.get(&path).await.expect(200)), [1]);
    server.post(&format!("{path}/2/restore"), &json!({})).await.expect(200);
    assert_eq!(order(&server.get(&path).await.expect(200)), [2, 1]);
    server.post(&path, &json!({ "step": 99, "text": "x" })).await.problem(422, "request");
    server.post(&path, &json!({ "step": 0, "text": " " })).await.problem(422, "request");
    server.get(&format!("{path}/77")).await.problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn documents_have_plain_names_a_size_and_a_revision() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let put = |name: &str, header: (header::HeaderName, &'static str), body: Value| {
        let put = request(Method::PUT, &format!("documents/{name}"))
            .header(header::CONTENT_TYPE, "application/json");
        server.send(put.header(header.0, header.1).body(body.to_string().into()).unwrap())
    };
    let new = || (header::IF_NONE_MATCH, "*");
    put("layout.mine", new(), json!([1])).await.expect(200);
    put("layout.mine", new(), json!([2])).await.problem(412, "changed");
    let second = put("layout.mine", (header::IF_MATCH, "\"1\""), json!([2])).await.expect(200);
    assert_eq!((&second["revision"], &second["value"]), (&json!(2), &json!([2])));
    put("..%2Fx", new(), json!(1)).await.problem(422, "field");
    put("big", new(), json!("x".repeat(300 << 10))).await.problem(413, "too_large");
    assert_eq!(server.get("documents").await.expect(200).as_array().unwrap().len(), 1);
    let remove = request(Method::DELETE, "documents/layout.mine").header(header::IF_MATCH, "\"2\"");
    assert_eq!(server.send(remove.body(axum::body::Body::empty()).unwrap()).await.status.as_u16(), 204);
    server.get("documents/layout.mine").await.problem(404, "not_found");
}
