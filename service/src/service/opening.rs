//! The stores, and the engine over them.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;

use zenoh::Session;

use super::StartError;
use crate::config::Config;
use crate::engine::{Engine, Publisher};
use crate::http::Served;
use crate::journal;
use crate::store::{self, LocalStore, Shards, StoreError, WholeStore};
#[cfg(feature = "object-storage")]
use crate::{
    cluster::{Node, NodeSettings, Replicas, Signals},
    store::{NodeId, ObjectStorage, Store},
    transport::ZenohPresence,
};

/// What a service serves from.
#[derive(Debug)]
pub(super) struct Opened {
    engine: Engine,
    #[cfg(feature = "object-storage")]
    node: Option<Clustered>,
}

/// The service as a node of a cluster.
#[cfg(feature = "object-storage")]
#[derive(Debug)]
struct Clustered {
    node: Node,
    replicas: Option<Replicas>,
}

impl Opened {
    /// Opens the store of the settings, or becomes a node of the cluster that shares it.
    #[cfg_attr(
        not(feature = "object-storage"),
        expect(
            unused_variables,
            clippy::unused_async,
            reason = "there is no cluster to join"
        )
    )]
    pub(super) async fn open(
        config: &Config,
        listens: SocketAddr,
        publisher: Arc<dyn Publisher>,
        session: Option<&Session>,
    ) -> Result<Self, StartError> {
        #[cfg(feature = "object-storage")]
        if let Some(session) = session.filter(|_| config.cluster.enabled) {
            return Self::join(config, listens, publisher, session).await;
        }
        Ok(Self {
            engine: open_engine(config, publisher)?,
            #[cfg(feature = "object-storage")]
            node: None,
        })
    }

    /// The engine.
    pub(super) fn engine(&self) -> &Engine {
        &self.engine
    }

    /// What HTTP answers from.
    pub(super) fn served(&self) -> Served {
        let served = Served::from(self.engine.clone());
        #[cfg(feature = "object-storage")]
        if let Some(Clustered { node, replicas }) = &self.node {
            return Served {
                cluster: Some(node.cluster().clone()),
                replicas: replicas.as_ref().map(|replicas| replicas.engine().clone()),
                ..served
            };
        }
        served
    }

    /// Makes everything durable and checkpoints it; a node gives its shards up. Blocks until then.
    pub(super) fn close(self) {
        #[cfg(feature = "object-storage")]
        if let Some(Clustered { node, replicas }) = self.node {
            drop(replicas);
            node.stop();
        }
        self.engine.shutdown();
    }
}

/// The engine over the store, with the spaces of the settings.
fn open_engine(config: &Config, publisher: Arc<dyn Publisher>) -> Result<Engine, StartError> {
    let place = config.store.place();
    let of_store = |source| StartError::Store {
        place: place.clone(),
        source,
    };
    let store = if config.store.url.is_empty() {
        let store = open_store(&config.store.directory).map_err(of_store)?;
        WholeStore::undivided(Arc::new(store))
    } else {
        store_at(&place, Some(config.store.shards())).map_err(of_store)?
    };
    say_shards(config, store.shards());
    let mut name_lost = false;
    let engine = Engine::new(store.shards(), config.engine.settings(), publisher);
    for (number, shard) in store.iter() {
        let stored = shard.spaces().map_err(of_store)?;
        name_lost |= stored.iter().any(|space| space.settings.is_none());
        engine
            .open_shard(number, Arc::clone(shard))
            .map_err(of_store)?;
    }
    create_spaces(config, &engine, name_lost)?;
    Ok(engine)
}

/// Says where the store is divided otherwise than the settings want a new one to be.
fn say_shards(config: &Config, found: Shards) {
    let wanted = config.store.shards();
    if !config.store.url.is_empty() && wanted != found && wanted != Shards::ONE {
        let (wanted, found) = (wanted.count(), found.count());
        tracing::warn!(
            wanted,
            found,
            "store.shards is without effect: it was fixed when the store was created"
        );
    }
}

