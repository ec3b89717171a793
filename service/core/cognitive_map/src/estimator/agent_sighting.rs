//! Sightings of agents by agents.

use nalgebra::{Isometry3, Point3};

use super::effect::{AgentSighted, Effect};
use super::innovation::{as_far_as_it_says, seen_at};
use super::joint::Estimator;
use super::measurement_update::Measurement;
use super::sightings::{CrossFrameSighting, PendingSighting};
use super::tuning::{CROSS_SIGHTINGS_APART_M, CROSS_SIGHTINGS_MAX, PENDING_MAX, PENDING_NS_MAX};
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
            relation: as_far_as_it_says(relation),
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

    /// Takes in a sighting of an agent: it corrects a frame that both agents are in, and says how
    /// two frames lie otherwise.
    fn take_in_agent_sighting(&mut self, pending: &PendingSighting, effects: &mut Vec<Effect>) {
        let motion_since = |this: &Self, agent: u32| {
            let filter = this.filter(agent)?;
            filter.history.motion_since(pending.stamp_ns)
        };
        // An observer that has not moved up to its sighting is where it was.
        let own = motion_since(self, pending.observer);
        let back = own.unwrap_or_else(Isometry3::identity);
        let Some(target_back) = motion_since(self, pending.target) else {
            return; // too long ago
        };
        // As the second one joins, the first one's index may change.
        let joined = self
            .join_estimate(pending.observer)
            .zip(self.join_estimate(pending.target));
        let Some(((number, _), (target_number, target))) = joined else {
            return;
        };
        let Some(observer) = self.frame(number).member(pending.observer) else {
            return;
        };
        let ends = Ends {
            frames: [number, target_number],
            members: [observer, target],
            backs: [back, target_back],
        };
        if number == target_number {
            self.update_by_agent(pending, &ends, effects);
        } else if let Some(sighting) = self.cross_sighting(&pending.relation, &ends)
            && self.keep_cross_sighting(sighting)
        {
            self.merge_with(pending.observer, None, effects);
        }
    }

    /// Corrects the frame of two agents by a sighting of the one by the other.
    fn update_by_agent(
        &mut self,
        pending: &PendingSighting,
        ends: &Ends,
        effects: &mut Vec<Effect>,
    ) {
        let (number, [observer, target]) = (ends.frames[0], ends.members);
        let measurement = Measurement {
            observer,
            back: &ends.backs[0],
            stamp_ns: pending.stamp_ns,
            relation: &pending.relation,
            parameters: &self.parameters,
        };
        let Some(frame) = self.frames.get_mut(number, 0) else {
            return;
        };
        let outcome = match &pending.relation {
            Relation::Range(range) => {
                frame.update_by_member_range(&measurement, range, target, &ends.backs[1])
            }
            _ => frame.update_by_member(&measurement, target, &ends.backs[1]),
        };
        let refused = frame.members[observer].state.refused;
        self.count(pending.observer, outcome.verdict, refused);
        effects.push(Effect::AgentSighted(AgentSighted {
            observer: pending.observer,
            target: pending.target,
            stamp_ns: pending.stamp_ns,
            relation: pending.relation,
            accepted: outcome.verdict.is_accepted(),
            variance: outcome.variance,
        }));
        self.sweep(number, effects);
        self.judge_evidence(pending.observer, effects);
    }

    /// Where the target of a sighting was in its own frame and in its observer's; `None` of a
    /// distance alone, which does not say where.
    fn cross_sighting(&self, relation: &Relation, ends: &Ends) -> Option<CrossFrameSighting> {
        let pose_then = |end: usize| {
            let frame = self.frame(ends.frames[end]);
            frame.members[ends.members[end]].filter().pose * ends.backs[end].inverse()
        };
        let (point, noise) = seen_at(relation)?;
        let lasting = self.parameters.lasting_range_error * point.norm();
        Some(CrossFrameSighting {
            frames: ends.frames,
            points: [
                pose_then(0) * Point3::from(point),
                pose_then(1).translation.vector.into(),
            ],
            variance: noise.trace() / 3.0 + lasting * lasting / 2.0,
        })
    }

    /// Keeps a sighting across frames; answers whether it did. Sightings from one place share their
    /// error, and do not say how the frames are turned.
    fn keep_cross_sighting(&mut self, sighting: CrossFrameSighting) -> bool {
        let is_elsewhere = |other: &CrossFrameSighting| {
            other.frames != sighting.frames
                || (other.points[1] - sighting.points[1]).norm() >= CROSS_SIGHTINGS_APART_M
        };
        if !self.cross_sightings.iter().all(is_elsewhere) {
            return false;
        }
        if self.cross_sightings.len() >= CROSS_SIGHTINGS_MAX {
            self.cross_sightings.remove(0);
        }
        self.cross_sightings.push(sighting);
        true
    }
}

/// Observer and target of a sighting: the frame of each, its index there, and its motion since.
struct Ends {
    frames: [usize; 2],
    members: [usize; 2],
    backs: [Isometry3<f64>; 2],
}
