//! The access token, which every request except for the page itself needs.
//!
//! A request carries the token in `Authorization: Bearer` (scripts) or in a cookie, because images, downloads and WebSockets
//! of a browser cannot send a header. The page gets the cookie once, in exchange for the token in the fragment of the
//! printed address. Browsers never send fragments, so neither logs nor referrers contain the token.

use std::fmt;
use std::sync::Arc;

use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use sha2::{Digest, Sha256};
use sightline_geometry::error::{Error, Result};

use crate::hosts::Hosts;
use crate::problem::{ApiError, ApiResult};
use crate::public_url::PublicUrl;

/// Random bytes in a token: 128 bits.
const RANDOM_BYTES: usize = 16;

/// Minimum and maximum length of a chosen token, characters.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=256;

/// A shared secret that grants access.
#[derive(Clone)]
pub struct Token(Arc<str>);

impl Token {
    /// Generates a token from the random numbers of the system.
    ///
    /// # Errors
    /// [`Error::Request`] when the system provides none.
    pub(crate) fn random() -> Result<Self> {
        let mut bytes = [0_u8; RANDOM_BYTES];
        getrandom::fill(&mut bytes)
            .map_err(|error| Error::Request(format!("the system gives no random numbers: {error}")))?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>().into()))
    }

    /// A token chosen by the user.
    ///
    /// # Errors
    /// [`Error::Request`] for a token that is too short, too long, or contains characters that a URL would escape.
    pub fn chosen(text: &str) -> Result<Self> {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.' | b'_' | b'~');
        if LENGTHS.contains(&text.len()) && text.bytes().all(is_plain) {
            return Ok(Self(text.into()));
        }
        let (shortest, longest) = (LENGTHS.start(), LENGTHS.end());
        Err(Error::Request(format!(
            "an access token has {shortest} to {longest} letters, digits or `-._~`; leave it out for a random one"
        )))
    }

    /// The secret itself, to print for the user who starts the server.
    pub(crate) fn secret(&self) -> &str {
        &self.0
    }

    /// Compares digests, so that the timing does not reveal how much of `given` is correct.
    fn is(&self, given: &str) -> bool {
        let [ours, theirs] = [self.0.as_bytes(), given.as_bytes()].map(Sha256::digest);
        ours.iter().zip(&theirs).fold(0, |differences, (a, b)| differences | (a ^ b)) == 0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Token(…)")
    }
}

/// The host names and the token under which the server may be used.
#[derive(Clone, Debug)]
pub struct Access {
    hosts: Hosts,
    token: Option<Token>,
    public: Option<PublicUrl>,
}

impl Access {
    /// Access with the token only.
    pub const fn with_token(hosts: Hosts, token: Token) -> Self {
        Self { hosts, token: Some(token), public: None }
    }

    /// Access for every client that uses one of these host names.
    pub const fn without_token(hosts: Hosts) -> Self {
        Self { hosts, token: None, public: None }
    }

    /// The same, behind a reverse proxy that publishes the server at `public`.
    #[must_use]
    pub fn behind_proxy(self, public: PublicUrl) -> Self {
        Self { hosts: self.hosts.and(public.authority()), public: Some(public), ..self }
    }

    /// The address at which a reverse proxy publishes the server.
    pub(crate) const fn public(&self) -> Option<&PublicUrl> {
        self.public.as_ref()
    }

    /// The host names under which the server may be addressed.
    pub(crate) const fn hosts(&self) -> &Hosts {
        &self.hosts
    }

    /// Accepts a request with the token in its header or cookie.
    ///
    /// # Errors
    /// A problem with status 401.
    pub(crate) fn check(&self, headers: &HeaderMap) -> ApiResult<()> {
        let Some(token) = &self.token else { return Ok(()) };
        let name = self.cookie_name();
        let texts = |name| headers.get_all(name).iter().filter_map(|value: &HeaderValue| value.to_str().ok());
        let bearers = texts(header::AUTHORIZATION).filter_map(bearer);
        let cookies = texts(header::COOKIE).flat_map(|all| all.split(';'));
        let cookies = cookies.filter_map(|cookie| cookie.trim().strip_prefix(&name)?.strip_prefix('='));
        if bearers.chain(cookies).any(|given| token.is(given)) { Ok(()) } else { Err(locked()) }
    }

