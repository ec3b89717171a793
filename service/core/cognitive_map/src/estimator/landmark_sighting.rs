//! Sightings of landmarks.

use nalgebra::{Isometry3, Vector3};

use super::effect::Effect;
use super::innovation::as_far_as_it_says;
use super::joint::Estimator;
use super::measurement_update::Measurement;
use super::odometry_noise::Told;
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
        let relation = &as_far_as_it_says(relation);
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
        if !matches!(relation, Relation::Range(_)) {
            frame.begin_veer(observer, &self.parameters);
        }
        let state = frame.members[observer].state_mut();
        if !matches!(relation, Relation::Range(_)) {
            let is_doubted = state.is_doubted();
            let filter = &mut state.filter;
            filter.learn_noise(called, stamp_ns, relation, is_doubted);
            if !is_doubted {
                frame.take_back_noise(observer, stamp_ns, Told::ByPairs);
            }
        }
        let measurement = Measurement {
            observer,
            back: &Isometry3::identity(),
            stamp_ns,
            relation,
            parameters: &self.parameters,
        };
        let outcome = match relation {
            Relation::Range(range) => frame.update_by_landmark_range(&measurement, range, label),
            _ => frame.update_by_landmark(&measurement, label),
        };
        let refused = frame.members[observer].state.refused;
        self.count(agent, outcome.verdict, refused);
        if outcome.verdict != Verdict::Reflected {
            self.associations.weigh(called, outcome.verdict, refused);
        }
        self.sweep(number, effects);
        self.judge_evidence(agent, effects);
        if self.frame_of(agent) == Some(number) {
            self.merge_with(agent, Some(label), effects);
        }
        if self.frame_of(agent) == Some(number) {
            self.associate_landmarks(number, agent, effects);
        }
        if outcome.verdict.is_accepted() {
            // It may just have turned out to be another landmark's.
            let label = self.associations.name_of(called).clone();
            let at = self.seen_from(agent, &label);
            effects.push(Effect::LandmarkSighted {
                agent,
                label,
                relation: *relation,
                variance: outcome.variance.fixed_rows::<3>(0).into_owned(),
                at,
                is_new: outcome.verdict == Verdict::Learned,
            });
        }
        LandmarkOutcome {
            is_new: outcome.verdict == Verdict::Learned,
            accepted: outcome.verdict.is_accepted() && outcome.verdict != Verdict::Pending,
        }
    }

    /// Where a landmark is in the body frame of an agent of its frame.
    fn seen_from(&self, agent: u32, label: &Label) -> Option<Vector3<f64>> {
        let frame = self.frames.get(self.frame_of(agent)?)?;
        let position = frame.landmarks.get(label)?.position;
        Some(
            self.in_frame(agent)?
                .inverse_transform_point(&position)
                .coords,
        )
    }

    /// Counts what became of a sighting.
    pub(super) fn count(&mut self, agent: u32, verdict: Verdict, refused: u32) {
        let evidence = &mut self.slot_mut(agent).evidence;
        evidence.refused_in_a_row = refused;
        match verdict {
            Verdict::Learned | Verdict::Pending => {}
            Verdict::Accepted { nis, components } => {
                evidence.accepted += 1;
                evidence.nis += nis;
                evidence.components += u64::from(components);
            }
            Verdict::Refused | Verdict::Reflected => evidence.refused += 1,
        }
    }
}
