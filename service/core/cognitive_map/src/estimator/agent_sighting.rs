//! Agents that see each other, and frames that turn out to be one.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector6};

use super::agent_filter::AgentFilter;
use super::frame::{Frame, MEMBERS_MAX};
use super::frame_alignment::{FrameAlignment, PointPair, align_frames};
use super::innovation::seen_at;
use super::joint::{Estimator, MAP};
use super::measurement_update::{Measurement, Verdict};
use super::outcome::{Merged, Settled};
use super::parameters::ANY_TURN_SD_RAD;
use crate::input::{Label, Relation};
use geometry::{PoseCovariance, is_somewhere, positive, se3};

/// Sightings of agents that wait for the other agent's motion to come up to them.
pub(super) const PENDING_MAX: usize = 64;
/// How long they wait, by the observer's clock \[ns\].
const PATIENCE_NS: i64 = 2_000_000_000;
/// Sightings between agents of different frames that are remembered.
pub(super) const CROSS_SIGHTINGS_MAX: usize = 64;
/// Least distance of the places where an agent was seen, for two sightings to count as two \[m\].
const CROSS_SIGHTINGS_APART_M: f64 = 0.2;
/// Frames that are compared with an agent's own after one of its sightings. Of more, others come next.
const COMPARED_MAX: usize = 16;

/// A sighting of an agent that has not moved up to it yet.
#[derive(Clone, Debug)]
pub(super) struct PendingSighting {
    pub(super) observer: u32,
    pub(super) target: u32,
    pub(super) stamp_ns: i64,
    pub(super) relation: Relation,
}

/// An agent of one frame was seen from another.
#[derive(Clone, Debug)]
pub(super) struct CrossFrameSighting {
    /// Frames of observer and target.
    pub(super) frames: [usize; 2],
    /// Where the target was, in either.
    pub(super) points: [Point3<f64>; 2],
    pub(super) variance: f64,
}

impl Estimator {
    /// An agent saw another one.
    ///
    /// The sighting is taken in as soon as both have moved up to its stamp, whichever comes first:
    /// [`Estimator::take_settled`] tells.
    pub fn sighting(&mut self, agent: u32, stamp_ns: i64, target: u32, relation: &Relation) {
        self.begin();
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
        self.take_in_pending();
    }

