//! The keyframe graph, and what is added to it.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector6};
use place_recognition::{LearnedChannel, ViewMap, ViewMatch};

use super::agent_track::{AgentTrack, is_level};
use super::attachments::Attachments;
use super::chains::Chains;
use super::constraint::{ClosureState, Constraint};
use super::constraints::Constraints;
use super::matching::ViewMatches;
use super::meanwhile::Meanwhile;
use super::moment::Moment;
use super::own_frame::OwnFrame;
use super::settings::KeyframeSettings;
use super::sightings::Sightings;
use super::tuning;
use crate::estimator::Calibrated;
use crate::input::StartPose;
use geometry::PoseCovariance;
use state::{NONE, PagedVec};

/// The keyframe graph: the past motions and sightings of all agents, to be smoothed.
///
/// [`refine`](Self::refine) is a pure function of what was added. A clone is a snapshot that shares
/// all pages.
#[derive(Clone, Debug)]
pub struct KeyframeGraph {
    pub(super) settings: KeyframeSettings,
    /// The revision under which changes are noted; for checkpoints only.
    pub(super) revision: u64,
    /// The keyframes, and where the agents are now.
    pub(super) chains: Chains,
    /// Sightings from keyframes.
    pub(super) sightings: Sightings,
    /// Start poses and loop closures.
    pub(super) constraints: Constraints,
    /// Matches of views, by the whole map as it was when they were last matched.
    pub(super) matches: ViewMatches,
    /// What was learned of the channels of views when they were last matched.
    pub(super) learned: Arc<[LearnedChannel]>,
    /// The views of each of these channels where the latest relaxation has them.
    pub(super) view_maps: PagedVec<ViewMap, 1>,
    /// Places that keep their pose relative to a keyframe.
    pub(super) attachments: Attachments,
    /// What has come since a relaxation began that is under way.
    pub(super) meanwhile: Option<Box<Meanwhile>>,
}

impl KeyframeGraph {
    /// Without any agent.
    pub fn new(settings: KeyframeSettings) -> Self {
        Self {
            settings,
            revision: 1,
            chains: Chains::default(),
            sightings: Sightings::default(),
            constraints: Constraints::default(),
            matches: ViewMatches::default(),
            learned: Arc::default(),
            view_maps: PagedVec::default(),
            attachments: Attachments::default(),
            meanwhile: None,
        }
    }

    /// Says under which revision changes are noted from now on: a checkpoint since a revision holds
    /// the later ones.
    pub fn set_revision(&mut self, revision: u64) {
        self.revision = revision;
    }

    /// Number of keyframes.
    pub fn n_keyframes(&self) -> usize {
        self.chains.keyframes.len()
    }

    /// Number of sightings, those joined into one counted once.
    pub fn n_sightings(&self) -> usize {
        self.sightings.slab.len()
    }

    /// Whether a constraint is one of robots that all stay in the plane.
    pub(super) fn is_planar(&self, constraint: &Constraint) -> bool {
        [constraint.from, constraint.to].iter().all(|&end| {
            let keyframe = self.chains.keyframes.get(end);
            let track = keyframe.and_then(|keyframe| self.chains.track(keyframe.agent));
            track.is_none_or(|track| track.is_planar)
        })
    }

    /// Whether so much is sighted that the map needs no views to hold together.
    pub(super) fn is_tied_by_sightings(&self) -> bool {
        self.n_sightings() * tuning::KEYFRAMES_PER_SIGHTING >= self.n_keyframes()
    }

    /// Adds an agent in a frame of its own; answers its number, counted from 0.
    pub fn enrol(&mut self) -> u32 {
        let agent = u32::try_from(self.chains.tracks.len()).unwrap_or(NONE);
        self.chains.tracks.push(AgentTrack::new(), self.revision);
        agent
    }

    /// The end of an agent's chain, to be changed.
    pub(super) fn track_mut(&mut self, agent: u32) -> Option<&mut AgentTrack> {
        self.chains.track_mut(agent, self.revision)
    }

    /// The frame of an agent becomes that of the map: its first keyframe is the origin.
    pub fn found(&mut self, agent: u32) {
        let Some(track) = self.chains.track(agent) else {
            return;
        };
        if track.is_in_map() {
            return;
        }
        self.placed(agent, &Isometry3::identity());
        let first = self.chains.first(agent);
        if let Some(keyframe) = self.chains.keyframes.get(first) {
            let (at, known) = (keyframe.pose, PoseCovariance::zero());
            self.add_constraint(Constraint::to_map(first, at, &known, ClosureState::Origin));
        } else if let Some(track) = self.track_mut(agent) {
            track.is_origin = true;
        }
    }

