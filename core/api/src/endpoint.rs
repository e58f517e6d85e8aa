//! An endpoint as a type: method, path template, and the types of path, query, body and reply, declared once.
//!
//! The server registers a handler for it and the viewer calls it; this module expands and escapes the template. Names in
//! braces are the fields of [`Endpoint::At`]; the fields of [`Endpoint::Query`] follow the question mark.

use std::fmt;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// The method of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Method {
    /// Reads.
    Get,
    /// Adds, or starts work.
    Post,
    /// Replaces.
    Put,
    /// Changes.
    Patch,
    /// Removes.
    Delete,
}

impl Method {
    /// Its name in HTTP.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Get => "GET",
            Self::Post => "POST",
            Self::Put => "PUT",
            Self::Patch => "PATCH",
            Self::Delete => "DELETE",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// One route of the REST interface.
pub trait Endpoint: 'static {
    /// Its method.
    const METHOD: Method;
    /// Its path below `/api/v1`, with the fields of [`Self::At`] in braces.
    const PATH: &'static str;
    /// The path parameters.
    type At: Clone + Serialize + DeserializeOwned + Send + 'static;
    /// The query parameters; [`NoQuery`] without any.
    type Query: Clone + Default + Serialize + DeserializeOwned + Send + 'static;
    /// The JSON body of the request; [`NoBody`] without one.
    type Body: Serialize + DeserializeOwned + Send + 'static;
    /// The body of the reply.
    type Reply: Reply;
}

/// The body of a reply as its receiver reads it.
pub trait Reply: Sized + Send + 'static {
    /// Reads the bytes of a body.
    ///
    /// # Errors
    /// Fails if the body is not a valid `Self`.
    fn read(bytes: &[u8]) -> serde_json::Result<Self>;
}

impl<T: DeserializeOwned + Send + 'static> Reply for T {
    fn read(bytes: &[u8]) -> serde_json::Result<Self> {
        serde_json::from_slice(bytes)
    }
}

/// A reply that is a file: an image, an array, a table or a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File(pub Vec<u8>);

impl Reply for File {
    fn read(bytes: &[u8]) -> serde_json::Result<Self> {
        Ok(Self(bytes.to_vec()))
    }
}

/// A reply whose body, if any, is ignored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Done;

impl Reply for Done {
    fn read(_: &[u8]) -> serde_json::Result<Self> {
        Ok(Self)
    }
}

/// No query parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, serde::Deserialize)]
pub struct NoQuery {}

/// No body: requests that start work send an empty object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, serde::Deserialize)]
pub struct NoBody {}

/// A request as it is sent; the type of its reply is erased.
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// Its method.
    pub method: Method,
    /// The path template of its endpoint.
    pub endpoint: &'static str,
    /// Its path below `/api/v1/`, with the query.
    pub path: String,
    /// Its JSON body.
    pub body: Option<Vec<u8>>,
    /// The revision that it changes (`If-Match`).
    pub revision: Option<u64>,
}

impl Call {
    /// Calls `E` at this location.
    pub fn to<E: Endpoint<Body = NoBody>>(at: &E::At) -> Self {
        Self::with_query::<E>(at, &E::Query::default())
    }

    /// Calls `E` at this location with query parameters.
    pub fn with_query<E: Endpoint<Body = NoBody>>(at: &E::At, query: &E::Query) -> Self {
        let starts_work = matches!(E::METHOD, Method::Post | Method::Put | Method::Patch);
        let body = starts_work.then(|| b"{}".to_vec());
        Self { method: E::METHOD, endpoint: E::PATH, path: path::<E>(at, query), body, revision: None }
    }

    /// Calls `E` at this location with a body.
    pub fn with_body<E: Endpoint>(at: &E::At, body: &E::Body) -> Self {
        let path = path::<E>(at, &E::Query::default());
        let body = serde_json::to_vec(body).ok();
        Self { method: E::METHOD, endpoint: E::PATH, path, body, revision: None }
    }

