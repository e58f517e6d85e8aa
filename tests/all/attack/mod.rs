//! Attacks over HTTP, as a table: the bytes sent to a listening server, and the response that is required.
//!
//! Every response to an attack must also have the headers that exclude other sites, and must not contain the access token.

mod access;
mod proxied;
mod rerun_stream;
mod single;
mod table;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

use sightline_recordings::Traverse;
use sightline_server::access::Access;
use sightline_server::state::AppState;
use sightline_tests::server::{PIXEL, TOKEN, small_drive};
use tempfile::TempDir;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use single::SINGLE;
use table::{CREDENTIALS, Entry, FOREIGN_HOSTS, FOREIGN_ORIGINS, KINDS, OURS};

/// Maximum time for a response; shorter than the server waits for a body.
const PATIENCE: Duration = Duration::from_secs(25);

/// A listening server with the session `s1`, which has a target and is streamed to Rerun.
pub(super) struct RunningServer {
    pub address: SocketAddr,
    pub state: AppState,
    pub traverse: String,
    _folders: [TempDir; 2],
}

impl RunningServer {
    /// Serves on a free port; `access` returns the access rules for that port.
    pub(crate) async fn start(access: impl FnOnce(u16) -> Access) -> Self {
        let folders = [small_drive(), tempfile::tempdir().unwrap()];
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let traverse = Traverse::open(folders[0].path()).unwrap();
        let state = AppState::new(vec![traverse], folders[1].path(), access(address.port())).unwrap();
        let traverse = state.traverses()[0].id.clone();
        let app = sightline_server::app(state.clone());
        tokio::spawn(async move { axum::serve(listener, app).await });
        Self { address, state, traverse, _folders: folders }
    }

    /// Returns the response to a request as our own page sends it; `path` is below `/api/v1/`.
    pub(crate) async fn request(&self, method: &str, path: &str, body: &str) -> Answer {
        let headers = ["Host: $HOST", "Authorization: Bearer $TOKEN", "Content-Type: application/json"];
        self.send(&format!("{method} /api/v1/{path} HTTP/1.1"), &headers, body).await
    }

    /// Sends a request in which `$HOST`, `$PORT`, `$TOKEN` and `$DRIVE` are replaced, and reads the head of the response and
    /// the beginning of its body.
    pub(crate) async fn send(&self, line: &str, headers: &[&str], body: &str) -> Answer {
        let address = self.address.to_string();
        let filled = |text: &str| {
            let text = text.replace("$HOST", &address).replace("$PORT", &self.address.port().to_string());
            text.replace("$TOKEN", TOKEN).replace("$DRIVE", &self.traverse)
        };
        let (mut text, body) = (filled(line), filled(body));
        for header in headers {
            text.push_str("\r\n");
            text.push_str(&filled(header));
        }
        let has_length = headers.iter().any(|header| {
            let name = header.split(':').next().unwrap_or_default();
            name.eq_ignore_ascii_case("content-length") || name.eq_ignore_ascii_case("transfer-encoding")
        });
        if !has_length && !body.is_empty() {
            text.push_str(&format!("\r\nContent-Length: {}", body.len()));
        }
        text.push_str("\r\n\r\n");
        text.push_str(&body);
        exchange(self.address, &text).await
    }

