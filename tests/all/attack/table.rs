//! The table: the request, and the required status. `$HOST`, `$PORT`, `$TOKEN` and `$DRIVE` are replaced.

/// A kind of route, with a request for it.
pub(super) struct RouteKind {
    pub name: &'static str,
    pub line: &'static str,
    pub headers: &'static [&'static str],
    pub body: &'static str,
    /// The status of our own request.
    pub status: u16,
    /// Whether an `Origin` is checked, because the request changes something or is an upgrade.
    pub changes: bool,
    /// Whether the route needs no token.
    pub is_open: bool,
}

/// One attack.
pub(super) struct Entry {
    pub name: String,
    pub line: String,
    pub headers: Vec<String>,
    pub body: String,
    /// Permitted statuses; 0 is a closed connection.
    pub statuses: Vec<u16>,
}

/// One attack, in short form.
pub(super) type Single = (&'static str, &'static str, &'static [&'static str], &'static str, &'static [u16]);

impl Entry {
    pub(super) fn single((name, line, headers, body, statuses): &Single) -> Self {
        Self {
            name: (*name).to_owned(),
            line: format!("{line} HTTP/1.1").replace(" HTTP/1.0 HTTP/1.1", " HTTP/1.0"),
            headers: headers.iter().map(|header| (*header).to_owned()).collect(),
            body: (*body).to_owned(),
            statuses: statuses.to_vec(),
        }
    }

    /// A request of a kind, with other headers before those of the kind for which `keeps` is true.
    pub(super) fn of(
        kind: &RouteKind,
        name: &str,
        status: u16,
        keeps: fn(&str) -> bool,
        headers: &[&str],
    ) -> Self {
        let own = kind.headers.iter().copied().filter(|header| keeps(header));
        Self {
            name: format!("{}, {name}", kind.name),
            line: format!("{} HTTP/1.1", kind.line),
            headers: headers.iter().copied().chain(own).map(str::to_owned).collect(),
            body: kind.body.to_owned(),
            statuses: vec![status],
        }
    }
}

/// Host and token of our own requests.
pub(super) const OURS: [&str; 2] = ["Host: $HOST", KEY];

pub(super) const HOST: &str = "Host: $HOST";
pub(super) const KEY: &str = "Authorization: Bearer $TOKEN";
pub(super) const JSON: &str = "Content-Type: application/json";
const UPGRADE: &[&str] = &[
    "Connection: Upgrade",
    "Upgrade: websocket",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
];

const fn reads(name: &'static str, line: &'static str) -> RouteKind {
    RouteKind { name, line, headers: &[], body: "", status: 200, changes: false, is_open: false }
}

pub(super) const KINDS: &[RouteKind] = &[
    RouteKind { is_open: true, ..reads("page", "GET /") },
    reads("JSON", "GET /api/v1/version"),
    reads("OpenAPI", "GET /api/v1/openapi.json"),
    reads("image", "GET /api/v1/traverses/$DRIVE/steps/0/images/left.png"),
    reads("download", "GET /api/v1/sessions/s1/exports/rows.csv"),
    reads("plain page", "GET /api/v1/page"),
    reads("Rerun viewer", "GET /api/v1/rerun/index.html"),
    reads("Rerun stream", "GET /api/v1/sessions/s1/rerun/live.rrd"),
    RouteKind { headers: UPGRADE, status: 101, changes: true, ..reads("WebSocket", "GET /api/v1/events") },
    RouteKind {
        headers: &[JSON],
        body: r#"{"target":null,"run":0,"step":0}"#,
        changes: true,
        ..reads("change", "PUT /api/v1/sessions/s1/cursor")
    },
    RouteKind {
        headers: &[JSON],
        body: r#"{"text":"x"}"#,
        status: 422,
        changes: true,
        ..reads("creation", "POST /api/v1/sessions/s1/targets")
    },
    RouteKind { status: 404, changes: true, ..reads("removal", "DELETE /api/v1/sessions/s99") },
    RouteKind {
        headers: &[JSON],
        body: r#"{"token":"$TOKEN"}"#,
        status: 204,
        changes: true,
        is_open: true,
        ..reads("login", "POST /api/v1/login")
    },
];

pub(super) const FOREIGN_HOSTS: &[&str] = &[
    "Host: evil.example",
    "Host: evil.example:$PORT",
    "Host: 127.0.0.1",
    "Host: 127.0.0.1:1",
    "Host: localhost:$PORT.evil.example",
    "Host: localhost.evil.example:$PORT",
    "Host: 127.0.0.1:$PORT@evil.example",
    "Host: 0.0.0.0:$PORT",
    "Host: 127.1:$PORT",
    "Host: localhost.:$PORT",
    "Host:",
    "X-Forwarded-Host: $HOST",
];

pub(super) const FOREIGN_ORIGINS: &[&str] = &[
    "Origin: https://evil.example",
    "Origin: null",
    "Origin:",
    "Origin: http://127.0.0.1:1",
    "Origin: http://localhost:3000",
    "Origin: http://$HOST.evil.example",
    "Origin: http://evil.example/$HOST",
    "Origin: $HOST",
    "Origin: file://",
    "Origin: https://rerun.io",
];

/// Wrong credentials: each replaces the correct header.
pub(super) const CREDENTIALS: &[&str] = &[
    "Accept: */*",
    "Authorization: Bearer wrong-token-of-another",
    "Authorization: Bearer $TOKEN0",
    "Authorization: Bearer token-of-the-test",
    "Authorization: Bearer",
    "Authorization: Basic $TOKEN",
    "Authorization: $TOKEN",
    "X-Token: $TOKEN",
    "Cookie: sightline-1=$TOKEN",
    "Cookie: sightline-$PORT=wrong-token-of-another",
    "Cookie: sightline=$TOKEN; token=$TOKEN",
    "Referer: http://$HOST/#token=$TOKEN",
];
