//! The keyframe graph, and what is added to it.

use nalgebra::{Isometry3, Vector6};

use super::agent_track::AgentTrack;
use super::attachment::Attachments;
use super::constraint::{ClosureState, Constraint};
use super::keyframe::Keyframe;
use super::keyframe_index::KeyframeIndex;
use super::landmarks::Landmarks;
use super::settings::KeyframeSettings;
use super::sighting::{PendingSighting, Sighting};
use super::tuning;
use crate::estimator::Calibrated;
use crate::input::StartPose;
use geometry::{PoseCovariance, is_within};
use state::PagedVec;
use state::{NONE, Slab};

/// A moment of an agent.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Number of the agent.
    pub agent: u32,
    /// Number of the sample within the agent's session.
    pub seq: u64,
    /// Its stamp \[ns\].
    pub stamp_ns: i64,
    /// Pose of the agent after it, in the frame in which it is estimated: the initial value of
    /// relaxations.
    pub pose: Isometry3<f64>,
}

/// The keyframe graph: the past motions and sightings of all agents, to be smoothed.
///
/// [`refine`](Self::refine) is a pure function of what was added. A clone is a snapshot that shares
/// all pages.
#[derive(Clone, Debug)]
pub struct KeyframeGraph {
    pub(super) settings: KeyframeSettings,
    /// The revision under which changes are noted; for checkpoints only.
    pub(super) revision: u64,
    pub(super) tracks: PagedVec<AgentTrack, 4>,
    pub(super) keyframes: Slab<Keyframe, 32>,
    pub(super) sightings: Slab<Sighting, 64>,
    pub(super) constraints: Slab<Constraint, 32>,
    pub(super) landmarks: Landmarks,
    /// Places that keep their pose relative to a keyframe.
    pub(super) attachments: Attachments,
    /// Sightings of agents whose motion has not come up to them yet.
    pub(super) pending: Vec<PendingSighting>,
    /// Sweep cursor: the number of the keyframe at which sparsification goes on.
    pub(super) sweep: u32,
    /// When to relax.
    pub(super) schedule: Schedule,
    pub(super) index: KeyframeIndex,
}

/// What has come in since the last relaxation.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Schedule {
    /// Motions.
    pub(super) records: u32,
    /// Loop closures that were kept.
    pub(super) new_closures: u32,
    /// Those of them that were accepted at once.
    pub(super) accepted: u32,
}

impl KeyframeGraph {
    /// Without any agent.
    pub fn new(settings: KeyframeSettings) -> Self {
        Self {
            settings,
            revision: 1,
            tracks: PagedVec::default(),
            keyframes: Slab::default(),
            sightings: Slab::default(),
            constraints: Slab::default(),
            landmarks: Landmarks::default(),
            attachments: Attachments::default(),
            pending: Vec::new(),
            sweep: 0,
            schedule: Schedule::default(),
            index: KeyframeIndex::default(),
        }
    }

    /// Says under which revision changes are noted from now on: a checkpoint since a revision holds
    /// the later ones.
    pub fn set_revision(&mut self, revision: u64) {
        self.revision = revision;
    }

    /// Number of keyframes.
    pub fn n_keyframes(&self) -> usize {
        self.keyframes.len()
    }

    /// Number of sightings, those joined into one counted once.
    pub fn n_sightings(&self) -> usize {
        self.sightings.len()
    }

    /// Adds an agent in a frame of its own; answers its number, counted from 0.
    pub fn enrol(&mut self) -> u32 {
        let agent = u32::try_from(self.tracks.len()).unwrap_or(NONE);
        self.tracks.push(AgentTrack::new(), self.revision);
        agent
    }

    /// The frame of an agent becomes that of the map: its first keyframe is the origin.
    pub fn found(&mut self, agent: u32) {
        let Some(track) = self.tracks.get(agent as usize) else {
            return;
        };
        if track.is_in_map {
            return;
        }
        self.placed(agent, &Isometry3::identity());
        let first = self.first_keyframe(agent);
        if let Some(keyframe) = self.keyframes.get(first) {
            let at = keyframe.pose;
            self.constrain_to_map(first, at, &PoseCovariance::zero(), ClosureState::Origin);
        } else if let Some(track) = self.tracks.get_mut(agent as usize, self.revision) {
            track.is_origin = true;
        }
    }

