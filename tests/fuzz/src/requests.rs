//! The REST interface: requests with arbitrary query and body, to a server in this process.

use std::cell::RefCell;

use crate::server::{LEFT_OUT, Server};

/// Requests per server, which limits its stored data.
const REQUESTS_EACH: usize = 500;

/// A request: method and path in the first line, such as `POST /sessions/s1/notes`; the other bytes are its body.
///
/// `{traverse}` in the path is the name of the recording.
pub(crate) fn requests(bytes: &[u8]) {
    thread_local! {
        static SERVER: RefCell<Option<(Server, usize)>> = const { RefCell::new(None) };
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
        if let Some((used, _)) = server.take_if(|(_, answered)| *answered >= REQUESTS_EACH) {
            used.leave();
        }
        let (server, answered) = server.get_or_insert_with(|| (Server::start(false), 0));
        *answered += 1;
        let path = path.replace("{traverse}", &server.traverse);
        let status = server.send(method, &path, body).unwrap_or_default();
        assert!(status < 500 || status == 503, "{status} for {method} {path}");
    });
}
