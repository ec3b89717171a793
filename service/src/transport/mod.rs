//! The transport: Zenoh in and out. Nothing else in the service knows Zenoh.

mod board;
mod intake;
mod latest;
mod linger;
mod outlet;
mod publisher;
mod queries;
mod session;

pub use intake::Intake;
pub use linger::forbid as forbid_lingering;
pub use outlet::ZenohOutlet;
pub use session::{TransportError, TransportSettings, open};
