//! What leaves the writer at the end of a round.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{AgentSlot, Writer};
use crate::encode;
use crate::engine::agent_view::Readout;
use crate::engine::committer::{Commit, Mark};
use crate::engine::counters::Standing;

impl Writer {
    /// Records the sizes of the space, and how its agents stand.
    pub(super) fn measure(&self, queued: usize) {
        self.counters.sizes(&self.map, queued);
        let mut standing = Standing::default();
        for slot in &self.agents {
            slot.view.stand(&mut standing);
        }
        self.counters.standing(&standing);
    }

    /// After a start: tells everyone where each agent stands.
    pub(super) fn publish_initial(&self) {
        self.measure(0);
        for slot in self.agents.iter().filter(|slot| !slot.removed) {
            let id = slot.view.id();
            if let Some(readout) = Readout::of(&self.shared.name, self.shared.term, &self.map, id) {
                slot.view.publish(readout);
            }
            self.remind(slot);
        }
    }

    /// Publishes what the round brought about, and hands it to the committer.
    pub(super) fn publish(&mut self) {
        let (space, term) = (&self.shared.name, self.shared.term);
        let mut commit = Commit {
            space: Arc::clone(space),
            samples: std::mem::take(&mut self.applied),
            marks: Vec::new(),
            answers: std::mem::take(&mut self.answers),
            changes: std::mem::take(&mut self.changes),
        };
        for slot in &mut self.agents {
            if !slot.applied && !slot.remind {
                continue;
            }
            let (applied, remind) = (
                std::mem::take(&mut slot.applied),
                std::mem::take(&mut slot.remind),
            );
            if slot.removed {
                continue;
            }
            let Some(agent) = self.map.agent(slot.view.id()) else {
                continue;
            };
            let (session, next) = (agent.session(), agent.next_seq());
            if applied {
                if let Some(readout) = Readout::of(space, term, &self.map, slot.view.id()) {
                    slot.view.publish(readout);
                    self.shared.publisher.estimate(space, &slot.view);
                }
                commit.marks.push(Mark {
                    view: Arc::clone(&slot.view),
                    session,
                    next,
                });
            }
            let sequencer = &slot.sequencer;
            let waiting = sequencer.waiting().samples as u64;
            // A session that has begun and has nothing applied yet is not the map's. What is only
            // followed does not pass the sequencer.
            let (session, next) = if self.shared.follows || sequencer.session() == session {
                (session, next)
            } else {
                (sequencer.session(), sequencer.next())
            };
            slot.view
                .marks()
                .applied(session, next, waiting, sequencer.gap());
            if remind {
                self.shared.publisher.watermark(space, &slot.view);
            }
        }
        if self.shared.live.is_watched() {
            self.shared.live.note_counts(encode::live_counts(&self.map));
        }
        self.counters
            .round(commit.samples, commit.marks.len() as u64);
        self.shared
            .revision
            .store(self.map.revision(), Ordering::Release);
        self.publish_events();
        if !commit.marks.is_empty() || !commit.answers.is_empty() || !commit.changes.is_empty() {
            // The committer outlives the writers; without it nothing could be acknowledged anyway.
            let _ = self.commits.send(commit);
        }
    }

    fn publish_events(&mut self) {
        for event in &self.published {
            self.shared.publisher.event(event);
        }
        self.shared.events.extend(self.published.drain(..));
    }

    fn remind(&self, slot: &AgentSlot) {
        self.shared
            .publisher
            .watermark(&self.shared.name, &slot.view);
    }
}