    async fn with_session(self) -> Self {
        let traverse = format!(r#"{{"traverse":"{}"}}"#, self.traverse);
        assert_eq!(self.request("POST", "sessions", &traverse).await.status, 201);
        let [x, y] = PIXEL;
        let target = format!(r#"{{"step":0,"pixel":{{"x":{x},"y":{y}}}}}"#);
        assert_eq!(self.request("POST", "sessions/s1/targets", &target).await.status, 201);
        assert_eq!(self.request("POST", "sessions/s1/rerun", "{}").await.status, 200);
        self
    }
}

/// Returns the response to a request that is sent unchanged.
pub(super) async fn exchange(address: SocketAddr, text: &str) -> Answer {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(text.as_bytes()).await.unwrap();
    Answer::read(&mut stream).await
}

/// The head of a response and the beginning of its body; the status is 0 if the server closed the connection.
#[derive(Debug)]
pub(super) struct Answer {
    pub status: u16,
    pub headers: BTreeMap<String, String>,
    pub body: String,
}

impl Answer {
    async fn read(stream: &mut TcpStream) -> Self {
        let mut bytes = Vec::new();
        let is_whole = |bytes: &[u8]| {
            let text = String::from_utf8_lossy(bytes);
            let Some((head, body)) = text.split_once("\r\n\r\n") else { return false };
            let length = head.to_ascii_lowercase();
            let length =
                length.split("content-length: ").nth(1).and_then(|rest| rest.lines().next()?.parse().ok());
            // Problems are short; of a file the beginning suffices.
            length.is_none_or(|length: usize| body.len() >= length.min(4096))
        };
        let mut part = [0; 8192];
        while !is_whole(&bytes) {
            let read = tokio::time::timeout(PATIENCE, stream.read(&mut part)).await;
            match read.expect("the server answers") {
                Ok(0) | Err(_) => break,
                Ok(count) => bytes.extend_from_slice(&part[..count]),
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or_default();
        let mut lines = head.lines();
        let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok()).unwrap_or(0);
        let headers = lines.filter_map(|line| line.split_once(": "));
        let headers = headers.map(|(name, value)| (name.to_ascii_lowercase(), value.to_owned())).collect();
        Self { status, headers, body: body.to_owned() }
    }

    fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", String::as_str)
    }

    /// The faults of the response apart from its status; responses of the HTTP parser itself lack the security headers.
    fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if self.body.contains(TOKEN) || self.headers.values().any(|value| value.contains(TOKEN)) {
            faults.push("the answer has the access token".to_owned());
        }
        if self.headers.keys().any(|name| name.starts_with("access-control-")) {
            faults.push("the answer is shared with other origins".to_owned());
        }
        if [0, 400].contains(&self.status) {
            return faults;
        }
        for (name, value) in [
            ("x-content-type-options", "nosniff"),
            ("referrer-policy", "no-referrer"),
            ("cross-origin-opener-policy", "same-origin"),
            ("cross-origin-resource-policy", "same-origin"),
        ] {
            if self.header(name) != value {
                faults.push(format!("{name} is `{}`", self.header(name)));
            }
        }
        let policy = self.header("content-security-policy");
        if !policy.contains("frame-ancestors 'none'") || !policy.contains("base-uri 'none'") {
            faults.push(format!("the page may be framed: `{policy}`"));
        }
        faults
    }
}

/// All entries: each kind of route with each foreign host, foreign origin and wrong credential, and the single ones.
fn entries() -> Vec<Entry> {
    let mut all: Vec<Entry> = SINGLE.iter().map(Entry::single).collect();
    for kind in KINDS {
        all.push(Entry::of(kind, "our own request", kind.status, |_| true, &OURS));
        for host in FOREIGN_HOSTS {
            all.push(Entry::of(kind, host, 403, |header| !header.starts_with("Host:"), &[host, OURS[1]]));
        }
        if kind.changes {
            for origin in FOREIGN_ORIGINS {
                all.push(Entry::of(kind, origin, 403, |_| true, &[OURS[0], OURS[1], origin]));
            }
        }
        for credential in CREDENTIALS {
            let status = if kind.is_open { kind.status } else { 401 };
            all.push(Entry::of(kind, credential, status, |_| true, &[OURS[0], credential]));
        }
        for site in ["Sec-Fetch-Site: cross-site", "Sec-Fetch-Site: same-site"] {
            all.push(Entry::of(kind, site, 403, |_| true, &[OURS[0], OURS[1], site]));
        }
    }
    all
}

#[tokio::test(flavor = "multi_thread")]
async fn every_attack_has_the_expected_status() {
    let server = RunningServer::start(sightline_tests::server::access).await.with_session().await;
    let all = entries();
    assert!(all.len() >= 60, "{} attacks", all.len());
    let mut wrong = Vec::new();
    for entry in &all {
        let headers: Vec<&str> = entry.headers.iter().map(String::as_str).collect();
        let answer = server.send(&entry.line, &headers, &entry.body).await;
        if !entry.statuses.contains(&answer.status) {
            let problem = format!("{} instead of {:?}: {:.200}", answer.status, entry.statuses, answer.body);
            wrong.push(format!("{} ({}): {problem}", entry.name, entry.line));
        }
        // A successful login returns the cookie and no body.
        let is_login = entry.line.contains("/login") && answer.status == 204;
        let faults = answer.faults().into_iter().filter(|fault| !(is_login && fault.contains("token")));
        wrong.extend(faults.map(|fault| format!("{} ({}): {fault}", entry.name, entry.line)));
    }
    assert!(wrong.is_empty(), "{} of {} attacks:\n{}", wrong.len(), all.len(), wrong.join("\n"));
    println!("{} attacks", all.len());
    let session = server.request("GET", "sessions/s1", "").await;
    assert_eq!(session.status, 200, "and the server goes on");
    assert_eq!(server.state.traverses().len(), 1);
}
