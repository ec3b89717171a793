//! The writer of a space: one thread that owns the map.
//!
//! A round takes what waits in the queue, decodes it, puts each agent's samples in order, appends
//! the round's block to the journal, and only then applies it. Estimates leave at the end of the
//! round; the committer makes the block durable beside the next one.

mod agents;
mod follow;
mod instructions;
mod journal;
mod objects;
mod pace;
mod publish;
mod receive;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use cogmap_proto::EventRecord;
use cognitive_map::{CognitiveMap, Event, Record};

use agents::note_removal;

use super::agent_view::AgentView;
use super::checkpointer::{Beside, Checkpointer};
use super::committer::{Answer, Commit};
use super::counters::SpaceCounters;
use super::episodes::EndedEpisodes;
use super::message::{Call, Change};
use super::queue::{Inbox, Message};
use super::recovery::Recovered;
use super::sequencer::{Sequencer, Window};
use super::shared::Shared;
use super::trajectory;
use super::workers::Handover;
use crate::encode::{self, LatestEpisode};
use crate::journal::BlockWriter;
use crate::store::ChunkKey;
use pace::Pace;

/// Most messages of a round: of those, too, that bring no records.
const ROUND_MESSAGES_MAX: usize = 2048;
/// How long a writer waits for a message before it looks after gaps and wishes.
const PATIENCE: Duration = Duration::from_millis(100);
/// Most samples of all agents that wait for earlier ones, and the most memory that they take
/// \[bytes\]: bounds whoever sends. One agent may hold as much as is free.
const WAITING_MAX: Window = Window {
    samples: 16_384,
    bytes: 64 << 20,
};

/// The thread's state.
pub(crate) struct Writer {
    shared: Arc<Shared>,
    commits: Sender<Commit>,
    checkpointer: Checkpointer,
    handover: Handover,
    counters: SpaceCounters,

    map: CognitiveMap,
    /// By number, those that have been removed among them.
    agents: Vec<AgentSlot>,
    by_name: BTreeMap<Box<str>, usize>,
    /// Numbers of removed agents that go to those who come next.
    vacant: BTreeSet<usize>,
    /// Until when nobody makes room for another agent.
    full_until: Option<Instant>,
    next_block: u64,
    interval_ns: i64,
    /// Number of the next lesson about an object, or wish to forget one.
    next_lesson: u64,
    /// Number of the next instruction.
    next_instruction: u64,
    /// How many samples of all agents wait for earlier ones, and what they take.
    waiting: Window,
    pace: Pace,

    /// The round under way; emptied and used again.
    block: BlockWriter,
    records: Vec<Record>,
    answers: Vec<Answer>,
    changes: Vec<Change>,
    /// What the record under way brings about.
    events: Vec<Event>,
    /// What the round has brought about that is published.
    published: Vec<Arc<EventRecord>>,
    /// Samples that it has applied.
    applied: u64,
}

