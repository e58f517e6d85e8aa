//! The files of rerun's own web viewer, served by this server.
//!
//! The viewer bundled with rerun reports its use to rerun.io and fetches fonts and examples from the network, and has no
//! switch to disable this. Our content security policy restricts the page to its own origin and to its original scripts,
//! identified by their digests. The page opens the live recording of the session named in its address, and no other
//! recording.

use std::sync::LazyLock;

use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use re_web_viewer_server::{WebViewerData, WebViewerDataError};
use sha2::{Digest, Sha256};

/// The page, a name for [`file`].
pub(crate) const PAGE: &str = "index.html";

/// The line in rerun's page that opens any recordings named in its address, from any host.
const ANY_RECORDING: &str = r#"url: query.getAll("url"),"#;

/// The replacement, which opens the recording of the session.
const OUR_RECORDING: &str = r#"url: [new URL(`../sessions/${encodeURIComponent(query.get("session"))}/rerun/live.rrd`, location.href).href],"#;

/// Rerun's viewer sends no cookies with its requests, so the server would reject them.
const WITH_COOKIE: &str = r#"<script>
const fetchWithoutCookie = window.fetch;
window.fetch = (request, options) => fetchWithoutCookie(request, { ...options, credentials: "same-origin" });
</script>"#;

/// The viewer's files and the policy of its page.
struct Files {
    data: WebViewerData,
    page: String,
    policy: String,
}

static FILES: LazyLock<Result<Files, WebViewerDataError>> = LazyLock::new(|| {
    let data = WebViewerData::load(None)?;
    let page = without_foreign_links(&String::from_utf8_lossy(data.index_html()));
    let page = page.replace(ANY_RECORDING, OUR_RECORDING);
    let page = page.replacen("<body>", &format!("<body>{WITH_COOKIE}"), 1);
    let policy = policy(&page);
    Ok(Files { data, page, policy })
});

/// A file of the viewer; `None` for an unknown name.
///
/// # Errors
/// The program was built without the viewer.
pub(crate) fn file(name: &str) -> Result<Option<Response>, &'static WebViewerDataError> {
    let files = FILES.as_ref()?;
    let data = &files.data;
    let (kind, bytes) = match name {
        PAGE => {
            let headers =
                [(CONTENT_TYPE, "text/html; charset=utf-8"), (CONTENT_SECURITY_POLICY, &files.policy)];
            return Ok(Some((headers, files.page.as_str()).into_response()));
        }
        "favicon.ico" => ("image/x-icon", data.favicon()),
        "apple-touch-icon.png" => ("image/png", data.apple_touch_icon()),
        "re_viewer.js" => ("text/javascript", data.viewer_js()),
        "re_viewer_bg.wasm" => ("application/wasm", data.viewer_wasm()),
        _ => return Ok(None),
    };
    // The files change only with the program; the largest has 40 MB.
    let headers = [(CONTENT_TYPE, kind), (CACHE_CONTROL, "private, max-age=3600")];
    Ok(Some((headers, bytes.to_vec()).into_response()))
}

/// The content security policy of the page.
fn policy(page: &str) -> String {
    let scripts: Vec<_> =
        inline_scripts(page).map(|script| format!(" 'sha256-{}'", digest(script))).collect();
    [
        "default-src 'none'",
        &format!("script-src 'self' 'wasm-unsafe-eval'{}", scripts.concat()),
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "connect-src 'self'",
        "worker-src 'self' blob:",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    ]
    .join("; ")
}

/// The contents of the inline scripts of the page.
fn inline_scripts(page: &str) -> impl Iterator<Item = &str> {
    page.split("<script>").skip(1).filter_map(|rest| rest.split("</script>").next())
}

fn digest(script: &str) -> String {
    STANDARD.encode(Sha256::digest(script.as_bytes()))
}

/// Removes links to other hosts from the page; the policy would block them and the console would report errors.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_to_other_hosts_are_taken_out_and_own_ones_stay() {
        let html =
            r#"<head><link rel="icon" href="favicon.ico" /><link href="https://a.example/f.css" /><p>x</p>"#;
        assert_eq!(without_foreign_links(html), r#"<head><link rel="icon" href="favicon.ico" /><p>x</p>"#);
        let page = &FILES.as_ref().unwrap().page;
        assert!(page.contains("favicon.ico") && !page.contains("fonts.g"));
    }

    #[test]
    fn page_opens_our_recording_and_no_other() {
        let files = FILES.as_ref().unwrap();
        let original = String::from_utf8_lossy(files.data.index_html());
        assert_eq!(original.matches(ANY_RECORDING).count(), 1, "rerun's page has changed");
        assert_eq!(files.page.matches(WITH_COOKIE).count(), 1);
        assert!(files.page.contains("/rerun/live.rrd") && !files.page.contains("getAll(\"url\")"));
    }

    #[test]
    fn policy_names_the_inline_scripts_and_allows_no_others() {
        let files = FILES.as_ref().unwrap();
        assert_eq!(inline_scripts(&files.page).count(), 3, "rerun's page has changed");
        let script = files.policy.split("; ").find(|part| part.starts_with("script-src")).unwrap();
        assert!(script.matches("'sha256-").count() == 3 && !script.contains("unsafe-inline"), "{script}");
    }
}
