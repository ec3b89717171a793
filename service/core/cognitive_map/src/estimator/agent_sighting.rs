//! Sightings of agents by agents.

use nalgebra::{Isometry3, Point3};

use super::effect::{AgentSighted, Effect};
use super::innovation::seen_at;
use super::joint::Estimator;
use super::measurement_update::Measurement;
use super::sightings::{CrossFrameSighting, PendingSighting};
use super::tuning::{CROSS_SIGHTINGS_APART_M, CROSS_SIGHTINGS_MAX, PENDING_MAX, PENDING_NS_MAX};
use super::verdict::Verdict;
use crate::input::Relation;

impl Estimator {
    /// An agent saw another one.
    ///
    /// The sighting is taken in as soon as both have moved up to its stamp, whichever comes first;
    /// then follows [`Effect::AgentSighted`].
    pub fn sighting(
        &mut self,
        agent: u32,
        stamp_ns: i64,
        target: u32,
        relation: &Relation,
        effects: &mut Vec<Effect>,
    ) {
        if agent == target || self.slots.len() <= agent.max(target) as usize {
            return;
        }
        if self.pending.len() >= PENDING_MAX {
            self.pending.remove(0);
        }
        self.pending.push(PendingSighting {
            observer: agent,
            target,
            stamp_ns,
            relation: *relation,
        });
        self.take_in_pending(effects);
    }

    /// Takes in the pending sightings whose time has come.
    pub(super) fn take_in_pending(&mut self, effects: &mut Vec<Effect>) {
        let stamp_of = |this: &Self, agent: u32| this.filter(agent)?.history.stamp_ns();
        let has_come = |this: &Self, pending: &PendingSighting| {
            stamp_of(this, pending.target).is_some_and(|stamp| stamp >= pending.stamp_ns)
        };
        let waits = |this: &Self, pending: &PendingSighting| {
            stamp_of(this, pending.observer)
                .is_none_or(|stamp| stamp.saturating_sub(pending.stamp_ns) < PENDING_NS_MAX)
        };
        if self
            .pending
            .iter()
            .all(|pending| !has_come(self, pending) && waits(self, pending))
        {
            return;
        }
        for pending in std::mem::take(&mut self.pending) {
            if has_come(self, &pending) {
                self.take_in_agent_sighting(&pending, effects);
            } else if waits(self, &pending) {
                self.pending.push(pending);
            }
        }
    }

    /// Takes in a sighting of an agent.
    fn take_in_agent_sighting(&mut self, pending: &PendingSighting, effects: &mut Vec<Effect>) {
        let motion_since = |this: &Self, agent: u32| {
            let filter = this.filter(agent)?;
            filter.history.motion_since(pending.stamp_ns)
        };
        // The observer itself may not have moved up to its sighting: then it is where it was.
        let own = motion_since(self, pending.observer);
        let back = own.unwrap_or_else(Isometry3::identity);
        let Some(target_back) = motion_since(self, pending.target) else {
            return; // too long ago
        };
        // Letting the one take part may move the other in the list of those who do.
        let admitted = self
            .join_estimate(pending.observer)
            .zip(self.join_estimate(pending.target));
        let Some(((number, _), (target_number, target))) = admitted else {
            return;
        };
        let Some(observer) = self.frame(number).member(pending.observer) else {
            return;
        };
        if number == target_number {
            let measurement = Measurement {
                observer,
                back: &back,
                stamp_ns: pending.stamp_ns,
                relation: &pending.relation,
                parameters: &self.parameters,
            };
            let Some(frame) = self.frames.get_mut(number, 0) else {
                return;
            };
            let outcome = frame.update_by_member(&measurement, target, &target_back);
            let refused = frame.members[observer].state.refused;
            self.count(pending.observer, outcome.verdict, refused);
            effects.push(Effect::AgentSighted(AgentSighted {
                observer: pending.observer,
                target: pending.target,
                stamp_ns: pending.stamp_ns,
                relation: pending.relation,
                accepted: outcome.verdict != Verdict::Refused,
                variance: outcome.variance,
            }));
            self.sweep(number, effects);
            self.judge_evidence(pending.observer, effects);
            return;
        }
        let pose_of = |frame: usize, index: usize| self.frame(frame).members[index].filter().pose;
        let (point, noise) = seen_at(&pending.relation);
        let lasting = self.parameters.lasting_range_error * point.norm();
        let observer_pose = pose_of(number, observer) * back.inverse();
        let target_pose = pose_of(target_number, target) * target_back.inverse();
        let cross_sighting = CrossFrameSighting {
            frames: [number, target_number],
            points: [
                observer_pose * Point3::from(point),
                target_pose.translation.vector.into(),
            ],
            variance: noise.trace() / 3.0 + lasting * lasting / 2.0,
        };
        // Sightings from one place share their error, and say nothing about how the frames are
        // turned.
        let is_elsewhere = |other: &CrossFrameSighting| {
            other.frames != cross_sighting.frames
                || (other.points[1] - cross_sighting.points[1]).norm() >= CROSS_SIGHTINGS_APART_M
        };
        if !self.cross_sightings.iter().all(is_elsewhere) {
            return;
        }
        if self.cross_sightings.len() >= CROSS_SIGHTINGS_MAX {
            self.cross_sightings.remove(0);
        }
        self.cross_sightings.push(cross_sighting);
        self.merge_with(pending.observer, None, effects);
    }
}
