//! What is kept of the past, so that it can be smoothed.

use super::CognitiveMap;
use super::apply::Fold;
use crate::keyframes::{Moment, Refined};
use crate::memory::place::PlaceId;
use pose_graph::PoseGraph;

/// Number of the frame that is the map's.
const MAP: usize = 0;

impl Fold<'_> {
    /// The agent at the sample that is being applied.
    pub(super) fn moment(&self) -> Moment {
        let agent = self.agent_id.0;
        let pose = self.estimator.in_frame(agent);
        Moment {
            agent,
            seq: self.agent.next_seq.saturating_sub(1),
            stamp_ns: self.stamp_ns,
            pose: *pose.unwrap_or(self.agent.body.in_map()),
        }
    }

    /// Remembers who was set aside with the latest call of the estimate.
    pub(super) fn remember_who_was_set_aside(&mut self) {
        for agent in self.estimator.take_set_aside() {
            self.chronicle.set_aside(agent);
        }
    }

    /// Remembers the sightings of agents that counted with the latest call of the estimate, the landmarks that turned out to be one,
    /// and the frames that it laid into others.
    pub(super) fn remember_what_was_settled(&mut self) {
        self.remember_who_was_set_aside();
        for settled in self.estimator.take_settled() {
            if settled.accepted {
                self.chronicle.graph.sighted(
                    settled.observer,
                    settled.target,
                    settled.stamp_ns,
                    &settled.relation,
                    &settled.variance.fixed_rows::<3>(0).into_owned(),
                );
            }
        }
        let same = self.estimator.take_same();
        if !same.is_empty() {
            self.chronicle.graph.merge_landmarks(&same);
            for (label, name) in &same {
                self.landmarks.unite(label, name, self.revision);
            }
        }
        for merged in self.estimator.take_merged() {
            for &agent in &merged.agents {
                if merged.into == MAP {
                    self.chronicle.graph.placed(agent, &merged.pose);
                } else {
                    self.chronicle.graph.transformed(agent, &merged.pose);
                }
            }
        }
    }
}

impl Fold<'_> {
    /// Relaxes the past when enough has come since the last time to pay for it and matches wait, and tells the
    /// estimate where the agents are by those that are believed.
    ///
    /// When that is depends on the records alone.
    pub(super) fn believe_matches(&mut self) {
        if !self.chronicle.graph.is_due() {
            return;
        }
        for correction in self.chronicle.graph.relax() {
            if let Some(covariance) = correction.covariance {
                self.estimator
                    .fix(correction.agent, &correction.pose, &covariance);
                self.remember_who_was_set_aside();
            }
        }
    }
}

impl Fold<'_> {
    /// Moves some of the places that turned out to lie elsewhere.
    pub(super) fn move_places(&mut self) {
        for (place, at) in self.chronicle.graph.moved_places() {
            self.places.put(PlaceId(place), &at, self.revision);
        }
    }
}

impl CognitiveMap {
    /// Where all agents were and all landmarks are, by everything that was seen until now: the whole map
    /// relaxed. A function of the map alone; takes time in proportion to what is remembered.
    pub fn refined(&self) -> Refined {
        self.chronicle.graph.refine()
    }

    /// What is remembered of the past, relaxed, as nodes and links: for other programs. As long in the making as
    /// [`refined`](Self::refined).
    pub fn experience_map(&self) -> PoseGraph {
        self.chronicle.graph.experience_map()
    }

    /// Number of matches and revisits that are believed.
    pub fn closure_count(&self) -> usize {
        self.chronicle.graph.n_matches_believed()
    }
}
