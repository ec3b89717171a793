//! Free loopback ports that stay free.

use std::fs::File;
use std::net::TcpListener;

use rand::RngExt;

/// Below the range from which systems take the ports of outgoing connections: such a connection
/// could otherwise sit on a server's port while the server is down.
const RANGE: std::ops::Range<u16> = 18_000..32_000;

/// A port of the loopback interface, kept from other tests by a locked file as long as this lives,
/// also while no server listens on it.
#[derive(Debug)]
pub struct Port {
    number: u16,
    _lock: File,
}

impl Port {
    /// A port that nobody has.
    pub fn free() -> Self {
        let locks = std::env::temp_dir().join("cogmap-test-ports");
        std::fs::create_dir_all(&locks).expect("the temporary directory takes a directory");
        for _ in 0..1000 {
            let number = rand::rng().random_range(RANGE);
            let lock = File::create(locks.join(number.to_string()))
                .expect("the temporary directory takes a file");
            if lock.try_lock().is_ok() && TcpListener::bind(("127.0.0.1", number)).is_ok() {
                return Self {
                    number,
                    _lock: lock,
                };
            }
        }
        panic!("no port of {RANGE:?} is free");
    }

    /// The number.
    pub fn number(&self) -> u16 {
        self.number
    }
}
