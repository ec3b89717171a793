//! What leaves the writer at the end of a round.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{AgentSlot, Writer};
use crate::engine::committer::{Commit, Mark};
use crate::engine::readout;

impl Writer {
    /// After a start: tells everyone where each agent stands.
    pub(super) fn greet(&self) {
        self.counters.sizes(&self.map, 0);
        for slot in self.agents.iter().filter(|slot| !slot.removed) {
            let id = slot.desk.id();
            if let Some(readout) = readout::readout(&self.shared.name, &self.map, id) {
                slot.desk.publish(readout);
            }
            self.remind(slot);
        }
    }

    /// Publishes what the round brought about, and hands it to the committer.
    pub(super) fn publish(&mut self) {
        let space = &self.shared.name;
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
            let Some(agent) = self.map.agent(slot.desk.id()) else {
                continue;
            };
            let (session, next) = (agent.session(), agent.next_seq());
            if applied {
                if let Some(readout) = readout::readout(space, &self.map, slot.desk.id()) {
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
            let waiting = sequencer.waiting().samples as u64;
            // A session that has begun and has nothing applied yet is not the map's.
            let (session, next) = if sequencer.session() == session {
                (session, next)
            } else {
                (sequencer.session(), sequencer.next())
            };
            slot.desk
                .marks()
                .applied(session, next, waiting, sequencer.gap());
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
        if !commit.marks.is_empty() || !commit.answers.is_empty() || !commit.changes.is_empty() {
            // The committer outlives the writers; without it nothing could be acknowledged anyway.
            let _ = self.commits.send(commit);
        }
    }

    fn publish_events(&mut self) {
        for event in self.events.drain(..) {
            self.counters.event(&self.map, &event);
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
