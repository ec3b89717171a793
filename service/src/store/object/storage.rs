//! A whole store on object storage: its description and its shards.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use slatedb::admin::Admin;
use slatedb::object_store::{
    Error, ObjectStore as _, ObjectStoreExt, PutMode, PutOptions, PutPayload,
};

use super::super::{ShardNumber, Shards, StoreError};
use super::database::Database;
use super::location::Location;
use super::registry::Registry;
use super::runtime::Runtime;
use super::{FORMAT, ObjectStore};

/// The object that describes the store.
const DESCRIPTION: &str = "store.json";
/// What the databases of the shards are below.
const SHARDS: &str = "shards";

/// Longest wait for the registry.
const LOOK_TIMEOUT: Duration = Duration::from_secs(30);
/// Least and longest wait for a node's next beat, and the intervals between two beats that are
/// waited for: one may be late, or fail.
const WAIT_MIN: Duration = Duration::from_secs(2);
const WAIT_MAX: Duration = Duration::from_secs(60);
const INTERVALS_WAITED: u32 = 3;
/// How often is looked meanwhile.
const LOOK_INTERVAL: Duration = Duration::from_millis(250);

/// A store on object storage, of which each shard is opened by itself.
#[derive(Debug)]
pub struct ObjectStorage {
    location: Location,
    runtime: Arc<Runtime>,
    shards: Shards,
}

/// What is fixed when a store is created.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Description {
    /// Format of the layout.
    format: u32,
    /// How many shards there are.
    shards: u32,
}

impl ObjectStorage {
    /// Finds the store at a URL such as `s3://bucket/prefix` or `file:///directory`, and creates
    /// it with so many shards where there is none. Region, endpoint and credentials of a provider
    /// come from its usual environment variables.
    ///
    /// # Errors
    /// [`StoreError::Io`] when the URL names no store or the storage does not keep what it
    /// promises, [`StoreError::Unreachable`], [`StoreError::NewerFormat`].
    pub fn open(url: &str, shards: Shards) -> Result<Self, StoreError> {
        Self::found(url, Some(shards))
    }

    /// Finds the store at a URL, where there is one.
    ///
    /// # Errors
    /// Those of [`ObjectStorage::open`], and [`StoreError::Io`] where there is none.
    pub fn open_existing(url: &str) -> Result<Self, StoreError> {
        Self::found(url, None)
    }

    fn found(url: &str, creates: Option<Shards>) -> Result<Self, StoreError> {
        let runtime = Arc::new(Runtime::start()?);
        let location = Location::parse(url)?;
        let opening = async {
            if creates.is_none() && location.is_empty().await? {
                return Err(StoreError::Io(format!("there is no store at {location}")));
            }
            location.probe().await?;
            match (read(&location).await?, creates) {
                (Some(found), _) => Ok(found),
                (None, Some(shards)) => create(&location, shards).await,
                (None, None) => Err(StoreError::Io(format!("there is no store at {location}"))),
            }
        };
        let description = runtime.wait(opening)?;
        if description.format > FORMAT {
            return Err(StoreError::NewerFormat {
                found: description.format,
                supported: FORMAT,
            });
        }
        let none = || StoreError::Corrupt(format!("{location}: a store without shards"));
        let shards = Shards::new(description.shards).ok_or_else(none)?;
        Ok(Self {
            location,
            runtime,
            shards,
        })
    }

    /// How many shards it has: as many as it was created with.
    pub fn shards(&self) -> Shards {
        self.shards
    }

    /// Opens a shard. Another process that has it open is fenced.
    ///
    /// # Errors
    /// [`StoreError::Unreachable`], [`StoreError::NewerFormat`], or the shard cannot be read.
    pub fn open_shard(&self, shard: ShardNumber) -> Result<ObjectStore, StoreError> {
        self.opened(shard, None)
    }

    /// Opens a shard whose last owner had a term. Of several who claim it at once, one wins.
    ///
    /// # Errors
    /// Those of [`ObjectStorage::open_shard`], and [`StoreError::Fenced`] where it has had another
    /// owner since.
    pub fn claim_shard(&self, shard: ShardNumber, term: u64) -> Result<ObjectStore, StoreError> {
        self.opened(shard, Some(term))
    }

    fn opened(&self, shard: ShardNumber, term: Option<u64>) -> Result<ObjectStore, StoreError> {
        let path = self.location.path([SHARDS, &shard.to_string()]);
        let database = Database::open(&self.location, &self.runtime, path, term)?;
        ObjectStore::over(database)
    }

