//! What the end-to-end tests start and send: servers as processes, streams of samples, and the raw
//! doors for what no client would send.
//!
//! Nothing here knows the service from inside: it is a binary, a Zenoh endpoint and a base URL.
#![allow(clippy::missing_panics_doc)] // All of it serves tests, and a test ends by a panic.

mod binary;
mod drive;
mod http;
mod port;
mod raw;
mod scrape;
mod server;
mod slow;
mod wait;

pub use binary::{Finished, binary, lab, run};
pub use drive::{Drive, batch, circle, velocity};
pub use http::{Answer, Http};
pub use port::Port;
pub use raw::RawPublisher;
pub use scrape::Metrics;
pub use server::Server;
pub use slow::{Slow, raise_open_files};
pub use wait::{LONG, eventually, seed};