    /// Aligns the frame of an agent with the map. All its keyframes move with it.
    pub fn placed(&mut self, agent: u32, frame: &Isometry3<f64>) {
        let Some(track) = self.track_mut(agent) else {
            return;
        };
        if !track.is_in_map() {
            track.own_frame = OwnFrame(Some(*frame));
            track.pose = frame * track.pose;
        }
    }

    /// Transforms the poses of an agent from its own frame to another one that is not the map's.
    /// Walks the whole chain of the agent; keyframes from before it was detached stay in the map.
    pub fn transformed(&mut self, agent: u32, frame: &Isometry3<f64>) {
        let revision = self.revision;
        let Some(track) = self.track_mut(agent) else {
            return;
        };
        if track.is_in_map() {
            return;
        }
        track.pose = frame * track.pose;
        let mut number = track.newest;
        while let Some(keyframe) = self.chains.keyframes.get_mut(number, revision) {
            if !keyframe.is_in_map {
                keyframe.pose = frame * keyframe.pose;
            }
            number = keyframe.previous;
        }
    }

    /// Detaches an agent: it begins anew in a frame of its own, and what it did in the map no
    /// longer counts there.
    pub fn set_aside(&mut self, agent: u32) {
        self.cut(agent);
        let Some(track) = self.track_mut(agent) else {
            return;
        };
        track.own_frame = OwnFrame(None);
        track.is_origin = false;
        track.begins_anew = true;
        track.pose = Isometry3::identity();
        if !track.needs_keyframe {
            self.add_keyframe(agent);
        }
    }

    /// Sets the pose of an agent in the map. If it was in the map already, no motion leads there
    /// from what it did before.
    pub fn start_pose(&mut self, moment: &Moment, start: &StartPose) {
        self.cut(moment.agent);
        let Some(track) = self.chains.track(moment.agent) else {
            return;
        };
        let was_in_map = track.is_in_map();
        let own_frame = start.pose() * track.pose.inverse();
        self.placed(moment.agent, &own_frame);
        self.note(moment);
        let Some(track) = self.track_mut(moment.agent) else {
            return;
        };
        track.pose = *start.pose();
        track.begins_anew |= was_in_map;
        track.is_origin = false;
        track.is_planar &= is_level(start.pose());
        let keyframe = self.add_keyframe(moment.agent);
        let covariance = PoseCovariance::from_sd(start.noise().sd());
        let (at, state) = (*start.pose(), ClosureState::Stated);
        self.add_constraint(Constraint::to_map(keyframe, at, &covariance, state));
    }

    /// Begins a session of an agent, which may have been moved by about `sd` \[m, m, m, rad, rad,
    /// rad\] since its latest sample.
    pub fn restart(&mut self, agent: u32, sd: &Vector6<f64>) {
        self.go_unseen(agent, sd);
        if let Some(track) = self.track_mut(agent) {
            track.session += 1;
        }
    }

    /// An agent may have moved by about `sd` \[m, m, m, rad, rad, rad\] unseen: what it did before
    /// is known as well as ever, and what it sees from now on is seen from elsewhere.
    pub fn go_unseen(&mut self, agent: u32, sd: &Vector6<f64>) {
        let Some(track) = self.chains.track(agent) else {
            return;
        };
        if track.newest != NONE && *track.since.motion() != Isometry3::identity() {
            self.add_keyframe(agent);
        }
        if let Some(track) = self.track_mut(agent) {
            track.needs_keyframe = true;
            track.since.inflate(&sd.component_mul(sd));
        }
        if let Some(meanwhile) = &mut self.meanwhile {
            meanwhile.inflate(agent, &sd.component_mul(sd));
        }
    }

    /// A new stretch of an agent, there if a pose is given: no motion leads to it.
    pub(super) fn begin_stretch(&mut self, agent: u32, at: Option<&Isometry3<f64>>) {
        self.cut(agent);
        if let Some(track) = self.track_mut(agent) {
            track.begins_anew = true;
            track.pose = at.copied().unwrap_or(track.pose);
        }
        self.add_keyframe(agent);
    }

    /// Where an agent was says no longer where it is: for a relaxation under way.
    pub(super) fn cut(&mut self, agent: u32) {
        if let Some(meanwhile) = &mut self.meanwhile {
            meanwhile.cut(agent);
        }
    }

