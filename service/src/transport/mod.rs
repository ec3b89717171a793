//! The transport: Zenoh in and out. Nothing else in the service knows Zenoh.

mod board;
mod intake;
mod latest;
mod linger;
#[cfg(feature = "object-storage")]
mod presence;
mod publisher;
mod publishing;
mod queries;
mod reply;
mod session;

pub use intake::{Intake, IntakeOfSpaces};
pub use linger::forbid as forbid_lingering;
#[cfg(feature = "object-storage")]
pub use presence::ZenohPresence;
pub use publisher::ZenohPublisher;
pub(crate) use session::open_endpoints;
pub use session::{TransportError, TransportSettings, open};
