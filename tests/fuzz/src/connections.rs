//! The connection itself: arbitrary bytes instead of requests, and arbitrary frames on a WebSocket.

use std::cell::RefCell;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

use crate::server::{LEFT_OUT, PORT, Server, TOKEN};

/// Connections per server, which limits its stored data.
const CONNECTIONS_EACH: usize = 500;
/// Maximum wait for the end of a connection whose client has closed its side. The search has a limit of its own.
const PATIENCE: Duration = Duration::from_secs(60);
/// Maximum number of bytes that are read of a response.
const ANSWER_BYTES: u64 = 16 << 20;
/// Maximum payload of a structured frame, whose length is one byte.
const PAYLOAD_BYTES: usize = 255;
/// The mask of frames, any four bytes.
const MASK: [u8; 4] = [0x37, 0xfa, 0x21, 0x3d];

/// Bytes on a new connection to a server that requires an access token.
///
/// Without the token in the bytes, no answer contains the name of the recording.
pub(crate) fn http(bytes: &[u8]) {
    let has = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    if has(TOKEN) && LEFT_OUT.iter().any(|end| has(end)) {
        return;
    }
    with_server(true, |server| {
        let traverse = server.traverse.clone();
        let answer = server.runtime.block_on(async {
            let stream = server.connect().await;
            exchange(stream, bytes).await
        });
        let answer = String::from_utf8_lossy(&answer);
        assert!(!answer.contains("HTTP/1.1 500"), "an internal error: {answer}");
        assert!(
            has(TOKEN) || has(&traverse) || !answer.contains(&traverse),
            "let in without a token: {answer}"
        );
    });
}

/// Frames on the WebSocket of events, after a proper handshake.
///
/// If the first byte is 0, the other bytes are sent unchanged. Otherwise frames follow: a first byte, a length and that many
/// payload bytes each. They are sent masked, as required of a client.
pub(crate) fn websocket(bytes: &[u8]) {
    let sent = match bytes.split_first() {
        None => return,
        Some((0, raw)) => raw.to_vec(),
        Some((_, frames)) => framed(frames),
    };
    with_server(false, |server| {
        let request = format!(
            "GET /api/v1/events HTTP/1.1\r\nHost: 127.0.0.1:{PORT}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        server.runtime.block_on(async {
            let mut stream = server.connect().await;
            stream.write_all(request.as_bytes()).await.expect("the server reads");
            // The client may close its side only after the handshake; earlier, that would end the connection.
            let mut head = Vec::new();
            while !head.ends_with(b"\r\n\r\n") {
                head.push(stream.read_u8().await.expect("the server answers"));
            }
            assert!(head.starts_with(b"HTTP/1.1 101 "), "no WebSocket: {}", String::from_utf8_lossy(&head));
            exchange(stream, &sent).await;
        });
        assert_eq!(server.send("GET", "/sessions", b""), Some(200));
    });
}

/// Encodes frames of at most [`PAYLOAD_BYTES`] (RFC 6455, 5.2).
fn framed(mut frames: &[u8]) -> Vec<u8> {
    let mut sent = Vec::new();
    while let [first, length, rest @ ..] = frames {
        let (payload, next) = rest.split_at(usize::from(*length).min(PAYLOAD_BYTES).min(rest.len()));
        sent.push(*first);
        match u8::try_from(payload.len()) {
            Ok(short) if short < 126 => sent.push(0x80 | short),
            _ => {
                sent.push(0x80 | 126);
                sent.extend((payload.len() as u16).to_be_bytes());
            }
        }
        sent.extend(MASK);
        sent.extend(payload.iter().zip(MASK.iter().cycle()).map(|(byte, mask)| byte ^ mask));
        frames = next;
    }
    sent
}

/// Sends the bytes, closes the client's side and reads until the server closes its own.
async fn exchange(stream: DuplexStream, bytes: &[u8]) -> Vec<u8> {
    let (reader, mut writer) = tokio::io::split(stream);
    let mut answer = Vec::new();
    let write = async {
        // The server may close the connection before it has read all bytes.
        let _ = writer.write_all(bytes).await;
        let _ = writer.shutdown().await;
    };
    let mut reader = reader.take(ANSWER_BYTES);
    let both = async { tokio::join!(write, reader.read_to_end(&mut answer)) };
    assert!(
        tokio::time::timeout(PATIENCE, both).await.is_ok(),
        "the server keeps a connection that its client has ended"
    );
    answer
}

/// Passes a server of this thread to `use_it`; it is replaced after [`CONNECTIONS_EACH`] connections.
fn with_server(is_locked: bool, use_it: impl FnOnce(&Server)) {
    thread_local! {
        static SERVERS: RefCell<[Option<(Server, usize)>; 2]> = const { RefCell::new([None, None]) };
    }
    SERVERS.with_borrow_mut(|servers| {
        let server = &mut servers[usize::from(is_locked)];
        if let Some((used, _)) = server.take_if(|(_, used)| *used >= CONNECTIONS_EACH) {
            used.leave();
        }
        let (server, used) = server.get_or_insert_with(|| (Server::start(is_locked), 0));
        *used += 1;
        use_it(server);
    });
}
