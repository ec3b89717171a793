//! Sightings of landmarks.

use nalgebra::Isometry3;

use super::effect::Effect;
use super::joint::Estimator;
use super::measurement_update::Measurement;
use super::outcome::LandmarkOutcome;
use super::verdict::Verdict;
use crate::input::{Label, Relation};

impl Estimator {
    /// An agent saw a landmark.
    pub fn landmark(
        &mut self,
        agent: u32,
        stamp_ns: i64,
        label: &Label,
        relation: &Relation,
        effects: &mut Vec<Effect>,
    ) -> LandmarkOutcome {
        let Some((number, observer)) = self.join_estimate(agent) else {
            return LandmarkOutcome::default();
        };
        let called = label;
        let label = &self.associations.name_of(called).clone();
        let is_aside = self.is_aside_for(agent, number, label);
        let Some(frame) = self.frames.get_mut(number, 0) else {
            return LandmarkOutcome::default();
        };
        if is_aside {
            frame.forget(label);
        }
        let state = frame.members[observer].state_mut();
        if !state.is_doubted() {
            state.filter.learn_noise(called, stamp_ns, relation);
        }
        let measurement = Measurement {
            observer,
            back: &Isometry3::identity(),
            stamp_ns,
            relation,
            parameters: &self.parameters,
        };
        let outcome = frame.update_by_landmark(&measurement, label);
        let refused = frame.members[observer].state.refused;
        self.count(agent, outcome.verdict, refused);
        self.associations.weigh(called, outcome.verdict, refused);
        self.sweep(number, effects);
        self.judge_evidence(agent, effects);
        if self.frame_of(agent) == Some(number) {
            self.merge_with(agent, Some(label), effects);
        }
        if self.frame_of(agent) == Some(number) {
            self.associate_landmarks(number, agent, effects);
        }
        let accepted = outcome.verdict != Verdict::Refused;
        if accepted {
            effects.push(Effect::LandmarkSighted {
                agent,
                // It may just have turned out to be another landmark's.
                label: self.associations.name_of(called).clone(),
                relation: *relation,
                variance: outcome.variance.fixed_rows::<3>(0).into_owned(),
            });
        }
        LandmarkOutcome {
            is_new: outcome.verdict == Verdict::Learned,
            accepted,
        }
    }

    /// Counts what became of a sighting.
    pub(super) fn count(&mut self, agent: u32, verdict: Verdict, refused: u32) {
        let evidence = &mut self.slot_mut(agent).evidence;
        evidence.refused_in_a_row = refused;
        match verdict {
            Verdict::Learned => {}
            Verdict::Accepted { nis, components } => {
                evidence.accepted += 1;
                evidence.nis += nis;
                evidence.components += u64::from(components);
            }
            Verdict::Refused => evidence.refused += 1,
        }
    }
}
