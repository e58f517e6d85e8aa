//! A reverse proxy that publishes the server in a folder: with and without removing the folder from paths, and with the Host
//! passed on or replaced by the server's own. Each proxy adds false forwarded headers.

use std::net::SocketAddr;

use axum::http::{HeaderValue, header};
use futures_util::StreamExt;
use sightline_server::public_url::PublicUrl;
use sightline_tests::browser::Browser;
use sightline_tests::server::{TOKEN, access};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio_tungstenite::tungstenite;

use super::{Answer, RunningServer, exchange};

/// Behaviour of the proxy.
#[derive(Clone, Copy, Debug)]
struct ProxyConfig {
    keeps_folder: bool,
    passes_host: bool,
}

/// A server behind a proxy.
struct ProxiedServer {
    server: RunningServer,
    proxy: SocketAddr,
}

impl ProxiedServer {
    async fn start(config: ProxyConfig) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let proxy = listener.local_addr().unwrap();
        let public = PublicUrl::parse(&format!("http://{proxy}/sightline/")).unwrap();
        let server = RunningServer::start(|port| access(port).behind_proxy(public)).await;
        let address = server.address;
        tokio::spawn(async move {
            while let Ok((client, _)) = listener.accept().await {
                tokio::spawn(pass(client, address, config));
            }
        });
        Self { server, proxy }
    }

    async fn send(&self, method: &str, path: &str, headers: &str, body: &str) -> Answer {
        let (host, length) = (self.proxy, body.len());
        let text = format!(
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\n{headers}Content-Length: {length}\r\n\r\n{body}"
        );
        exchange(self.proxy, &text).await
    }
}

/// Passes on one request and all following bytes.
async fn pass(mut client: TcpStream, server: SocketAddr, config: ProxyConfig) {
    let (mut bytes, mut part) = (Vec::new(), [0; 4096]);
    let end = loop {
        if let Some(end) = bytes.windows(4).position(|bytes| bytes == b"\r\n\r\n") {
            break end;
        }
        match client.read(&mut part).await {
            Ok(0) | Err(_) => return,
            Ok(count) => bytes.extend_from_slice(&part[..count]),
        }
    };
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let is_upgrade = head.to_ascii_lowercase().contains("\r\nupgrade:");
    let mut lines = head.lines();
    let mut first = lines.next().unwrap_or_default().to_owned();
    if !config.keeps_folder {
        first = first.replacen(" /sightline", " ", 1);
    }
    let mut passed = vec![first];
    for line in lines {
        let name = line.split(':').next().unwrap_or_default().to_ascii_lowercase();
        match name.as_str() {
            "host" if !config.passes_host => passed.push(format!("Host: {server}")),
            "connection" if !is_upgrade => {}
            _ => passed.push(line.to_owned()),
        }
    }
    if !is_upgrade {
        passed.push("Connection: close".to_owned());
    }
    for lie in ["Forwarded: host=evil.example;proto=gopher", "X-Forwarded-Host: evil.example"] {
        passed.push(lie.to_owned());
    }
    for lie in ["X-Forwarded-Proto: gopher", "X-Forwarded-Prefix: /elsewhere", "X-Forwarded-For: 8.8.8.8"] {
        passed.push(lie.to_owned());
    }
    let Ok(mut upstream) = TcpStream::connect(server).await else { return };
    let head = format!("{}\r\n\r\n", passed.join("\r\n"));
    if upstream.write_all(head.as_bytes()).await.is_ok()
        && upstream.write_all(&bytes[end + 4..]).await.is_ok()
    {
        // Either side may close first.
        let _ = tokio::io::copy_bidirectional(&mut client, &mut upstream).await;
    }
}

const PROXY_CONFIGS: [ProxyConfig; 4] = [
    ProxyConfig { keeps_folder: false, passes_host: false },
    ProxyConfig { keeps_folder: false, passes_host: true },
    ProxyConfig { keeps_folder: true, passes_host: false },
    ProxyConfig { keeps_folder: true, passes_host: true },
];

