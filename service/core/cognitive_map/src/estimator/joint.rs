//! All frames of a space, and the samples that move and correct what is in them.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector6};

use super::agent_filter::AgentFilter;
use super::agent_sighting::{CrossFrameSighting, PendingSighting};
use super::agent_slot::{AgentSlot, AgentState, Detached};
use super::associations::Associations;
use super::frame::{Frame, LandmarkState, MEMBERS_MAX};
use super::frame_registration::FrameMatch;
use super::measurement_update::{Measurement, Verdict};
use super::outcome::{Evidence, LandmarkOutcome, Merged, Settled, Step};
use super::parameters::{ANY_TURN_SD_RAD, Parameters};
use crate::input::{Label, Motion, Relation, StartPose};
use ::state::PagedVec;
use geometry::PoseCovariance;

/// Longest interval between two motions over which a bias counts \[s\].
const DURATION_S_MAX: f64 = 10.0;

/// The joint estimate of all agents and landmarks of a space.
///
/// Every agent begins in a frame of its own. The first frame is that of the map: an agent enters it by
/// [`Estimator::found`] or by a start pose. Frames are laid into one another as soon as enough points
/// are known in both: landmarks, and places where one agent saw the other, or when the landmarks of both lie alike under
/// other names. The older frame prevails.
///
/// An agent takes part in the joint estimate of its frame from its first sighting on, or from when it is
/// first seen; of more than 32, the one whose latest sighting is longest ago goes on by itself and comes
/// back with its next one. There are as many frames as there have been agents, and one more; an empty
/// one holds nothing.
///
/// A clone is a snapshot: it shares everything, and only what changes afterwards is copied.
#[derive(Clone, Debug)]
pub struct Estimator {
    pub(super) parameters: Parameters,
    /// The map's frame, then one for each agent; empty ones were merged into earlier ones.
    pub(super) frames: PagedVec<Frame, 8>,
    pub(super) slots: PagedVec<AgentSlot, 16>,
    pub(super) pending: Vec<PendingSighting>,
    pub(super) cross_sightings: Vec<CrossFrameSighting>,
    /// The frame from which on others are compared next.
    pub(super) turn: usize,
    /// How frames seem to lie in one another by their landmarks, whatever these are called.
    pub(super) frame_matches: Vec<FrameMatch>,
    /// Landmarks that have more than one name.
    pub(super) associations: Associations,
    /// What the latest call settled and merged.
    pub(super) settled: Vec<Settled>,
    pub(super) merged: Vec<Merged>,
    /// What it found to be one landmark: the name that was given up, and the one that stays.
    pub(super) same: Vec<(Label, Label)>,
    /// Whom it set aside.
    pub(super) set_aside: Vec<u32>,
}

/// The frame of the map.
pub(super) const MAP: usize = 0;

impl Estimator {
    /// Without any agent.
    pub fn new(parameters: Parameters) -> Self {
        let mut frames = PagedVec::default();
        frames.push(Frame::default(), 0);
        Self {
            parameters,
            frames,
            slots: PagedVec::default(),
            pending: Vec::new(),
            cross_sightings: Vec::new(),
            turn: 0,
            frame_matches: Vec::new(),
            associations: Associations::default(),
            settled: Vec::new(),
            merged: Vec::new(),
            same: Vec::new(),
            set_aside: Vec::new(),
        }
    }

    /// The same estimate, which goes on with other parameters.
    pub(crate) fn with_parameters(mut self, parameters: Parameters) -> Self {
        self.parameters = parameters;
        self
    }

    /// What it takes for granted.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Number of agents.
    pub fn agent_count(&self) -> usize {
        self.slots.len()
    }

    /// A new agent, at the identity of a frame of its own; answers its number, counted from 0.
    pub fn enrol(&mut self) -> u32 {
        let agent = u32::try_from(self.slots.len()).unwrap_or(u32::MAX);
        let filter = AgentFilter::new(Isometry3::identity(), &Matrix6::zeros(), &self.parameters);
        self.slots
            .push(AgentSlot::new(self.frames.len(), filter), 0);
        let frame = Frame {
            population: 1,
            ..Frame::default()
        };
        self.frames.push(frame, 0);
        agent
    }

