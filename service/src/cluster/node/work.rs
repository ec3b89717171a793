//! What takes a node long: beats, and opening and closing shards, each on a thread of its own.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread::Builder;
use std::time::{Duration, Instant};

use cogmap_proto::{Name, SpaceSettings};

use super::{NodeSettings, Signal};
use crate::engine::{Engine, SpaceError};
use crate::store::{
    NodeId, ObjectStorage, OwnerRecord, Registry, Seen, ShardNumber, Store, StoreError,
};

/// Beats that may fail within a lease.
const BEATS_PER_LEASE: u32 = 3;

/// What a beat has brought.
#[derive(Debug)]
pub(super) struct Beat {
    /// When it began.
    pub(super) asked: Instant,
    /// What is in the storage.
    pub(super) seen: Result<Seen, StoreError>,
}

/// What has been done.
#[derive(Debug)]
pub(super) enum Done {
    /// A shard is open, with its term, or is not.
    Opened(ShardNumber, Result<u64, StoreError>),
    /// A shard is closed, and may be opened by others.
    Closed(OwnerRecord),
}

/// Does what takes long.
pub(super) struct Worker {
    storage: Arc<ObjectStorage>,
    registry: Registry,
    engine: Engine,
    signals: Sender<Signal>,
    /// Where this node is reached over HTTP.
    address: String,
    /// Time between beats.
    interval: Duration,
    /// Longest wait for the storage.
    timeout: Duration,
    /// Spaces that are created where they are not there yet.
    spaces: Arc<BTreeMap<Name, SpaceSettings>>,
    beating: bool,
}

impl Worker {
    pub(super) fn new(
        storage: Arc<ObjectStorage>,
        engine: Engine,
        signals: Sender<Signal>,
        settings: &NodeSettings,
    ) -> Self {
        Self {
            registry: storage.registry(),
            storage,
            engine,
            signals,
            address: settings.address.clone(),
            interval: settings.beat_interval,
            timeout: settings.lease,
            spaces: Arc::new(settings.spaces.clone()),
            beating: false,
        }
    }

    /// Whether a beat is under way.
    pub(super) fn is_beating(&self) -> bool {
        self.beating
    }

    /// The beat that was under way has come back.
    pub(super) fn beaten(&mut self) {
        self.beating = false;
    }

    /// Says in the storage that the node is there, and looks who else is.
    pub(super) fn beat(&mut self, node: &NodeId, count: u64) {
        self.beating = true;
        let (registry, node, timeout) = (self.registry.clone(), node.clone(), self.timeout);
        let (address, interval) = (self.address.clone(), self.interval);
        let failed = Signal::Beat(Beat {
            asked: Instant::now(),
            seen: Err(StoreError::Io("a beat ended with a panic".into())),
        });
        self.spawn("beat", failed, move || {
            let asked = Instant::now();
            // A connection that was lost without a word must not cost the lease.
            let seen = registry.beat(&node, &address, count, interval, timeout / BEATS_PER_LEASE);
            Signal::Beat(Beat { asked, seen })
        });
    }

    /// Claims a shard that `last` owned last, and starts its spaces.
    pub(super) fn open(&self, shard: ShardNumber, node: &NodeId, last: Option<OwnerRecord>) {
        let (storage, registry) = (Arc::clone(&self.storage), self.registry.clone());
        let (engine, node, timeout) = (self.engine.clone(), node.clone(), self.timeout);
        let spaces = Arc::clone(&self.spaces);
        let failed = StoreError::Io("opening it ended with a panic".into());
        let failed = Signal::Done(Done::Opened(shard, Err(failed)));
        self.spawn("open shard", failed, move || {
            let open = || {
                let known = last.as_ref().map_or(0, |last| last.term);
                let before = storage.term_of(shard)?;
                let owners = registry.look(timeout)?.owners;
                let later =
                    { owners.into_iter() }.find(|owner| owner.shard == shard && owner.term > known);
                if let Some(owner) = later {
                    return Err(StoreError::Fenced(format!(
                        "shard {shard}, by {}",
                        owner.node
                    )));
                }
                // Whoever has claimed it since the term was read, keeps it.
                let store = storage.claim_shard(shard, before)?;
                let store: Arc<dyn Store> = Arc::new(store);
                let term = store.term();
                let record = OwnerRecord { shard, term, node };
                registry.own(&record, timeout)?;
                // What is left of it says nothing any more, and may stay.
                if let Some(last) = last {
                    let _ = registry.disown(&last, timeout);
                }
                engine.open_shard(shard, store)?;
                create_spaces(&engine, shard, &spaces);
                Ok(term)
            };
            Signal::Done(Done::Opened(shard, open()))
        });
    }