    /// The cookie for a page that sends the token; `None` if the server needs no token.
    ///
    /// # Errors
    /// A problem with status 401 for a wrong token.
    pub(crate) fn log_in(&self, given: &str) -> ApiResult<Option<String>> {
        match &self.token {
            None => Ok(None),
            Some(token) if token.is(given) => {
                let (name, secret) = (self.cookie_name(), token.secret());
                let folder = self.public().map_or("/", PublicUrl::folder);
                let secure = if self.public().is_some_and(PublicUrl::is_https) { "; Secure" } else { "" };
                Ok(Some(format!("{name}={secret}; HttpOnly; SameSite=Strict; Path={folder}{secure}")))
            }
            Some(_) => Err(locked()),
        }
    }

    /// Browsers send a cookie to all ports of a host, so the name contains the port.
    fn cookie_name(&self) -> String {
        format!("sightline-{}", self.hosts.port())
    }
}

/// The token in the value of an `Authorization` header.
fn bearer(value: &str) -> Option<&str> {
    let (scheme, token) = value.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim())
}

fn locked() -> ApiError {
    ApiError::new(StatusCode::UNAUTHORIZED, "token", "The server asks for its access token.")
        .hint("Open the address that `sightline serve` printed, or send `Authorization: Bearer TOKEN`.")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECRET: &str = "0123456789abcdef";

    fn access() -> Access {
        Access::with_token(Hosts::new(7700, &[]), Token::chosen(SECRET).unwrap())
    }

    fn is_let_in(name: header::HeaderName, value: &str) -> bool {
        let headers: HeaderMap = [(name, HeaderValue::from_str(value).unwrap())].into_iter().collect();
        access().check(&headers).is_ok()
    }

    #[test]
    fn only_the_whole_token_opens() {
        for (value, opens) in [
            (format!("Bearer {SECRET}"), true),
            (format!("bearer {SECRET}"), true),
            (format!("Bearer {SECRET}0"), false),
            (format!("Bearer {}", &SECRET[1..]), false),
            (format!("Basic {SECRET}"), false),
            (SECRET.to_owned(), false),
            ("Bearer ".to_owned(), false),
        ] {
            assert_eq!(is_let_in(header::AUTHORIZATION, &value), opens, "{value}");
        }
        for (value, opens) in [
            (format!("sightline-7700={SECRET}"), true),
            (format!("other=1; sightline-7700={SECRET}; more=2"), true),
            (format!("sightline-7701={SECRET}"), false),
            (format!("xsightline-7700={SECRET}"), false),
            ("sightline-7700=".to_owned(), false),
        ] {
            assert_eq!(is_let_in(header::COOKIE, &value), opens, "{value}");
        }
        assert!(access().check(&HeaderMap::new()).is_err());
        assert!(Access::without_token(Hosts::new(7700, &[])).check(&HeaderMap::new()).is_ok());
    }

    #[test]
    fn the_cookie_is_for_the_folder_of_the_proxy() {
        let cookie = |access: Access| access.log_in(SECRET).unwrap().unwrap();
        let strict = "HttpOnly; SameSite=Strict; Path=";
        assert_eq!(cookie(access()), format!("sightline-7700={SECRET}; {strict}/"));
        let public = PublicUrl::parse("https://rover.example/sightline/").unwrap();
        let published = access().behind_proxy(public);
        assert!(published.hosts().has("rover.example"));
        assert_eq!(cookie(published), format!("sightline-7700={SECRET}; {strict}/sightline/; Secure"));
    }

    #[test]
    fn random_tokens_differ_and_have_128_bits() {
        let [one, other] = [(); 2].map(|()| Token::random().unwrap());
        assert_ne!(one.secret(), other.secret());
        assert_eq!(one.secret().len(), 32);
        assert!(Token::chosen(one.secret()).is_ok());
    }

    #[test]
    fn chosen_tokens_are_long_and_fit_an_address() {
        for text in
            ["", "short", "0123456789abcde", "0123456789abcde&", "0123456789abcde ", "0123456789abcdé"]
        {
            assert!(Token::chosen(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_secret_is_in_no_debug_output() {
        assert!(!format!("{:?}", access()).contains(SECRET));
    }
}
