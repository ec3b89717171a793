//! Where the engine publishes; the transport implements it.

use std::sync::Arc;

use cogmap_proto::EventRecord;

use super::desk::AgentDesk;

/// Is told what there is to publish. Calls come from the writers' and the committer's threads and
/// must not block, so an outlet publishes on a thread of its own: estimates and watermarks as they
/// are on the agent's desk by then, which supersede all before them; of events as many as it holds.
pub trait Outlet: std::fmt::Debug + Send + Sync + 'static {
    /// The estimate on an agent's desk is a new one.
    fn estimate(&self, space: &Arc<str>, agent: &Arc<AgentDesk>);
    /// The watermark on an agent's desk moved, or its client should look at it again. Whoever hears
    /// it has been sent the estimate of the samples that it covers before.
    fn watermark(&self, space: &Arc<str>, agent: &Arc<AgentDesk>);
    /// Something happened in a space.
    fn event(&self, event: &Arc<EventRecord>);
}

/// An outlet into nowhere, for services without Zenoh.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Outlet for Silent {
    fn estimate(&self, _: &Arc<str>, _: &Arc<AgentDesk>) {}
    fn watermark(&self, _: &Arc<str>, _: &Arc<AgentDesk>) {}
    fn event(&self, _: &Arc<EventRecord>) {}
}
