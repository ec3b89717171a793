//! Where the engine publishes; the transport implements it.

use std::sync::Arc;

use cogmap_proto::EventRecord;

use super::agent_view::AgentView;

/// Is told what there is to publish. Calls come from the writers' and the committer's threads and
/// must not block, so a publisher works on a thread of its own: estimates and watermarks as
/// they are on the agent's view by then, which supersede all before them; of events as many as it
/// holds.
pub trait Publisher: std::fmt::Debug + Send + Sync + 'static {
    /// The estimate on an agent's view is a new one.
    fn estimate(&self, space: &Arc<str>, agent: &Arc<AgentView>);
    /// The watermark on an agent's view moved, or its client should look at it again. Whoever hears
    /// it has been sent the estimate of the samples that it covers before.
    fn watermark(&self, space: &Arc<str>, agent: &Arc<AgentView>);
    /// Something happened in a space.
    fn event(&self, event: &Arc<EventRecord>);
}

/// A publisher into nowhere, for services without Zenoh.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Publisher for Silent {
    fn estimate(&self, _: &Arc<str>, _: &Arc<AgentView>) {}
    fn watermark(&self, _: &Arc<str>, _: &Arc<AgentView>) {}
    fn event(&self, _: &Arc<EventRecord>) {}
}
