//! Connections that say next to nothing and stay.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Pause between two bytes on a connection, about.
const PAUSE: Duration = Duration::from_millis(500);

/// Many connections on which a head comes byte by byte, and never ends. One that is closed is
/// opened again.
#[derive(Debug)]
pub struct Slow {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<usize>,
}

impl Slow {
    /// Opens so many connections to an address, and returns once the first attempts have been made.
    pub fn start(address: &str, connections: usize) -> Self {
        raise_open_files();
        let (address, stop) = (address.to_owned(), Arc::new(AtomicBool::new(false)));
        let mut streams: Vec<_> = (0..connections).map(|_| open(&address)).collect();
        let mut opened = streams.iter().flatten().count();
        let thread = {
            let stop = Arc::clone(&stop);
            thread::spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    for stream in &mut streams {
                        let alive = stream.as_mut().is_some_and(goes_on);
                        if !alive {
                            *stream = open(&address);
                            opened += usize::from(stream.is_some());
                        }
                    }
                    thread::sleep(PAUSE);
                }
                opened
            })
        };
        Self { stop, thread }
    }

    /// Closes them; returns how many have been opened in all.
    pub fn stop(self) -> usize {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().expect("the thread ends")
    }
}

/// Raises the limit of open files of this process as far as it may be.
pub fn raise_open_files() {
    // Where that is too low, fewer connections are opened, and the test says so.
    let _ = rlimit::increase_nofile_limit(u64::MAX);
}

fn open(address: &str) -> Option<TcpStream> {
    let target = address.parse().expect("an address");
    let mut stream = TcpStream::connect_timeout(&target, PAUSE).ok()?;
    stream.set_nonblocking(true).ok()?;
    stream.write_all(b"GET /healthz HTTP/1.1\r\nx: ").ok()?;
    Some(stream)
}

/// Sends one more byte; says whether the connection is still open.
fn goes_on(stream: &mut TcpStream) -> bool {
    let closed = match stream.read(&mut [0; 64]) {
        Ok(_) => true,
        Err(error) => error.kind() != ErrorKind::WouldBlock,
    };
    !closed && stream.write_all(b"x").is_ok()
}