#[cfg(feature = "object-storage")]
impl Opened {
    /// Becomes a node, which opens shards as they come to it.
    async fn join(
        config: &Config,
        listens: SocketAddr,
        publisher: Arc<dyn Publisher>,
        session: &Session,
    ) -> Result<Self, StartError> {
        let (url, shards) = (config.store.url.clone(), config.store.shards());
        let place = url.clone();
        let of_store = |source| StartError::Store { place, source };
        let storage = tokio::task::spawn_blocking(move || ObjectStorage::open(&url, shards)).await;
        let interrupted = |_| StoreError::Io("the start was interrupted".to_owned());
        let storage = storage.map_err(interrupted).flatten().map_err(of_store)?;
        say_shards(config, storage.shards());
        let engine = Engine::new(storage.shards(), config.engine.settings(), publisher);
        let settings = NodeSettings {
            id: NodeId {
                name: config.cluster.node(),
                session: session.zid().to_string(),
            },
            address: config.cluster.address(listens),
            beat_interval: config.cluster.beat_interval(),
            lease: config.cluster.lease(),
            spaces: config.spaces.clone(),
        };
        let (storage, signals) = (Arc::new(storage), Signals::default());
        let presence = Box::new(ZenohPresence::watch(session, signals.teller()).await?);
        let of_node = Arc::clone(&storage);
        let node = Node::start(settings, of_node, engine.clone(), presence, signals);
        let replicas = config.cluster.replicas.then(|| {
            let followers = Engine::following(storage.shards(), config.engine.settings());
            Replicas::start(storage, node.cluster().clone(), followers)
        });
        let node = Some(Clustered { node, replicas });
        Ok(Self { engine, node })
    }
}

/// Creates the spaces of the settings that the store does not hold.
fn create_spaces(config: &Config, engine: &Engine, name_lost: bool) -> Result<(), StartError> {
    for (name, settings) in &config.spaces {
        if let Some(space) = engine.space(name.as_str()) {
            if space.settings() != settings {
                tracing::warn!(space = %name,
                    "the settings given for the space are without effect: they were fixed when it was created");
            }
            continue;
        }
        if name_lost {
            // A robot must not find an empty map where its own may be.
            tracing::error!(space = %name,
                "the space is not created: it may be one whose name is lost, see /v1/spaces");
            continue;
        }
        engine
            .create_space(name, settings)
            .map_err(|source| StartError::Space {
                name: name.to_string(),
                source,
            })?;
    }
    Ok(())
}

/// Opens the store in `directory`, made anew in the present format where it has an older one.
///
/// # Errors
/// See [`LocalStore::open`] and [`store::migrate`].
pub fn open_store(directory: &Path) -> Result<LocalStore, StoreError> {
    store::migrate(directory, journal::samples_in)?;
    LocalStore::open(directory)
}

/// Opens the store at a URL or in a directory, with all its shards. Where there is none it is
/// created, if so wanted: with so many shards on object storage, undivided in a directory.
///
/// # Errors
/// See [`open_store`] and `ObjectStorage::open`; there is none, nodes of a cluster are at work on
/// it, or this build has no object storage.
pub fn store_at(place: &str, creates: Option<Shards>) -> Result<WholeStore, StoreError> {
    if !place.contains("://") {
        let directory = Path::new(place);
        // An empty directory would be made a store.
        let mut names = std::fs::read_dir(directory).into_iter().flatten();
        if creates.is_none() && names.next().is_none() {
            return Err(StoreError::Io(format!("there is no store at {place}")));
        }
        return Ok(WholeStore::undivided(Arc::new(open_store(directory)?)));
    }
    #[cfg(feature = "object-storage")]
    {
        let storage = match creates {
            Some(shards) => ObjectStorage::open(place, shards)?,
            None => ObjectStorage::open_existing(place)?,
        };
        storage.refuse_a_cluster()?;
        WholeStore::open(storage.shards(), |shard| {
            Ok(Arc::new(storage.open_shard(shard)?) as Arc<dyn Store>)
        })
    }
    #[cfg(not(feature = "object-storage"))]
    Err(StoreError::Io(
        "this program is built without object storage; build it with --features object-storage"
            .to_owned(),
    ))
}