#[tokio::test(flavor = "multi_thread")]
async fn a_proxy_may_publish_the_server_in_a_folder() {
    for config in PROXY_CONFIGS {
        let published = ProxiedServer::start(config).await;
        let json = "Content-Type: application/json\r\n";
        let login = published
            .send("POST", "/sightline/api/v1/login", json, &format!(r#"{{"token":"{TOKEN}"}}"#))
            .await;
        assert_eq!(login.status, 204, "{config:?}");
        let (pair, attributes) = login.header("set-cookie").split_once("; ").unwrap();
        assert_eq!(attributes, "HttpOnly; SameSite=Strict; Path=/sightline/", "{config:?}");
        let origin = format!("Origin: http://{}\r\nCookie: {pair}\r\n{json}", published.proxy);
        let new = format!(r#"{{"traverse":"{}"}}"#, published.server.traverse);
        let begun = published.send("POST", "/sightline/api/v1/sessions", &origin, &new).await;
        let location = (begun.status, begun.header("location"));
        assert_eq!(location, (201, "/sightline/api/v1/sessions/s1"), "{config:?}");
        let page = published.send("GET", "/sightline/api/v1/page", &format!("Cookie: {pair}\r\n"), "").await;
        assert!(page.body.contains("href=\"../../api/v1/sessions/s1/page\""), "{}", page.body);
        let image =
            format!("/sightline/api/v1/traverses/{}/steps/0/images/left.png", published.server.traverse);
        assert_eq!(published.send("GET", &image, &format!("Cookie: {pair}\r\n"), "").await.status, 200);
        assert_eq!(published.send("GET", &image, "", "").await.status, 401, "{config:?}");
        assert_eq!(published.send("GET", "/sightline/", "", "").await.status, 200, "{config:?}");
        let foreign = format!("Origin: http://evil.example\r\nCookie: {pair}\r\n{json}");
        assert_eq!(published.send("POST", "/sightline/api/v1/sessions", &foreign, &new).await.status, 403);
        assert_eq!(events(&published, pair, &format!("http://{}", published.proxy)).await.unwrap(), 101);
        for origin in ["http://evil.example", "null"] {
            match events(&published, pair, origin).await {
                Err(tungstenite::Error::Http(response)) => assert_eq!(response.status(), 403, "{config:?}"),
                other => panic!("{config:?} {origin}: {other:?}"),
            }
        }
    }
}

/// Opens the WebSocket and reads its first event.
async fn events(published: &ProxiedServer, cookie: &str, origin: &str) -> Result<u16, tungstenite::Error> {
    let url = format!("ws://{}/sightline/api/v1/events", published.proxy);
    let mut request = tungstenite::client::IntoClientRequest::into_client_request(url)?;
    request.headers_mut().insert(header::COOKIE, HeaderValue::from_str(cookie).unwrap());
    request.headers_mut().insert(header::ORIGIN, HeaderValue::from_str(origin).unwrap());
    let (mut socket, response) = tokio_tungstenite::connect_async(request).await?;
    let event = socket.next().await.expect("an event")?;
    assert!(event.to_text()?.contains("session_changed"), "{event}");
    Ok(response.status().as_u16())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_folder_without_its_slash_leads_to_the_page() {
    let published = ProxiedServer::start(PROXY_CONFIGS[2]).await;
    let answer = published.send("GET", "/sightline", "", "").await;
    assert_eq!((answer.status, answer.header("location")), (308, "/sightline/"));
    // Without the setting, the same headers and paths have no effect.
    let plain = RunningServer::start(access).await;
    let headers = ["Host: $HOST", "Authorization: Bearer $TOKEN", "X-Forwarded-Prefix: /sightline"];
    assert_eq!(plain.send("GET /sightline/api/v1/version HTTP/1.1", &headers, "").await.status, 404);
    assert_eq!(plain.send("GET /api/v1/version HTTP/1.1", &headers, "").await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_works_in_the_folder_of_a_proxy() {
    let published = ProxiedServer::start(PROXY_CONFIGS[1]).await;
    let browser = Browser::start().await;
    browser.goto(&format!("http://{}/sightline/#token={TOKEN}", published.proxy)).await;
    browser.wait_for_viewer().await;
    let shown = "s.phase === 'ready' && s.shown && s.image_to_screen !== null";
    browser.wait_for_status("the first image", shown).await;
    let address = browser.evaluate("return location.href").await;
    assert!(!address.as_str().unwrap().contains(TOKEN), "{address}");
    assert_eq!(browser.console_errors().await, Vec::<String>::new());
    // Without the cookie, the page asks for the token and accepts it.
    let other = Browser::start().await;
    other.goto(&format!("http://{}/sightline/", published.proxy)).await;
    other.wait_for("the form", "return !document.getElementById('login').hidden").await;
    let enter = format!(
        "const field = document.getElementById('login-token'); field.value = '{TOKEN}'; \
         document.getElementById('login').requestSubmit(); return true"
    );
    other.evaluate(&enter).await;
    other.wait_for_viewer().await;
    other.close().await;
    browser.close().await;
}
