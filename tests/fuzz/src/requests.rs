//! The interface: requests with any query and any body, to a server in this process.

use std::cell::RefCell;

use axum::Router;
use axum::body::Body;
use axum::http::{Request, header};
use sightline_server::access::Access;
use sightline_server::hosts::Hosts;
use sightline_server::state::AppState;
use tempfile::TempDir;
use tokio::runtime::Runtime;
use tower::ServiceExt;

use crate::recording;

/// Requests that one server answers, so that what it keeps stays small.
const REQUESTS_EACH: usize = 500;
/// The port in the server's own address.
const PORT: u16 = 7700;
/// Paths that start long work, open ports or send events without an end.
const LEFT_OUT: [&str; 6] = ["/traverses", "/reproduced", "/studies/jobs", "/resume", "/rerun", "/events"];

/// A server with the recording, a session, a target and its run.
struct Server {
    app: Router,
    runtime: Runtime,
    traverse: String,
    answered: usize,
    _folder: TempDir,
}

/// A request: method and path in the first line, such as `POST /sessions/s1/notes`; the other bytes are its body.
///
/// `{traverse}` in the path is the name of the recording.
pub(crate) fn requests(bytes: &[u8]) {
    thread_local! {
        static SERVER: RefCell<Option<Server>> = const { RefCell::new(None) };
    }
    let line = bytes.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let body = bytes.get(line.len() + 1..).unwrap_or_default();
    let Some((method, path)) = std::str::from_utf8(line).ok().and_then(|line| line.split_once(' ')) else {
        return;
    };
    let plain = path.split(['?', '#']).next().unwrap_or_default().trim_end_matches('/');
    let is_known = ["GET", "POST", "PUT", "PATCH", "DELETE"].contains(&method);
    if !is_known || (method != "GET" || plain == "/events") && LEFT_OUT.iter().any(|end| plain.ends_with(end))
    {
        return;
    }
    SERVER.with_borrow_mut(|server| {
        if server.as_ref().is_none_or(|server| server.answered >= REQUESTS_EACH) {
            *server = Some(Server::start());
        }
        if let Some(server) = server {
            server.answered += 1;
            let path = path.replace("{traverse}", &server.traverse);
            let status = server.send(method, &path, body).unwrap_or_default();
            assert!(status < 500 || status == 503, "{status} for {method} {path}");
        }
    });
}

impl Server {
    fn start() -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.expect("a runtime");
        let folder = recording::folder();
        let inside = runtime.enter();
        let state = AppState::new(
            vec![recording::recording()],
            folder.path(),
            Access::without_token(Hosts::new(PORT, &[])),
        );
        let state = state.expect("a server");
        drop(inside);
        let traverse = state.traverses()[0].id.clone();
        let server =
            Self { app: sightline_server::app(state), runtime, traverse, answered: 0, _folder: folder };
        let session = format!(r#"{{"traverse":"{}"}}"#, server.traverse);
        assert_eq!(server.send("POST", "/sessions", session.as_bytes()), Some(201));
        let target = br#"{"step":0,"pixel":{"x":48,"y":32}}"#;
        assert_eq!(server.send("POST", "/sessions/s1/targets", target), Some(201));
        server
    }

    /// The status of the answer, which is read to its end; `None` for a path that no URL has.
    fn send(&self, method: &str, path: &str, body: &[u8]) -> Option<u16> {
        let request = Request::builder()
            .method(method)
            .uri(format!("/api/v1{path}"))
            .header(header::HOST, format!("127.0.0.1:{PORT}"))
            .header(header::CONTENT_TYPE, "application/json")
            .body(Body::from(body.to_vec()))
            .ok()?;
        Some(self.runtime.block_on(async {
            let response = self.app.clone().oneshot(request).await.expect("the router never fails");
            let status = response.status().as_u16();
            axum::body::to_bytes(response.into_body(), 1 << 28).await.expect("a whole body");
            status
        }))
    }
}
