//! Samples in order become entries of the journal and records of the map, or are refused for good.

use std::time::Instant;

use cogmap_proto::{Rejection, Sample, SampleBatch, SeqRange};
use cognitive_map::{AgentId, Record, SkipReason};

use super::Writer;
use crate::decode;
use crate::encode;
use crate::journal::Entry;

impl Writer {
    /// Journals samples that are in order now, refusing those that make no sense.
    pub(super) fn accept(&mut self, slot: usize, session: u64, accepted: Vec<(u64, Sample)>) {
        let agent = self.agents[slot].view.id();
        let mut run = SampleBatch {
            session,
            first_seq: 0,
            samples: Vec::new(),
        };
        for (seq, wire) in accepted {
            let slot = &mut self.agents[slot];
            let refusal = match decode::sample(&wire) {
                Err(invalid) => SkipReason::Invalid(invalid),
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
        let published = encode::skip_reason(reason);
        self.block.push(&Entry::Skip {
            agent: agent.0,
            session,
            from,
            to,
            reason: published,
        });
        self.records.push(Record::Skip {
            agent,
            session,
            from,
            to,
            reason,
        });
        self.counters.skipped(to - from, published);
        let slot = &mut self.agents[agent.0 as usize];
        slot.remind = true;
        let rejection = Rejection {
            range,
            reason: published,
        };
        slot.view.marks().rejected(session, rejection);
    }

    /// Gives up samples that have been missing for too long.
    pub(super) fn give_up_gaps(&mut self, now: Instant) {
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
            self.waiting.recount(before, sequencer.waiting());
            if let Some(range) = lost {
                let agent = self.agents[slot].view.id();
                tracing::warn!(space = %self.shared.name, agent = self.agents[slot].view.name(),
                    session, from = range.from, to = range.to, "samples lost");
                self.skip(agent, session, range, SkipReason::Lost);
                self.accept(slot, session, accepted);
            }
        }
        self.finish_round();
    }
}
