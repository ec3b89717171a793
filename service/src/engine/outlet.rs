//! Where the engine publishes; the transport implements it.

use cogmap_proto::{Estimate, EventRecord, Watermark};

/// Takes what is published. Calls come from the writers' and the committer's threads and must not
/// block: an outlet that cannot keep up drops.
pub trait Outlet: std::fmt::Debug + Send + Sync + 'static {
    /// The estimate of an agent moved.
    fn estimate(&self, estimate: &Estimate);
    /// The watermark of an agent moved, or a client should look at it again.
    fn watermark(&self, space: &str, agent: &str, watermark: &Watermark);
    /// Something happened in a space.
    fn event(&self, event: &EventRecord);
}

/// An outlet into nowhere, for services without Zenoh.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Outlet for Silent {
    fn estimate(&self, _: &Estimate) {}
    fn watermark(&self, _: &str, _: &str, _: &Watermark) {}
    fn event(&self, _: &EventRecord) {}
}
