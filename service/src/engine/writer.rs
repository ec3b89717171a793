//! The writer of a space: one thread that owns the map.
//!
//! A round takes what waits in the queue, decodes it, puts each agent's samples in order, appends the
//! round's block to the journal, and only then applies it. Estimates leave at the end of the round;
//! the committer makes the block durable beside the next one.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use cogmap_proto::{Codec, Rejection, SampleBatch, SeqRange, SkipReason};
use cognitive_map::{AgentId, CognitiveMap, Event, InvalidSample, Label, Record, Sample};

use super::block::{BlockWriter, Entry};
use super::checkpointer::Checkpointer;
use super::committer::{Answer, Commit, Mark};
use super::counters::{self, Drop, SpaceCounters};
use super::desk::AgentDesk;
use super::message::{Body, Inbox, IngestError, Message, Reply, Samples};
use super::readout::{self, skip_reason, skip_reason_of_wire};
use super::recovery::Recovered;
use super::sequencer::{Sequencer, SessionOrder};
use super::space::Shared;
use super::trajectory;
use crate::decode;
use crate::store::ChunkKey;

/// Most messages of a round: it bounds how old an estimate can be when it leaves.
const ROUND_MESSAGES_MAX: usize = 2048;
/// How long a writer waits for a message before it looks after gaps and wishes.
const PATIENCE: Duration = Duration::from_millis(100);
/// Most samples of all agents that wait for earlier ones: a bound on memory, whoever sends.
const WAITING_MAX: usize = 16_384;

/// The thread's state.
pub(crate) struct Writer {
    shared: Arc<Shared>,
    inbox: Inbox,
    commits: Sender<Commit>,
    checkpointer: Checkpointer,
    counters: SpaceCounters,

    map: CognitiveMap,
    agents: Vec<AgentSlot>,
    by_name: BTreeMap<Box<str>, usize>,
    next_block: u64,
    interval_ns: i64,
    /// Samples of all agents that wait for earlier ones.
    waiting: usize,

    /// The round under way; emptied and used again.
    block: BlockWriter,
    records: Vec<Record>,
    answers: Vec<Answer>,
    events: Vec<Event>,
}

/// What the writer knows of an agent beside the map: how its samples stand before the journal.
struct AgentSlot {
    desk: Arc<AgentDesk>,
    sequencer: Sequencer<Pending>,
    /// Stamp of the latest accepted sample of the session.
    latest_ns: i64,
    /// Whether this round changed the agent in the map.
    applied: bool,
    /// Whether its watermark is to be sent although nothing new becomes durable.
    remind: bool,
}

/// A sample that came, and what it means.
type Pending = (cogmap_proto::Sample, Result<Sample, InvalidSample>);