    /// Aligns the frame of an agent with the map. All its keyframes move with it.
    pub fn placed(&mut self, agent: u32, frame: &Isometry3<f64>) {
        let revision = self.revision;
        let Some(track) = self.tracks.get_mut(agent as usize, revision) else {
            return;
        };
        if !track.is_in_map {
            track.own_frame = Some(*frame);
            track.is_in_map = true;
            track.pose = frame * track.pose;
        }
    }

    /// Transforms the poses of an agent from its own frame to another one that is not the map's.
    /// Walks the whole chain of the agent; keyframes from before it was detached stay in the map.
    pub fn transformed(&mut self, agent: u32, frame: &Isometry3<f64>) {
        let revision = self.revision;
        let Some(track) = self.tracks.get_mut(agent as usize, revision) else {
            return;
        };
        if track.is_in_map {
            return;
        }
        track.pose = frame * track.pose;
        let mut number = track.newest;
        while let Some(keyframe) = self.keyframes.get_mut(number, revision) {
            if !keyframe.is_in_map {
                keyframe.pose = frame * keyframe.pose;
            }
            number = keyframe.previous;
        }
    }

    /// Sets the pose of an agent in the map. If it was in the map already, no motion leads there
    /// from what it did before.
    pub fn start_pose(&mut self, moment: &Moment, start: &StartPose) {
        let Some(track) = self.tracks.get(moment.agent as usize) else {
            return;
        };
        let was_in_map = track.is_in_map;
        let own_frame = start.pose() * track.pose.inverse();
        self.placed(moment.agent, &own_frame);
        self.note(moment);
        let revision = self.revision;
        let Some(track) = self.tracks.get_mut(moment.agent as usize, revision) else {
            return;
        };
        track.pose = *start.pose();
        track.begins_anew |= was_in_map;
        track.is_origin = false;
        track.is_planar &= is_level(start.pose());
        let keyframe = self.add_keyframe(moment.agent);
        let covariance = PoseCovariance::from_sd(start.noise().sd());
        self.constrain_to_map(keyframe, *start.pose(), &covariance, ClosureState::Stated);
    }

    /// Begins a session of an agent, which may have been moved by about `sd` \[m, m, m, rad, rad,
    /// rad\] since its latest sample.
    pub fn restart(&mut self, agent: u32, sd: &Vector6<f64>) {
        let revision = self.revision;
        let Some(track) = self.tracks.get(agent as usize) else {
            return;
        };
        if track.newest != NONE && *track.since.motion() != Isometry3::identity() {
            self.add_keyframe(agent);
        }
        let Some(track) = self.tracks.get_mut(agent as usize, revision) else {
            return;
        };
        track.session += 1;
        track.needs_keyframe = true;
        track.since.inflate(&sd.component_mul(sd));
        self.pending
            .retain(|pending| pending.observer != agent && pending.target != agent);
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
        self.schedule.records = self.schedule.records.saturating_add(1);
        let Some(track) = self.tracks.get(agent as usize) else {
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
        let revision = self.revision;
        let (spacing, attached) = (self.settings.spacing, self.settings.attached_within());
        let Some(track) = self.tracks.get_mut(agent as usize, revision) else {
            return;
        };
        track.go(increment, variance, calibrated);
        track.is_planar &= is_level(increment);
        track.pose = moment.pose;
        (track.seq, track.stamp_ns) = (moment.seq, moment.stamp_ns);
        if is_within(
            track.since.motion(),
            tuning::REST_WITHIN.0,
            tuning::REST_WITHIN.1,
        ) {
            (track.until_seq, track.until_ns) = (moment.seq, moment.stamp_ns);
        }
        let is_step = !is_within(track.since.motion(), spacing.0, spacing.1);
        let mut rests = false;
        if is_within(
            &track.rest.inv_mul(track.since.motion()),
            tuning::REST_WITHIN.0,
            tuning::REST_WITHIN.1,
        ) {
            rests = !is_within(track.since.motion(), attached.0, attached.1)
                && moment.stamp_ns.saturating_sub(track.rest_ns) >= tuning::REST_NS;
        } else {
            track.rest = *track.since.motion();
            (track.rest_seq, track.rest_ns) = (moment.seq, moment.stamp_ns);
        }
        if is_step || rests {
            self.add_keyframe(agent);
        }
        if !self.pending.is_empty() {
            self.resolve_pending();
        }
    }
}

/// Whether a motion keeps the plane.
fn is_level(motion: &Isometry3<f64>) -> bool {
    let axis = motion.rotation.imag();
    motion.translation.z == 0.0 && axis.x == 0.0 && axis.y == 0.0
}
