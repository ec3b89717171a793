//! Agents that see each other, and frames that turn out to be one.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector6};

use super::frame::{Frame, MEMBERS_MAX};
use super::innovation::seen_at;
use super::joint::{Estimator, MAP};
use super::mover::Mover;
use super::outcome::{Merged, Settled};
use super::parameters::ANY_TURN_SD_RAD;
use super::sight::{Glance, Verdict};
use super::tie::{Pair, Tie, tie};
use crate::input::{Label, Relation};
use geometry::{PoseCovariance, is_somewhere, positive, se3};

/// Sightings of agents that wait for the other agent's motion to come up to them.
pub(super) const PENDING_MAX: usize = 64;
/// How long they wait, by the observer's clock \[ns\].
const PATIENCE_NS: i64 = 2_000_000_000;
/// Sightings between agents of different frames that are remembered.
pub(super) const MEETINGS_MAX: usize = 64;
/// Least distance of the places where an agent was seen, for two sightings to count as two \[m\].
const MEETING_APART_M: f64 = 0.2;
/// Frames that are compared with an agent's own after one of its sightings. Of more, others come next.
const COMPARED_MAX: usize = 16;

/// A sighting of an agent that has not moved up to it yet.
#[derive(Clone, Debug)]
pub(super) struct Pending {
    pub(super) observer: u32,
    pub(super) target: u32,
    pub(super) stamp_ns: i64,
    pub(super) relation: Relation,
}