impl Writer {
    pub(crate) fn new(
        shared: Arc<Shared>,
        inbox: Inbox,
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
        let mut writer = Self {
            shared,
            inbox,
            commits,
            checkpointer,
            counters,
            map,
            agents: Vec::new(),
            by_name: BTreeMap::new(),
            next_block,
            interval_ns,
            waiting: 0,
            block: BlockWriter::new(),
            records: Vec::new(),
            answers: Vec::new(),
            events: Vec::new(),
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
    pub(crate) fn run(mut self) {
        self.greet();
        let mut messages = Vec::new();
        let mut next_look = Instant::now() + PATIENCE;
        loop {
            // What came before the space closed is still taken: the flag is read before the queue.
            let closing = self.shared.closing.load(Ordering::Acquire);
            let patience = if closing { Duration::ZERO } else { PATIENCE };
            self.inbox
                .drain(&mut messages, ROUND_MESSAGES_MAX, patience);
            let drained = messages.len();
            let now = Instant::now();
            self.round(&mut messages, now);
            if now >= next_look {
                self.give_up_gaps(now);
                self.counters.sizes(&self.map, self.inbox.len());
                next_look = now + PATIENCE;
            }
            self.shared.serve_snapshots(&self.map);
            self.checkpointer.offer(self.next_block, &self.map, || {
                self.agents
                    .iter()
                    .map(|slot| slot.desk.recorder().clone())
                    .collect()
            });
            if closing && drained == 0 {
                break;
            }
        }
        self.checkpointer.finish(self.next_block, &self.map, || {
            self.agents
                .iter()
                .map(|slot| slot.desk.recorder().clone())
                .collect()
        });
    }

    /// After a start: tells everyone where each agent stands.
    fn greet(&self) {
        for slot in &self.agents {
            if let Some(agent) = self.map.agent(slot.desk.id())
                && let Some(readout) = readout::readout(&self.shared.name, agent, &self.map)
            {
                slot.desk.publish(readout);
            }
            self.remind(slot);
        }
    }

    fn round(&mut self, messages: &mut Vec<Message>, now: Instant) {
        for message in messages.drain(..) {
            if let Message::Samples(samples) = message {
                self.receive(samples, now);
            }
        }
        self.finish_round();
    }

    /// Journals and applies what the round has accepted, then publishes.
    fn finish_round(&mut self) {
        if !self.block.is_empty() {
            let bytes = self.block.bytes();
            match self
                .shared
                .store
                .append(self.shared.number, self.next_block, bytes)
            {
                Ok(()) => {
                    self.counters.journaled(bytes.len());
                    self.next_block += 1;
                    self.apply();
                }
                Err(error) => {
                    self.shared.health.fail(&error);
                    self.records.clear();
                }
            }
            self.block.clear();
        }
        self.publish();
    }

    fn receive(&mut self, samples: Samples, now: Instant) {
        let Samples { agent, body } = samples;
        let (batch, raw, reply) = match body {
            Body::Decoded(batch, reply) => (batch, None, Some(reply)),
            Body::Encoded(codec, bytes) => match codec.decode_batch(&bytes) {
                Ok(batch) => (batch, (codec == Codec::Postcard).then_some(bytes), None),
                Err(error) => {
                    tracing::debug!(space = %self.shared.name, %agent, %error, "undecodable message");
                    return counters::undecodable(&error);
                }
            },
        };
        if let Some(refusal) = self.shared.health.refusal() {
            self.counters.dropped(Drop::StoreFailed);
            return answer(reply, Err(refusal));
        }
        let Some(slot) = self.slot_of(&agent) else {
            self.counters.dropped(Drop::TooManyAgents);
            return answer(reply, Err(IngestError::TooManyAgents));
        };
        let sequencer = &mut self.agents[slot].sequencer;
        match sequencer.order_of(batch.session) {
            SessionOrder::Current => {}
            SessionOrder::Stale => {
                let current = sequencer.session();
                self.agents[slot].remind = true;
                self.counters.dropped(Drop::StaleSession);
                return answer(reply, Err(IngestError::StaleSession { current }));
            }
            SessionOrder::Newer => {
                if reply.is_some() && batch.first_seq > 0 {
                    let refusal = IngestError::Gap {
                        session: batch.session,
                        expected: 0,
                    };
                    return answer(reply, Err(refusal));
                }
                let abandoned = sequencer.begin(batch.session);
                self.waiting -= abandoned;
                self.agents[slot].latest_ns = i64::MIN;
                self.counters.abandoned(abandoned);
            }
        }
        let sequencer = &self.agents[slot].sequencer;
        if reply.is_some() && batch.first_seq > sequencer.next() {
            let refusal = IngestError::Gap {
                session: batch.session,
                expected: sequencer.next(),
            };
            return answer(reply, Err(refusal));
        }
        let duplicates = self.take(slot, batch, raw.as_deref(), now);
        if let Some(reply) = reply {
            let desk = Arc::clone(&self.agents[slot].desk);
            self.answers.push(Answer {
                reply,
                desk,
                duplicates,
            });
        }
    }

    /// The slot of an agent; a new one unless there are too many.
    fn slot_of(&mut self, name: &str) -> Option<usize> {
        if let Some(&slot) = self.by_name.get(name) {
            return Some(slot);
        }
        if self.agents.len() >= self.shared.agents_max {
            return None;
        }
        let label = Label::new(name).ok()?;
        let id = AgentId(u32::try_from(self.agents.len()).ok()?);
        self.block.push(&Entry::Enrol {
            agent: id.0,
            name: name.into(),
        });
        self.records.push(Record::Enrol {
            agent: id,
            name: label,
        });
        let desk = AgentDesk::new(id, name, 0, 0, trajectory::Recorder::default());
        Some(self.seat(desk, Sequencer::new(0, 0), i64::MIN))
    }

    fn seat(&mut self, desk: AgentDesk, sequencer: Sequencer<Pending>, latest_ns: i64) -> usize {
        let slot = self.agents.len();
        let desk = Arc::new(desk);
        self.by_name.insert(desk.name().into(), slot);
        self.shared.seat(Arc::clone(&desk));
        let slot_of_agent = AgentSlot {
            desk,
            sequencer,
            latest_ns,
            applied: false,
            remind: false,
        };
        self.agents.push(slot_of_agent);
        slot
    }

    /// Puts a batch in order and journals what is. Returns the number of duplicates.
    fn take(&mut self, slot: usize, batch: SampleBatch, raw: Option<&[u8]>, now: Instant) -> u64 {
        if self.agents[slot].sequencer.is_next(batch.first_seq)
            && self.take_whole(slot, &batch, raw)
        {
            return 0;
        }
        let session = batch.session;
        let pending = batch.samples.into_iter().map(|wire| {
            let sample = decode::sample(&wire);
            (wire, sample)
        });
        let mut accepted = Vec::new();
        let sequencer = &mut self.agents[slot].sequencer;
        let before = sequencer.waiting();
        let room = WAITING_MAX.saturating_sub(self.waiting);
        let window = self.shared.reorder_window.min(before + room);
        let offered = sequencer.offer(batch.first_seq, pending, window, now, |seq, pending| {
            accepted.push((seq, pending));
        });
        self.waiting = self.waiting + sequencer.waiting() - before;
        self.counters.offered(&offered);
        self.agents[slot].remind |= offered != super::sequencer::Offered::default();
        self.accept(slot, session, accepted);
        offered.duplicates
    }

    /// The common case: the batch continues the session and every sample makes sense, so it goes to
    /// the journal as it came. Changes nothing and returns false otherwise.
    fn take_whole(&mut self, slot: usize, batch: &SampleBatch, raw: Option<&[u8]>) -> bool {
        let agent = self.agents[slot].desk.id();
        let mut latest_ns = self.agents[slot].latest_ns;
        let before = self.records.len();
        for (seq, wire) in (batch.first_seq..).zip(&batch.samples) {
            match decode::sample(wire) {
                Ok(sample) if sample.stamp_ns >= latest_ns => {
                    latest_ns = sample.stamp_ns;
                    let session = batch.session;
                    self.records.push(Record::Sample {
                        agent,
                        session,
                        seq,
                        sample,
                    });
                }
                _ => {
                    self.records.truncate(before);
                    return false;
                }
            }
        }
        match raw {
            Some(payload) => self.block.push_postcard_batch(agent.0, payload),
            None => self.block.push(&Entry::Samples {
                agent: agent.0,
                batch: batch.clone(),
            }),
        }
        let slot = &mut self.agents[slot];
        slot.latest_ns = latest_ns;
        slot.sequencer.take_run(batch.samples.len() as u64);
        true
    }

    /// Journals samples that are in order now, refusing those that make no sense.
    fn accept(&mut self, slot: usize, session: u64, accepted: Vec<(u64, Pending)>) {
        let agent = self.agents[slot].desk.id();
        let mut run = SampleBatch {
            session,
            first_seq: 0,
            samples: Vec::new(),
        };
        for (seq, (wire, sample)) in accepted {
            let slot = &mut self.agents[slot];
            let refusal = match sample {
                Err(invalid) => skip_reason(cognitive_map::SkipReason::Invalid(invalid)),
                Ok(sample) if sample.stamp_ns < slot.latest_ns => SkipReason::TimeBackwards,
                Ok(sample) => {
                    slot.latest_ns = sample.stamp_ns;
                    if run.samples.is_empty() {
                        run.first_seq = seq;
                    }
                    run.samples.push(wire);
                    self.records.push(Record::Sample {
                        agent,
                        session,
                        seq,
                        sample,
                    });
                    continue;
                }
            };
            self.journal_run(agent, &mut run);
            self.skip(
                agent,
                session,
                SeqRange {
                    from: seq,
                    to: seq + 1,
                },
                refusal,
            );
        }
        self.journal_run(agent, &mut run);
    }

    fn journal_run(&mut self, agent: AgentId, run: &mut SampleBatch) {
        if !run.samples.is_empty() {
            let batch = SampleBatch {
                samples: std::mem::take(&mut run.samples),
                ..*run
            };
            self.block.push(&Entry::Samples {
                agent: agent.0,
                batch,
            });
        }
    }

    /// Journals that samples are refused for good.
    fn skip(&mut self, agent: AgentId, session: u64, range: SeqRange, reason: SkipReason) {
        let SeqRange { from, to } = range;
        self.block.push(&Entry::Skip {
            agent: agent.0,
            session,
            from,
            to,
            reason,
        });
        let reason_of_core = skip_reason_of_wire(reason);
        self.records.push(Record::Skip {
            agent,
            session,
            from,
            to,
            reason: reason_of_core,
        });
        self.counters.skipped(to - from, reason);
        let slot = &mut self.agents[agent.0 as usize];
        slot.remind = true;
        slot.desk
            .marks()
            .rejected(session, Rejection { range, reason });
    }

    /// Gives up samples that have been missing for too long.
    fn give_up_gaps(&mut self, now: Instant) {
        if self.shared.health.failed().is_some() {
            return;
        }
        for slot in 0..self.agents.len() {
            let (mut lost, mut accepted) = (None, Vec::new());
            let sequencer = &mut self.agents[slot].sequencer;
            let timeout = self.shared.gap_timeout;
            let (session, before) = (sequencer.session(), sequencer.waiting());
            sequencer.give_up(
                timeout,
                now,
                |range| lost = Some(range),
                |seq, pending| {
                    accepted.push((seq, pending));
                },
            );
            self.waiting = self.waiting + sequencer.waiting() - before;
            if let Some(range) = lost {
                let agent = self.agents[slot].desk.id();
                tracing::warn!(space = %self.shared.name, agent = self.agents[slot].desk.name(),
                    session, from = range.from, to = range.to, "samples lost");
                self.skip(agent, session, range, SkipReason::Lost);
                self.accept(slot, session, accepted);
            }
        }
        self.finish_round();
    }

    /// Applies the round's records: from here on they are part of the map.
    fn apply(&mut self) {
        for record in self.records.drain(..) {
            self.map.apply(&record, &mut self.events);
            let (Record::Sample { agent, .. }
            | Record::Skip { agent, .. }
            | Record::Enrol { agent, .. }) = &record;
            let slot = &mut self.agents[agent.0 as usize];
            slot.applied = true;
            let Some(agent_in_map) = self.map.agent(*agent) else {
                continue;
            };
            // The chunk is stored before the lock is released, so a reader that takes the rows here
            // first and the chunks in the store afterwards misses none.
            let mut recorder = slot.desk.recorder();
            if let Some(chunk) = recorder.note(&record, agent_in_map, self.interval_ns) {
                let first_stamp_ns = chunk.rows[0].stamp_ns;
                let key = ChunkKey {
                    agent: agent.0,
                    session: chunk.session,
                    first_stamp_ns,
                };
                let bytes = trajectory::encode(&chunk.rows);
                if let Err(error) = self.shared.store.put_chunk(self.shared.number, key, &bytes) {
                    self.shared.health.fail(&error);
                }
            }
        }
    }

    /// Publishes what the round brought about, and hands it to the committer.
    fn publish(&mut self) {
        let space = &self.shared.name;
        let mut commit = Commit {
            space: Arc::clone(space),
            samples: 0,
            marks: Vec::new(),
            answers: std::mem::take(&mut self.answers),
        };
        for slot in &mut self.agents {
            if !slot.applied && !slot.remind {
                continue;
            }
            let (applied, remind) = (
                std::mem::take(&mut slot.applied),
                std::mem::take(&mut slot.remind),
            );
            let Some(agent) = self.map.agent(slot.desk.id()) else {
                continue;
            };
            let (session, next) = (agent.session(), agent.next_seq());
            if applied {
                if let Some(readout) = readout::readout(space, agent, &self.map) {
                    let readout = slot.desk.publish(readout);
                    self.shared.outlet.estimate(&readout.estimate);
                }
                commit.marks.push(Mark {
                    desk: Arc::clone(&slot.desk),
                    session,
                    next,
                });
            }
            let sequencer = &slot.sequencer;
            let waiting = sequencer.waiting() as u64;
            if sequencer.session() == session {
                commit.samples +=
                    slot.desk
                        .marks()
                        .applied(session, next, waiting, sequencer.gap());
            } else {
                let gap = sequencer.gap();
                slot.desk
                    .marks()
                    .applied(sequencer.session(), sequencer.next(), waiting, gap);
            }
            if remind {
                self.shared
                    .outlet
                    .watermark(space, slot.desk.name(), &slot.desk.watermark());
            }
        }
        self.counters
            .round(commit.samples, commit.marks.len() as u64);
        self.shared
            .revision
            .store(self.map.revision(), Ordering::Release);
        self.publish_events();
        if !commit.marks.is_empty() || !commit.answers.is_empty() {
            // The committer outlives the writers; without it nothing could be acknowledged anyway.
            let _ = self.commits.send(commit);
        }
    }

    fn publish_events(&mut self) {
        for event in self.events.drain(..) {
            if let Some(event) = readout::event(&self.shared.name, &self.map, &event) {
                self.shared.outlet.event(&event);
                // No one listening is no fault.
                let _ = self.shared.events.send(Arc::new(event));
            }
        }
    }

    fn remind(&self, slot: &AgentSlot) {
        let watermark = slot.desk.watermark();
        self.shared
            .outlet
            .watermark(&self.shared.name, slot.desk.name(), &watermark);
    }
}

fn answer(reply: Option<Reply>, answer: Result<cogmap_proto::IngestAnswer, IngestError>) {
    if let Some(reply) = reply {
        // Whoever asked may have gone.
        let _ = reply.send(answer);
    }
}
