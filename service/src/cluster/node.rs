//! A node: the thread that opens and closes shards as the view says.

mod work;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use cogmap_proto::{Name, SpaceSettings};
use metrics::{counter, gauge};

use super::presence::{Presence, PresenceSign};
use super::standing::{Cluster, NodeState, NodeStatus, OwnerState, OwnerStatus, Standing};
use super::view::{Patience, View};
use crate::engine::Engine;
use crate::metrics as names;
use crate::store::{NodeId, ObjectStorage, OwnerRecord, ShardNumber};
use work::{Done, Worker};

/// How long the live nodes must have been the same before shards move.
const SETTLED: Duration = Duration::from_millis(500);
/// How often a node looks after its shards between beats.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// How long a shard is left alone that could not be opened.
const BACK_OFF: Duration = Duration::from_secs(1);

/// What a node is told.
#[derive(Clone, Debug)]
pub struct NodeSettings {
    /// What it is called, and what is new with this start.
    pub id: NodeId,
    /// Where other nodes reach it over HTTP.
    pub address: String,
    /// Time between its beats.
    pub beat_interval: Duration,
    /// How long it does without contact to the storage.
    pub lease: Duration,
    /// Spaces that are created where they are not there yet.
    pub spaces: BTreeMap<Name, SpaceSettings>,
}

/// A running node.
#[derive(Debug)]
pub struct Node {
    cluster: Cluster,
    signals: Sender<Signal>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

/// The way to a node, made before it.
#[derive(Debug)]
pub struct Signals(Sender<Signal>, Receiver<Signal>);

impl Default for Signals {
    fn default() -> Self {
        let (sender, inbox) = channel();
        Self(sender, inbox)
    }
}

impl Signals {
    /// Tells the node what is heard of others. Whatever comes after it has ended is told nobody.
    pub fn teller(&self) -> impl Fn(PresenceSign) + Clone + Send + Sync + 'static {
        let signals = self.0.clone();
        move |sign| drop(signals.send(Signal::Presence(sign)))
    }
}

/// What the thread is told.
#[derive(Debug)]
enum Signal {
    Presence(PresenceSign),
    Beat(work::Beat),
    Done(Done),
    Stop,
}

/// The thread's state.
struct State {
    me: NodeId,
    settings: NodeSettings,
    engine: Engine,
    cluster: Cluster,
    view: View,
    presence: Box<dyn Presence>,
    worker: Worker,
    /// Shards that are being opened or closed.
    busy: BTreeMap<ShardNumber, OwnerState>,
    /// Terms of the shards that are open.
    open: BTreeMap<ShardNumber, u64>,
    /// When a shard may be tried again.
    not_before: BTreeMap<ShardNumber, Instant>,
    next_beat: Instant,
    resigned: bool,
    stopping: bool,
}

impl Node {
    /// Starts a node that serves the shards of a store by an engine. What is heard of others comes
    /// by `signals`.
    ///
    /// # Panics
    /// The system cannot start a thread.
    pub fn start(
        settings: NodeSettings,
        storage: Arc<ObjectStorage>,
        engine: Engine,
        presence: Box<dyn Presence>,
        Signals(signals, inbox): Signals,
    ) -> Self {
        let me = settings.id.clone();
        let cluster = Cluster::new(Standing {
            node: me.name.clone(),
            resigned: true,
            ..Standing::default()
        });
        let patience = Patience {
            beat: settings.beat_interval,
            lease: settings.lease,
            settled: SETTLED,
        };
        let state = State {
            view: View::new(me.clone(), engine.shards(), patience),
            worker: Worker::new(storage, engine.clone(), signals.clone(), &settings),
            me,
            settings,
            engine,
            cluster: cluster.clone(),
            presence,
            busy: BTreeMap::new(),
            open: BTreeMap::new(),
            not_before: BTreeMap::new(),
            next_beat: Instant::now(),
            resigned: true,
            stopping: false,
        };
        let thread = Builder::new()
            .name("node".into())
            .spawn(move || state.run(&inbox))
            .expect("the system can start a thread");
        Self {
            cluster,
            signals,
            thread: Mutex::new(Some(thread)),
        }
    }

    /// How the cluster stands.
    pub fn cluster(&self) -> &Cluster {
        &self.cluster
    }

