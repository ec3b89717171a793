//! All frames of a space, and the samples that move and correct what is in them.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3, Vector6};

use super::frame::Frame;
use super::innovation::seen_at;
use super::mover::Mover;
use super::parameters::Parameters;
use super::sensor::Sensor;
use super::sight::{Glance, Verdict};
use super::tie::{Pair, tie};
use crate::geometry::PoseCovariance;
use crate::sample::{Label, Motion, Relation, StartPose};

/// Sightings of agents that wait for the other agent's motion to come up to them.
const PENDING_MAX: usize = 64;
/// How long they wait, by the observer's clock \[ns\].
const PATIENCE_NS: i64 = 2_000_000_000;
/// Sightings between agents of different frames that are remembered.
const MEETINGS_MAX: usize = 64;
/// Least distance of the places where an agent was seen, for two sightings to count as two \[m\].
const MEETING_APART_M: f64 = 0.2;
/// Longest interval between two motions over which a bias counts \[s\].
const DURATION_S_MAX: f64 = 10.0;

/// What became of an agent's sightings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Sightings taken in.
    pub accepted: u64,
    /// Sightings refused.
    pub refused: u64,
    /// Of those, how many one after the other, up to now.
    pub refused_in_a_row: u32,
    /// Sum of the normalised innovations squared of those taken in. It has the mean of `components`
    /// where the stated noise is honest.
    pub nis: f64,
    /// Number of their components.
    pub components: u64,
}

/// An agent, in whatever frame.
#[derive(Clone, Debug)]
pub(super) struct Seat {
    /// Its frame.
    pub(super) frame: usize,
    pub(super) in_odom: Isometry3<f64>,
    /// Stamp of its latest motion \[ns\].
    pub(super) stamp_ns: Option<i64>,
    pub(super) evidence: Evidence,
}

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

/// The joint estimate of all agents and landmarks of a space.
///
/// Every agent begins in a frame of its own. The first frame is that of the map: an agent enters it by
/// [`Estimator::found`] or by a start pose. Frames are laid into one another as soon as enough points
/// are known in both: landmarks, and places where one agent saw the other. The older frame prevails.
#[derive(Clone, Debug)]
pub struct Estimator {
    pub(super) parameters: Parameters,
    /// The map's frame, then one for each agent; empty ones were merged into earlier ones.
    pub(super) frames: Vec<Frame>,
    pub(super) seats: Vec<Seat>,
    pub(super) pending: Vec<Pending>,
    pub(super) meetings: Vec<Meeting>,
}

/// The frame of the map.
const MAP: usize = 0;

impl Estimator {
    /// Without any agent.
    pub fn new(parameters: Parameters) -> Self {
        Self {
            parameters,
            frames: vec![Frame::default()],
            seats: Vec::new(),
            pending: Vec::new(),
            meetings: Vec::new(),
        }
    }

    /// A new agent, at the identity of a frame of its own; answers its number, counted from 0.
    pub fn enrol(&mut self) -> u32 {
        let agent = u32::try_from(self.seats.len()).unwrap_or(u32::MAX);
        let mover = Mover::new(Isometry3::identity(), &Matrix6::zeros(), &self.parameters);
        let mut frame = Frame::default();
        frame.join(agent, mover, Sensor::default());
        self.seats.push(Seat {
            frame: self.frames.len(),
            in_odom: Isometry3::identity(),
            stamp_ns: None,
            evidence: Evidence::default(),
        });
        self.frames.push(frame);
        agent
    }

    /// Makes an agent's frame that of the map, if nobody is in that yet; answers whether it did.
    pub fn found(&mut self, agent: u32) -> bool {
        let Some(seat) = self.seats.get(agent as usize) else {
            return false;
        };
        let is_new = self.frames[MAP].members.is_empty() && seat.frame != MAP;
        if is_new {
            self.frames.swap(MAP, seat.frame);
            let from = seat.frame;
            for seat in self.seats.iter_mut().filter(|seat| seat.frame == from) {
                seat.frame = MAP;
            }
        }
        is_new
    }