    /// Whether this calls `E`, at any location.
    pub fn is_to<E: Endpoint>(&self) -> bool {
        self.method == E::METHOD && self.endpoint == E::PATH
    }

    /// Makes the call conditional on a revision (`If-Match`).
    #[must_use]
    pub fn at_revision(self, revision: u64) -> Self {
        Self { revision: Some(revision), ..self }
    }
}

/// The path of an endpoint below `/api/v1/`, with its query.
pub fn path<E: Endpoint>(at: &E::At, query: &E::Query) -> String {
    let mut path = E::PATH.trim_start_matches('/').to_owned();
    for (name, text) in fields(at) {
        path = path.replace(&format!("{{{name}}}"), &escaped(&text));
    }
    // An empty query is omitted; spaces are escaped as in a path.
    let query = serde_urlencoded::to_string(query).unwrap_or_default().replace('+', "%20");
    if !query.is_empty() {
        path = format!("{path}?{query}");
    }
    path
}

/// The fields of a record as text.
fn fields(record: &impl Serialize) -> Vec<(String, String)> {
    let Ok(Value::Object(fields)) = serde_json::to_value(record) else { return Vec::new() };
    let text = |value: Value| match value {
        Value::String(text) => text,
        other => other.to_string(),
    };
    fields.into_iter().map(|(name, value)| (name, text(value))).collect()
}

/// Percent-encodes a text for a path or query; ASCII letters, digits, dots, underscores and hyphens stay as they are.
pub fn escaped(text: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_' | b'-');
    let escape =
        |byte: u8| if is_plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    text.bytes().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoints::{ALL, CancelCounterfactual, ForkRun, ShowRun, ShowWhy};
    use crate::location::{AtRun, AtStep, AtTarget};
    use crate::query::{FirstRow, ValueName};
    use crate::wire::NewRun;

    fn step() -> AtStep {
        AtStep { session: "s1".to_owned(), target: 2, run: 3, step: 4 }
    }

    #[test]
    fn a_path_is_the_template_with_its_names() {
        assert_eq!(
            Call::to::<CancelCounterfactual>(&step()).path,
            "sessions/s1/targets/2/runs/3/steps/4/counterfactual/cancel"
        );
    }

    #[test]
    fn a_query_is_escaped_and_null_is_left_out() {
        let value = ValueName { value: Some("gate.ncc & more".to_owned()) };
        let path = Call::with_query::<ShowWhy>(&step(), &value).path;
        assert_eq!(path, "sessions/s1/targets/2/runs/3/steps/4/why?value=gate.ncc%20%26%20more");
        assert!(Call::to::<ShowWhy>(&step()).path.ends_with("/why"));
        let at = AtRun { session: "s1".to_owned(), target: 0, run: 1 };
        let rows = Call::with_query::<ShowRun>(&at, &FirstRow { from_row: 7 });
        assert_eq!((rows.path.as_str(), rows.body), ("sessions/s1/targets/0/runs/1?from_row=7", None));
    }

    #[test]
    fn a_body_is_json() {
        let new = NewRun { run: 0, from_step: 5, settings: Default::default(), prediction_px: None };
        let call = Call::with_body::<ForkRun>(&AtTarget { session: "s1".to_owned(), target: 2 }, &new);
        assert_eq!((call.method, call.path.as_str()), (Method::Post, "sessions/s1/targets/2/runs"));
        assert_eq!(NewRun::read(&call.body.unwrap()).unwrap(), new);
    }

    #[test]
    fn a_call_names_its_endpoint() {
        let call = Call::to::<ShowWhy>(&step());
        assert!(call.is_to::<ShowWhy>() && !call.is_to::<CancelCounterfactual>());
    }

    #[test]
    fn no_route_is_declared_twice() {
        let mut known = std::collections::BTreeSet::new();
        assert!(ALL.iter().all(|route| known.insert(*route)));
    }
}
