//! How the cluster stands, as a node sees it: what HTTP needs to know.

use std::sync::Arc;
use std::time::{Duration, Instant};

use arc_swap::ArcSwap;
use serde::Serialize;
use utoipa::ToSchema;

use crate::store::ShardNumber;

/// How the cluster stands. Clones share it.
#[derive(Clone, Debug)]
pub struct Cluster(Arc<ArcSwap<Standing>>);

/// The nodes, and who owns what.
#[derive(Clone, Debug, Default)]
pub struct Standing {
    /// Name of this node.
    pub node: String,
    /// Whether it has given up its part, since it has no contact to the storage.
    pub resigned: bool,
    /// When it had contact to the storage last.
    pub contact: Option<Instant>,
    /// How long a node does without that.
    pub lease: Duration,
    /// All nodes, by name.
    pub nodes: Vec<NodeStatus>,
    /// The owners, by shard.
    pub owners: Vec<OwnerStatus>,
}

/// A node.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct NodeStatus {
    /// Its name.
    pub name: String,
    /// Where it is reached over HTTP.
    pub address: String,
    /// Whether it takes part.
    pub state: NodeState,
}

/// Whether a node takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum NodeState {
    /// It has a link to this node, and the storage.
    Live,
    /// It has the storage, and no link to this node.
    Apart,
    /// It says nothing any more.
    Lapsed,
}

/// A shard and its owner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnerStatus {
    /// The shard.
    pub shard: ShardNumber,
    /// Name of the owner.
    pub owner: Option<String>,
    /// Where the owner is reached over HTTP.
    pub address: Option<String>,
    /// Which owner in a row it is; 0 for none.
    pub term: u64,
    /// What this node does with it.
    pub state: OwnerState,
}

/// What a node does with a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum OwnerState {
    /// It has it.
    Open,
    /// It takes it over.
    Opening,
    /// It gives it up.
    Closing,
    /// Another node has it.
    Elsewhere,
    /// No node in reach has it.
    None,
}

/// Where a space is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Whereabouts {
    /// In this process.
    Here,
    /// On the node at this address.
    At(String),
    /// Nowhere, for the moment.
    Nowhere,
}

impl Standing {
    /// Whether this node takes part: it has not given up, nor would it if it had not stood still.
    fn takes_part(&self) -> bool {
        let is_over = |contact: Instant| contact.elapsed() >= self.lease;
        !self.resigned && !self.contact.is_none_or(is_over)
    }
}

impl Cluster {
    /// A cluster of which this node knows nothing yet.
    pub fn new(standing: Standing) -> Self {
        Self(Arc::new(ArcSwap::from_pointee(standing)))
    }

    /// How it stands.
    pub fn standing(&self) -> Arc<Standing> {
        self.0.load_full()
    }

    /// Puts another standing in force.
    pub fn update(&self, standing: Standing) {
        self.0.store(Arc::new(standing));
    }

    /// Whether this node takes part.
    pub fn takes_part(&self) -> bool {
        self.0.load().takes_part()
    }

    /// Where a shard is.
    pub fn whereabouts(&self, shard: ShardNumber) -> Whereabouts {
        let standing = self.0.load();
        if !standing.takes_part() {
            return Whereabouts::Nowhere;
        }
        match standing.owners.get(shard.0 as usize) {
            Some(owner) if owner.state == OwnerState::Open => Whereabouts::Here,
            Some(OwnerStatus {
                state: OwnerState::Elsewhere,
                address: Some(address),
                ..
            }) => Whereabouts::At(address.clone()),
            _ => Whereabouts::Nowhere,
        }
    }
}