/// An agent of one frame was seen from another.
#[derive(Clone, Debug)]
pub(super) struct Meeting {
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
        if agent == target || self.seats.len() <= agent.max(target) as usize {
            return;
        }
        if self.pending.len() >= PENDING_MAX {
            self.pending.remove(0);
        }
        self.pending.push(Pending {
            observer: agent,
            target,
            stamp_ns,
            relation: *relation,
        });
        self.settle();
    }

    /// Takes in the pending sightings whose time has come.
    pub(super) fn settle(&mut self) {
        let stamp_of = |this: &Self, agent: u32| this.seat(agent).and_then(|seat| seat.stamp_ns);
        let has_come = |this: &Self, pending: &Pending| {
            stamp_of(this, pending.target).is_some_and(|stamp| stamp >= pending.stamp_ns)
        };
        let waits = |this: &Self, pending: &Pending| {
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
                self.meet(&pending);
            } else if waits(self, &pending) {
                self.pending.push(pending);
            }
        }
    }

    /// Takes in a sighting of an agent.
    fn meet(&mut self, pending: &Pending) {
        let motion_since = |this: &Self, agent: u32| {
            let mover = this.mover(agent)?;
            mover.history.motion_since(pending.stamp_ns)
        };
        // The observer itself may not have moved up to its sighting: then it is where it was.
        let own = motion_since(self, pending.observer);
        let back = own.unwrap_or_else(Isometry3::identity);
        let Some(target_back) = motion_since(self, pending.target) else {
            return; // too long ago
        };
        // Letting the one take part may move the other in the list of those who do.
        let admitted = self.admit(pending.observer).zip(self.admit(pending.target));
        let Some(((number, _), (target_number, target))) = admitted else {
            return;
        };
        let Some(observer) = self.frame(number).member(pending.observer) else {
            return;
        };
        if number == target_number {
            let glance = Glance {
                observer,
                back: &back,
                stamp_ns: pending.stamp_ns,
                relation: &pending.relation,
                parameters: &self.parameters,
            };
            let Some(frame) = self.frames.get_mut(number, 0) else {
                return;
            };
            let weighed = frame.see_member(&glance, target, &target_back);
            let refused = frame.members[observer].traveller.refused;
            self.count(pending.observer, weighed.verdict, refused);
            self.settled.push(Settled {
                observer: pending.observer,
                target: pending.target,
                stamp_ns: pending.stamp_ns,
                relation: pending.relation,
                accepted: weighed.verdict != Verdict::Refused,
                variance: weighed.variance,
            });
            self.sweep(number);
            self.judge(pending.observer);
            return;
        }
        let pose_of = |frame: usize, index: usize| self.frame(frame).members[index].mover().pose;
        let (point, noise) = seen_at(&pending.relation);
        let lasting = self.parameters.lasting_range_error * point.norm();
        let observer_pose = pose_of(number, observer) * back.inverse();
        let target_pose = pose_of(target_number, target) * target_back.inverse();
        let meeting = Meeting {
            frames: [number, target_number],
            points: [
                observer_pose * Point3::from(point),
                target_pose.translation.vector.into(),
            ],
            variance: noise.trace() / 3.0 + lasting * lasting / 2.0,
        };
        // Sightings from one place share their error, and say nothing about how the frames are turned.
        let is_elsewhere = |other: &Meeting| {
            other.frames != meeting.frames
                || (other.points[1] - meeting.points[1]).norm() >= MEETING_APART_M
        };
        if !self.meetings.iter().all(is_elsewhere) {
            return;
        }
        if self.meetings.len() >= MEETINGS_MAX {
            self.meetings.remove(0);
        }
        self.meetings.push(meeting);
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
            let knows = |frame: &Frame| label.is_none_or(|label| frame.marks.contains_key(label));
            let is_empty = frame.population == 0 && frame.marks.is_empty();
            if other == own || is_empty || !knows(frame) {
                continue;
            }
            let (older, newer) = (own.min(other), own.max(other));
            if let Some(tie) = self.tie(older, newer) {
                self.merge(older, newer, &tie);
                return;
            }
        }
    }

    /// How one frame lies in an older one, if that is known.
    fn tie(&self, older: usize, newer: usize) -> Option<Tie> {
        let [one, other] = [older, newer].map(|number| self.frame(number));
        let mut pairs = one.shared(other);
        for meeting in &self.meetings {
            let [a, b] = meeting.points;
            let (in_older, in_newer) = match meeting.frames {
                frames if frames == [older, newer] => (a, b),
                frames if frames == [newer, older] => (b, a),
                _ => continue,
            };
            pairs.push(Pair {
                older: in_older,
                newer: in_newer,
                variance: meeting.variance,
            });
        }
        tie(&pairs, one.is_planar() && other.is_planar())
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
        self.seat_mut(agent).is_aside = false;
        if own == MAP {
            self.put(agent, pose, &covariance);
            return;
        }
        // The error ξ of the body is Ad(T_b) ξ of the frame.
        let adjoint = se3::adjoint(&in_frame);
        let tie = Tie {
            pose: pose * in_frame.inverse(),
            covariance: positive(&(adjoint * covariance * adjoint.transpose())),
        };
        self.merge(MAP, own, &tie);
    }

    /// An agent of the map may be anywhere, about `sd_m` from where it was believed to be along each axis and turned in any way. One that
    /// moves in a plane stays there.
    pub fn lose(&mut self, agent: u32, sd_m: f64) {
        self.begin();
        let Some(mover) = self.mover(agent).filter(|_| self.is_in_map(agent)) else {
            return;
        };
        let (pose, is_planar) = (mover.pose, mover.is_planar);
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
    pub(super) fn merge(&mut self, older: usize, newer: usize, tie: &Tie) {
        let moved = std::mem::take(self.frame_mut(newer));
        let parameters = self.parameters.clone();
        let agents = self.move_seats(newer, older);
        let is_trusted = |&agent: &u32| older != MAP || !self.was_contradicted(agent);
        if agents.iter().any(is_trusted) {
            self.frame_mut(older).merge(moved, tie, &parameters);
        } else {
            self.frame_mut(older).take_in_doubted(moved, tie);
        }
        for &agent in &agents {
            if let Some(apart) = &mut self.seat_mut(agent).apart {
                let mover = &mut Arc::make_mut(&mut apart.traveller).mover;
                mover.carry_over(tie);
                // The error of the tie is everybody's.
                apart.was_joint = true;
            }
        }
        if older == MAP {
            for &agent in &agents {
                let doubt = self.doubt_of_return(agent);
                if let Some(traveller) = self.traveller_mut(agent) {
                    traveller.doubt = doubt;
                }
                // What one has seen that was nowhere lies as the map has it.
                let is_doubted = self.was_contradicted(agent);
                self.seat_mut(agent).is_aside &= is_doubted;
            }
        }
        let is_nowhere = |&agent: &u32| self.mover(agent).is_some_and(Mover::is_nowhere);
        let (lost, agents) = agents.into_iter().partition::<Vec<u32>, _>(is_nowhere);
        while self.frame(older).members.len() > MEMBERS_MAX {
            self.dismiss(older);
        }
        self.forget_meetings(newer);
        self.merged.push(Merged {
            frame: newer,
            into: older,
            pose: tie.pose,
            agents,
        });
        for agent in lost {
            self.set_aside(agent);
        }
        self.sweep(older);
    }

    /// Forgets the sightings between a frame and others, and how it resembles them.
    pub(super) fn forget_meetings(&mut self, frame: usize) {
        self.meetings
            .retain(|meeting| !meeting.frames.contains(&frame));
        self.resemblances
            .retain(|resemblance| !resemblance.frames.contains(&frame));
    }
}
