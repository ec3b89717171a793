//! All frames of a space, with the agents and landmarks in them.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3};

use super::agent_filter::AgentFilter;
use super::agent_slot::{AgentSlot, AgentState, Detached};
use super::associations::Associations;
use super::frame::{Frame, LandmarkState};
use super::frame_match::FrameMatch;
use super::outcome::Evidence;
use super::parameters::Parameters;
use super::sightings::{CrossFrameSighting, PendingSighting};
use super::tuning::MEMBERS_MAX;
use crate::input::Label;
use ::state::PagedVec;
use geometry::PoseCovariance;

/// The joint estimate of all agents and landmarks of a space.
///
/// Every agent begins in a frame of its own. The first frame is that of the map: an agent enters it
/// by [`Estimator::found`] or by a start pose. Frames are laid into one another as soon as enough
/// points are known in both: landmarks, and places where one agent saw the other, or when the
/// landmarks of both have one arrangement under other names. The older frame prevails.
///
/// An agent takes part in the joint estimate of its frame from its first sighting on, or from when
/// it is first seen; of more than 32, the one whose latest sighting is longest ago goes on by
/// itself and comes back with its next one. There are as many frames as there have been agents, and
/// one more; an empty one holds nothing.
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

    /// Lets an agent take part in the joint estimate of its frame, as one that was just seen or
    /// saw; answers where it is.
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
        let frame = self.frames.get(slot.frame)?;
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

    /// Whether it is known where an agent is in the map.
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

    /// Whether all motion of an agent so far was in its x-y plane.
    pub fn is_planar(&self, agent: u32) -> bool {
        self.filter(agent).is_some_and(|filter| filter.is_planar)
    }

    /// Pose of an agent by motion alone since its session began.
    pub fn in_odom(&self, agent: u32) -> Option<Isometry3<f64>> {
        Some(self.filter(agent)?.history.pose())
    }

    /// What became of an agent's sightings.
    pub fn evidence(&self, agent: u32) -> Option<&Evidence> {
        Some(&self.slot(agent)?.evidence)
    }

    /// The one name of a landmark that may have several.
    pub fn name_of<'a>(&'a self, label: &'a Label) -> &'a Label {
        self.associations.name_of(label)
    }

    /// The names of landmarks that go by another one.
    pub fn other_names(&self) -> impl Iterator<Item = &Label> {
        self.associations.names.keys()
    }

    /// The landmarks of the map that are estimated jointly now, by label: position \[m\] and
    /// covariance \[m²\]. Those are left out that only agents have seen which are set aside.
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
