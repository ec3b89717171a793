//! The cluster: its nodes, and who owns which shard.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use serde::Serialize;
use utoipa::ToSchema;

use super::extract::NoQuery;
use super::reply;
use super::state::Service;
use crate::cluster::{NodeStatus, OwnerState, OwnerStatus};
use crate::engine::OpenShard;

/// The cluster, as this node sees it.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ClusterInfo {
    /// Name of this node; none of a service that is not one.
    node: Option<String>,
    /// How many shards the store has.
    shards: u32,
    /// The nodes, by name.
    nodes: Vec<NodeStatus>,
    /// The shards with their owners, by number.
    owners: Vec<ShardInfo>,
}

/// A shard and its owner.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ShardInfo {
    /// Number of the shard.
    shard: u32,
    /// Name of the node that owns it, or is about to.
    owner: Option<String>,
    /// Which owner in a row it is; 0 where nobody is known, and of a store in a directory.
    term: u64,
    /// What this node does with it.
    state: OwnerState,
    /// How many spaces it has, if it is here.
    spaces: Option<usize>,
    /// Samples of all its agents that are applied and not durable yet, if it is here.
    lag_samples: Option<u64>,
}

/// The cluster: its nodes, and who owns which shard.
///
/// Another node may know of a change a moment earlier or later. A service that is no node of a
/// cluster tells its own shards.
#[utoipa::path(get, path = "/v1/cluster", tag = "service", operation_id = "get_cluster",
    responses((status = 200, description = "The cluster", body = ClusterInfo)))]
pub(crate) async fn get(State(service): State<Service>, _: NoQuery) -> Response<Body> {
    let open = service.engine.open_shards();
    let shards = service.engine.shards().count();
    let Some(cluster) = &service.cluster else {
        return reply::json(&ClusterInfo {
            node: None,
            shards,
            nodes: Vec::new(),
            owners: open.iter().map(alone).collect(),
        });
    };
    let standing = cluster.standing();
    let owner = |status: &OwnerStatus| {
        let open = open.iter().find(|open| open.number == status.shard);
        ShardInfo {
            owner: status.owner.clone(),
            term: status.term,
            state: status.state,
            ..open.map_or_else(|| elsewhere(status), alone)
        }
    };
    reply::json(&ClusterInfo {
        node: Some(standing.node.clone()),
        shards,
        nodes: standing.nodes.clone(),
        owners: standing.owners.iter().map(owner).collect(),
    })
}

/// A shard that is here.
fn alone(open: &OpenShard) -> ShardInfo {
    ShardInfo {
        shard: open.number.0,
        owner: None,
        term: open.term,
        state: OwnerState::Open,
        spaces: Some(open.spaces.len()),
        lag_samples: Some(open.spaces.iter().map(|space| space.lag_samples()).sum()),
    }
}

/// A shard that is not.
fn elsewhere(status: &OwnerStatus) -> ShardInfo {
    ShardInfo {
        shard: status.shard.0,
        owner: None,
        term: 0,
        state: status.state,
        spaces: None,
        lag_samples: None,
    }
}
