//! What came becomes samples in order, each agent's by itself.

use std::sync::Arc;
use std::time::Instant;

use cogmap_proto::{Codec, Rejection, SampleBatch, SeqRange, SkipReason};
use cognitive_map::Record;

use super::{WAITING_MAX, Writer};
use crate::decode;
use crate::engine::committer::Answer;
use crate::engine::counters::{self, Drop};
use crate::engine::message::{IngestError, Request};
use crate::engine::sequencer::{Offered, SessionOrder, Window};
use crate::journal::Entry;

impl Writer {
    /// Takes a message of Zenoh.
    pub(super) fn receive(&mut self, agent: &str, codec: Codec, payload: &[u8], now: Instant) {
        match codec.decode_batch(payload) {
            Ok(batch) => {
                let raw = (codec == Codec::Postcard).then_some(payload);
                // Nobody waits for an answer; a refusal is counted.
                let _ = self
                    .slot_for(agent, &batch, now)
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
        match self.slot_for_request(&agent, &batch, now) {
            Ok(slot) => {
                let duplicates = self.take(slot, batch, None, now);
                self.answers.push(Answer {
                    reply,
                    view: Arc::clone(&self.agents[slot].view),
                    duplicates,
                });
            }
            Err(refusal) => {
                // Whoever asked may have gone.
                let _ = reply.send(Err(refusal));
            }
        }
    }

    fn slot_for_request(
        &mut self,
        agent: &str,
        batch: &SampleBatch,
        now: Instant,
    ) -> Result<usize, IngestError> {
        let gap = |session, expected| Err(IngestError::Gap { session, expected });
        // A session that begins with a gap must not end the one before it.
        let begins = self.by_name.get(agent).is_none_or(|&slot| {
            self.agents[slot].sequencer.order_of(batch.session) == SessionOrder::Newer
        });
        if begins && batch.first_seq > 0 {
            return gap(batch.session, 0);
        }
        let slot = self.slot_for(agent, batch, now)?;
        let expected = self.agents[slot].sequencer.next();
        if batch.first_seq > expected {
            return gap(batch.session, expected);
        }
        Ok(slot)
    }

    /// The slot that takes a batch, its session begun where it is a new one.
    fn slot_for(
        &mut self,
        agent: &str,
        batch: &SampleBatch,
        now: Instant,
    ) -> Result<usize, IngestError> {
        if let Some(refusal) = self.shared.health.refusal() {
            self.counters.dropped(Drop::StoreFailed);
            return Err(refusal);
        }
        let known = self.by_name.get(agent).copied();
        let current = known.map(|slot| self.agents[slot].sequencer.session());
        // Before anything is journaled, so that no replay depends on the clock.
        if current.is_none_or(|current| batch.session > current)
            && let Err(refusal) = self.shared.sessions.check(batch.session)
        {
            self.counters.dropped(Drop::SessionInFuture);
            return Err(refusal);
        }
        let Some(slot) = known.or_else(|| self.enrol(agent, now)) else {
            self.counters.dropped(Drop::TooManyAgents);
            return Err(IngestError::TooManyAgents);
        };
        self.agents[slot].heard = now;
        self.agents[slot].view.hear(now);
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
        let mut others = self.waiting;
        others.recount(before, Window::NONE);
        // How far ahead samples may be is the agent's own, whatever room others leave.
        let reach = self.shared.reorder_window as u64;
        let room = WAITING_MAX.fair_share(others);
        let offered = sequencer.offer(
            batch.first_seq,
            batch.samples,
            (reach, room),
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
        tracing::warn!(space = %self.shared.name, agent = slot.view.name(), session,
            from = range.from, next = slot.sequencer.next(), "samples too far ahead refused");
        slot.remind = true;
        let rejection = Rejection { range, reason };
        slot.view.marks().rejected(session, rejection);
    }

    /// The common case: the batch continues the session and every sample makes sense, so it goes to
    /// the journal as it came. Changes nothing and returns false otherwise.
    fn take_whole(&mut self, slot: usize, batch: &SampleBatch, raw: Option<&[u8]>) -> bool {
        let agent = self.agents[slot].view.id();
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