    /// Makes an agent's frame that of the map, if nobody is in that yet; answers whether it did.
    pub fn found(&mut self, agent: u32) -> bool {
        let Some(from) = self.frame_of(agent) else {
            return false;
        };
        if from == MAP || self.frame(MAP).population > 0 {
            return false;
        }
        let frame = std::mem::take(self.frame_mut(from));
        *self.frame_mut(MAP) = frame;
        self.move_slots(from, MAP);
        self.frame_matches
            .retain(|frame_match| !frame_match.frames.contains(&from));
        for cross_sighting in &mut self.cross_sightings {
            for frame in cross_sighting
                .frames
                .iter_mut()
                .filter(|frame| **frame == from)
            {
                *frame = MAP;
            }
        }
        true
    }

    /// An agent was told where it stands in the map.
    pub fn start_pose(&mut self, agent: u32, start: &StartPose) {
        self.begin();
        let sd = start.noise().sd();
        // No rotation is off by more than half a turn.
        let sd = Vector6::from_fn(|k, _| {
            if k < 3 {
                sd[k]
            } else {
                sd[k].min(ANY_TURN_SD_RAD)
            }
        });
        let covariance = PoseCovariance::from_sd(&sd);
        self.put(agent, start.pose(), covariance.matrix());
        if self.filter(agent).is_some_and(AgentFilter::is_nowhere) {
            self.set_aside(agent);
        }
    }

    /// Puts an agent somewhere in the map, by itself.
    pub(super) fn put(&mut self, agent: u32, pose: &Isometry3<f64>, covariance: &Matrix6<f64>) {
        let doubt = self.doubt_of_return(agent);
        let Some((from, state)) = self.leave(agent) else {
            return;
        };
        self.depart(from);
        self.frame_mut(MAP).population += 1;
        let AgentState {
            filter, mut sensor, ..
        } = Arc::unwrap_or_clone(state);
        // Numbers of landmarks change.
        sensor.latest.clear();
        let state = AgentState {
            filter: filter.placed(*pose, covariance),
            sensor,
            refused: 0,
            // Who was doubted stays so until what it sees fits.
            doubt,
        };
        let slot = self.slot_mut(agent);
        slot.frame = MAP;
        slot.detached = Some(Detached::new(Arc::new(state)));
    }

    /// A new session of an agent: its odometry begins anew, and it may have been moved by about `sd`
    /// \[m, m, m, rad, rad, rad\] since.
    pub fn restart(&mut self, agent: u32, sd: &Vector6<f64>) {
        let Some(frame) = self.frame_of(agent) else {
            return;
        };
        let slot = self.slot_mut(agent);
        slot.in_odom = Isometry3::identity();
        slot.stamp_ns = None;
        let widen = |state: &mut AgentState| {
            state.filter.history.clear();
            let covariance = state.filter.covariance_mut();
            for k in 0..6 {
                covariance[(k, k)] += sd[k] * sd[k];
            }
        };
        if let Some(detached) = &mut slot.detached {
            widen(Arc::make_mut(&mut detached.state));
        } else {
            let frame = self.frame_mut(frame);
            frame.flush();
            if let Some(index) = frame.member(agent) {
                let member = &mut frame.members[index];
                widen(member.state_mut());
                let own = member.state.filter.covariance();
                frame.covariance.set_diagonal(member.offset, own);
            }
        }
        self.forget_pending(agent);
    }

    /// An agent moved.
    ///
    /// Costs the same however much is known.
    pub fn motion(&mut self, agent: u32, stamp_ns: i64, motion: &Motion) -> Step {
        self.begin();
        let Some(slot) = self.slots.get_mut(agent as usize, 0) else {
            return Step::none();
        };
        let state = if let Some(detached) = &mut slot.detached {
            Arc::make_mut(&mut detached.state)
        } else if let Some(frame) = self.frames.get_mut(slot.frame, 0)
            && let Some(index) = frame.member(agent)
        {
            frame.members[index].state_mut()
        } else {
            return Step::none();
        };
        let before_ns = slot.stamp_ns.replace(stamp_ns);
        let duration_s = before_ns.map_or(0.0, |before| {
            let interval_s = stamp_ns.saturating_sub(before) as f64 * 1e-9;
            interval_s.clamp(0.0, DURATION_S_MAX)
        });
        let filter = &mut state.filter;
        let step = filter.step(motion, duration_s, &self.parameters);
        slot.in_odom *= motion.increment();
        slot.in_odom.rotation.renormalize_fast();
        filter.history.note(stamp_ns, &slot.in_odom);
        if filter.is_nowhere() {
            self.set_aside(agent);
        }
        if !self.pending.is_empty() {
            self.take_in_pending();
        }
        step
    }

