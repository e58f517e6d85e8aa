//! Access control: the checks before every route, and the security headers of every answer.
//!
//! A page of any site can send requests to a server on this machine. Three checks prevent abuse. The Host must be one of
//! ours, exactly: a rebinding page controls both Host and Origin, so comparing them with each other would prove nothing. A
//! foreign Origin may change nothing and open no WebSocket. Bodies must be JSON, which a form cannot send. Scripts send no
//! Origin and are not affected.
//!
//! Other users of this machine, and other machines, need the access token for everything except the files of the page, which
//! are public, and the route that exchanges the token for a cookie.

use axum::extract::{Request, State};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderMap, HeaderValue, Method, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::access::Access;
use crate::extract::check_content_type;
use crate::problem::{ApiError, ApiResult};
use crate::public_url::PublicUrl;
use crate::request_id;
use tracing::Instrument;

/// The only route below `/api` without a token check, because it receives the token.
const LOGIN: &str = "/api/v1/login";

/// Checks a request before routing, and sets the headers of its answer.
pub(crate) async fn guard(State(access): State<Access>, request: Request, next: Next) -> Response {
    let checked = check(&access, request.method(), request.uri(), request.headers());
    let (host, is_api) = match &checked {
        Ok(host) => (Some(host.clone()), request.uri().path().starts_with("/api/")),
        Err(_) => (None, false),
    };
    let id = request_id::next();
    let answer = async {
        match checked {
            Ok(_) => next.run(request).await,
            Err(refusal) => {
                tracing::warn!("refused: {}", crate::printable::printable(&refusal.problem().detail));
                refusal.into_response()
            }
        }
    };
    let mut response = answer.instrument(tracing::info_span!("request", id)).await;
    response = request_id::add_to_problem(response, &id).await;
    let published = access.public().map(PublicUrl::authority);
    put_headers(response.headers_mut(), &[host.as_deref(), published], is_api);
    response
}

/// The host name of the request, if the request is allowed.
fn check(access: &Access, method: &Method, uri: &Uri, headers: &HeaderMap) -> ApiResult<String> {
    let hosts = access.hosts();
    let mut named = headers.get_all(header::HOST).iter();
    let host = match (named.next().map(HeaderValue::to_str), named.next()) {
        (Some(Ok(host)), None) if hosts.has(host) => host,
        _ => return Err(foreign_host()),
    };
    if uri.authority().is_some_and(|authority| !hosts.has(authority.as_str())) {
        return Err(foreign_host());
    }
    let is_upgrade = headers.contains_key(header::UPGRADE);
    if !method.is_safe() || is_upgrade {
        let is_ours = |origin: &HeaderValue| {
            let origin = origin.to_str().unwrap_or_default();
            let host = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
            host.is_some_and(|host| hosts.has(host))
        };
        if !headers.get_all(header::ORIGIN).iter().all(is_ours) {
            return Err(ApiError::forbidden("origin", "A page of another site may not do this."));
        }
    }
    let value_of = |name: &'static str| headers.get(HeaderName::from_static(name)).map(HeaderValue::as_bytes);
    let is_navigation =
        *method == Method::GET && value_of("sec-fetch-mode") == Some(b"navigate") && !is_upgrade;
    // Another port of this machine is the same site, so its requests include our cookie.
    let is_foreign = matches!(value_of("sec-fetch-site"), Some(b"cross-site" | b"same-site"));
    if is_foreign && !is_navigation {
        return Err(ApiError::forbidden("origin", "A page of another site may not read this."));
    }
    check_content_type(method, uri.path(), headers)?;
    if uri.path().starts_with("/api") && uri.path() != LOGIN {
        access.check(headers)?;
    }
    Ok(host.to_owned())
}

fn foreign_host() -> ApiError {
    ApiError::forbidden("host", "The server is not known under the name by which it was addressed.")
        .hint("Use http://127.0.0.1 with the server's port, or start it with `--allow-host NAME`.")
}

fn put_headers(headers: &mut HeaderMap, hosts: &[Option<&str>], is_api: bool) {
    // The hosts were checked and cannot terminate a directive. Older browsers do not include WebSockets in 'self'.
    let sockets: String = hosts.iter().flatten().map(|host| format!(" ws://{host} wss://{host}")).collect();
    let policy = format!(
        "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'{sockets}; \
         img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let policy = HeaderValue::try_from(policy).unwrap_or(HeaderValue::from_static("default-src 'none'"));
    // A self-contained page sets a stricter policy.
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(policy);
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    let same_origin = HeaderValue::from_static("same-origin");
    headers.insert(HeaderName::from_static("cross-origin-opener-policy"), same_origin.clone());
    headers.insert(HeaderName::from_static("cross-origin-resource-policy"), same_origin);
    if is_api && !headers.contains_key(header::CACHE_CONTROL) {
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hosts::Hosts;

    fn verdict(method: Method, headers: &[(&'static str, &str)]) -> Result<String, u16> {
        let pairs = headers
            .iter()
            .map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_str(value).unwrap()));
        let headers: HeaderMap = pairs.collect();
        let hosts = Hosts::new(7700, &["rover.example".to_owned()]);
        check(&Access::without_token(hosts), &method, &Uri::from_static("/"), &headers)
            .map_err(|error| error.problem().status)
    }

    #[test]
    fn only_exact_own_host_names_are_answered() {
        for host in ["localhost:7700", "127.0.0.1:7700", "[::1]:7700", "LOCALHOST:7700", "rover.example"] {
            assert!(verdict(Method::GET, &[("host", host)]).is_ok(), "{host}");
        }
        for host in ["localhost", "localhost:7701", "localhost:7700.evil.example", "evil-localhost:7700", ""]
        {
            assert_eq!(verdict(Method::GET, &[("host", host)]), Err(403), "{host}");
        }
        assert_eq!(verdict(Method::GET, &[]), Err(403));
    }

    #[test]
    fn a_foreign_page_may_change_nothing() {
        let ours = ("host", "localhost:7700");
        for origin in ["http://localhost:7700", "http://127.0.0.1:7700"] {
            assert!(verdict(Method::POST, &[ours, ("origin", origin)]).is_ok(), "{origin}");
        }
        for origin in
            ["http://localhost:3000", "https://evil.example", "null", "http://localhost:7700.evil.example"]
        {
            assert_eq!(verdict(Method::POST, &[ours, ("origin", origin)]), Err(403), "{origin}");
            assert_eq!(verdict(Method::GET, &[ours, ("origin", origin), ("upgrade", "websocket")]), Err(403));
        }
        for foreign in [("sec-fetch-site", "cross-site"), ("sec-fetch-site", "same-site")] {
            assert_eq!(verdict(Method::GET, &[ours, foreign]), Err(403));
            assert!(verdict(Method::GET, &[ours, foreign, ("sec-fetch-mode", "navigate")]).is_ok());
        }
        assert!(verdict(Method::GET, &[ours, ("sec-fetch-site", "same-origin")]).is_ok());
    }

    #[test]
    fn a_form_is_refused_whether_or_not_it_has_fields() {
        let ours = ("host", "localhost:7700");
        let form = ("content-type", "application/x-www-form-urlencoded");
        assert_eq!(verdict(Method::POST, &[ours, form, ("content-length", "0")]), Err(415));
        assert_eq!(verdict(Method::POST, &[ours, ("content-length", "5")]), Err(415));
        assert!(verdict(Method::POST, &[ours, ("content-length", "0")]).is_ok());
        let json = ("content-type", "Application/JSON; charset=utf-8");
        assert!(verdict(Method::POST, &[ours, json, ("content-length", "5")]).is_ok());
    }
}
