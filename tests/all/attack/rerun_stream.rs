//! The live stream to Rerun: behind the token on the main port, on no other port, and closed on request.

use sightline_tests::rrd;
use sightline_tests::server::{TOKEN, access};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::RunningServer;

/// Ports on which this process listens.
#[cfg(target_os = "linux")]
fn listening_ports() -> std::collections::BTreeSet<u16> {
    let sockets: std::collections::BTreeSet<String> = std::fs::read_dir("/proc/self/fd")
        .unwrap()
        .filter_map(|entry| std::fs::read_link(entry.ok()?.path()).ok()?.to_str().map(str::to_owned))
        .filter_map(|link| Some(link.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned()))
        .collect();
    let table = std::fs::read_to_string("/proc/self/net/tcp").unwrap();
    let rows = table.lines().skip(1).map(|line| line.split_whitespace().collect::<Vec<_>>());
    let ours = rows.filter(|row| row[3] == "0A" && sockets.contains(row[9]));
    ours.map(|row| u16::from_str_radix(row[1].split(':').nth(1).unwrap(), 16).unwrap()).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_is_opened_read_and_closed_behind_the_token() {
    let server = RunningServer::start(access).await;
    let new = format!(r#"{{"traverse":"{}"}}"#, server.traverse);
    assert_eq!(server.request("POST", "sessions", &new).await.status, 201);
    let stream = "sessions/s1/rerun/live.rrd";
    assert_eq!(server.request("GET", stream, "").await.status, 404, "it is off until asked for");
    assert_eq!(server.request("DELETE", "sessions/s1/rerun", "").await.status, 404);
    let opened = server.request("POST", "sessions/s1/rerun", "{}").await;
    assert_eq!(opened.status, 200);
    let paths: serde_json::Value = serde_json::from_str(&opened.body).unwrap();
    assert_eq!(paths["stream_path"], stream);
    let page = paths["viewer_path"].as_str().unwrap();
    let viewer = server.request("GET", page, "").await;
    let policy = viewer.header("content-security-policy");
    assert!(viewer.status == 200 && policy.contains("connect-src 'self';"), "{policy}");
    assert!(!policy.contains("script-src 'self' 'unsafe-inline'"), "{policy}");

    let mut socket = TcpStream::connect(server.address).await.unwrap();
    let request = format!(
        "GET /api/v1/{stream} HTTP/1.0\r\nHost: {}\r\nAuthorization: Bearer {TOKEN}\r\n\r\n",
        server.address
    );
    socket.write_all(request.as_bytes()).await.unwrap();
    let mut bytes = vec![0; 1 << 16];
    let mut read = socket.read(&mut bytes).await.unwrap();
    let head = String::from_utf8_lossy(&bytes[..read]).into_owned();
    assert!(head.starts_with("HTTP/1.0 200 OK"), "{head}");
    // The session and the open stream continue; closing the stream ends the response.
    let [x, y] = sightline_tests::server::PIXEL;
    let target = format!(r#"{{"step":0,"pixel":{{"x":{x},"y":{y}}}}}"#);
    assert_eq!(server.request("POST", "sessions/s1/targets", &target).await.status, 201);
    let label = |text: &[u8]| text.windows(8).any(|bytes| bytes == b"target_1");
    bytes.truncate(read);
    while !label(&bytes) {
        let mut part = vec![0; 1 << 16];
        read = socket.read(&mut part).await.unwrap();
        assert!(read > 0, "the stream ended early");
        bytes.extend_from_slice(&part[..read]);
    }
    assert_eq!(server.request("DELETE", "sessions/s1/rerun", "").await.status, 204);
    socket.read_to_end(&mut bytes).await.unwrap();
    let start = bytes.windows(4).position(|bytes| bytes == b"RRF2").unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("live.rrd"), &bytes[start..]).unwrap();
    let recording = rrd::read(&folder.path().join("live.rrd"));
    assert!(
        recording.application == "sightline" && recording.entities.contains_key("/target_1/update/position")
    );
    assert_eq!(server.request("GET", stream, "").await.status, 404, "and stays closed");
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn a_stream_opens_no_further_port() {
    let server = RunningServer::start(access).await;
    let new = format!(r#"{{"traverse":"{}"}}"#, server.traverse);
    assert_eq!(server.request("POST", "sessions", &new).await.status, 201);
    let before = listening_ports();
    assert!(before.contains(&server.address.port()));
    assert_eq!(server.request("POST", "sessions/s1/rerun", "{}").await.status, 200);
    assert_eq!(server.request("GET", "sessions/s1/rerun/live.rrd", "").await.status, 200);
    // Other tests of this process may open and close ports at the same time.
    let new: Vec<_> = listening_ports().difference(&before).copied().collect();
    for port in new {
        let mut socket = match TcpStream::connect(("127.0.0.1", port)).await {
            Ok(socket) => socket,
            Err(_) => continue,
        };
        socket
            .write_all(b"POST /rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages HTTP/1.0\r\n\r\n")
            .await
            .unwrap();
        let mut answer = String::new();
        // The port of another test may close the connection.
        let _ = socket.read_to_string(&mut answer).await;
        assert!(!answer.contains("grpc"), "port {port} speaks gRPC: {answer}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fifth_stream_is_rejected_with_a_way_out() {
    let server = RunningServer::start(access).await;
    let new = format!(r#"{{"traverse":"{}"}}"#, server.traverse);
    for number in 1..=5 {
        assert_eq!(server.request("POST", "sessions", &new).await.status, 201);
        let opened = server.request("POST", &format!("sessions/s{number}/rerun"), "{}").await;
        if number == 5 {
            assert_eq!(opened.status, 409);
            assert!(opened.body.contains("DELETE sessions/s1/rerun"), "{}", opened.body);
        } else {
            assert_eq!(opened.status, 200);
        }
    }
    assert_eq!(server.request("DELETE", "sessions/s1/rerun", "").await.status, 204);
    assert_eq!(server.request("POST", "sessions/s5/rerun", "{}").await.status, 200);
}
