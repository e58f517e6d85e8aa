//! A server in this process with the recording, a session, a target and its run.

use axum::Router;
use axum::body::Body;
use axum::http::{Request, header};
use sightline_server::access::{Access, Token};
use sightline_server::hosts::Hosts;
use sightline_server::state::AppState;
use tempfile::TempDir;
use tokio::io::DuplexStream;
use tokio::runtime::Runtime;
use tokio::sync::mpsc::{Sender, channel};
use tower::ServiceExt;

use crate::recording;

/// The port in the server's own address.
pub(crate) const PORT: u16 = 7700;
/// The access token of a server that requires one.
pub(crate) const TOKEN: &str = "a-token-of-the-tests";
/// Ends of paths that start long computations, open ports or send events without an end.
pub(crate) const LEFT_OUT: [&str; 6] =
    ["/traverses", "/reproduced", "/studies/jobs", "/resume", "/rerun", "/events"];
/// Capacity of the pipe between the server and a client, in each direction, bytes.
const PIPE_BYTES: usize = 64 << 10;
/// Connections that wait to be accepted.
const WAITING: usize = 4;

/// The server.
pub(crate) struct Server {
    app: Router,
    pub(crate) runtime: Runtime,
    /// The name of the recording.
    pub(crate) traverse: String,
    connections: Sender<DuplexStream>,
    folder: TempDir,
}

impl Server {
    /// Starts a server; it requires [`TOKEN`] if `is_locked`.
    pub(crate) fn start(is_locked: bool) -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.expect("a runtime");
        let folder = recording::folder();
        let hosts = Hosts::new(PORT, &[]);
        let access = if is_locked {
            Access::with_token(hosts, Token::chosen(TOKEN).expect("a token"))
        } else {
            Access::without_token(hosts)
        };
        let inside = runtime.enter();
        let state = AppState::new(vec![recording::recording()], folder.path(), access).expect("a server");
        let traverse = state.traverses()[0].id.clone();
        let app = sightline_server::app(state);
        let (connections, accepted) = channel(WAITING);
        let served = axum::serve(Pipes(accepted), app.clone());
        tokio::spawn(async { served.await });
        drop(inside);
        let server = Self { app, runtime, traverse, connections, folder };
        let session = format!(r#"{{"traverse":"{}"}}"#, server.traverse);
        assert_eq!(server.send("POST", "/sessions", session.as_bytes()), Some(201));
        let target = br#"{"step":0,"pixel":{"x":48,"y":32}}"#;
        assert_eq!(server.send("POST", "/sessions/s1/targets", target), Some(201));
        server
    }

    /// Returns the status of the response, which is read to its end; `None` if the path is not a valid URL.
    pub(crate) fn send(&self, method: &str, path: &str, body: &[u8]) -> Option<u16> {
        let request = Request::builder()
            .method(method)
            .uri(format!("/api/v1{path}"))
            .header(header::HOST, format!("127.0.0.1:{PORT}"))
            .header(header::CONTENT_TYPE, "application/json")
            .header(header::AUTHORIZATION, format!("Bearer {TOKEN}"))
            .body(Body::from(body.to_vec()))
            .ok()?;
        Some(self.runtime.block_on(async {
            let response = self.app.clone().oneshot(request).await.expect("the router never fails");
            let status = response.status().as_u16();
            axum::body::to_bytes(response.into_body(), 1 << 28).await.expect("a whole body");
            status
        }))
    }

    /// Ends the server when its work is done; returns its folder.
    pub(crate) fn end(self) -> TempDir {
        let Self { folder, .. } = self;
        folder
    }

    /// Drops the server without waiting for its work on blocking threads, which is not cancelled here.
    pub(crate) fn leave(self) {
        self.runtime.shutdown_background();
    }

    /// Opens a new connection to the server.
    pub(crate) async fn connect(&self) -> DuplexStream {
        let (ours, theirs) = tokio::io::duplex(PIPE_BYTES);
        self.connections.send(theirs).await.expect("the server accepts connections");
        ours
    }
}

/// Accepts connections inside this process.
struct Pipes(tokio::sync::mpsc::Receiver<DuplexStream>);

impl axum::serve::Listener for Pipes {
    type Io = DuplexStream;
    type Addr = ();

    async fn accept(&mut self) -> (DuplexStream, ()) {
        match self.0.recv().await {
            Some(stream) => (stream, ()),
            // The other end was dropped with its server.
            None => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> std::io::Result<()> {
        Ok(())
    }
}