    /// An agent was told where it stands in the map.
    pub fn start_pose(&mut self, agent: u32, start: &StartPose) {
        let Some(seat) = self.seats.get_mut(agent as usize) else {
            return;
        };
        let Some((before, sensor)) = self.frames[seat.frame].leave(agent) else {
            return;
        };
        seat.frame = MAP;
        let covariance = *PoseCovariance::from_sd(start.noise().sd()).matrix();
        let mover = before.placed(*start.pose(), &covariance);
        self.frames[MAP].join(agent, mover, sensor);
    }

    /// A new session of an agent: its odometry begins anew, and it may have been moved by about `sd`
    /// \[m, m, m, rad, rad, rad\] since.
    pub fn restart(&mut self, agent: u32, sd: &Vector6<f64>) {
        let Some(seat) = self.seats.get_mut(agent as usize) else {
            return;
        };
        seat.in_odom = Isometry3::identity();
        seat.stamp_ns = None;
        let frame = &mut self.frames[seat.frame];
        frame.flush();
        if let Some(index) = frame.member(agent) {
            let member = &mut frame.members[index];
            member.mover.history.clear();
            for k in 0..6 {
                member.mover.covariance[(k, k)] += sd[k] * sd[k];
            }
            let own = &member.mover.covariance;
            frame.covariance.set_diagonal(member.offset, own);
        }
        self.pending
            .retain(|pending| pending.observer != agent && pending.target != agent);
    }

    /// An agent moved; answers its displacement along the axes of its frame \[m\].
    ///
    /// Costs the same however much is known.
    pub fn motion(&mut self, agent: u32, stamp_ns: i64, motion: &Motion) -> Vector3<f64> {
        let Some(seat) = self.seats.get_mut(agent as usize) else {
            return Vector3::zeros();
        };
        let frame = &mut self.frames[seat.frame];
        let Some(index) = frame.member(agent) else {
            return Vector3::zeros();
        };
        let before_ns = seat.stamp_ns.replace(stamp_ns);
        let duration_s = before_ns.map_or(0.0, |before| {
            let interval_s = stamp_ns.saturating_sub(before) as f64 * 1e-9;
            interval_s.clamp(0.0, DURATION_S_MAX)
        });
        let mover = &mut frame.members[index].mover;
        let displacement = mover.step(motion, duration_s, &self.parameters);
        seat.in_odom *= motion.increment();
        seat.in_odom.rotation.renormalize_fast();
        mover.history.note(stamp_ns, &seat.in_odom);
        if !self.pending.is_empty() {
            self.settle();
        }
        displacement
    }

    /// An agent saw a landmark; answers whether it is new in the agent's frame.
    pub fn landmark(
        &mut self,
        agent: u32,
        stamp_ns: i64,
        label: &Label,
        relation: &Relation,
    ) -> bool {
        let Some(seat) = self.seats.get(agent as usize) else {
            return false;
        };
        let frame = &mut self.frames[seat.frame];
        let Some(observer) = frame.member(agent) else {
            return false;
        };
        let glance = Glance {
            observer,
            back: &Isometry3::identity(),
            stamp_ns,
            relation,
            parameters: &self.parameters,
        };
        let verdict = frame.see_mark(&glance, label);
        let refused = frame.members[observer].refused;
        self.count(agent, verdict, refused);
        self.merge_with(agent, Some(label));
        verdict == Verdict::Learned
    }

