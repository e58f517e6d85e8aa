//! The access token: required on every route, and absent from every output of the server.

use std::process::{Command, Stdio};

use axum::body::Body;
use axum::http::{Method, Request, header};
use serde_json::{Value, json};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{ALL, LogIn};
use sightline_tests::server::{PORT, TOKEN, TestServer, small_drive};

use crate::cli::program;

/// The path of a route, with names that do not exist.
fn filled(path: &str) -> String {
    let parts = path.split('/').map(|part| match part {
        "{session}" => "s99",
        "{file}" | "{name}" | "{id}" | "{job}" => "none",
        part if part.starts_with('{') => "99",
        part => part,
    });
    format!("/api/v1{}", parts.collect::<Vec<_>>().join("/"))
}

#[tokio::test(flavor = "multi_thread")]
async fn every_route_of_the_list_needs_the_token() {
    let folders = [small_drive(), tempfile::tempdir().unwrap()];
    let server = TestServer::open(folders[0].path(), folders[1].path());
    let wrong = [
        None,
        Some((header::AUTHORIZATION, "Bearer wrong-token-of-the-tests".to_owned())),
        Some((header::AUTHORIZATION, format!("Basic {TOKEN}"))),
        Some((header::COOKIE, format!("sightline-{PORT}=wrong-token-of-the-tests"))),
        Some((header::COOKIE, format!("sightline-{}={TOKEN}", PORT + 1))),
    ];
    let right = [
        Some((header::AUTHORIZATION, format!("Bearer {TOKEN}"))),
        Some((header::COOKIE, format!("sightline-{PORT}={TOKEN}"))),
    ];
    let mut count = 0;
    for (method, path) in ALL {
        let send = |credential: &Option<(header::HeaderName, String)>| {
            let request = Request::builder()
                .method(Method::from_bytes(method.name().as_bytes()).unwrap())
                .uri(filled(path))
                .header(header::HOST, format!("127.0.0.1:{PORT}"))
                .header(header::CONTENT_TYPE, "application/json");
            let request = match credential {
                Some((name, value)) => request.header(name, value),
                None => request,
            };
            server.send(request.body(Body::from("{}")).unwrap())
        };
        for credential in &wrong {
            let answer = send(credential).await;
            if *path == LogIn::PATH {
                answer.problem(422, "field");
            } else {
                answer.problem(401, "token");
                assert!(answer.headers.contains_key(header::WWW_AUTHENTICATE), "{method} {path}");
            }
            count += 1;
        }
        for credential in &right {
            let answer = send(credential).await;
            assert!(answer.status != 401 && answer.status != 405, "{method} {path}: {}", answer.text());
            assert!(!answer.text().contains("There is no such route"), "{method} {path}");
            count += 1;
        }
    }
    assert_eq!(count, ALL.len() * 7);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_login_gives_a_cookie_that_opens() {
    let folders = [small_drive(), tempfile::tempdir().unwrap()];
    let server = TestServer::open(folders[0].path(), folders[1].path());
    let host = format!("127.0.0.1:{PORT}");
    let log_in = |token: &str| {
        let request = Request::post("/api/v1/login").header(header::HOST, &host);
        let request = request.header(header::CONTENT_TYPE, "application/json");
        server.send(request.body(Body::from(json!({ "token": token }).to_string())).unwrap())
    };
    let refused = log_in("wrong").await;
    refused.problem(401, "token");
    assert!(!refused.headers.contains_key(header::SET_COOKIE));
    let taken = log_in(TOKEN).await;
    assert_eq!((taken.status.as_u16(), taken.bytes.len()), (204, 0));
    let cookie = taken.headers[header::SET_COOKIE].to_str().unwrap();
    let (pair, attributes) = cookie.split_once("; ").unwrap();
    assert_eq!(attributes, "HttpOnly; SameSite=Strict; Path=/");
    let image = format!("/api/v1/traverses/{}/steps/0/images/left.png", server.traverse);
    let image = Request::get(image).header(header::HOST, &host).header(header::COOKIE, pair);
    assert_eq!(server.send(image.body(Body::empty()).unwrap()).await.status, 200);
}

/// Covers the complete output of the program at the most detailed log level, while the token is used in every way.
#[test]
fn the_token_is_in_no_line_of_the_log_and_in_no_export() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let log = data.path().join("log.txt");
    let mut child = Command::new(program())
        .args(["serve", drive.path().to_str().unwrap(), "--port", "0", "--data-dir"])
        .arg(data.path().join("data"))
        .env("SIGHTLINE_TOKEN", TOKEN)
        .env("RUST_LOG", "trace")
        .stdout(Stdio::piped())
        .stderr(std::fs::File::create(&log).unwrap())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let mut output = std::io::BufReader::new(child.stdout.take().unwrap());
    std::io::BufRead::read_line(&mut output, &mut line).unwrap();
    let address = line.trim().strip_prefix("Sightline is ready: http://").unwrap();
    let host = address.strip_suffix(&format!("/#token={TOKEN}")).unwrap().to_owned();
    let curl = |arguments: &[&str], path: &str| {
        let url = format!("http://{host}{path}");
        Command::new("curl").args(["-sS", "-i"]).args(arguments).arg(url).output().unwrap().stdout
    };
    let key = format!("Authorization: Bearer {TOKEN}");
    let cookie = format!("Cookie: sightline-{}={TOKEN}", host.rsplit(':').next().unwrap());
    let json = "Content-Type: application/json";
    let body = json!({ "token": TOKEN }).to_string();
    curl(&["-H", json, "-d", &body], "/api/v1/login");
    curl(&["-H", json, "-d", &body, "-H", &key], "/api/v1/sessions");
    curl(&["-H", &cookie, "-H", "Referer: http://x/#token=token-of-the-tests"], "/api/v1/version");
    curl(&[], &format!("/api/v1/{TOKEN}/x?token={TOKEN}"));
    curl(&["-H", &format!("Host: {TOKEN}")], "/api/v1/version");
    let traverses = curl(&["-H", &key], "/api/v1/traverses");
    let traverses = String::from_utf8_lossy(&traverses).into_owned();
    let traverses: Value = serde_json::from_str(traverses.split("\r\n\r\n").nth(1).unwrap()).unwrap();
    let new = json!({ "traverse": traverses[0]["id"] }).to_string();
    curl(&["-H", json, "-d", &new, "-H", &key], "/api/v1/sessions");
    for file in ["rows.csv", "rows.jsonl", "report.html", "reproduce.json"] {
        let bytes = curl(&["-H", &key], &format!("/api/v1/sessions/s1/exports/{file}"));
        assert!(!String::from_utf8_lossy(&bytes).contains(TOKEN), "{file}");
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let log = std::fs::read_to_string(log).unwrap();
    assert!(log.contains("refused"), "the log is detailed: {log:.2000}");
    assert!(!log.contains(TOKEN), "{}", log.lines().find(|line| line.contains(TOKEN)).unwrap());
}

/// The address and the warnings that the program prints.
fn printed(arguments: &[&str]) -> (String, String) {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let mut child = Command::new(program())
        .args([
            "serve",
            drive.path().to_str().unwrap(),
            "--port",
            "0",
            "--data-dir",
            data.path().to_str().unwrap(),
        ])
        .args(arguments)
        .env_remove("SIGHTLINE_TOKEN")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    std::io::BufRead::read_line(&mut std::io::BufReader::new(child.stdout.take().unwrap()), &mut line)
        .unwrap();
    child.kill().unwrap();
    let output = child.wait_with_output().unwrap();
    (line.trim().to_owned(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn each_start_prints_another_token_unless_one_is_chosen() {
    let tokens = [(); 2].map(|()| printed(&[]).0.split_once("/#token=").unwrap().1.to_owned());
    assert!(tokens[0] != tokens[1] && tokens.iter().all(|token| token.len() == 32), "{tokens:?}");
    assert!(printed(&["--token", TOKEN]).0.ends_with(&format!("/#token={TOKEN}")));
    let (line, warning) = printed(&["--no-token"]);
    assert!(!line.contains('#') && warning.contains("without an access token"), "{line} {warning}");
    let (line, _) = printed(&["--behind-proxy", "https://rover.example/sightline"]);
    assert!(line.starts_with("Sightline is ready: https://rover.example/sightline/#token="), "{line}");
}

#[cfg(unix)]
#[test]
fn an_image_that_is_a_link_out_of_its_folder_is_not_followed() {
    let (drive, elsewhere) = (sightline_tests::server::small_recording(), tempfile::tempdir().unwrap());
    let image = drive.path().join("images/left_0000.png");
    let outside = elsewhere.path().join("private.png");
    std::fs::rename(&image, &outside).unwrap();
    std::os::unix::fs::symlink(&outside, &image).unwrap();
    let refused = sightline_recordings::Traverse::open(drive.path()).err().unwrap().to_string();
    assert!(
        refused.contains("images/left_0000.png") && refused.contains("leads out of the folder"),
        "{refused}"
    );
}
