//! The table: what is sent and which status it must get. `$HOST`, `$PORT`, `$TOKEN` and `$DRIVE` are replaced.

/// A kind of route, with a request of each.
pub(super) struct Kind {
    pub name: &'static str,
    pub line: &'static str,
    pub headers: &'static [&'static str],
    pub body: &'static str,
    /// The status of our own request.
    pub status: u16,
    /// Whether an `Origin` is checked: it changes something, or it is an upgrade.
    pub changes: bool,
    /// Whether it needs no token.
    pub is_open: bool,
}

/// One attack.
pub(super) struct Entry {
    pub name: String,
    pub line: String,
    pub headers: Vec<String>,
    pub body: String,
    /// Statuses that are right; 0 is a closed connection.
    pub statuses: Vec<u16>,
}

/// One attack, as it is written down.
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

    /// A request of a kind with other headers in front of those of the kind that `keeps` keeps.
    pub(super) fn of(
        kind: &Kind,
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

const HOST: &str = "Host: $HOST";
const KEY: &str = "Authorization: Bearer $TOKEN";
const JSON: &str = "Content-Type: application/json";
const UPGRADE: &[&str] = &[
    "Connection: Upgrade",
    "Upgrade: websocket",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
];

const fn reads(name: &'static str, line: &'static str) -> Kind {
    Kind { name, line, headers: &[], body: "", status: 200, changes: false, is_open: false }
}

pub(super) const KINDS: &[Kind] = &[
    Kind { is_open: true, ..reads("page", "GET /") },
    reads("JSON", "GET /api/v1/version"),
    reads("OpenAPI", "GET /api/v1/openapi.json"),
    reads("image", "GET /api/v1/traverses/$DRIVE/steps/0/images/left.png"),
    reads("download", "GET /api/v1/sessions/s1/exports/rows.csv"),
    reads("plain page", "GET /api/v1/page"),
    reads("Rerun viewer", "GET /api/v1/rerun/index.html"),
    reads("Rerun stream", "GET /api/v1/sessions/s1/rerun/live.rrd"),
    Kind { headers: UPGRADE, status: 101, changes: true, ..reads("WebSocket", "GET /api/v1/events") },
    Kind {
        headers: &[JSON],
        body: r#"{"target":null,"run":0,"step":0}"#,
        changes: true,
        ..reads("change", "PUT /api/v1/sessions/s1/cursor")
    },
    Kind {
        headers: &[JSON],
        body: r#"{"text":"x"}"#,
        status: 422,
        changes: true,
        ..reads("creation", "POST /api/v1/sessions/s1/targets")
    },
    Kind { status: 404, changes: true, ..reads("removal", "DELETE /api/v1/sessions/s99") },
    Kind {
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

/// Wrong credentials: each takes the place of the right header.
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

pub(super) const SINGLE: &[Single] = &[
    // The right ones.
    ("token as header", "GET /api/v1/version", &[HOST, KEY], "", &[200]),
    ("token as cookie", "GET /api/v1/version", &[HOST, "Cookie: sightline-$PORT=$TOKEN"], "", &[200]),
    (
        "token among other cookies",
        "GET /api/v1/version",
        &[HOST, "Cookie: a=b; sightline-$PORT=$TOKEN; c"],
        "",
        &[200],
    ),
    ("our name", "GET /api/v1/version", &["Host: localhost:$PORT", KEY], "", &[200]),
    ("our name in IPv6", "GET /api/v1/version", &["Host: [::1]:$PORT", KEY], "", &[200]),
    ("absolute form with our name", "GET http://$HOST/api/v1/version", &[HOST, KEY], "", &[200]),
    (
        "a link from elsewhere to the page",
        "GET /",
        &[HOST, "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate"],
        "",
        &[200],
    ),
    // The token where it must not be.
    ("token in the query", "GET /api/v1/version?token=$TOKEN", &[HOST], "", &[401]),
    ("token in the path", "GET /api/v1/$TOKEN/version", &[HOST], "", &[401]),
    ("token in the fragment", "GET /api/v1/version#token=$TOKEN", &[HOST], "", &[400, 401]),
    ("token in the body", "POST /api/v1/sessions", &[HOST, JSON], r#"{"token":"$TOKEN"}"#, &[401]),
    ("login with the token in the query", "POST /api/v1/login?token=$TOKEN", &[HOST, JSON], "{}", &[422]),
    ("login with a wrong token", "POST /api/v1/login", &[HOST, JSON], r#"{"token":"wrong"}"#, &[401]),
    ("login with a number", "POST /api/v1/login", &[HOST, JSON], r#"{"token":1}"#, &[422]),
    (
        "login as a form",
        "POST /api/v1/login",
        &[HOST, "Content-Type: application/x-www-form-urlencoded"],
        "token=$TOKEN",
        &[415],
    ),
    ("login by GET", "GET /api/v1/login", &[HOST], "", &[405]),
    (
        "wrong header beside the right cookie",
        "GET /api/v1/version",
        &[HOST, "Authorization: Bearer x", "Cookie: sightline-$PORT=$TOKEN"],
        "",
        &[200],
    ),
    // Ways around the check of the path.
    ("route with two slashes", "GET //api/v1/version", &[HOST], "", &[404]),
    ("route with a dot", "GET /./api/v1/version", &[HOST], "", &[404]),
    ("route with dots", "GET /x/../api/v1/version", &[HOST], "", &[404]),
    ("route percent-encoded", "GET /%61pi/v1/version", &[HOST], "", &[404]),
    ("route in capitals", "GET /API/v1/version", &[HOST], "", &[404]),
    ("route with a slash behind", "GET /api/v1/version/", &[HOST], "", &[401]),
    ("route with a semicolon", "GET /api;x/v1/version", &[HOST], "", &[401, 404]),
    ("route with a backslash", "GET /api\\v1/version", &[HOST], "", &[400, 401, 404]),
    ("another version", "GET /api/v2/version", &[HOST], "", &[401]),
    ("the API itself", "GET /api", &[HOST], "", &[401]),
    (
        "method in a header",
        "POST /api/v1/login",
        &[HOST, JSON, "X-HTTP-Method-Override: DELETE"],
        r#"{"token":"wrong"}"#,
        &[401],
    ),
    (
        "path in a header",
        "GET /",
        &[HOST, "X-Original-URL: /api/v1/version", "X-Rewrite-URL: /api/v1/version"],
        "",
        &[200],
    ),
    // Names of the server.
    ("two hosts", "GET /api/v1/version", &[HOST, "Host: evil.example", KEY], "", &[400, 403]),
    (
        "two hosts, the foreign one first",
        "GET /api/v1/version",
        &["Host: evil.example", HOST, KEY],
        "",
        &[400, 403],
    ),
    ("no host", "GET /api/v1/version", &[KEY], "", &[400, 403]),
    ("no host, HTTP/1.0", "GET /api/v1/version HTTP/1.0", &[KEY], "", &[403]),
    ("our host, HTTP/1.0", "GET /api/v1/version HTTP/1.0", &[HOST, KEY], "", &[200]),
    ("absolute form with a foreign name", "GET http://evil.example/api/v1/version", &[HOST, KEY], "", &[403]),
    (
        "absolute form with a user",
        "GET http://$HOST@evil.example/api/v1/version",
        &[HOST, KEY],
        "",
        &[400, 403],
    ),
    (
        "forwarded from our name",
        "GET /api/v1/version",
        &["Host: evil.example", "Forwarded: host=$HOST", KEY],
        "",
        &[403],
    ),
    (
        "forwarded from a foreign name",
        "GET /api/v1/version",
        &[HOST, "X-Forwarded-Host: evil.example", KEY],
        "",
        &[200],
    ),
    ("CONNECT", "CONNECT evil.example:443", &["Host: evil.example:443", KEY], "", &[400, 403, 405]),
    ("CONNECT to ourselves", "CONNECT $HOST", &[HOST, KEY], "", &[400, 403, 405]),
    // Methods.
    ("TRACE", "TRACE /api/v1/version", &[HOST, KEY], "", &[405]),
    ("TRACE without a token", "TRACE /api/v1/version", &[HOST, "Cookie: a=$TOKEN"], "", &[401]),
    (
        "preflight",
        "OPTIONS /api/v1/sessions",
        &[HOST, "Origin: http://evil.example", "Access-Control-Request-Method: POST"],
        "",
        &[401],
    ),
    (
        "preflight from us",
        "OPTIONS /api/v1/sessions",
        &[HOST, KEY, "Access-Control-Request-Method: POST"],
        "",
        &[405],
    ),
    ("a method of our own", "BREAK /api/v1/version", &[HOST, KEY], "", &[405]),
    ("POST to the page", "POST /", &[HOST, JSON], "{}", &[405]),
    // What a form of another site can send.
    (
        "form",
        "POST /api/v1/sessions",
        &[HOST, KEY, "Content-Type: application/x-www-form-urlencoded"],
        "traverse=x",
        &[415],
    ),
    (
        "form with a file",
        "POST /api/v1/sessions",
        &[HOST, KEY, "Content-Type: multipart/form-data; boundary=x"],
        "--x--",
        &[415],
    ),
    ("plain text", "POST /api/v1/sessions", &[HOST, KEY, "Content-Type: text/plain"], "{}", &[415]),
    ("no type", "POST /api/v1/sessions", &[HOST, KEY], "{}", &[415]),
    ("two types", "POST /api/v1/sessions", &[HOST, KEY, JSON, "Content-Type: text/plain"], "{}", &[415]),
    (
        "a type that contains ours",
        "POST /api/v1/sessions",
        &[HOST, KEY, "Content-Type: text/plain; application/json"],
        "{}",
        &[415],
    ),
    (
        "form without fields",
        "DELETE /api/v1/sessions/s99",
        &[HOST, KEY, "Content-Type: text/plain"],
        "",
        &[415],
    ),
    // Bodies.
    (
        "a body of 100 MB that never comes",
        "POST /api/v1/sessions",
        &[HOST, KEY, JSON, "Content-Length: 100000000"],
        "",
        &[413],
    ),
    (
        "a body above every number",
        "POST /api/v1/sessions",
        &[HOST, KEY, JSON, "Content-Length: 99999999999999999999999"],
        "",
        &[0, 400],
    ),
    (
        "a body of 100 MB that never comes, to the login",
        "POST /api/v1/login",
        &[HOST, JSON, "Content-Length: 100000000"],
        "",
        &[413],
    ),
    (
        "length and chunks",
        "POST /api/v1/sessions",
        &[HOST, KEY, JSON, "Content-Length: 4", "Transfer-Encoding: chunked"],
        "0\r\n\r\n",
        &[400, 422],
    ),
    (
        "two lengths",
        "POST /api/v1/sessions",
        &[HOST, KEY, JSON, "Content-Length: 2", "Content-Length: 3"],
        "{}",
        &[0, 400],
    ),
    (
        "chunks without an end",
        "POST /api/v1/sessions",
        &[HOST, KEY, JSON, "Transfer-Encoding: chunked, identity"],
        "0\r\n\r\n",
        &[0, 400, 501],
    ),
    // Traversal: no name in a path becomes the name of a file.
    ("traversal in the page", "GET /../Cargo.toml", &[HOST], "", &[404]),
    ("traversal in the page, encoded", "GET /%2e%2e/Cargo.toml", &[HOST], "", &[404]),
    ("traversal in the page, slash encoded", "GET /..%2fCargo.toml", &[HOST], "", &[404]),
    ("traversal in the page, encoded twice", "GET /%252e%252e/Cargo.toml", &[HOST], "", &[404]),
    ("absolute path in the page", "GET //etc/passwd", &[HOST], "", &[404]),
    ("packed file of the page by its own name", "GET /sightline_viewer_bg.wasm.gz", &[HOST], "", &[404]),
    (
        "traversal in an image",
        "GET /api/v1/traverses/$DRIVE/steps/0/images/..%2f..%2ftraverse.toml",
        &[HOST, KEY],
        "",
        &[404],
    ),
    (
        "traversal in an image, encoded twice",
        "GET /api/v1/traverses/$DRIVE/steps/0/images/%252e%252e%252ftraverse.toml",
        &[HOST, KEY],
        "",
        &[404],
    ),
    (
        "traversal in an image, overlong UTF-8",
        "GET /api/v1/traverses/$DRIVE/steps/0/images/%c0%ae%c0%ae%2fx",
        &[HOST, KEY],
        "",
        &[400, 404],
    ),
    (
        "NUL in an image",
        "GET /api/v1/traverses/$DRIVE/steps/0/images/left.png%00.txt",
        &[HOST, KEY],
        "",
        &[404],
    ),
    (
        "traversal in an export",
        "GET /api/v1/sessions/s1/exports/..%2f..%2fsessions.redb",
        &[HOST, KEY],
        "",
        &[404],
    ),
    ("traversal in a session", "GET /api/v1/sessions/..%2f..%2f", &[HOST, KEY], "", &[404]),
    (
        "traversal in a document",
        "GET /api/v1/documents/..%2f..%2fetc%2fpasswd",
        &[HOST, KEY],
        "",
        &[404, 422],
    ),
    ("traversal in a study", "GET /api/v1/studies/jobs/..%2f..%2f/report.html", &[HOST, KEY], "", &[404]),
    ("traversal in the Rerun viewer", "GET /api/v1/rerun/..%2fversion", &[HOST, KEY], "", &[404]),
    (
        "Windows path in an export",
        "GET /api/v1/sessions/s1/exports/C:%5cwindows%5cwin.ini",
        &[HOST, KEY],
        "",
        &[404],
    ),
    // Rerun: its own stream is not served, under any of its names.
    (
        "gRPC read",
        "POST /rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages",
        &[HOST, KEY, "Content-Type: application/grpc-web+proto"],
        "\0\0\0\0\0",
        &[415],
    ),
    (
        "gRPC write",
        "POST /rerun.sdk_comms.v1alpha1.MessageProxyService/WriteMessages",
        &[HOST, KEY, "Content-Type: application/grpc"],
        "\0\0\0\0\0",
        &[415],
    ),
    (
        "gRPC as JSON",
        "POST /rerun.sdk_comms.v1alpha1.MessageProxyService/WriteMessages",
        &[HOST, KEY, JSON],
        "{}",
        &[405],
    ),
    (
        "stream of a session that is not streamed",
        "GET /api/v1/sessions/s99/rerun/live.rrd",
        &[HOST, KEY],
        "",
        &[404],
    ),
    ("writing to the stream", "POST /api/v1/sessions/s1/rerun/live.rrd", &[HOST, KEY, JSON], "{}", &[405]),
    ("sign-in page of the Rerun viewer", "GET /api/v1/rerun/signed-in.html", &[HOST, KEY], "", &[404]),
    // Upgrades.
    (
        "upgrade to HTTP/2",
        "GET /api/v1/version",
        &[
            HOST,
            KEY,
            "Connection: Upgrade, HTTP2-Settings",
            "Upgrade: h2c",
            "HTTP2-Settings: AAMAAABkAAQAAP__",
        ],
        "",
        &[200],
    ),
    (
        "upgrade of another route",
        "GET /api/v1/version",
        &[HOST, "Connection: Upgrade", "Upgrade: websocket"],
        "",
        &[401],
    ),
    ("events without an upgrade", "GET /api/v1/events", &[HOST, KEY], "", &[426]),
];
