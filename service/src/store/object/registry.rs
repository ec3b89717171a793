//! What the nodes of a cluster say of themselves, as objects beside the shards.
//!
//! ```text
//! cluster/nodes/{node}.{session}/{host}/{port}        rewritten with every beat of the node
//! cluster/owners/{shard}/{term}/{node}.{session}      nothing: the node owns the shard
//! ```
//!
//! A listing tells nodes everything: they read no object. A beat holds a count and the time between
//! two beats \[ms\], for programs that look whether nodes are at work. Records of owners say where
//! a shard is; who may write it the storage itself decides, by the epoch of its database.

use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt;
use slatedb::object_store::path::Path;
use slatedb::object_store::{Error, ObjectMeta, ObjectStore, ObjectStoreExt, PutPayload};

use super::super::{ShardNumber, StoreError};
use super::location::Location;
use super::runtime::Runtime;

const CLUSTER: &str = "cluster";
const NODES: &str = "nodes";
const OWNERS: &str = "owners";

/// A node, from its start to its end.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId {
    /// Its name, which it has again after a restart.
    pub name: String,
    /// What is new with every start.
    pub session: String,
}

impl std::fmt::Display for NodeId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.name, self.session)
    }
}

impl NodeId {
    /// Reads what [`NodeId`] is written as.
    pub fn parse(text: &str) -> Option<Self> {
        let (name, session) = text.rsplit_once('.')?;
        Some(Self {
            name: name.to_owned(),
            session: session.to_owned(),
        })
    }
}

/// That a node owns a shard.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct OwnerRecord {
    /// The shard.
    pub shard: ShardNumber,
    /// Which owner of the shard in a row it is.
    pub term: u64,
    /// The node.
    pub node: NodeId,
}

/// That a node is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeRecord {
    /// The node.
    pub node: NodeId,
    /// Where it is reached over HTTP.
    pub address: String,
    /// What changes when the node says so again.
    pub mark: String,
}

/// What is in the registry.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The nodes that have said something.
    pub nodes: Vec<NodeRecord>,
    /// Who owns or owned what.
    pub owners: Vec<OwnerRecord>,
}

/// The registry of a store.
#[derive(Clone, Debug)]
pub struct Registry {
    location: Location,
    runtime: Arc<Runtime>,
}

impl Registry {
    pub(super) fn new(location: Location, runtime: Arc<Runtime>) -> Self {
        Self { location, runtime }
    }

    /// Says that a node is there, reached over HTTP at an address, and says so again after an
    /// interval; and looks who else is. `count` differs from beat to beat.
    ///
    /// # Errors
    /// [`StoreError::Unreachable`], also when it takes longer than `timeout`.
    pub fn beat(
        &self,
        node: &NodeId,
        address: &str,
        count: u64,
        interval: Duration,
        timeout: Duration,
    ) -> Result<Seen, StoreError> {
        let object = self.node(node, address);
        let beat = async {
            let said = format!("{count} {}", interval.as_millis());
            let payload = PutPayload::from(said.into_bytes());
            self.location.storage().put(&object, payload).await?;
            self.list().await
        };
        self.wait(beat, timeout)
    }

    /// Looks who is there.
    ///
    /// # Errors
    /// As [`Registry::beat`].
    pub fn look(&self, timeout: Duration) -> Result<Seen, StoreError> {
        self.wait(self.list(), timeout)
    }

    /// The time between the beats of a node, by its own word; none of one that is gone.
    ///
    /// # Errors
    /// As [`Registry::beat`].
    pub fn interval(
        &self,
        record: &NodeRecord,
        timeout: Duration,
    ) -> Result<Option<Duration>, StoreError> {
        let object = self.node(&record.node, &record.address);
        let get = async {
            match self.location.storage().get(&object).await {
                Ok(found) => found.bytes().await.map(Some),
                Err(Error::NotFound { .. }) => Ok(None),
                Err(error) => Err(error),
            }
        };
        let said = self.wait(get, timeout)?;
        Ok(said.and_then(|said| {
            let (_, interval) = std::str::from_utf8(&said).ok()?.split_once(' ')?;
            interval.parse().ok().map(Duration::from_millis)
        }))
    }

