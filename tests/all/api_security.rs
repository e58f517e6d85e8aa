//! Requests that the server refuses; afterwards it continues to work.

use std::net::SocketAddr;

use axum::body::Body;
use axum::http::{HeaderValue, Method, StatusCode, header};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use sightline_tests::server::{PIXEL, PORT, TOKEN, TestServer, access, request, small_drive};
use tokio_tungstenite::tungstenite::{self, Message};

/// A server with a session, and its folders.
async fn server() -> (TestServer, String, [tempfile::TempDir; 2]) {
    let folders = [small_drive(), tempfile::tempdir().unwrap()];
    let server = TestServer::open(folders[0].path(), folders[1].path());
    let session = server.begin().await;
    (server, session, folders)
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_designations_are_rejected_in_one_sentence() {
    let (server, session, _folders) = server().await;
    let path = format!("sessions/{session}/targets");
    let refused = |body: Value| {
        let (server, path) = (&server, &path);
        async move { server.post(path, &body).await }
    };
    let pixel = json!({ "x": PIXEL[0], "y": PIXEL[1] });
    let outside = refused(json!({ "step": 0, "pixel": { "x": 900.0, "y": 10.0 } })).await;
    assert!(outside.problem(422, "target").contains("(900, 10)"));
    let nowhere = refused(json!({ "step": 99, "pixel": pixel })).await;
    assert!(nowhere.problem(422, "target").contains("step 99"));
    let setting = refused(json!({ "step": 0, "pixel": pixel, "settings": { "ncc_mim": 0.5 } })).await;
    assert!(setting.problem(422, "setting").contains("ncc_min"));
    let range = refused(json!({ "step": 0, "pixel": pixel, "settings": { "ncc_min": 7 } })).await;
    assert!(range.problem(422, "setting").contains("ncc_min"));
    let field = refused(json!({ "step": 0, "pixel": pixel, "colour": "red" })).await;
    assert!(field.problem(422, "field").contains("colour"));
    let inner = refused(json!({ "step": 0, "pixel": { "x": "left", "y": 3 } })).await;
    assert!(inner.problem(422, "field").starts_with("pixel.x: "));
    let label = refused(json!({ "step": 0, "pixel": pixel, "label": "x".repeat(1000) })).await;
    assert!(label.problem(422, "field").contains("label"));
    let view = server.get(&format!("sessions/{session}")).await.expect(200);
    assert_eq!(view["targets"], json!([]), "nothing was added");
    assert_eq!(server.pick(&session).await, 0, "and the server goes on");
}

#[tokio::test(flavor = "multi_thread")]
async fn unreadable_requests_are_rejected() {
    let (server, session, _folders) = server().await;
    let path = format!("sessions/{session}/targets");
    let with = |media_type: &'static str, body: &'static str| {
        let request = request(Method::POST, &path).header(header::CONTENT_TYPE, media_type);
        server.send(request.body(Body::from(body)).unwrap())
    };
    with("application/json", "{\"step\": 0,").await.problem(400, "malformed_json");
    with("application/json", "{\"step\": 0} {}").await.problem(400, "malformed_json");
    with("application/json", "{\"label\": \"no step\"}").await.problem(422, "field");
    with("application/json", "[0, null]").await.problem(422, "field");
    let four = with("application/json", "{\"step\": 0, \"point_in_rover\": [1, 2, 3, 4]}").await;
    assert_eq!(four.problem(422, "field"), "point_in_rover: has too many elements");
    with("application/x-www-form-urlencoded", "step=0").await.problem(415, "not_json");
    with("text/plain", "{}").await.problem(415, "not_json");
    let large = request(Method::POST, &path).header(header::CONTENT_TYPE, "application/json");
    let large = server.send(large.body(Body::from(vec![b' '; (1 << 20) + 1])).unwrap()).await;
    large.problem(413, "too_large");
    server.json(Method::PATCH, "sessions", &json!({})).await.problem(405, "method");
    server.post("sessions", &json!({ "traverse": "../secret" })).await.problem(422, "field");
    let cursor = json!({ "target": 3, "run": 0, "step": 0 });
    server.json(Method::PUT, &format!("sessions/{session}/cursor"), &cursor).await.problem(422, "request");
    let run = json!({ "run": 0, "from_step": 1 });
    server.post(&format!("sessions/{session}/targets/0/runs"), &run).await.problem(404, "not_found");
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    for (from_step, named) in [(5, "from 0 to 4"), (99, "from 0 to 4")] {
        let run = json!({ "run": 0, "from_step": from_step });
        let refused = server.post(&format!("sessions/{session}/targets/0/runs"), &run).await;
        assert!(refused.problem(422, "field").contains(named));
    }
    server.get("health").await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn unknown_names_are_not_found_in_any_spelling() {
    let (server, session, _folders) = server().await;
    server.pick(&session).await;
    let traverse = &server.traverse;
    let paths = [
        "nothing".to_owned(),
        "sessions/s99".to_owned(),
        "sessions/S1".to_owned(),
        "sessions/s1%00".to_owned(),
        "sessions/..".to_owned(),
        "sessions/..%2f..%2fetc%2fpasswd".to_owned(),
        "sessions/%2e%2e".to_owned(),
        "sessions/%ff".to_owned(),
        format!("sessions/{session}/targets/-1/runs/0"),
        format!("sessions/{session}/targets/0/runs/9"),
        format!("sessions/{session}/targets/99999999999999999999999/runs/0"),
        format!("sessions/{session}/targets/0/runs/0/steps/77"),
        format!("sessions/{session}/targets/0/runs/0/steps/0x1"),
        format!("sessions/{session}/targets/0/runs/0/steps/0/think"),
        format!("sessions/{session}/exports/..%2f..%2fsecret.npy"),
        format!("traverses/{traverse}x"),
        format!("traverses/{traverse}/steps/99/images/left.png"),
        format!("traverses/{traverse}/steps/0/images/middle.png"),
        format!("traverses/{traverse}/steps/0/images/..%2f..%2ftraverse.toml"),
        format!("traverses/{traverse}/steps/0/images/%2e%2e/traverse.toml"),
    ];
    for path in paths {
        let answer = server.get(&path).await;
        assert_eq!(answer.status, StatusCode::NOT_FOUND, "{path}: {}", answer.text());
        answer.problem(404, "not_found");
    }
    for path in
        ["/../Cargo.toml", "/%2e%2e/Cargo.toml", "/..%2fCargo.toml", "//etc/passwd", "/api/v2/version"]
    {
        let request = axum::http::Request::get(path).header(header::HOST, format!("localhost:{PORT}"));
        let request = request.header(header::AUTHORIZATION, format!("Bearer {TOKEN}"));
        server.send(request.body(Body::empty()).unwrap()).await.problem(404, "not_found");
    }
    server.get(&format!("sessions/{session}")).await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn other_sites_are_refused_before_any_route() {
    let (server, session, _folders) = server().await;
    let before = server.get(&format!("sessions/{session}")).await.expect(200);
    let send = |method: Method, path: String, pairs: Vec<(header::HeaderName, String)>| {
        let mut request = request(method, &path).header(header::CONTENT_TYPE, "application/json");
        for (name, value) in pairs {
            if name == header::HOST {
                request.headers_mut().unwrap().insert(name, HeaderValue::try_from(value).unwrap());
            } else {
                request = request.header(name, value);
            }
        }
        server.send(request.body(Body::from("{}")).unwrap())
    };
    let cancel = format!("sessions/{session}/targets/0/runs/0/cancel");
    for host in
        ["evil.example", "evil.example:7700", "localhost", "127.0.0.1:7701", "localhost:7700@evil.example"]
    {
        for path in ["version", "nothing"] {
            let answer = send(Method::GET, path.to_owned(), vec![(header::HOST, host.to_owned())]).await;
            answer.problem(403, "host");
        }
    }
    for origin in
        ["https://evil.example", "null", "http://localhost:3000", "http://127.0.0.1:7700.evil.example"]
    {
        let answer = send(Method::POST, cancel.clone(), vec![(header::ORIGIN, origin.to_owned())]).await;
        answer.problem(403, "origin");
    }
    let cross = (header::HeaderName::from_static("sec-fetch-site"), "cross-site".to_owned());
    send(Method::GET, "version".to_owned(), vec![cross]).await.problem(403, "origin");
    let ours =
        send(Method::GET, "version".to_owned(), vec![(header::ORIGIN, format!("http://localhost:{PORT}"))])
            .await;
    ours.expect(200);
    let policy = ours.headers[header::CONTENT_SECURITY_POLICY].to_str().unwrap();
    assert!(
        policy.contains("script-src 'self' 'wasm-unsafe-eval';") && policy.contains("frame-ancestors 'none'")
    );
    for (name, value) in [
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-resource-policy", "same-origin"),
        ("cache-control", "no-store"),
    ] {
        assert_eq!(ours.headers[name], value);
    }
    assert_eq!(server.get(&format!("sessions/{session}")).await.expect(200), before);
}

/// Serves on a free port of this machine, which is also the port in the server's own address.
async fn bound() -> (SocketAddr, TestServer, [tempfile::TempDir; 2]) {
    let folders = [small_drive(), tempfile::tempdir().unwrap()];
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let traverse = sightline_recordings::Traverse::open(folders[0].path()).unwrap();
    let access = access(address.port());
    let state = sightline_server::state::AppState::new(vec![traverse], folders[1].path(), access).unwrap();
    let app = sightline_server::app(state.clone());
    tokio::spawn(async move { axum::serve(listener, app).await });
    let traverse = state.traverses()[0].id.clone();
    // Requests passed to the router use the usual port and would be refused; only the events are used here.
    (address, TestServer { app: sightline_server::app(state.clone()), state, traverse }, folders)
}

async fn connect(address: SocketAddr, origin: Option<&str>) -> Result<u16, tungstenite::Error> {
    let mut request = events_request(address);
    if let Some(origin) = origin {
        request.headers_mut().insert(header::ORIGIN, HeaderValue::from_str(origin).unwrap());
    }
    tokio_tungstenite::connect_async(request).await.map(|(_, response)| response.status().as_u16())
}

fn events_request(address: SocketAddr) -> tungstenite::handshake::client::Request {
    let url = format!("ws://{address}/api/v1/events");
    let mut request = tungstenite::client::IntoClientRequest::into_client_request(url).unwrap();
    let token = HeaderValue::from_str(&format!("Bearer {TOKEN}")).unwrap();
    request.headers_mut().insert(header::AUTHORIZATION, token);
    request
}

#[tokio::test(flavor = "multi_thread")]
async fn a_foreign_page_opens_no_websocket() {
    let (address, _server, _folders) = bound().await;
    let own = format!("http://{address}");
    assert_eq!(connect(address, None).await.unwrap(), 101);
    assert_eq!(connect(address, Some(&own)).await.unwrap(), 101);
    for origin in ["https://evil.example", "null", "http://127.0.0.1:1"] {
        match connect(address, Some(origin)).await {
            Err(tungstenite::Error::Http(response)) => assert_eq!(response.status(), 403, "{origin}"),
            other => panic!("{origin}: {other:?}"),
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_page_hears_what_changes_and_a_flood_hurts_nobody() {
    let (address, server, _folders) = bound().await;
    let (mut socket, _) = tokio_tungstenite::connect_async(events_request(address)).await.unwrap();
    let (mut flooding, _) = tokio_tungstenite::connect_async(events_request(address)).await.unwrap();
    // A message above the limit ends only that connection.
    let _ = flooding.send(Message::text("x".repeat(200_000))).await;
    socket.send(Message::text("{\"anything\": 1}")).await.unwrap();
    let traverse = server.state.traverse(&server.traverse).unwrap();
    let live = server.state.begin_session(traverse).unwrap();
    let received = async {
        loop {
            let Some(Ok(message)) = socket.next().await else { panic!("the connection ended") };
            if message.to_text().is_ok_and(|text| text.contains("session_changed") && text.contains(&live.id))
            {
                break;
            }
        }
    };
    tokio::time::timeout(std::time::Duration::from_secs(20), received).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn the_document_describes_every_route_and_names_each_once() {
    let (server, session, _folders) = server().await;
    let document = server.get("openapi.json").await.expect(200);
    assert_eq!(document["openapi"], json!("3.1.0"));
    let mut names = std::collections::BTreeSet::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            assert!(names.insert(operation["operationId"].to_string()), "{path}: its name is used twice");
            assert!(operation["responses"].as_object().is_some_and(|all| !all.is_empty()), "{path}");
            // Every path of the document is a route: none returns the error for an unknown route.
            let path = path
                .replace("{session}", &session)
                .replace("{id}", "none")
                .replace(['{', '}'], "")
                .trim_start_matches('/')
                .to_owned();
            let method = Method::from_bytes(method.to_uppercase().as_bytes()).unwrap();
            let answer = server.json(method.clone(), &path, &json!({})).await;
            assert!(!answer.text().contains("There is no such route"), "{method} {path}");
            assert_ne!(answer.status, StatusCode::METHOD_NOT_ALLOWED, "{method} {path}");
        }
    }
    assert_eq!(names.len(), sightline_api::endpoints::ALL.len());
    let text = document.to_string();
    for reference in text.split("#/components/schemas/").skip(1) {
        let name = reference.split('"').next().unwrap();
        assert!(document["components"]["schemas"].get(name).is_some(), "{name} is not described");
    }
    // Readers of the document have the papers, not our requirement numbers.
    let is_number = |word: &&str| {
        word.strip_prefix('R').is_some_and(|rest| {
            (1..=3).contains(&rest.len()) && rest.bytes().all(|letter| letter.is_ascii_digit())
        })
    };
    let numbers: Vec<&str> = text.split(|letter: char| !letter.is_alphanumeric()).filter(is_number).collect();
    assert!(numbers.is_empty(), "{numbers:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plain_page_that_is_not_there_is_a_page() {
    let (server, session, _folders) = server().await;
    for path in [
        format!("sessions/{session}/targets/0/runs/2/steps/-1/page"),
        format!("sessions/{session}/targets/0/runs/0/steps/0/page"),
        "sessions/s99/page".to_owned(),
    ] {
        let answer = server.get(&path).await;
        assert_eq!(
            (answer.status, answer.headers[header::CONTENT_TYPE].to_str().unwrap()),
            (StatusCode::NOT_FOUND, "text/html; charset=utf-8"),
            "{path}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_table_of_settings_is_what_the_tracker_takes() {
    let (server, _, _folders) = server().await;
    let table = server.get("settings").await.expect(200);
    let keys: Vec<_> = table.as_array().unwrap().iter().map(|info| info["key"].as_str().unwrap()).collect();
    assert!(keys.contains(&"ncc_min") && keys.contains(&"search_window_px"));
    let version = server.get("version").await.expect(200);
    assert_eq!((&version["name"], &version["limits"]["body_bytes"]), (&json!("sightline"), &json!(1 << 20)));
}
