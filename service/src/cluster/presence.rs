//! Presence: how nodes hear of one another at once, and where the transport comes in.

use crate::store::{NodeId, OwnerRecord, ShardNumber};

/// Says what this node is and has, to all others, until it is said no more or the node is gone.
pub trait Presence: std::fmt::Debug + Send + 'static {
    /// This node is there.
    fn join(&mut self, node: &NodeId);
    /// This node owns a shard.
    fn own(&mut self, owner: &OwnerRecord);
    /// This node owns a shard no more.
    fn disown(&mut self, shard: ShardNumber);
    /// Asks who is there and owns what: a sign may have been lost while links came and went.
    fn ask(&self);
    /// This node is there no more, nor owns anything.
    fn leave(&mut self);
}

/// What is heard of nodes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PresenceSign {
    /// A node is there, or there no more.
    Node {
        /// The node.
        node: NodeId,
        /// Whether it is there.
        there: bool,
    },
    /// A node owns a shard, or owns it no more.
    Owner {
        /// The owner.
        owner: OwnerRecord,
        /// Whether it owns it.
        there: bool,
    },
}
