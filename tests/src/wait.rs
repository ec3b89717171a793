//! Waiting for what has to come, and seeds.

use std::thread;
use std::time::{Duration, Instant};

/// Longest wait of any test for anything: reached only where something is broken.
pub const LONG: Duration = Duration::from_secs(90);

/// How often is looked.
const PAUSE: Duration = Duration::from_millis(20);

/// Looks until `look` finds something; panics after [`LONG`] with what `look` said last.
pub fn eventually<T>(what: &str, mut look: impl FnMut() -> Result<T, String>) -> T {
    let deadline = Instant::now() + LONG;
    loop {
        match look() {
            Ok(found) => return found,
            Err(last) => assert!(Instant::now() < deadline, "{what} did not come: {last}"),
        }
        thread::sleep(PAUSE);
    }
}

/// The seed of a test: `COGMAP_TEST_SEED` where it is set, `default` otherwise. It is printed, so
/// that a failure can be repeated.
pub fn seed(default: u64) -> u64 {
    let seed = std::env::var("COGMAP_TEST_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok())
        .unwrap_or(default);
    eprintln!("seed: COGMAP_TEST_SEED={seed}");
    seed
}
