//! Parses the bodies of replies.

use sightline_api::endpoint::{Endpoint, Reply as _};
use sightline_api::wire::Problem;

/// Parses the reply of `E`.
pub(super) fn parse<E: Endpoint>(bytes: &[u8]) -> Result<E::Reply, Problem> {
    E::Reply::read(bytes).map_err(|why| misread(&why.to_string()))
}

/// The problem of an answer that cannot be parsed.
pub(super) fn misread(why: &str) -> Problem {
    let hint = "Page and server may be of different versions: load the page again.".to_owned();
    let detail = format!("The server's answer cannot be read: {why}.");
    Problem { hint: Some(hint), ..Problem::new(500, "misread", "unreadable answer", detail) }
}
