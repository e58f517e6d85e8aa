//! The database of sessions, with arbitrary changes to the bytes of its file.

use std::path::Path;
use std::sync::OnceLock;

use axum::body::Body;
use axum::http::{Request, header};
use sightline_server::access::Access;
use sightline_server::hosts::Hosts;
use sightline_server::state::AppState;
use tower::ServiceExt;

use crate::recording;
use crate::server::{PORT, Server};

/// The file in the folder of sessions.
const FILE: &str = "sessions.redb";
/// A change of this length truncates the file at its offset.
const CUT: u8 = 255;

/// Changes a complete database with a session, a target and its run: each change has an offset of three bytes, a length byte
/// and that many bytes; the offset is taken modulo the length of the file.
///
/// Whatever is changed, the server starts and lists its sessions.
pub(crate) fn store(bytes: &[u8]) {
    let folder = recording::folder();
    std::fs::write(folder.path().join(FILE), changed(whole(), bytes))
        .expect("the scratch folder can be written");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let status = runtime.block_on(async {
        let access = Access::without_token(Hosts::new(PORT, &[]));
        let state = AppState::new(vec![recording::recording()], folder.path(), access).expect("a server");
        let request = Request::builder()
            .uri("/api/v1/sessions")
            .header(header::HOST, format!("127.0.0.1:{PORT}"))
            .body(Body::empty())
            .expect("a request");
        sightline_server::app(state).oneshot(request).await.expect("the router never fails").status()
    });
    assert_eq!(status, 200);
}

/// The database file of a server that has ended.
fn whole() -> &'static [u8] {
    static WHOLE: OnceLock<Vec<u8>> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let folder = Server::start(false).end();
        read(folder.path())
    })
}

fn read(folder: &Path) -> Vec<u8> {
    std::fs::read(folder.join(FILE)).expect("a database")
}

fn changed(whole: &[u8], mut changes: &[u8]) -> Vec<u8> {
    let mut file = whole.to_vec();
    while let [a, b, c, length, rest @ ..] = changes {
        let at = u32::from_le_bytes([*a, *b, *c, 0]) as usize % file.len().max(1);
        let (given, next) = rest.split_at(usize::from(*length).min(rest.len()));
        if *length == CUT {
            file.truncate(at);
        } else {
            let end = (at + given.len()).min(file.len());
            file[at..end].copy_from_slice(&given[..end - at]);
        }
        changes = next;
    }
    file
}