    /// An agent saw another one.
    ///
    /// The sighting is taken in as soon as both have moved up to its stamp, whichever comes first.
    pub fn sighting(&mut self, agent: u32, stamp_ns: i64, target: u32, relation: &Relation) {
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
    fn settle(&mut self) {
        for pending in std::mem::take(&mut self.pending) {
            let stamp_of = |agent: u32| self.seats[agent as usize].stamp_ns;
            if stamp_of(pending.target).is_some_and(|stamp| stamp >= pending.stamp_ns) {
                self.meet(&pending);
            } else if stamp_of(pending.observer)
                .is_none_or(|stamp| stamp.saturating_sub(pending.stamp_ns) < PATIENCE_NS)
            {
                self.pending.push(pending);
            }
        }
    }

    /// Takes in a sighting of an agent.
    fn meet(&mut self, pending: &Pending) {
        let [from, to] = [pending.observer, pending.target].map(|agent| {
            let frame = self.seats[agent as usize].frame;
            self.frames[frame].member(agent).map(|index| (frame, index))
        });
        let (Some((frame, observer)), Some((target_frame, target))) = (from, to) else {
            return;
        };
        let mover = |frame: usize, index: usize| &self.frames[frame].members[index].mover;
        // The observer itself may not have moved up to its sighting: then it is where it was.
        let own = mover(frame, observer)
            .history
            .motion_since(pending.stamp_ns);
        let back = own.unwrap_or_else(Isometry3::identity);
        let others = mover(target_frame, target)
            .history
            .motion_since(pending.stamp_ns);
        let Some(target_back) = others else {
            return; // too long ago
        };
        if frame == target_frame {
            let glance = Glance {
                observer,
                back: &back,
                stamp_ns: pending.stamp_ns,
                relation: &pending.relation,
                parameters: &self.parameters,
            };
            let frame = &mut self.frames[frame];
            let verdict = frame.see_member(&glance, target, &target_back);
            let refused = frame.members[observer].refused;
            self.count(pending.observer, verdict, refused);
            return;
        }
        let (point, noise) = seen_at(&pending.relation);
        let lasting = self.parameters.lasting_range_error * point.norm();
        let observer_pose = mover(frame, observer).pose * back.inverse();
        let target_pose = mover(target_frame, target).pose * target_back.inverse();
        let meeting = Meeting {
            frames: [frame, target_frame],
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
    fn merge_with(&mut self, agent: u32, label: Option<&Label>) {
        let own = self.seats[agent as usize].frame;
        if self
            .frames
            .iter()
            .filter(|frame| !frame.members.is_empty())
            .count()
            < 2
        {
            return;
        }
        for other in 0..self.frames.len() {
            let knows = |frame: &Frame| label.is_none_or(|label| frame.marks.contains_key(label));
            if other == own || self.frames[other].members.is_empty() || !knows(&self.frames[other])
            {
                continue;
            }
            let (older, newer) = (own.min(other), own.max(other));
            let mut pairs = self.frames[older].shared(&self.frames[newer]);
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
            let is_planar = self.frames[older].is_planar() && self.frames[newer].is_planar();
            if let Some(tie) = tie(&pairs, is_planar) {
                let merged = std::mem::take(&mut self.frames[newer]);
                self.frames[older].merge(merged, &tie, &self.parameters);
                for seat in self.seats.iter_mut().filter(|seat| seat.frame == newer) {
                    seat.frame = older;
                }
                self.meetings
                    .retain(|meeting| !meeting.frames.contains(&newer));
                return;
            }
        }
    }

    /// Counts what became of a sighting.
    fn count(&mut self, agent: u32, verdict: Verdict, refused: u32) {
        let evidence = &mut self.seats[agent as usize].evidence;
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

    /// Whether it is known where an agent stands in the map.
    pub fn is_in_map(&self, agent: u32) -> bool {
        let seat = self.seats.get(agent as usize);
        seat.is_some_and(|seat| seat.frame == MAP)
    }

    /// Pose of an agent in its frame, with its covariance.
    pub fn pose(&self, agent: u32) -> Option<(Isometry3<f64>, PoseCovariance)> {
        let seat = self.seats.get(agent as usize)?;
        let frame = &self.frames[seat.frame];
        let mover = &frame.members[frame.member(agent)?].mover;
        Some((mover.pose, mover.pose_covariance()))
    }

    /// Pose of an agent by motion alone since its session began.
    pub fn in_odom(&self, agent: u32) -> Option<&Isometry3<f64>> {
        Some(&self.seats.get(agent as usize)?.in_odom)
    }

    /// What became of an agent's sightings.
    pub fn evidence(&self, agent: u32) -> Option<&Evidence> {
        Some(&self.seats.get(agent as usize)?.evidence)
    }

    /// The landmarks of the map that are estimated jointly now, by label: position \[m\] and covariance
    /// \[m²\].
    pub fn landmarks(&self) -> impl Iterator<Item = (&Label, Point3<f64>, Matrix3<f64>)> {
        let frame = &self.frames[MAP];
        frame
            .marks
            .iter()
            .map(|(label, mark)| (label, mark.position, frame.mark_covariance(mark)))
    }
}