    /// An agent saw a landmark.
    pub fn landmark(
        &mut self,
        agent: u32,
        stamp_ns: i64,
        label: &Label,
        relation: &Relation,
    ) -> LandmarkOutcome {
        self.begin();
        let Some((number, observer)) = self.join_estimate(agent) else {
            return LandmarkOutcome::nothing();
        };
        let called = label;
        let label = &self.associations.name_of(called).clone();
        let is_aside = self.is_aside_for(agent, number, label);
        let Some(frame) = self.frames.get_mut(number, 0) else {
            return LandmarkOutcome::nothing();
        };
        if is_aside {
            frame.forget(label);
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
        self.sweep(number);
        self.judge_evidence(agent);
        if self.frame_of(agent) == Some(number) {
            self.merge_with(agent, Some(label));
        }
        if self.frame_of(agent) == Some(number) {
            self.associate_landmarks(number, agent);
        }
        LandmarkOutcome {
            is_new: outcome.verdict == Verdict::Learned,
            accepted: outcome.verdict != Verdict::Refused,
            variance: outcome.variance.fixed_rows::<3>(0).into_owned(),
        }
    }

    /// Forgets what the call before told.
    pub(super) fn begin(&mut self) {
        self.settled.clear();
        self.merged.clear();
        self.same.clear();
        self.set_aside.clear();
    }

    /// Lets an agent take part in the joint estimate of its frame, as one that was just seen or saw;
    /// answers where it is.
    pub(super) fn join_estimate(&mut self, agent: u32) -> Option<(usize, usize)> {
        let number = self.frame_of(agent)?;
        if self.slot(agent)?.detached.is_some() {
            if self.frame(number).members.len() >= MEMBERS_MAX {
                self.detach_idlest(number);
            }
            if let Some(detached) = self.slot_mut(agent).detached.take() {
                self.frame_mut(number).join(agent, detached.independent());
            }
        }
        let frame = self.frame_mut(number);
        let index = frame.member(agent)?;
        frame.note_use(index);
        Some((number, index))
    }

    /// Lets the agent go on by itself that saw and was seen longest ago.
    pub(super) fn detach_idlest(&mut self, frame: usize) {
        let frame = self.frame_mut(frame);
        if let Some(agent) = frame.idlest()
            && let Some(state) = frame.leave(agent)
        {
            self.slot_mut(agent).detached = Some(Detached {
                state,
                was_joint: true,
            });
        }
    }

    /// Takes an agent out of its frame's joint estimate, without a place of its own for now.
    pub(super) fn leave(&mut self, agent: u32) -> Option<(usize, Arc<AgentState>)> {
        let number = self.frame_of(agent)?;
        let state = match self.slot_mut(agent).detached.take() {
            Some(detached) => detached.state,
            None => self.frame_mut(number).leave(agent)?,
        };
        Some((number, state))
    }

    /// The agents of one frame are in another one now; answers their numbers.
    pub(super) fn move_slots(&mut self, from: usize, to: usize) -> Vec<u32> {
        let slots = self.slots.iter().zip(0..);
        let moved = slots.filter(|(slot, _)| slot.frame == from);
        let moved: Vec<u32> = moved.map(|(_, agent)| agent).collect();
        for &agent in &moved {
            self.slot_mut(agent).frame = to;
        }
        moved
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

    /// An agent's slot.
    pub(super) fn slot(&self, agent: u32) -> Option<&AgentSlot> {
        self.slots.get(agent as usize)
    }

    /// The slot of an agent that is known to have one, to be changed.
    pub(super) fn slot_mut(&mut self, agent: u32) -> &mut AgentSlot {
        let slot = self.slots.get_mut(agent as usize, 0);
        slot.expect("an agent has a slot")
    }

    /// A frame that is known to be there.
    pub(super) fn frame(&self, number: usize) -> &Frame {
        self.frames.get(number).expect("a slot's frame is there")
    }

    /// A frame that is known to be there, to be changed.
    pub(super) fn frame_mut(&mut self, number: usize) -> &mut Frame {
        let frame = self.frames.get_mut(number, 0);
        frame.expect("a slot's frame is there")
    }

    /// What is known of an agent itself.
    pub(super) fn agent_state(&self, agent: u32) -> Option<&AgentState> {
        let slot = self.slot(agent)?;
        if let Some(detached) = &slot.detached {
            return Some(&detached.state);
        }
        let frame = self.frame(slot.frame);
        Some(&frame.members[frame.member(agent)?].state)
    }

    /// The same, to be changed.
    pub(super) fn agent_state_mut(&mut self, agent: u32) -> Option<&mut AgentState> {
        let slot = self.slots.get_mut(agent as usize, 0)?;
        if let Some(detached) = &mut slot.detached {
            return Some(Arc::make_mut(&mut detached.state));
        }
        let frame = self.frames.get_mut(slot.frame, 0)?;
        let index = frame.member(agent)?;
        Some(frame.members[index].state_mut())
    }

    /// The body of an agent.
    pub(super) fn filter(&self, agent: u32) -> Option<&AgentFilter> {
        Some(&self.agent_state(agent)?.filter)
    }

    /// Number of the frame that an agent is in; the map's is 0.
    pub fn frame_of(&self, agent: u32) -> Option<usize> {
        Some(self.slot(agent)?.frame)
    }

    /// Whether it is known where an agent stands in the map.
    pub fn is_in_map(&self, agent: u32) -> bool {
        self.frame_of(agent) == Some(MAP)
    }

    /// Pose of an agent in its frame, with its covariance.
    pub fn pose(&self, agent: u32) -> Option<(Isometry3<f64>, PoseCovariance)> {
        let filter = self.filter(agent)?;
        Some((filter.pose, filter.pose_covariance()))
    }

    /// Covariance of the pose of an agent.
    pub fn covariance(&self, agent: u32) -> Option<PoseCovariance> {
        Some(self.filter(agent)?.pose_covariance())
    }

    /// Pose of an agent in its frame.
    pub fn in_frame(&self, agent: u32) -> Option<&Isometry3<f64>> {
        Some(&self.filter(agent)?.pose)
    }

    /// Pose of an agent by motion alone since its session began.
    pub fn in_odom(&self, agent: u32) -> Option<&Isometry3<f64>> {
        Some(&self.slot(agent)?.in_odom)
    }

    /// What became of an agent's sightings.
    pub fn evidence(&self, agent: u32) -> Option<&Evidence> {
        Some(&self.slot(agent)?.evidence)
    }

    /// Takes what the latest call settled: sightings of agents, in the order in which they count.
    /// What is not taken is dropped by the next motion or sighting.
    pub fn take_settled(&mut self) -> Vec<Settled> {
        std::mem::take(&mut self.settled)
    }

    /// Takes which frames the latest call laid into others. What is not taken is dropped by the next
    /// motion or sighting.
    pub fn take_merged(&mut self) -> Vec<Merged> {
        std::mem::take(&mut self.merged)
    }

    /// Takes which names the latest call found to be those of one landmark: each time the name that was given up, and the one that
    /// stays. What is not taken is dropped by the next motion or sighting.
    pub fn take_same(&mut self) -> Vec<(Label, Label)> {
        std::mem::take(&mut self.same)
    }

    /// The one name of a landmark that may have several.
    pub fn name_of<'a>(&'a self, label: &'a Label) -> &'a Label {
        self.associations.name_of(label)
    }

    /// The names of landmarks that go by another one.
    pub fn other_names(&self) -> impl Iterator<Item = &Label> {
        self.associations.names.keys()
    }

    /// The landmarks of the map that are estimated jointly now, by label: position \[m\] and covariance
    /// \[m²\]. Those are left out that only agents have seen which are set aside.
    pub fn landmarks(&self) -> impl Iterator<Item = (&Label, Point3<f64>, Matrix3<f64>)> {
        let frame = self.frame(MAP);
        let is_aside =
            |landmark: &LandmarkState| landmark.observers.are_all(|agent| self.is_aside(agent));
        let landmarks = frame
            .landmarks
            .iter()
            .filter(move |(_, landmark)| !is_aside(landmark));
        landmarks.map(|(label, landmark)| {
            (
                label,
                landmark.position,
                frame.landmark_covariance(landmark),
            )
        })
    }
}
