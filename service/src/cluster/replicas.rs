//! Replicas: a node follows the shards that others own, and can answer questions about them.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use super::standing::{Cluster, OwnerState};
use crate::engine::Engine;
use crate::store::{ObjectStorage, ShardNumber, Store, StoreError};

/// How often is looked which shards there are to follow, and which spaces are in them.
const LOOK_INTERVAL: Duration = Duration::from_millis(250);

/// The replicas of a node. Dropping them ends them.
#[derive(Debug)]
pub struct Replicas {
    engine: Engine,
    /// Dropped to stop.
    running: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Replicas {
    /// Follows, by `engine`, what the cluster says others own.
    ///
    /// # Panics
    /// The system cannot start a thread.
    pub fn start(storage: Arc<ObjectStorage>, cluster: Cluster, engine: Engine) -> Self {
        let (running, stopped) = channel();
        let mut followed = Followed {
            storage,
            cluster,
            engine: engine.clone(),
            terms: BTreeMap::new(),
        };
        let run = move || {
            while stopped.recv_timeout(LOOK_INTERVAL) == Err(RecvTimeoutError::Timeout) {
                followed.look();
            }
            followed.engine.shutdown();
        };
        let thread = Builder::new().name("replicas".into()).spawn(run);
        Self {
            engine,
            running: Some(running),
            thread: Some(thread.expect("the system can start a thread")),
        }
    }

    /// The engine that follows.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }
}

impl Drop for Replicas {
    fn drop(&mut self) {
        self.running = None;
        if self
            .thread
            .take()
            .is_some_and(|thread| thread.join().is_err())
        {
            tracing::error!("the replicas ended with a panic");
        }
    }
}

/// What is followed: the terms of the owners, by shard.
struct Followed {
    storage: Arc<ObjectStorage>,
    cluster: Cluster,
    engine: Engine,
    terms: BTreeMap<ShardNumber, u64>,
}

impl Followed {
    fn look(&mut self) {
        for owner in &self.cluster.standing().owners {
            let shard = owner.shard;
            let followed = self.terms.get(&shard).copied();
            match owner.state {
                // Each owner is followed from the beginning: its term stands in what is answered.
                OwnerState::Elsewhere if followed != Some(owner.term) => {
                    self.leave(shard);
                    match self.follow(shard) {
                        Ok(()) => _ = self.terms.insert(shard, owner.term),
                        Err(error) => tracing::debug!(%shard, %error, "follow a shard"),
                    }
                }
                // Its journal could not be read on; the next look begins anew.
                OwnerState::Elsewhere if self.has_failed(shard) => self.leave(shard),
                OwnerState::Elsewhere => {
                    if let Err(error) = self.engine.follow_spaces(shard) {
                        tracing::debug!(%shard, %error, "follow the spaces of a shard");
                    }
                }
                OwnerState::Open => self.leave(shard),
                // What is known of it may still be asked for.
                OwnerState::Opening | OwnerState::Closing | OwnerState::None => {}
            }
        }
    }

    fn has_failed(&self, shard: ShardNumber) -> bool {
        let open = self.engine.open_shards().into_iter();
        let spaces = open
            .filter(|open| open.number == shard)
            .flat_map(|open| open.spaces);
        spaces.into_iter().any(|space| space.failure().is_some())
    }

    fn follow(&self, shard: ShardNumber) -> Result<(), StoreError> {
        let store: Arc<dyn Store> = Arc::new(self.storage.follow_shard(shard)?);
        self.engine.open_shard(shard, store)
    }

    fn leave(&mut self, shard: ShardNumber) {
        if self.terms.remove(&shard).is_some() {
            self.engine.close_shard(shard);
        }
    }
}
