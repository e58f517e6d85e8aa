//! The page: the viewer's files, embedded in the program, or, during development, read from the output folder of `cargo
//! xtask web`.

use axum::http::{HeaderMap, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use rust_embed::RustEmbed;

use crate::problem::ApiError;

/// The page shown if the viewer was not built.
const MISSING: &str = include_str!("missing.html");

/// File extension of compressed files.
const PACKED: &str = ".gz";

/// The header with the uncompressed length of a file.
const UNPACKED_LENGTH: &str = "sightline-unpacked-length";

#[derive(RustEmbed)]
#[folder = "../target/web/"]
#[allow_missing = true]
struct Web;

/// Answers every path outside the API.
pub(crate) async fn serve(method: Method, uri: Uri, headers: HeaderMap) -> Response {
    if !method.is_safe() {
        return wrong_method().await.into_response();
    }
    let name = match uri.path() {
        "/" => "index.html",
        path => path.trim_start_matches('/'),
    };
    // Only names in the list are opened.
    let is_there =
        !uri.path().starts_with("/api/") && !name.ends_with(PACKED) && Web::iter().any(|file| file == name);
    match Web::get(name).filter(|_| is_there) {
        Some(file) => answer(name, file, &headers),
        None if name == "index.html" => {
            let html = [(header::CONTENT_TYPE, "text/html; charset=utf-8")];
            (StatusCode::OK, html, MISSING).into_response()
        }
        None => ApiError::not_found("There is nothing at this address.").into_response(),
    }
}

/// A file of the page, compressed if the browser accepts it; 304 if the browser has the same version.
fn answer(name: &str, file: rust_embed::EmbeddedFile, headers: &HeaderMap) -> Response {
    let packed = Web::get(&format!("{name}{PACKED}")).filter(|_| takes_gzip(headers));
    let sent = packed.as_ref().unwrap_or(&file);
    let hash: String = sent.metadata.sha256_hash()[..16].iter().map(|byte| format!("{byte:02x}")).collect();
    let tag = format!("\"{hash}\"");
    let caching = [
        (header::ETAG, tag.clone()),
        (header::CACHE_CONTROL, "no-cache".to_owned()),
        (header::VARY, "accept-encoding".to_owned()),
    ];
    if headers.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, caching).into_response();
    }
    let media_type = [(header::CONTENT_TYPE, file.metadata.mimetype().to_owned())];
    match packed {
        Some(packed) => {
            // The uncompressed length, for the progress bar of the page.
            let unpacked = [(UNPACKED_LENGTH, file.data.len().to_string())];
            let encoding = [(header::CONTENT_ENCODING, "gzip")];
            (media_type, caching, encoding, unpacked, packed.data).into_response()
        }
        None => (media_type, caching, file.data).into_response(),
    }
}

/// Whether a browser accepts gzip with a weight above 0.
fn takes_gzip(headers: &HeaderMap) -> bool {
    let accepted = headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
    accepted.flat_map(|list| list.split(',')).any(|part| {
        let (coding, weight) = part.split_once(';').unwrap_or((part, "q=1"));
        let weight = weight.trim().strip_prefix("q=").and_then(|q| q.parse::<f32>().ok());
        coding.trim().eq_ignore_ascii_case("gzip") && weight.is_none_or(|weight| weight > 0.0)
    })
}

/// The answer to an unsupported method.
pub(crate) async fn wrong_method() -> ApiError {
    ApiError::new(StatusCode::METHOD_NOT_ALLOWED, "method", "This route does not know that method.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gzip_is_sent_only_to_clients_that_accept_it() {
        for (accepted, takes) in [
            ("gzip, deflate, br", true),
            ("br, GZIP;q=0.5", true),
            ("gzip;q=0", false),
            ("identity", false),
            ("xgzip", false),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(header::ACCEPT_ENCODING, accepted.parse().unwrap());
            assert_eq!(takes_gzip(&headers), takes, "{accepted}");
        }
        assert!(!takes_gzip(&HeaderMap::new()));
    }
}