/// What the writer knows of an agent beside the map: how its samples stand before the journal.
struct AgentSlot {
    view: Arc<AgentView>,
    sequencer: Sequencer<cogmap_proto::Sample>,
    /// Stamp of the latest accepted sample of the session.
    latest_ns: i64,
    /// When a message of it came last.
    heard: Instant,
    /// Whether it has been removed.
    removed: bool,
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
        handover: Handover,
        recovered: Recovered,
    ) -> Self {
        let Recovered {
            map,
            recorders,
            episodes,
            next_block,
            ..
        } = recovered;
        let counters = SpaceCounters::new(&shared.name, &shared.live);
        let interval_ns = shared.interval_ns;
        let (next_lesson, next_instruction) = (map.lessons(), map.instructions());
        let mut writer = Self {
            shared,
            commits,
            checkpointer,
            handover,
            counters,
            map,
            agents: Vec::new(),
            by_name: BTreeMap::new(),
            vacant: BTreeSet::new(),
            full_until: None,
            next_block,
            interval_ns,
            next_lesson,
            next_instruction,
            waiting: Window::NONE,
            pace: Pace::new(),
            block: BlockWriter::new(),
            records: Vec::new(),
            answers: Vec::new(),
            changes: Vec::new(),
            events: Vec::new(),
            published: Vec::new(),
            applied: 0,
        };
        writer.restore_agents(recorders, episodes);
        writer.handover.offer(&writer.map);
        writer
    }

    /// Runs until the space closes.
    pub(crate) fn run(mut self, mut inbox: Inbox) {
        self.publish_initial();
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
                self.measure(waiting);
                self.handover.offer(&self.map);
                next_look = now + PATIENCE;
            }
            self.shared.serve_snapshots(&self.map);
            let (shared, agents) = (&self.shared, &self.agents);
            let beside = || beside(shared, agents);
            self.checkpointer.offer(self.next_block, &self.map, beside);
            if closing && waiting == 0 {
                break;
            }
        }
        self.counters.gone();
        let beside = || beside(&self.shared, &self.agents);
        self.checkpointer.finish(self.next_block, &self.map, beside);
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
                Some(Message::Call(Call::Removal(request))) => self.receive_removal(request),
                Some(Message::Call(Call::Instruction(request))) => {
                    self.receive_instruction(request);
                }
                None => break,
            }
            if self.pace.is_over(self.records.len(), now.elapsed()) {
                break;
            }
        }
        let records = self.records.len();
        self.finish_round();
        self.pace.note(records, now.elapsed());
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
        let is_watched = self.shared.live.is_watched();
        for record in &self.records {
            self.map.apply(record, &mut self.events);
            self.handover.offer(&self.map);
            if is_watched
                && let Record::Sample { agent, sample, .. } = record
                && let Some(sighting) = encode::live_sighting(&self.map, *agent, sample)
            {
                self.shared.live.note_sighting(sighting);
            }
            for event in &self.events {
                self.counters.event(&self.map, event);
                let change = encode::ended_episode(&self.shared.name, &self.map, event);
                if let Some(LatestEpisode(episode)) = change {
                    let slot = &self.agents[event.agent.0 as usize];
                    slot.view.put_ended_episode(episode);
                }
            }
            let records = encode::event_records(&self.shared.name, &self.map, &self.events);
            self.published.extend(records.map(Arc::new));
            self.events.clear();
            self.applied += u64::from(matches!(record, Record::Sample { .. }));
            let (Record::Sample { agent, .. }
            | Record::Skip { agent, .. }
            | Record::Enrol { agent, .. }
            | Record::Remove { agent }) = record
            else {
                continue; // of no agent
            };
            if matches!(record, Record::Remove { .. }) {
                note_removal(
                    &self.shared,
                    &self.map,
                    &mut self.vacant,
                    &self.agents[agent.0 as usize],
                );
            }
            let slot = &mut self.agents[agent.0 as usize];
            slot.applied = true;
            let Some(agent_in_map) = self.map.agent(*agent) else {
                continue;
            };
            // The chunk is stored before the lock is released, so a reader that takes the rows here
            // first and the chunks in the store afterwards misses none.
            let mut recorder = slot.view.recorder();
            if let Some(chunk) = recorder.note(record, agent_in_map, self.interval_ns) {
                let first_stamp_ns = chunk.rows[0].stamp_ns;
                let key = ChunkKey {
                    agent: agent.0,
                    session: chunk.session,
                    first_stamp_ns,
                };
                let bytes = trajectory::chunk_bytes(&chunk.rows);
                if let Err(error) = self.shared.store.put_chunk(self.shared.number, key, &bytes) {
                    self.shared.health.derived_fail(&error);
                }
            }
        }
    }
}

/// What a checkpoint holds beside the map.
fn beside(shared: &Shared, agents: &[AgentSlot]) -> Beside {
    Beside {
        recorders: { agents.iter() }
            .map(|slot| slot.view.recorder().clone())
            .collect(),
        events: shared.events.ring(),
        episodes: EndedEpisodes(
            { agents.iter() }
                .map(|slot| slot.view.ended_episode())
                .collect(),
        ),
    }
}
