//! `vastlight view`: the address, the token, errors before work.

mod common;

use common::Workspace;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// The command, ended whatever happens.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The status of an answer.
fn status(address: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("connected");
    stream.set_read_timeout(Some(Duration::from_secs(30))).expect("a timeout");
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("answered");
    answer.split(' ').nth(1).unwrap_or_default().to_owned()
}

#[test]
fn the_first_line_is_the_address_and_an_interrupt_ends_it() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vastlight"));
    command.args(["view", "demo:cornell", "--no-open", "--port", "0"]).stdout(Stdio::piped());
    let mut running = Running(command.spawn().expect("started"));
    let stdout = running.0.stdout.take().expect("a pipe");
    let mut line = String::new();
    BufReader::new(stdout).read_line(&mut line).expect("a line");
    let rest = line.trim_end().strip_prefix("http://127.0.0.1:").expect("an address");
    let (port, token) = rest.split_once("/?token=").expect("a token");
    let address = format!("127.0.0.1:{port}");
    assert_eq!(status(&address, &format!("/?token={token}")), "200");
    assert_eq!(status(&address, "/"), "403");
    if cfg!(unix) {
        let pid = running.0.id().to_string();
        assert!(Command::new("kill").args(["-INT", &pid]).status().is_ok_and(|status| status.success()));
        assert_eq!(running.0.wait().expect("ended").code(), Some(0));
    }
}

#[test]
fn mistakes_are_errors_before_anything_listens() {
    let workspace = Workspace::new();
    for (arguments, what) in [
        ("view --folder nowhere --no-open", "nowhere"),
        ("view --host example --no-open", "--host"),
        ("view demo:cornell --spp 0 --no-open", "--spp"),
        ("view demo:cornell --override none.toml --no-open", "none.toml"),
    ] {
        let outcome = workspace.run(arguments);
        assert!(outcome.code == 2 || outcome.code == 3, "{arguments}: {outcome:?}");
        assert!(outcome.stderr.contains(what) && outcome.stdout.is_empty(), "{arguments}: {outcome:?}");
    }
    let outcome = workspace.run("view demo:cornell --no-open --device gpu");
    assert_eq!(outcome.code, 5, "{outcome:?}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    let outcome = workspace.run(&format!("view demo:cornell --no-open --port {port}"));
    assert!(outcome.code == 2 && outcome.stderr.contains("--port"), "{outcome:?}");
}