    /// Notes that a node owns a shard.
    ///
    /// # Errors
    /// As [`Registry::beat`].
    pub fn own(&self, record: &OwnerRecord, timeout: Duration) -> Result<(), StoreError> {
        let object = self.owner(record);
        let put = async {
            let storage = self.location.storage();
            storage.put(&object, PutPayload::new()).await.map(|_| ())
        };
        self.wait(put, timeout)
    }

    /// Forgets that a node owns or owned a shard.
    ///
    /// # Errors
    /// As [`Registry::beat`].
    pub fn disown(&self, record: &OwnerRecord, timeout: Duration) -> Result<(), StoreError> {
        self.remove(&self.owner(record), timeout)
    }

    /// Forgets a node that was reached at an address.
    ///
    /// # Errors
    /// As [`Registry::beat`].
    pub fn leave(&self, node: &NodeId, address: &str, timeout: Duration) -> Result<(), StoreError> {
        self.remove(&self.node(node, address), timeout)
    }

    fn remove(&self, object: &Path, timeout: Duration) -> Result<(), StoreError> {
        let removal = async {
            match self.location.storage().delete(object).await {
                Ok(()) | Err(Error::NotFound { .. }) => Ok(()),
                Err(error) => Err(error),
            }
        };
        self.wait(removal, timeout)
    }

    fn wait<T: Send>(
        &self,
        asked: impl Future<Output = Result<T, Error>> + Send,
        timeout: Duration,
    ) -> Result<T, StoreError> {
        let asked = async { tokio::time::timeout(timeout, asked).await };
        match self.runtime.wait(asked) {
            Ok(answered) => answered.map_err(|error| self.location.away(&error)),
            Err(_) => Err(self.location.away(&"no answer")),
        }
    }

    async fn list(&self) -> Result<Seen, Error> {
        let below = self.location.path([CLUSTER]);
        let storage = self.location.storage();
        let objects: Vec<ObjectMeta> = storage.list(Some(&below)).try_collect().await?;
        let mut seen = Seen::default();
        for object in objects {
            let Some(parts) = object.location.prefix_match(&below) else {
                continue;
            };
            let parts: Vec<_> = parts.collect();
            let parts: Vec<&str> = parts.iter().map(AsRef::as_ref).collect();
            match *parts {
                [NODES, node, host, port] => {
                    let changed = (object.last_modified, object.e_tag);
                    let record = NodeId::parse(node).map(|node| NodeRecord {
                        node,
                        address: address(host, port),
                        mark: format!("{changed:?}"),
                    });
                    seen.nodes.extend(record);
                }
                [OWNERS, shard, term, node] => seen.owners.extend(owner_record(shard, term, node)),
                _ => {}
            }
        }
        Ok(seen)
    }

    fn node(&self, node: &NodeId, address: &str) -> Path {
        let (host, port) = address.rsplit_once(':').unwrap_or((address, "0"));
        // Storages escape brackets.
        let host = host.trim_matches(['[', ']']);
        let node = node.to_string();
        self.location.path([CLUSTER, NODES, &node, host, port])
    }

    fn owner(&self, OwnerRecord { shard, term, node }: &OwnerRecord) -> Path {
        let (shard, term, node) = (shard.to_string(), term.to_string(), node.to_string());
        self.location.path([CLUSTER, OWNERS, &shard, &term, &node])
    }
}

/// Where a node is reached; an address of IPv6 has brackets.
fn address(host: &str, port: &str) -> String {
    if host.contains(':') {
        format!("[{host}]:{port}")
    } else {
        format!("{host}:{port}")
    }
}

fn owner_record(shard: &str, term: &str, node: &str) -> Option<OwnerRecord> {
    Some(OwnerRecord {
        shard: ShardNumber(shard.parse().ok()?),
        term: term.parse().ok()?,
        node: NodeId::parse(node)?,
    })
}
