//! A small browser without a screen: requests, and the socket's messages.
#![allow(dead_code, reason = "not every test needs all of it")]

pub(crate) mod browser;
pub(crate) mod slow;

use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};
use vastlight_viewer::{Server, Viewer};

/// Longest time to wait for anything.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// A server that shows a scene with few samples.
pub(crate) fn server(source: Option<&str>, spp: u32) -> Server {
    Server::start(Viewer { source: source.map(str::to_owned), spp, ..Viewer::default() }).expect("started")
}

/// Host and port of an address, and the token.
pub(crate) fn parts(url: &str) -> (String, String) {
    let rest = url.strip_prefix("http://").expect("an address");
    let (host, query) = rest.split_once("/?token=").expect("a token");
    (host.to_owned(), query.to_owned())
}

/// An answer: status, head, body.
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

/// Asks for a path, with a host's name and an origin.
pub(crate) fn get(address: &str, path: &str, host: &str, origin: Option<&str>) -> Answer {
    let mut stream = TcpStream::connect(address).expect("connected");
    stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    let origin = origin.map_or(String::new(), |origin| format!("Origin: {origin}\r\n"));
    let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{origin}Connection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).expect("sent");
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).expect("answered");
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").expect("a head");
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status");
    Answer { status, head, body: bytes[end + 4..].to_vec() }
}

/// Asks as the page does.
pub(crate) fn fetch(url: &str, name: &str) -> Answer {
    let (host, token) = parts(url);
    get(&host, &format!("/{name}?token={token}"), &host, None)
}

/// A picture that came.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    pub(crate) number: u32,
    pub(crate) input: u32,
    pub(crate) spp: u32,
    pub(crate) is_final: bool,
    pub(crate) size: [u16; 2],
    pub(crate) file: Vec<u8>,
}

/// A connection.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    pub(crate) id: u64,
    /// Whether pictures are confirmed as they come.
    pub(crate) confirms: bool,
}

/// What came.
#[derive(Debug)]
pub(crate) enum Event {
    Picture(Picture),
    News(Value),
    Closed,
}

impl Page {
    pub(crate) fn open(url: &str) -> Self {
        let (host, token) = parts(url);
        let mut page = Self::with_headers(&host, &format!("/ws?token={token}"), &[]).expect("connected");
        page.id = page.wait_for("hello")["id"].as_u64().expect("a number");
        page
    }

    /// Connects with headers; the status of a refusal.
    pub(crate) fn with_headers(
        host: &str,
        path: &str,
        headers: &[(&'static str, &str)],
    ) -> Result<Self, u16> {
        let mut request = format!("ws://{host}{path}").into_client_request().expect("a request");
        for (name, value) in headers {
            request.headers_mut().insert(*name, value.parse().expect("a header"));
        }
        let stream = TcpStream::connect(host).expect("connected");
        stream.set_read_timeout(Some(Duration::from_millis(100))).expect("a timeout");
        let mut handshake = tungstenite::client(request, stream);
        loop {
            handshake = match handshake {
                Ok((socket, _)) => return Ok(Self { socket, id: 0, confirms: true }),
                Err(tungstenite::HandshakeError::Interrupted(middle)) => middle.handshake(),
                Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                    return Err(answer.status().as_u16());
                }
                Err(error) => panic!("{error}"),
            };
        }
    }

    pub(crate) fn send_bytes(&mut self, bytes: Vec<u8>) {
        self.socket.send(Message::Binary(bytes.into())).expect("sent");
    }

    pub(crate) fn send_message(&mut self, message: Message) -> bool {
        self.socket.send(message).is_ok()
    }

    pub(crate) fn send(&mut self, command: &Value) {
        self.send_bytes([&[2], command.to_string().as_bytes()].concat());
    }

    pub(crate) fn confirm(&mut self, frame: u32) {
        self.send_bytes([&[1], &frame.to_le_bytes()[..]].concat());
    }

    /// The next message within a time.
    pub(crate) fn next_within(&mut self, time: Duration) -> Option<Event> {
        let start = Instant::now();
        while start.elapsed() < time {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) if bytes[0] == 1 => {
                    let picture = picture(&bytes);
                    if self.confirms {
                        self.confirm(picture.number);
                    }
                    return Some(Event::Picture(picture));
                }
                Ok(Message::Binary(bytes)) => {
                    return Some(Event::News(serde_json::from_slice(&bytes[1..]).expect("JSON")));
                }
                Ok(Message::Close(_)) => return Some(Event::Closed),
                Ok(_) => {}
                Err(tungstenite::Error::Io(e))
                    if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
                Err(_) => return Some(Event::Closed),
            }
        }
        None
    }

    /// The first news of a kind.
    pub(crate) fn wait_for(&mut self, kind: &str) -> Value {
        self.wait_until(kind, |_| true)
    }

    /// The first news of a kind that are as wanted.
    pub(crate) fn wait_until(&mut self, kind: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            match self.next_within(PATIENCE) {
                Some(Event::News(news)) if news["kind"] == kind && wanted(&news) => return news,
                Some(Event::Closed) => panic!("closed before {kind}"),
                _ => {}
            }
        }
        panic!("no {kind}");
    }

    /// The first picture that is as wanted.
    pub(crate) fn picture_until(&mut self, wanted: impl Fn(&Picture) -> bool) -> Picture {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            match self.next_within(PATIENCE) {
                Some(Event::Picture(picture)) if wanted(&picture) => return picture,
                Some(Event::Closed) => panic!("closed before a picture"),
                _ => {}
            }
        }
        panic!("no such picture");
    }
}

fn picture(bytes: &[u8]) -> Picture {
    let word = |i: usize| u32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
    let edge = |i: usize| u16::from_le_bytes([bytes[i], bytes[i + 1]]);
    Picture {
        number: word(4),
        input: word(8),
        spp: word(12),
        is_final: bytes[2] == 1,
        size: [edge(16), edge(18)],
        file: bytes[24..].to_vec(),
    }
}
