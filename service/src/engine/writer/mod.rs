//! The writer of a space: one thread that owns the map.
//!
//! A round takes what waits in the queue, decodes it, puts each agent's samples in order, appends the
//! round's block to the journal, and only then applies it. Estimates leave at the end of the round;
//! the committer makes the block durable beside the next one.

mod journal;
mod objects;
mod publish;
mod receive;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use cognitive_map::{CognitiveMap, Event, Record};

use super::block::BlockWriter;
use super::checkpointer::Checkpointer;
use super::committer::{Answer, Commit};
use super::counters::SpaceCounters;
use super::desk::AgentDesk;
use super::message::{Call, ObjectReply};
use super::queue::{Inbox, Message};
use super::recovery::Recovered;
use super::sequencer::{Sequencer, Window};
use super::space::Shared;
use super::trajectory;
use crate::store::ChunkKey;

/// Most messages of a round, and the number of records that ends it: they bound how old an estimate
/// can be when it leaves, and how long a reader waits for a snapshot.
const ROUND_MESSAGES_MAX: usize = 2048;
const ROUND_RECORDS_MAX: usize = 16_384;
/// How long a writer waits for a message before it looks after gaps and wishes.
const PATIENCE: Duration = Duration::from_millis(100);
/// Most samples of all agents that wait for earlier ones, and the most memory that they take
/// \[bytes\]: bounds whoever sends.
const WAITING_MAX: Window = Window {
    samples: 16_384,
    bytes: 64 << 20,
};

/// The thread's state.
pub(crate) struct Writer {
    shared: Arc<Shared>,
    commits: Sender<Commit>,
    checkpointer: Checkpointer,
    counters: SpaceCounters,

    map: CognitiveMap,
    agents: Vec<AgentSlot>,
    by_name: BTreeMap<Box<str>, usize>,
    next_block: u64,
    interval_ns: i64,
    /// Number of the next lesson about an object, or wish to forget one.
    next_lesson: u64,
    /// How many samples of all agents wait for earlier ones, and what they take.
    waiting: Window,

    /// The round under way; emptied and used again.
    block: BlockWriter,
    records: Vec<Record>,
    answers: Vec<Answer>,
    objects: Vec<ObjectReply>,
    events: Vec<Event>,
    /// Samples that it has applied.
    applied: u64,
}

/// What the writer knows of an agent beside the map: how its samples stand before the journal.
struct AgentSlot {
    desk: Arc<AgentDesk>,
    sequencer: Sequencer<cogmap_proto::Sample>,
    /// Stamp of the latest accepted sample of the session.
    latest_ns: i64,
    /// Whether this round changed the agent in the map.
    applied: bool,
    /// Whether its watermark is to be sent although nothing new becomes durable.
    remind: bool,
}

impl Writer {
    pub(crate) fn new(
        shared: Arc<Shared>,
        commits: Sender<Commit>,
        checkpointer: Checkpointer,
        recovered: Recovered,
    ) -> Self {
        let Recovered {
            map,
            recorders,
            next_block,
            ..
        } = recovered;
        let counters = SpaceCounters::new(&shared.name);
        let interval_ns = shared.interval_ns;
        let next_lesson = map.lessons();
        let mut writer = Self {
            shared,
            commits,
            checkpointer,
            counters,
            map,
            agents: Vec::new(),
            by_name: BTreeMap::new(),
            next_block,
            interval_ns,
            next_lesson,
            waiting: Window::NONE,
            block: BlockWriter::new(),
            records: Vec::new(),
            answers: Vec::new(),
            objects: Vec::new(),
            events: Vec::new(),
            applied: 0,
        };
        let mut recorders = recorders.into_iter();
        let known: Vec<_> = writer
            .map
            .agents()
            .map(|(id, agent)| {
                let recorder = recorders.next().unwrap_or_default();
                let name = agent.name().as_str();
                let desk = AgentDesk::new(id, name, agent.session(), agent.next_seq(), recorder);
                let sequencer = Sequencer::new(agent.session(), agent.next_seq());
                (desk, sequencer, agent.stamp_ns().unwrap_or(i64::MIN))
            })
            .collect();
        for (desk, sequencer, latest_ns) in known {
            writer.seat(desk, sequencer, latest_ns);
        }
        writer
    }