    /// Takes in the pending sightings whose time has come.
    pub(super) fn take_in_pending(&mut self) {
        let stamp_of = |this: &Self, agent: u32| this.slot(agent).and_then(|slot| slot.stamp_ns);
        let has_come = |this: &Self, pending: &PendingSighting| {
            stamp_of(this, pending.target).is_some_and(|stamp| stamp >= pending.stamp_ns)
        };
        let waits = |this: &Self, pending: &PendingSighting| {
            stamp_of(this, pending.observer)
                .is_none_or(|stamp| stamp.saturating_sub(pending.stamp_ns) < PATIENCE_NS)
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
                self.take_in_agent_sighting(&pending);
            } else if waits(self, &pending) {
                self.pending.push(pending);
            }
        }
    }

    /// Takes in a sighting of an agent.
    fn take_in_agent_sighting(&mut self, pending: &PendingSighting) {
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
            self.settled.push(Settled {
                observer: pending.observer,
                target: pending.target,
                stamp_ns: pending.stamp_ns,
                relation: pending.relation,
                accepted: outcome.verdict != Verdict::Refused,
                variance: outcome.variance,
            });
            self.sweep(number);
            self.judge_evidence(pending.observer);
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
        // Sightings from one place share their error, and say nothing about how the frames are turned.
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
        self.merge_with(pending.observer, None);
    }

    /// Looks whether an agent's frame and another one can be laid into each other, after a sighting of
    /// a landmark, or of another agent.
    pub(super) fn merge_with(&mut self, agent: u32, label: Option<&Label>) {
        let (Some(own), count) = (self.frame_of(agent), self.frames.len()) else {
            return;
        };
        let start = if count <= COMPARED_MAX { 0 } else { self.turn };
        let others = (0..count.min(COMPARED_MAX)).map(|k| (start + k) % count);
        // The map's frame is always among them.
        let others: Vec<usize> = std::iter::once(MAP)
            .chain(others.filter(|&other| other != MAP))
            .collect();
        self.turn = (start + COMPARED_MAX) % count;
        for other in others {
            let frame = self.frame(other);
            let knows =
                |frame: &Frame| label.is_none_or(|label| frame.landmarks.contains_key(label));
            let is_empty = frame.population == 0 && frame.landmarks.is_empty();
            if other == own || is_empty || !knows(frame) {
                continue;
            }
            let (older, newer) = (own.min(other), own.max(other));
            if let Some(alignment) = self.alignment_of(older, newer) {
                self.merge(older, newer, &alignment);
                return;
            }
        }
    }

    /// How one frame lies in an older one, if that is known.
    fn alignment_of(&self, older: usize, newer: usize) -> Option<FrameAlignment> {
        let [one, other] = [older, newer].map(|number| self.frame(number));
        let mut pairs = one.shared(other);
        for cross_sighting in &self.cross_sightings {
            let [a, b] = cross_sighting.points;
            let (in_older, in_newer) = match cross_sighting.frames {
                frames if frames == [older, newer] => (a, b),
                frames if frames == [newer, older] => (b, a),
                _ => continue,
            };
            pairs.push(PointPair {
                older: in_older,
                newer: in_newer,
                variance: cross_sighting.variance,
            });
        }
        align_frames(&pairs, one.is_planar() && other.is_planar())
    }

    /// An agent turned out to be at a pose in the map, of which the error on its right has this covariance. Its frame is laid
    /// into the map's, with all that is in it; one that was in the map is put there.
    pub fn recognised(&mut self, agent: u32, pose: &Isometry3<f64>, covariance: &PoseCovariance) {
        self.begin();
        let (Some(own), Some(in_frame)) = (self.frame_of(agent), self.in_frame(agent).copied())
        else {
            return;
        };
        let covariance = positive(covariance.matrix());
        let is_known = covariance.iter().all(|entry| entry.is_finite());
        if !is_known || !is_somewhere(&pose.translation.vector) {
            return;
        }
        self.slot_mut(agent).is_aside = false;
        if own == MAP {
            self.put(agent, pose, &covariance);
            return;
        }
        // The error ξ of the body is Ad(T_b) ξ of the frame.
        let adjoint = se3::adjoint(&in_frame);
        let alignment = FrameAlignment {
            pose: pose * in_frame.inverse(),
            covariance: positive(&(adjoint * covariance * adjoint.transpose())),
        };
        self.merge(MAP, own, &alignment);
    }

    /// An agent of the map may be anywhere, about `sd_m` from where it was believed to be along each axis and turned in any way. One that
    /// moves in a plane stays there.
    pub fn lose(&mut self, agent: u32, sd_m: f64) {
        self.begin();
        let Some(filter) = self.filter(agent).filter(|_| self.is_in_map(agent)) else {
            return;
        };
        let (pose, is_planar) = (filter.pose, filter.is_planar);
        let sd = Vector6::from_fn(|k, _| {
            let is_held = is_planar && matches!(k, 2..=4);
            match (is_held, k < 3) {
                (true, _) => 0.0,
                (false, true) => sd_m,
                (false, false) => ANY_TURN_SD_RAD,
            }
        });
        self.put(agent, &pose, PoseCovariance::from_sd(&sd).matrix());
    }

    /// Lays a frame into an older one.
    pub(super) fn merge(&mut self, older: usize, newer: usize, alignment: &FrameAlignment) {
        let moved = std::mem::take(self.frame_mut(newer));
        let parameters = self.parameters.clone();
        let agents = self.move_slots(newer, older);
        let is_trusted = |&agent: &u32| older != MAP || !self.was_contradicted(agent);
        if agents.iter().any(is_trusted) {
            self.frame_mut(older).merge(moved, alignment, &parameters);
        } else {
            self.frame_mut(older).merge_doubted(moved, alignment);
        }
        for &agent in &agents {
            if let Some(detached) = &mut self.slot_mut(agent).detached {
                let filter = &mut Arc::make_mut(&mut detached.state).filter;
                filter.transform_by(alignment);
                // All of them share the error of the alignment.
                detached.was_joint = true;
            }
        }
        if older == MAP {
            for &agent in &agents {
                let doubt = self.doubt_of_return(agent);
                if let Some(state) = self.agent_state_mut(agent) {
                    state.doubt = doubt;
                }
                // What one has seen that was nowhere lies as the map has it.
                let is_doubted = self.was_contradicted(agent);
                self.slot_mut(agent).is_aside &= is_doubted;
            }
        }
        let is_nowhere = |&agent: &u32| self.filter(agent).is_some_and(AgentFilter::is_nowhere);
        let (lost, agents) = agents.into_iter().partition::<Vec<u32>, _>(is_nowhere);
        while self.frame(older).members.len() > MEMBERS_MAX {
            self.detach_idlest(older);
        }
        self.forget_cross_sightings(newer);
        self.merged.push(Merged {
            frame: newer,
            into: older,
            pose: alignment.pose,
            agents,
        });
        for agent in lost {
            self.set_aside(agent);
        }
        self.sweep(older);
    }

    /// Forgets the sightings between a frame and others, and how it resembles them.
    pub(super) fn forget_cross_sightings(&mut self, frame: usize) {
        self.cross_sightings
            .retain(|cross_sighting| !cross_sighting.frames.contains(&frame));
        self.frame_matches
            .retain(|frame_match| !frame_match.frames.contains(&frame));
    }
}
