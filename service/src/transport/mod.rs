//! The transport: Zenoh in and out. Nothing else in the service knows Zenoh.

mod board;
mod intake;
mod latest;
mod linger;
mod publisher;
mod publishing;
mod queries;
mod reply;
mod session;

pub use intake::Intake;
pub use linger::forbid as forbid_lingering;
pub use publisher::ZenohPublisher;
pub use session::{TransportError, TransportSettings, open};