    /// Closes a shard: what is queued becomes durable, if this node still owns it.
    pub(super) fn close(&self, record: OwnerRecord) {
        let (registry, engine, timeout) =
            (self.registry.clone(), self.engine.clone(), self.timeout);
        // What the engine still has of it is closed once more.
        let failed = Signal::Done(Done::Closed(record.clone()));
        self.spawn("close shard", failed, move || {
            engine.close_shard(record.shard);
            if let Err(error) = registry.disown(&record, timeout) {
                tracing::debug!(%error, "forget the owner of a shard");
            }
            Signal::Done(Done::Closed(record))
        });
    }

    /// Removes the record of an owner.
    pub(super) fn disown(&self, record: OwnerRecord) {
        let (registry, timeout) = (self.registry.clone(), self.timeout);
        spawn("disown", move || {
            if let Err(error) = registry.disown(&record, timeout) {
                tracing::debug!(%error, "forget the owner of a shard");
            }
        });
    }

    /// Forgets this node in the storage, and waits for that.
    pub(super) fn leave(&self, node: &NodeId) {
        leave(&self.registry, node, &self.address, self.timeout);
    }

    /// Forgets a node that is gone.
    pub(super) fn forget(&self, node: NodeId, address: String) {
        let (registry, timeout) = (self.registry.clone(), self.timeout);
        spawn("forget node", move || {
            leave(&registry, &node, &address, timeout);
        });
    }

    /// Does what takes long, and tells the node what came of it, or that it `failed` where it
    /// panicked. The node may have ended meanwhile.
    fn spawn(&self, name: &str, failed: Signal, work: impl FnOnce() -> Signal + Send + 'static) {
        let signals = self.signals.clone();
        spawn(name, move || drop(signals.send(outcome(work, failed))));
    }
}

/// What comes of work, or `failed` where it panics. The panic has been logged then.
fn outcome<T>(work: impl FnOnce() -> T, failed: T) -> T {
    // What the work shares with others is behind locks, which tell of the panic by themselves.
    catch_unwind(AssertUnwindSafe(work)).unwrap_or(failed)
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) {
    let spawned = Builder::new().name(name.to_owned()).spawn(work);
    spawned.expect("the system can start a thread");
}

fn leave(registry: &Registry, node: &NodeId, address: &str, timeout: Duration) {
    if let Err(error) = registry.leave(node, address, timeout) {
        tracing::debug!(%node, %error, "forget a node");
    }
}

/// Creates the spaces of the settings that belong to a shard and are not there.
fn create_spaces(engine: &Engine, shard: ShardNumber, spaces: &BTreeMap<Name, SpaceSettings>) {
    let of_shard = spaces
        .iter()
        .filter(|(name, _)| engine.shards().of(name.as_str()) == shard);
    for (name, settings) in of_shard {
        match engine.create_space(name, settings) {
            Ok(_) => {}
            Err(SpaceError::ExistsWithOtherSettings(others)) => {
                tracing::warn!(space = %name, others,
                    "the settings given for the space are without effect: they were fixed when it was created");
            }
            Err(error) => tracing::error!(space = %name, %error, "create a space"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_node_is_told_of_work_that_panics() {
        assert_eq!(outcome(|| "open", "failed"), "open");
        assert_eq!(outcome(|| panic!("on purpose"), "failed"), "failed");
    }
}