    /// Gives all shards up, so that other nodes take them at once, and ends. Blocks until then.
    pub fn stop(&self) {
        // A node that has ended already takes nothing.
        let _ = self.signals.send(Signal::Stop);
        let thread = self
            .thread
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if thread.is_some_and(|thread| thread.join().is_err()) {
            tracing::error!("the node ended with a panic");
        }
    }
}

impl State {
    fn run(mut self, signals: &Receiver<Signal>) {
        let mut beats = 0;
        loop {
            let now = Instant::now();
            if now >= self.next_beat && !self.worker.is_beating() {
                self.next_beat = now + self.settings.beat_interval;
                beats += 1;
                self.worker.beat(&self.me, beats);
                let is_apart = |(_, _, state): &(_, _, NodeState)| *state == NodeState::Apart;
                if self.view.others(now).iter().any(is_apart) {
                    self.presence.ask();
                }
            }
            self.view.settle(now);
            self.keep_contact(now);
            self.look_after_shards(now);
            self.show(now);
            if self.stopping && self.busy.is_empty() && self.open.is_empty() {
                break;
            }
            match signals.recv_timeout(LOOK_INTERVAL) {
                Ok(signal) => self.take(signal),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            // What has come together is looked at together.
            while let Ok(signal) = signals.try_recv() {
                self.take(signal);
            }
        }
        self.presence.leave();
        self.worker.leave(&self.me);
    }

    fn take(&mut self, signal: Signal) {
        let now = Instant::now();
        match signal {
            Signal::Presence(PresenceSign::Node { node, there }) => self.view.link(node, there),
            Signal::Presence(PresenceSign::Owner { owner, there }) => {
                self.view.announce(owner, there, now);
            }
            Signal::Beat(beat) => {
                self.worker.beaten();
                match beat.seen {
                    Ok(seen) => {
                        self.view.observe(seen, beat.asked, now);
                        for (node, address) in self.view.left_behind(now) {
                            self.worker.forget(node, address);
                        }
                    }
                    Err(error) => tracing::debug!(%error, "beat"),
                }
            }
            Signal::Done(done) => self.done(done, now),
            Signal::Stop => self.stopping = true,
        }
    }

    /// Takes part while there is contact to the storage, and says so.
    fn keep_contact(&mut self, now: Instant) {
        let resigned = !self.view.in_contact(now);
        if resigned != self.resigned {
            self.resigned = resigned;
            if resigned {
                tracing::warn!("no contact to the storage: this node gives up its part");
                self.presence.leave();
            } else {
                tracing::info!(node = %self.me, "this node takes part in the cluster");
                self.presence.join(&self.me);
                for (shard, term) in &self.open {
                    self.presence.own(&self.record(*shard, *term));
                }
            }
        }
    }

    fn look_after_shards(&mut self, now: Instant) {
        let wanted = if self.stopping {
            Some(BTreeSet::new())
        } else {
            self.view.wanted(now)
        };
        for shard in self.engine.open_shards() {
            let number = shard.number;
            if self.busy.contains_key(&number) {
                continue;
            }
            let owner = self.view.recorded(number).map(|owner| owner.term);
            let lost = shard.failure.is_some() || owner.is_some_and(|term| term > shard.term);
            let unwanted = wanted
                .as_ref()
                .is_some_and(|wanted| !wanted.contains(&number));
            if lost || (unwanted && !self.resigned) || self.stopping {
                self.close(number, shard.term, lost);
                if lost {
                    self.not_before.insert(number, now + BACK_OFF);
                }
            }
        }
        if self.resigned || self.stopping {
            return;
        }
        self.clear_records(wanted.as_ref(), now);
        for number in wanted.into_iter().flatten() {
            let waits = self
                .not_before
                .get(&number)
                .is_some_and(|until| now < *until);
            let taken = self.busy.contains_key(&number) || self.open.contains_key(&number);
            if !waits && !taken && self.view.is_free(number, now) {
                self.busy.insert(number, OwnerState::Opening);
                let last = self.view.recorded(number).cloned();
                self.worker.open(number, &self.me, last);
            }
        }
    }

    /// Removes records of shards that this node neither owns nor is to own: an answer was lost as
    /// they came or went, and the others would wait for this node.
    fn clear_records(&mut self, wanted: Option<&BTreeSet<ShardNumber>>, now: Instant) {
        let Some(wanted) = wanted else { return };
        let stale = self.view.recorded_of_me().filter(|record| {
            let is_due = self
                .not_before
                .get(&record.shard)
                .is_none_or(|at| now >= *at);
            let held =
                self.busy.contains_key(&record.shard) || self.open.contains_key(&record.shard);
            is_due && !held && !wanted.contains(&record.shard)
        });
        let stale: Vec<_> = stale.cloned().collect();
        for record in stale {
            self.not_before.insert(record.shard, now + BACK_OFF);
            self.worker.disown(record);
        }
    }

    fn close(&mut self, number: ShardNumber, term: u64, lost: bool) {
        let why = if lost { "lost" } else { "given up" };
        tracing::info!(shard = %number, term, why, "a shard is closed");
        counter!(names::SHARDS_CLOSED, "reason" => if lost { "lost" } else { "moved" })
            .increment(1);
        self.busy.insert(number, OwnerState::Closing);
        self.presence.disown(number);
        self.worker.close(self.record(number, term));
    }

    fn done(&mut self, done: Done, now: Instant) {
        match done {
            Done::Opened(number, Ok(term)) => {
                tracing::info!(shard = %number, term, "a shard is open");
                counter!(names::SHARDS_OPENED).increment(1);
                self.busy.remove(&number);
                self.open.insert(number, term);
                let record = self.record(number, term);
                self.view.announce(record.clone(), true, now);
                if !self.resigned {
                    self.presence.own(&record);
                }
            }
            Done::Opened(number, Err(error)) => {
                tracing::warn!(shard = %number, %error, "a shard is not opened");
                self.busy.remove(&number);
                self.not_before.insert(number, now + BACK_OFF);
            }
            Done::Closed(record) => {
                self.busy.remove(&record.shard);
                self.open.remove(&record.shard);
                self.view.announce(record, false, now);
            }
        }
    }

    fn record(&self, shard: ShardNumber, term: u64) -> OwnerRecord {
        OwnerRecord {
            shard,
            term,
            node: self.me.clone(),
        }
    }

    /// Shows how the cluster stands.
    fn show(&self, now: Instant) {
        let me = NodeStatus {
            name: self.me.name.clone(),
            address: self.settings.address.clone(),
            state: if self.resigned {
                NodeState::Lapsed
            } else {
                NodeState::Live
            },
        };
        let status = |(node, address, state): (&NodeId, &str, NodeState)| NodeStatus {
            name: node.name.clone(),
            address: address.to_owned(),
            state,
        };
        let mut nodes: Vec<_> = self.view.others(now).into_iter().map(status).collect();
        nodes.push(me);
        // A former session of a node that is there again says nothing.
        nodes.sort_by_key(|node| (node.name.clone(), node.state == NodeState::Lapsed));
        nodes.dedup_by(|later, first| later.name == first.name);
        let live = nodes
            .iter()
            .filter(|node| node.state == NodeState::Live)
            .count();
        gauge!(names::CLUSTER_NODES).set(live as f64);
        gauge!(names::SHARDS_OPEN).set(self.open.len() as f64);
        let owners = self
            .engine
            .shards()
            .all()
            .map(|shard| self.owner_status(shard, now));
        self.cluster.update(Standing {
            node: self.me.name.clone(),
            resigned: self.resigned,
            contact: self.view.contact(),
            lease: self.settings.lease,
            nodes,
            owners: owners.collect(),
        });
    }

    fn owner_status(&self, shard: ShardNumber, now: Instant) -> OwnerStatus {
        let own = |state, term| OwnerStatus {
            shard,
            owner: Some(self.me.name.clone()),
            address: Some(self.settings.address.clone()),
            term,
            state,
        };
        let term = self.open.get(&shard).copied();
        if let Some(state) = self.busy.get(&shard) {
            return own(*state, term.unwrap_or(0));
        }
        if let Some(term) = term {
            return own(OwnerState::Open, term);
        }
        let owner = self.view.owner(shard, now);
        match owner.filter(|owner| owner.node != self.me) {
            Some(OwnerRecord { term, node, .. }) => OwnerStatus {
                shard,
                owner: Some(node.name.clone()),
                address: self.view.address(node).map(str::to_owned),
                term: *term,
                state: OwnerState::Elsewhere,
            },
            None => OwnerStatus {
                shard,
                owner: None,
                address: None,
                term: self.view.recorded(shard).map_or(0, |owner| owner.term),
                state: OwnerState::None,
            },
        }
    }
}
