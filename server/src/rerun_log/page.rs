//! The page with rerun's own viewer, from this machine and talking to this machine only.
//!
//! Rerun can serve the page itself, but the viewer it bundles reports its use to rerun.io and fetches fonts
//! and examples from the network, with no switch to turn that off. We serve the same files under a content
//! security policy that lets the page talk to its own origin and to the data stream, and to nothing else.

use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::thread::JoinHandle;

use axum::Router;
use axum::extract::State;
use axum::http::header::{CONTENT_SECURITY_POLICY, CONTENT_TYPE, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS};
use axum::http::{StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use re_web_viewer_server::WebViewerData;
use tokio::sync::oneshot;

/// The page, served until it is dropped.
pub(super) struct ViewerPage {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// The viewer's files and the policy they are served under.
struct Files {
    data: WebViewerData,
    page: String,
    policy: String,
}

impl ViewerPage {
    /// Serves the page for a stream on `stream_port`, on a free port of the loopback address.
    pub(super) fn start(stream_port: u16) -> io::Result<Self> {
        let data = WebViewerData::load(None).map_err(io::Error::other)?;
        let page = without_foreign_links(&String::from_utf8_lossy(data.index_html()));
        let files = Arc::new(Files { data, page, policy: policy(stream_port) });
        let listener = std::net::TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        // A runtime of its own, so that the page can be started from inside and outside of one.
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (stop, stopped) = oneshot::channel::<()>();
        let serve = async move {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            let serving = axum::serve(listener, router(files));
            tokio::select! {
                ended = serving.into_future() => ended,
                _ = stopped => Ok(()),
            }
        };
        let thread = std::thread::Builder::new().name("rerun_page".to_owned()).spawn(move || {
            if let Err(error) = runtime.block_on(serve) {
                tracing::warn!(%error, "the page of the rerun viewer ended");
            }
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Where the page is.
    pub(super) fn url(&self) -> String {
        format!("http://{}", self.address)
    }
}

impl Drop for ViewerPage {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            // The thread may have ended by itself, and then nobody listens.
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            // It was told to end; that it panicked before is of no use to anyone here.
            let _ = thread.join();
        }
    }
}

/// What the page may load and whom it may talk to.
fn policy(stream_port: u16) -> String {
    let stream = format!("http://127.0.0.1:{stream_port}");
    [
        "default-src 'none'",
        "script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        &format!("connect-src 'self' {stream}"),
        "worker-src 'self' blob:",
        "base-uri 'none'",
        "form-action 'none'",
    ]
    .join("; ")
}

/// The page without its links to other hosts, which the policy would refuse and the console would report.
fn without_foreign_links(html: &str) -> String {
    let mut parts = html.split("<link");
    let mut page = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.split_once('>') {
            Some((link, rest)) if link.contains("https://") => page.push_str(rest),
            _ => page.extend(["<link", part]),
        }
    }
    page
}

fn router(files: Arc<Files>) -> Router {
    Router::new().fallback(file).with_state(files)
}

async fn file(State(files): State<Arc<Files>>, uri: Uri) -> Response {
    let data = &files.data;
    let (kind, bytes) = match uri.path() {
        "/" | "/index.html" => ("text/html; charset=utf-8", files.page.as_bytes()),
        "/favicon.ico" => ("image/x-icon", data.favicon()),
        "/apple-touch-icon.png" => ("image/png", data.apple_touch_icon()),
        "/re_viewer.js" => ("text/javascript", data.viewer_js()),
        "/re_viewer_bg.wasm" => ("application/wasm", data.viewer_wasm()),
        _ => return StatusCode::NOT_FOUND.into_response(),
    };
    let headers = [
        (CONTENT_TYPE, kind),
        (CONTENT_SECURITY_POLICY, files.policy.as_str()),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
    ];
    (headers.map(|(name, value)| (name, value.to_owned())), bytes.to_vec()).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_to_other_hosts_are_taken_out_and_own_ones_stay() {
        let html =
            r#"<head><link rel="icon" href="favicon.ico" /><link href="https://a.example/f.css" /><p>x</p>"#;
        assert_eq!(without_foreign_links(html), r#"<head><link rel="icon" href="favicon.ico" /><p>x</p>"#);
        let data = WebViewerData::load(None).unwrap();
        let page = without_foreign_links(&String::from_utf8_lossy(data.index_html()));
        assert!(page.contains("favicon.ico") && !page.contains("fonts.g"));
    }
}
