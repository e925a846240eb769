//! A small HTTP server for tests: one file, answers that can be told to fail.

use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// What the server does with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// What was asked for.
    Right,
    /// This status and nothing else.
    Status(&'static str),
    /// Closes the connection.
    HangUp,
    /// Closes the connection in the middle of the body.
    Half,
    /// Waits first.
    Late(Duration),
    /// The whole file, as servers do that know no ranges.
    Whole,
}

/// A server on the loopback interface; it ends when it is dropped.
pub(super) struct Server {
    address: SocketAddr,
    over: Arc<AtomicBool>,
    requests: Arc<AtomicUsize>,
    thread: Option<JoinHandle<()>>,
}

/// What connections share.
struct Plan<F> {
    file: Vec<u8>,
    answer: F,
    requests: Arc<AtomicUsize>,
}

impl Server {
    /// Serves `file`; `answer` says what happens to each request, counted from 0.
    pub(super) fn start(file: Vec<u8>, answer: impl Fn(usize) -> Answer + Send + Sync + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("bound");
        let (over, requests) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let plan = Arc::new(Plan { file, answer, requests: requests.clone() });
        let stop = over.clone();
        let thread = std::thread::spawn(move || {
            for stream in listener.incoming() {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let (stream, plan) = (stream.expect("accepted"), plan.clone());
                std::thread::spawn(move || plan.serve(stream));
            }
        });
        Self { address, over, requests, thread: Some(thread) }
    }

    /// The address of the file.
    pub(super) fn address(&self) -> String {
        format!("http://{}/scenes/a%20scene.vls", self.address)
    }

    pub(super) fn host(&self) -> String {
        format!("http://{}", self.address)
    }

    pub(super) fn requests(&self) -> usize {
        self.requests.load(Ordering::Relaxed)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        drop(TcpStream::connect(self.address));
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

impl<F: Fn(usize) -> Answer> Plan<F> {
    /// Answers one request. A client that goes away is its own business.
    fn serve(&self, mut stream: TcpStream) {
        let Some((path, range)) = request(&stream) else { return };
        let number = self.requests.fetch_add(1, Ordering::Relaxed);
        let answer = (self.answer)(number);
        if let Answer::Late(time) = answer {
            std::thread::sleep(time);
        }
        let known = path.starts_with("/scenes/a%20scene.vls") || path.starts_with("/bucket/");
        let (status, first, body) = match answer {
            Answer::HangUp => return,
            Answer::Status(status) => (status, 0, &[][..]),
            _ if !known => ("404 Not Found", 0, &[][..]),
            Answer::Whole => ("200 OK", 0, &self.file[..]),
            _ => match self.part(range) {
                Some((first, body)) => ("206 Partial Content", first, body),
                None => ("416 Range Not Satisfiable", 0, &[][..]),
            },
        };
        let last = first + body.len().saturating_sub(1);
        let all = self.file.len();
        let head = format!(
            "HTTP/1.1 {status}\r\nContent-Length: {}\r\nContent-Range: bytes {first}-{last}/{all}\r\n\
             ETag: \"1\"\r\nLast-Modified: Sun, 01 Nov 2026 00:00:00 GMT\r\nConnection: close\r\n\r\n",
            body.len()
        );
        let sent = if answer == Answer::Half { &body[..body.len() / 2] } else { body };
        drop(stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(sent)));
    }

    fn part(&self, range: Option<(usize, usize)>) -> Option<(usize, &[u8])> {
        let (first, last) = range.unwrap_or((0, usize::MAX));
        let end = last.saturating_add(1).min(self.file.len());
        self.file.get(first..end).filter(|part| !part.is_empty()).map(|part| (first, part))
    }
}

/// The path and the range of a request.
fn request(stream: &TcpStream) -> Option<(String, Option<(usize, usize)>)> {
    let mut lines = BufReader::new(stream).lines().map_while(Result::ok);
    let path = lines.next()?.split(' ').nth(1)?.to_owned();
    let mut range = None;
    for line in lines.take_while(|line| !line.is_empty()) {
        let line = line.to_ascii_lowercase();
        if let Some((first, last)) = line.strip_prefix("range: bytes=").and_then(|r| r.split_once('-')) {
            range = Some((first.parse().ok()?, last.parse().unwrap_or(usize::MAX)));
        }
    }
    Some((path, range))
}