    /// Runs until the space closes.
    pub(crate) fn run(mut self, mut inbox: Inbox) {
        self.greet();
        let mut next_look = Instant::now() + PATIENCE;
        loop {
            // What came before the space closed is still taken: the flag is read before the queue.
            let closing = self.shared.closing.load(Ordering::Acquire);
            let patience = if closing { Duration::ZERO } else { PATIENCE };
            let waiting = inbox.wait(patience);
            let now = Instant::now();
            self.round(&mut inbox, now);
            if now >= next_look {
                self.give_up_gaps(now);
                self.counters.sizes(&self.map, waiting);
                next_look = now + PATIENCE;
            }
            self.shared.serve_snapshots(&self.map);
            self.checkpointer.offer(self.next_block, &self.map, || {
                self.agents
                    .iter()
                    .map(|slot| slot.desk.recorder().clone())
                    .collect()
            });
            if closing && waiting == 0 {
                break;
            }
        }
        self.counters.gone();
        self.checkpointer.finish(self.next_block, &self.map, || {
            self.agents
                .iter()
                .map(|slot| slot.desk.recorder().clone())
                .collect()
        });
    }

    fn round(&mut self, inbox: &mut Inbox, now: Instant) {
        for _ in 0..ROUND_MESSAGES_MAX {
            match inbox.next() {
                Some(Message::Encoded {
                    agent,
                    codec,
                    payload,
                }) => self.receive(agent, codec, payload, now),
                Some(Message::Call(Call::Samples(request))) => self.receive_request(request, now),
                Some(Message::Call(Call::Object(request))) => self.receive_object(request),
                None => break,
            }
            if self.records.len() >= ROUND_RECORDS_MAX {
                break;
            }
        }
        self.finish_round();
    }

    /// Journals and applies what the round has accepted, then publishes.
    fn finish_round(&mut self) {
        if !self.block.is_empty() {
            let bytes = self.block.bytes();
            let is_sample = |record: &&Record| matches!(record, Record::Sample { .. });
            let samples = self.records.iter().filter(is_sample).count() as u64;
            let (space, block) = (self.shared.number, self.next_block);
            match self.shared.store.append(space, block, samples, bytes) {
                Ok(()) => {
                    self.counters.journaled(bytes.len());
                    self.next_block += 1;
                    self.apply();
                }
                Err(error) => {
                    self.shared.health.fail(&error);
                }
            }
            self.block.clear();
            self.records.clear();
        }
        self.publish();
    }

    /// Applies the round's records: from here on they are part of the map.
    fn apply(&mut self) {
        for record in &self.records {
            self.map.apply(record, &mut self.events);
            self.applied += u64::from(matches!(record, Record::Sample { .. }));
            let (Record::Sample { agent, .. }
            | Record::Skip { agent, .. }
            | Record::Enrol { agent, .. }) = record
            else {
                continue; // of no agent
            };
            let slot = &mut self.agents[agent.0 as usize];
            slot.applied = true;
            let Some(agent_in_map) = self.map.agent(*agent) else {
                continue;
            };
            // The chunk is stored before the lock is released, so a reader that takes the rows here
            // first and the chunks in the store afterwards misses none.
            let mut recorder = slot.desk.recorder();
            if let Some(chunk) = recorder.note(record, agent_in_map, self.interval_ns) {
                let first_stamp_ns = chunk.rows[0].stamp_ns;
                let key = ChunkKey {
                    agent: agent.0,
                    session: chunk.session,
                    first_stamp_ns,
                };
                let bytes = trajectory::encode(&chunk.rows);
                if let Err(error) = self.shared.store.put_chunk(self.shared.number, key, &bytes) {
                    self.shared.health.derived_fail(&error);
                }
            }
        }
    }
}
