//! Sightings of landmarks, agents and own samples.

use super::apply::Fold;
use crate::event::EventKind;
use crate::input::{Label, Relation, Sighting, Target};
use crate::memory::landmark::{Landmark, PositionEstimate};

impl Fold<'_> {
    /// A target was seen.
    pub(super) fn sighting(&mut self, sighting: &Sighting) {
        self.agent.sightings += 1;
        match &sighting.target {
            Target::Landmark(label) => {
                self.define_frame();
                self.landmark(label, &sighting.relation);
            }
            Target::Agent(name) => self.other_agent(name, &sighting.relation),
            Target::OwnSample(seq) => {
                // It waits until it is found in agreement with the map.
                let moment = self.moment();
                let is_remembered = self
                    .keyframes
                    .graph
                    .closure(&moment, *seq, &sighting.relation);
                self.agent.forgotten_matches += u64::from(!is_remembered);
                return;
            }
        }
        self.update_pose();
        if self.agent.placed() {
            self.place_landmarks();
        }
    }

    /// A landmark was seen.
    fn landmark(&mut self, label: &Label, relation: &Relation) {
        let agent = self.agent_id.0;
        let (stamp_ns, effects) = (self.stamp_ns, &mut self.effects);
        let outcome = self
            .estimator
            .landmark(agent, stamp_ns, label, relation, effects);
        self.apply_effects();
        // The label may just have turned out to be another name of a landmark.
        let name = self.estimator.name_of(label);
        if outcome.accepted
            && self.agent.placed()
            && let Some(landmark) = self.landmarks.by_label(name.as_str())
        {
            self.landmarks
                .see(landmark, self.stamp_ns, agent, self.revision);
        }
    }

    /// Another agent was seen. The sighting of an agent that the space does not know is dropped.
    fn other_agent(&mut self, name: &Label, relation: &Relation) {
        if let Some(target) = self.names.get(name) {
            let (agent, stamp_ns) = (self.agent_id.0, self.stamp_ns);
            let effects = &mut self.effects;
            self.estimator
                .sighting(agent, stamp_ns, target.0, relation, effects);
            self.apply_effects();
        }
    }

    /// Takes over where the landmarks are now: a sighting corrects all of them that are correlated
    /// with what it shows, and may have brought those of another frame.
    fn place_landmarks(&mut self) {
        for (label, position, covariance) in self.estimator.landmarks() {
            let estimate = PositionEstimate {
                position,
                covariance,
            };
            if let Some(landmark) = self.landmarks.by_label(label.as_str()) {
                self.landmarks.place(landmark, estimate, self.revision);
                continue;
            }
            let observers = self.estimator.observers_of(label).cloned();
            let landmark = Landmark::learn(
                label.clone(),
                estimate,
                self.stamp_ns,
                observers.unwrap_or_default(),
            );
            if let Some(landmark) = self.landmarks.learn(landmark, self.revision) {
                self.events.push(crate::event::Event {
                    agent: self.agent_id,
                    stamp_ns: self.stamp_ns,
                    kind: EventKind::LandmarkLearned { landmark, position },
                });
            }
        }
    }
}