    /// Notes the present sample and pose of an agent that has not moved.
    pub(super) fn note(&mut self, moment: &Moment) {
        if let Some(track) = self.track_mut(moment.agent) {
            track.note(moment);
        }
    }

    /// Adds a motion of an agent, in its frame before, with the variances of the error on its right
    /// \[m², m², m², rad², rad², rad²\]; `calibrated` says how the motion was corrected.
    pub fn motion(
        &mut self,
        moment: &Moment,
        increment: &Isometry3<f64>,
        variance: &Vector6<f64>,
        calibrated: &Calibrated,
    ) {
        let agent = moment.agent;
        let schedule = &mut self.constraints.schedule;
        schedule.records = schedule.records.saturating_add(1);
        let Some(track) = self.chains.track(agent) else {
            return;
        };
        if track.needs_keyframe {
            // The first keyframe lies where the agent was before it moved.
            self.note(&Moment {
                pose: moment.pose * increment.inverse(),
                ..*moment
            });
            self.add_keyframe(agent);
        }
        if let Some(meanwhile) = &mut self.meanwhile {
            meanwhile.go(agent, increment, variance);
        }
        let (spacing, attached) = (self.settings.spacing, self.settings.attached_within());
        let Some(track) = self.track_mut(agent) else {
            return;
        };
        track.go(moment, increment, variance, calibrated);
        let is_step = !track.is_near(spacing);
        let rests = track.rests_elsewhere(moment, attached);
        if is_step || rests {
            self.add_keyframe(agent);
        }
    }

    /// An agent's motions are corrected in another way from now on: those until now end at a
    /// keyframe.
    pub fn end_motion(&mut self, agent: u32) {
        let track = self.chains.track(agent);
        if track.is_some_and(|track| !track.needs_keyframe && !track.is_near((0.0, 0.0))) {
            self.add_keyframe(agent);
        }
    }

    /// Adds a keyframe where an agent is; answers its number, or that of the latest one if memory
    /// is full.
    pub(super) fn add_keyframe(&mut self, agent: u32) -> u32 {
        let is_full = |this: &Self| this.n_keyframes() >= this.settings.keyframes_max as usize;
        if is_full(self) {
            self.sparsify();
        }
        let Some(track) = self.chains.track(agent) else {
            return NONE;
        };
        if is_full(self) {
            return track.newest;
        }
        let (pose, is_origin) = (track.pose, track.is_origin);
        let number = self.chains.append(agent, self.revision);
        let schedule = &mut self.constraints.schedule;
        schedule.keyframes = schedule.keyframes.saturating_add(1);
        if let Some(meanwhile) = &mut self.meanwhile {
            meanwhile.keyframes.insert(number);
        }
        if is_origin {
            let (known, state) = (PoseCovariance::zero(), ClosureState::Origin);
            self.add_constraint(Constraint::to_map(number, pose, &known, state));
        }
        number
    }

    /// Adds a constraint; answers its number, or [`NONE`] if memory is full or an end is gone.
    pub(super) fn add_constraint(&mut self, constraint: Constraint) -> u32 {
        let number = self.put_constraint(constraint);
        if let Some(meanwhile) = &mut self.meanwhile {
            meanwhile.constraints.insert(number);
        }
        number
    }

    /// The same for one that was taken out a moment ago to be changed: it is no other one than
    /// before, and has the same number, which is the latest that became vacant.
    pub(super) fn put_constraint(&mut self, constraint: Constraint) -> u32 {
        let (keyframes, most) = (&mut self.chains.keyframes, self.settings.constraints_max);
        self.constraints
            .add(constraint, keyframes, most, self.revision)
    }

    /// Removes a constraint; answers it.
    pub(super) fn remove_constraint(&mut self, number: u32) -> Option<Constraint> {
        let keyframes = &mut self.chains.keyframes;
        self.constraints.remove(number, keyframes, self.revision)
    }

    /// Whether a graph that was read from a checkpoint is sound: damaged bytes must not pass for
    /// one. All numbers lead somewhere, and all lists come to an end.
    pub(super) fn is_sound(&self) -> bool {
        let keyframes = &self.chains.keyframes;
        self.chains.is_sound()
            && self.sightings.is_sound(keyframes)
            && self.constraints.is_sound(keyframes)
            && self.attachments.is_sound(keyframes)
            && self.matches.iter().all(ViewMatch::is_sound)
            && self.learned.iter().all(LearnedChannel::is_sound)
            && { self.meanwhile.iter() }.all(|since| since.is_sound(self.chains.tracks.len()))
    }
}
