//! The address under which a reverse proxy publishes the server.
//!
//! The address is a setting and never read from a request: a client can forge `Forwarded` and `X-Forwarded-*`, and this
//! address contains the same information. Both kinds of proxies work: those that remove the path prefix and those that keep
//! it.

use std::fmt;

use axum::extract::{Request, State};
use axum::http::uri::PathAndQuery;
use axum::http::{HeaderValue, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Redirect, Response};
use sightline_geometry::error::{Error, Result};

/// The address of a page: scheme, host, port and folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PublicUrl {
    is_https: bool,
    authority: String,
    /// Begins and ends with a slash.
    folder: String,
}

impl PublicUrl {
    /// Parses an address such as `https://rover.example/sightline/`.
    ///
    /// # Errors
    /// [`Error::Request`] for another form.
    pub fn parse(text: &str) -> Result<Self> {
        let wrong = || {
            Error::Request(format!(
                "`{text}` is not the address of a page; write it as https://rover.example/sightline/"
            ))
        };
        let uri: Uri = text.parse().map_err(|_| wrong())?;
        let is_https = match uri.scheme_str() {
            Some("https") => true,
            Some("http") => false,
            _ => return Err(wrong()),
        };
        let authority = uri.authority().ok_or_else(wrong)?.as_str().to_ascii_lowercase();
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'/' | b'-' | b'_' | b'~');
        let path = uri.path().trim_matches('/');
        if uri.query().is_some()
            || authority.contains('@')
            || path.contains("//")
            || !path.bytes().all(is_plain)
        {
            return Err(wrong());
        }
        let folder = if path.is_empty() { "/".to_owned() } else { format!("/{path}/") };
        // Browsers omit the default port of the scheme.
        let implied = if is_https { ":443" } else { ":80" };
        let authority = authority.strip_suffix(implied).unwrap_or(&authority).to_owned();
        Ok(Self { is_https, authority, folder })
    }

    /// Host and port, as in the header `Host`.
    pub(crate) fn authority(&self) -> &str {
        &self.authority
    }

    /// The path of the page; begins and ends with a slash.
    pub(crate) fn folder(&self) -> &str {
        &self.folder
    }

    /// Whether browsers reach the proxy over TLS.
    pub(crate) const fn is_https(&self) -> bool {
        self.is_https
    }

    /// The path of a request without the folder prefix; `None` if it does not have the prefix.
    fn without_folder(&self, path: &PathAndQuery) -> Option<PathAndQuery> {
        let rest = path.as_str().strip_prefix(&self.folder)?;
        format!("/{rest}").parse().ok()
    }
}

impl fmt::Display for PublicUrl {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.is_https { "https" } else { "http" };
        write!(formatter, "{scheme}://{}{}", self.authority, self.folder)
    }
}

/// Removes the folder from the path of a request, and adds it to the `Location` header of the answer.
pub(crate) async fn mount(State(public): State<PublicUrl>, mut request: Request, next: Next) -> Response {
    if request.method().is_safe() && request.uri().path() == public.folder.trim_end_matches('/') {
        // Relative addresses on the page require the trailing slash.
        return Redirect::permanent(&public.folder).into_response();
    }
    if let Some(rest) = request.uri().path_and_query().and_then(|path| public.without_folder(path)) {
        let mut parts = request.uri().clone().into_parts();
        parts.path_and_query = Some(rest);
        if let Ok(uri) = Uri::from_parts(parts) {
            *request.uri_mut() = uri;
        }
    }
    let mut response = next.run(request).await;
    let path = response.headers().get(header::LOCATION).and_then(|value| value.to_str().ok());
    let inside = path.and_then(|path| path.strip_prefix('/'));
    if let Some(Ok(location)) = inside.map(|path| HeaderValue::try_from(format!("{}{path}", public.folder))) {
        response.headers_mut().insert(header::LOCATION, location);
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_read_with_and_without_port_and_folder() {
        for (text, shown) in [
            ("https://rover.example/sightline", "https://rover.example/sightline/"),
            ("https://Rover.Example:443", "https://rover.example/"),
            ("http://rover.example:8080/a/b/", "http://rover.example:8080/a/b/"),
            ("http://rover.example:80/", "http://rover.example/"),
        ] {
            assert_eq!(PublicUrl::parse(text).unwrap().to_string(), shown);
        }
    }

    #[test]
    fn anything_else_is_refused() {
        for text in [
            "",
            "/sightline",
            "rover.example",
            "ftp://rover.example/",
            "https://me@rover.example/",
            "https://rover.example/?a=1",
            "https://rover.example/a;b/",
            "https://rover.example/../",
            "https://rover.example/a//b",
        ] {
            assert!(PublicUrl::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn only_the_whole_folder_is_removed() {
        let public = PublicUrl::parse("https://rover.example/sightline/").unwrap();
        let rest = |path: &str| public.without_folder(&path.parse().unwrap()).map(|rest| rest.to_string());
        assert_eq!(rest("/sightline/api/v1/page?x=1").as_deref(), Some("/api/v1/page?x=1"));
        assert_eq!(rest("/sightline/").as_deref(), Some("/"));
        assert_eq!(rest("/sightlines/api"), None);
        assert_eq!(rest("/api/v1/page"), None);
    }
}