    /// Opens a shard that another process owns, to be read: what it makes durable is seen a moment
    /// later.
    ///
    /// # Errors
    /// [`StoreError::Unreachable`], or there is no such shard yet.
    pub fn follow_shard(&self, shard: ShardNumber) -> Result<ObjectStore, StoreError> {
        let path = self.location.path([SHARDS, &shard.to_string()]);
        let database = Database::follow(&self.location, &self.runtime, path)?;
        Ok(ObjectStore::reading(database))
    }

    /// The term of the last owner of a shard; 0 where it has had none.
    ///
    /// # Errors
    /// [`StoreError::Unreachable`].
    pub fn term_of(&self, shard: ShardNumber) -> Result<u64, StoreError> {
        let path = self.location.path([SHARDS, &shard.to_string()]);
        let admin = Admin::builder(path, self.location.storage()).build();
        let manifest = self.runtime.wait(admin.read_manifest(None));
        let manifest = manifest.map_err(|error| self.location.away(&error))?;
        Ok(manifest.map_or(0, |manifest| manifest.writer_epoch()))
    }

    /// Refuses to go on where nodes of a cluster are at work: they would be fenced.
    ///
    /// # Errors
    /// [`StoreError::Io`] if so, [`StoreError::Unreachable`].
    pub fn refuse_a_cluster(&self) -> Result<(), StoreError> {
        let look = || self.registry().look(LOOK_TIMEOUT);
        let before = look()?.nodes;
        if before.is_empty() {
            return Ok(());
        }
        // What nodes that are gone have left says nothing.
        let mut wait = WAIT_MIN;
        for node in &before {
            let interval = self.registry().interval(node, LOOK_TIMEOUT)?;
            let interval = interval.unwrap_or_default();
            wait = wait.max(interval.saturating_mul(INTERVALS_WAITED));
            if wait > WAIT_MAX {
                let what = format!(
                    "{}: node {} of a cluster may be at work on it, and says so only every \
                     {interval:?}; end it, or if it was killed, start a node and end that",
                    self.location, node.node.name
                );
                return Err(StoreError::Io(what));
            }
        }
        let until = Instant::now() + wait;
        let mut at_work = None;
        while at_work.is_none() && Instant::now() < until {
            std::thread::sleep(LOOK_INTERVAL);
            let mut nodes = look()?.nodes.into_iter();
            at_work = nodes.find(|node| !before.contains(node));
        }
        at_work.map_or(Ok(()), |record| {
            let what = format!(
                "{}: node {} of a cluster is at work on it",
                self.location, record.node.name
            );
            Err(StoreError::Io(what))
        })
    }

    /// What nodes say of themselves.
    pub fn registry(&self) -> Registry {
        Registry::new(self.location.clone(), Arc::clone(&self.runtime))
    }
}

/// The description of the store that is there.
async fn read(location: &Location) -> Result<Option<Description>, StoreError> {
    let object = location.path([DESCRIPTION]);
    let bytes = match location.storage().get(&object).await {
        Ok(found) => found.bytes().await,
        Err(Error::NotFound { .. }) => return Ok(None),
        Err(error) => Err(error),
    };
    let bytes = bytes.map_err(|error| location.away(&error))?;
    let description = serde_json::from_slice(&bytes);
    let corrupt = |error| StoreError::Corrupt(format!("{location}: {DESCRIPTION}: {error}"));
    description.map(Some).map_err(corrupt)
}

/// Describes a new store, or finds what somebody else has described meanwhile.
async fn create(location: &Location, shards: Shards) -> Result<Description, StoreError> {
    let description = Description {
        format: FORMAT,
        shards: shards.count(),
    };
    let bytes = serde_json::to_vec(&description).expect("plain data encodes");
    let object = location.path([DESCRIPTION]);
    let options = PutOptions::from(PutMode::Create);
    let (storage, payload) = (location.storage(), PutPayload::from(bytes));
    let put = storage.put_opts(&object, payload, options);
    match put.await {
        Ok(_) => Ok(description),
        Err(Error::AlreadyExists { .. } | Error::Precondition { .. }) => {
            let gone = || StoreError::Corrupt(format!("{location}: {DESCRIPTION} came and went"));
            read(location).await?.ok_or_else(gone)
        }
        Err(error) => Err(location.away(&error)),
    }
}
