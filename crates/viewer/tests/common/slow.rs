//! A slow network: what goes through it is late, and comes drop by drop.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

/// Bytes that go at once, and pieces of so many that are on their way: no more than a network holds.
const PIECE: usize = 1400;
const PIECES: usize = 64;

/// How slow it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slow {
    /// One way.
    pub(crate) delay: Duration,
    pub(crate) bytes_per_s: f64,
}

impl Slow {
    /// Listens, and passes all connections on to a server, to the end of the program.
    pub(crate) fn before(self, server: SocketAddr) -> SocketAddr {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        spawn(move || {
            for near in listener.incoming().flatten() {
                let Ok(far) = TcpStream::connect(server) else { continue };
                let copies = || (near.try_clone().expect("a socket"), far.try_clone().expect("a socket"));
                let (to, back) = (copies(), copies());
                self.pass(to.0, to.1);
                self.pass(back.1, back.0);
            }
        });
        address
    }

    /// Passes one direction on.
    fn pass(self, mut from: TcpStream, to: TcpStream) {
        let (sender, receiver) = sync_channel(PIECES);
        spawn(move || self.write(&receiver, to));
        spawn(move || {
            read(&mut from, &sender);
            // Who has nothing more to say takes nothing more.
            let _ = from.shutdown(Shutdown::Read);
        });
    }

    fn write(self, pieces: &Receiver<(Instant, Vec<u8>)>, mut to: TcpStream) {
        let _ = to.set_nodelay(true);
        for (came, bytes) in pieces {
            sleep((came + self.delay).saturating_duration_since(Instant::now()));
            sleep(Duration::from_secs_f64(bytes.len() as f64 / self.bytes_per_s));
            if to.write_all(&bytes).is_err() {
                break;
            }
        }
        let _ = to.shutdown(Shutdown::Both);
    }
}

fn read(from: &mut TcpStream, pieces: &SyncSender<(Instant, Vec<u8>)>) {
    let mut piece = [0; PIECE];
    while let Ok(count @ 1..) = from.read(&mut piece) {
        if pieces.send((Instant::now(), piece[..count].to_vec())).is_err() {
            return;
        }
    }
}
