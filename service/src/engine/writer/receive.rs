//! What came becomes samples in order, each agent's by itself.

use std::sync::Arc;
use std::time::Instant;

use cogmap_proto::{Codec, Rejection, Sample, SampleBatch, SeqRange, SkipReason};
use cognitive_map::{AgentId, Label, Record};

use super::{AgentSlot, WAITING_MAX, Writer};
use crate::decode;
use crate::engine::block::Entry;
use crate::engine::committer::Answer;
use crate::engine::counters::{self, Drop};
use crate::engine::desk::AgentDesk;
use crate::engine::message::{IngestError, Request};
use crate::engine::sequencer::{Offered, Sequencer, SessionOrder, Window};
use crate::engine::trajectory;

impl Writer {
    /// Takes a message of Zenoh.
    pub(super) fn receive(&mut self, agent: &str, codec: Codec, payload: &[u8], now: Instant) {
        match codec.decode_batch(payload) {
            Ok(batch) => {
                let raw = (codec == Codec::Postcard).then_some(payload);
                // Nobody waits for an answer; a refusal is counted.
                let _ = self
                    .slot_for(agent, &batch)
                    .map(|slot| self.take(slot, batch, raw, now));
            }
            Err(error) => {
                let key = cogmap_proto::samples_key(&self.shared.name, agent);
                counters::undecodable(&key, &error);
            }
        }
    }

    /// Takes a request of HTTP. Samples beyond a gap are not kept waiting: whoever can be answered
    /// is told what is missing.
    pub(super) fn receive_request(&mut self, request: Request, now: Instant) {
        let Request {
            agent,
            batch,
            reply,
        } = request;
        match self.slot_for_request(&agent, &batch) {
            Ok(slot) => {
                let duplicates = self.take(slot, batch, None, now);
                self.answers.push(Answer {
                    reply,
                    desk: Arc::clone(&self.agents[slot].desk),
                    duplicates,
                });
            }
            Err(refusal) => {
                // Whoever asked may have gone.
                let _ = reply.send(Err(refusal));
            }
        }
    }

    fn slot_for_request(&mut self, agent: &str, batch: &SampleBatch) -> Result<usize, IngestError> {
        let gap = |session, expected| Err(IngestError::Gap { session, expected });
        // A session that begins with a gap must not end the one before it.
        let begins = self.by_name.get(agent).is_none_or(|&slot| {
            self.agents[slot].sequencer.order_of(batch.session) == SessionOrder::Newer
        });
        if begins && batch.first_seq > 0 {
            return gap(batch.session, 0);
        }
        let slot = self.slot_for(agent, batch)?;
        let expected = self.agents[slot].sequencer.next();
        if batch.first_seq > expected {
            return gap(batch.session, expected);
        }
        Ok(slot)
    }

    /// The slot that takes a batch, its session begun where it is a new one.
    fn slot_for(&mut self, agent: &str, batch: &SampleBatch) -> Result<usize, IngestError> {
        if let Some(refusal) = self.shared.health.refusal() {
            self.counters.dropped(Drop::StoreFailed);
            return Err(refusal);
        }
        let Some(slot) = self.slot_of(agent) else {
            self.counters.dropped(Drop::TooManyAgents);
            return Err(IngestError::TooManyAgents);
        };
        let sequencer = &mut self.agents[slot].sequencer;
        match sequencer.order_of(batch.session) {
            SessionOrder::Current => {}
            SessionOrder::Stale => {
                let current = sequencer.session();
                self.agents[slot].remind = true;
                self.counters.dropped(Drop::StaleSession);
                return Err(IngestError::StaleSession { current });
            }
            SessionOrder::Newer => {
                let abandoned = sequencer.begin(batch.session);
                self.waiting.recount(abandoned, Window::NONE);
                self.agents[slot].latest_ns = i64::MIN;
                self.counters.abandoned(abandoned.samples);
            }
        }
        Ok(slot)
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

    pub(super) fn seat(
        &mut self,
        desk: AgentDesk,
        sequencer: Sequencer<Sample>,
        latest_ns: i64,
    ) -> usize {
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
        let count = batch.samples.len();
        if { &self.agents[slot].sequencer }.is_out_of_reach(batch.first_seq, count) {
            self.refuse_leap(slot, batch.session, batch.first_seq, count);
            return 0;
        }
        if self.agents[slot].sequencer.is_next(batch.first_seq)
            && self.take_whole(slot, &batch, raw)
        {
            return 0;
        }
        let session = batch.session;
        let mut accepted = Vec::new();
        let sequencer = &mut self.agents[slot].sequencer;
        let before = sequencer.waiting();
        // What others leave, and what is its own already.
        let mut window = WAITING_MAX.beside(self.waiting);
        window.recount(Window::NONE, before);
        window.samples = window.samples.min(self.shared.reorder_window);
        let offered = sequencer.offer(
            batch.first_seq,
            batch.samples,
            window,
            now,
            |seq, sample| {
                accepted.push((seq, sample));
            },
        );
        self.waiting.recount(before, sequencer.waiting());
        self.counters.offered(&offered);
        self.agents[slot].remind |= offered != Offered::default();
        self.accept(slot, session, accepted);
        offered.duplicates
    }

    /// Tells that samples leap too far ahead. The journal hears nothing of it, for nothing has
    /// changed.
    fn refuse_leap(&mut self, slot: usize, session: u64, first: u64, count: usize) {
        let range = SeqRange {
            from: first,
            to: first.saturating_add(count as u64),
        };
        let reason = SkipReason::SequenceLeap;
        self.counters.skipped(count as u64, reason);
        let slot = &mut self.agents[slot];
        tracing::warn!(space = %self.shared.name, agent = slot.desk.name(), session,
            from = range.from, next = slot.sequencer.next(), "samples too far ahead refused");
        slot.remind = true;
        let rejection = Rejection { range, reason };
        slot.desk.marks().rejected(session, rejection);
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
}
