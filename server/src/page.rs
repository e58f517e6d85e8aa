//! The page: the viewer's files, embedded in the program, or read from where `cargo xtask web` puts them while
//! developing.

use axum::http::{HeaderMap, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use rust_embed::RustEmbed;

use crate::problem::ApiError;

/// What the page says when the viewer was not built.
const MISSING: &str = include_str!("missing.html");

#[derive(RustEmbed)]
#[folder = "../target/web/"]
#[allow_missing = true]
struct Web;

/// Answers every path that is none of the API's.
pub async fn serve(method: Method, uri: Uri, headers: HeaderMap) -> Response {
    if !method.is_safe() {
        return crate::wrong_method().await.into_response();
    }
    let name = match uri.path() {
        "/" => "index.html",
        path => path.trim_start_matches('/'),
    };
    // Only a name that is in the list is ever opened.
    let is_there = !uri.path().starts_with("/api/") && Web::iter().any(|file| file == name);
    match Web::get(name).filter(|_| is_there) {
        Some(file) => answer(file, &headers),
        None if name == "index.html" => {
            let html = [(header::CONTENT_TYPE, "text/html; charset=utf-8")];
            (StatusCode::OK, html, MISSING).into_response()
        }
        None => ApiError::not_found("There is nothing at this address.").into_response(),
    }
}

fn answer(file: rust_embed::EmbeddedFile, headers: &HeaderMap) -> Response {
    let hash: String = file.metadata.sha256_hash()[..16].iter().map(|byte| format!("{byte:02x}")).collect();
    let tag = format!("\"{hash}\"");
    let caching = [(header::ETAG, tag.clone()), (header::CACHE_CONTROL, "no-cache".to_owned())];
    if headers.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, caching).into_response();
    }
    let media_type = [(header::CONTENT_TYPE, file.metadata.mimetype().to_owned())];
    (media_type, caching, file.data).into_response()
}
