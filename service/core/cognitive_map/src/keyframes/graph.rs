//! The keyframe graph, and what is added to it.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::agent_track::AgentTrack;
use super::attachment::Attachments;
use super::constraint::{ClosureState, Constraint};
use super::keyframe::Keyframe;
use super::keyframe_index::KeyframeIndex;
use super::landmarks::Landmarks;
use super::settings::KeyframeSettings;
use super::sighting::{Seen, SeenPoint, Sighting};
use crate::estimator::Calibrated;
use crate::input::{Label, Relation, StartPose};
use geometry::{PoseCovariance, is_within, se3};
use state::PagedVec;
use state::state_of_struct;
use state::{NONE, Slab};

/// Motion after which a keyframe is added in any case \[m, rad\]: poses between two are
/// interpolated.
const STEP: (f64, f64) = (0.1, 0.1);
/// Motion since a keyframe up to which sightings are attached to it \[m, rad\].
const NEAR: (f64, f64) = (0.02, 0.02);
/// Motion that counts as rest \[m, rad\].
pub(super) const REST: (f64, f64) = (0.005, 0.005);
/// Rest after which a keyframe is added \[ns\].
const REST_NS: i64 = 1_000_000_000;
/// Most sightings that wait for the motion of the agent that was seen.
const WAITING_MAX: usize = 64;
/// Longest time that they wait, by the observer's clock \[ns\].
const PATIENCE_NS: i64 = 2_000_000_000;
/// Keyframes searched back for the instant of a sighting.
const LOOK_BACK_MAX: usize = 256;
/// Most sightings of a keyframe.
pub(super) const SIGHTINGS_PER_KEYFRAME_MAX: usize = 32;

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

/// A sighting of an agent whose motion has not come up to it yet.
#[derive(Clone, Debug)]
pub(super) struct PendingSighting {
    pub(super) keyframe: u32,
    pub(super) observer: u32,
    pub(super) target: u32,
    pub(super) stamp_ns: i64,
    pub(super) point: SeenPoint,
}

state_of_struct!(PendingSighting {
    keyframe,
    observer,
    target,
    stamp_ns,
    point
});

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

/// An instant between keyframes: a keyframe, the motion from there, and the covariance of its
/// error.
pub(super) struct KeyframeOffset {
    pub(super) keyframe: u32,
    pub(super) motion: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
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
        let Some(track) = self.tracks.get_mut(agent as usize, revision) else {
            return;
        };
        track.go(increment, variance, calibrated);
        track.is_planar &= is_level(increment);
        track.pose = moment.pose;
        (track.seq, track.stamp_ns) = (moment.seq, moment.stamp_ns);
        if is_within(track.since.motion(), REST.0, REST.1) {
            (track.until_seq, track.until_ns) = (moment.seq, moment.stamp_ns);
        }
        let is_step = !is_within(track.since.motion(), STEP.0, STEP.1);
        let mut rests = false;
        if is_within(&track.rest.inv_mul(track.since.motion()), REST.0, REST.1) {
            rests = !is_within(track.since.motion(), NEAR.0, NEAR.1)
                && moment.stamp_ns.saturating_sub(track.rest_ns) >= REST_NS;
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

    /// Adds a sighting of a landmark. `variance` is that of the relation's components: along the
    /// axes, or of distance, azimuth and elevation; the angles are those by which the seen
    /// direction is off.
    pub fn landmark(
        &mut self,
        moment: &Moment,
        label: &Label,
        relation: &Relation,
        variance: &Vector3<f64>,
    ) {
        self.note(moment);
        let Some(here) = self.here(moment.agent) else {
            return;
        };
        let point = SeenPoint::new(relation, variance).before(&here.motion, &here.covariance);
        if let Some(landmark) = self.landmarks.show(label, self.revision) {
            self.remember_sighting(here.keyframe, Seen::Landmark(landmark), point);
        }
    }

    /// Adds a sighting of another agent, perhaps at an instant that is over. It takes effect once
    /// both have moved up to it.
    pub fn sighted(
        &mut self,
        observer: u32,
        target: u32,
        stamp_ns: i64,
        relation: &Relation,
        variance: &Vector3<f64>,
    ) {
        if observer == target || target as usize >= self.tracks.len() {
            return;
        }
        let Some(here) = self.at_stamp(observer, stamp_ns) else {
            return; // too long ago
        };
        if self.pending.len() >= WAITING_MAX {
            self.pending.remove(0);
        }
        self.pending.push(PendingSighting {
            keyframe: here.keyframe,
            observer,
            target,
            stamp_ns,
            point: SeenPoint::new(relation, variance).before(&here.motion, &here.covariance),
        });
        self.resolve_pending();
    }

    /// Resolves the pending sightings whose time has come.
    fn resolve_pending(&mut self) {
        for pending in std::mem::take(&mut self.pending) {
            let stamp_ns = |agent: u32| {
                let track = self.tracks.get(agent as usize);
                track
                    .filter(|track| track.newest != NONE)
                    .map(|track| track.stamp_ns)
            };
            if stamp_ns(pending.target).is_some_and(|stamp| stamp >= pending.stamp_ns) {
                self.resolve(&pending);
            } else if stamp_ns(pending.observer)
                .is_none_or(|stamp| stamp.saturating_sub(pending.stamp_ns) < PATIENCE_NS)
            {
                self.pending.push(pending);
            }
        }
    }

    /// Resolves a sighting of an agent.
    fn resolve(&mut self, pending: &PendingSighting) {
        let Some(there) = self.at_stamp(pending.target, pending.stamp_ns) else {
            return; // too long ago
        };
        let (Some(observer), Some(target)) = (
            self.keyframes.get(pending.keyframe),
            self.keyframes.get(there.keyframe),
        ) else {
            return;
        };
        // Noise of the motion from the keyframe, in the frame of the observer.
        let turn = observer.pose.rotation.inverse() * target.pose.rotation * there.motion.rotation;
        let turn = turn.to_rotation_matrix().into_inner();
        let spread = there
            .covariance
            .matrix()
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        let point = SeenPoint {
            fresh: pending.point.fresh + turn * spread * turn.transpose(),
            ..pending.point
        };
        let lever = there.motion.translation.vector;
        self.remember_sighting(pending.keyframe, Seen::Agent(there.keyframe, lever), point);
    }

    /// Adds a sighting; where memory is full, another one makes room for it.
    fn remember_sighting(&mut self, keyframe: u32, shown: Seen, point: SeenPoint) {
        let is_full = |this: &Self| this.sightings.len() >= this.settings.sightings_max as usize;
        if is_full(self) {
            self.sparsify();
        }
        if is_full(self) {
            self.forget_least_certain();
        }
        let sighting = Sighting {
            keyframe,
            next: NONE,
            shown,
            next_shown: NONE,
            point,
        };
        if !self.add_sighting(sighting)
            && let Seen::Landmark(landmark) = shown
        {
            self.landmarks.release(landmark, self.revision);
        }
    }

    /// Notes the present sample and pose of an agent that has not moved.
    pub(super) fn note(&mut self, moment: &Moment) {
        let revision = self.revision;
        let Some(track) = self.tracks.get_mut(moment.agent as usize, revision) else {
            return;
        };
        track.pose = moment.pose;
        track.seq = moment.seq;
        track.stamp_ns = track.stamp_ns.max(moment.stamp_ns);
        if !track.needs_keyframe && is_within(track.since.motion(), REST.0, REST.1) {
            (track.until_seq, track.until_ns) = (track.seq, track.stamp_ns);
        }
    }

    /// The present instant of an agent: at its latest keyframe if that is near, or at a new one.
    pub(super) fn here(&mut self, agent: u32) -> Option<KeyframeOffset> {
        let track = self.tracks.get(agent as usize)?;
        if track.needs_keyframe || !is_within(track.since.motion(), NEAR.0, NEAR.1) {
            self.add_keyframe(agent);
        }
        let revision = self.revision;
        let track = self.tracks.get(agent as usize)?;
        let at = track.pose * track.since.motion().inverse();
        let (newest, is_in_map) = (track.newest, track.is_in_map);
        let here = KeyframeOffset {
            keyframe: newest,
            motion: *track.since.motion(),
            covariance: track.since.covariance(),
        };
        // The estimator has corrected the pose since.
        let keyframe = self.keyframes.get_mut(newest, revision)?;
        (keyframe.pose, keyframe.is_in_map) = (at, is_in_map);
        Some(here)
    }

    /// An instant of an agent, if it was not long ago.
    fn at_stamp(&mut self, agent: u32, stamp_ns: i64) -> Option<KeyframeOffset> {
        let track = self.tracks.get(agent as usize)?;
        if stamp_ns >= track.stamp_ns {
            return self.here(agent);
        }
        let mut later = (
            track.stamp_ns,
            *track.since.motion(),
            track.since.covariance(),
        );
        let (mut number, mut until_ns) = (track.newest, track.until_ns);
        for _ in 0..LOOK_BACK_MAX {
            let keyframe = self.keyframes.get(number)?;
            if keyframe.stamp_ns <= stamp_ns {
                let (end_ns, motion, covariance) = later;
                let way_ns = end_ns.saturating_sub(until_ns).max(1) as f64;
                let share = stamp_ns.saturating_sub(until_ns) as f64 / way_ns;
                return Some(offset(number, &motion, &covariance, share));
            }
            later = (keyframe.stamp_ns, keyframe.motion, keyframe.covariance);
            number = keyframe.previous;
            until_ns = self.keyframes.get(number)?.until_ns;
        }
        None
    }
}

/// The instant after a share of the motion that begins at a keyframe.
pub(super) fn offset(
    keyframe: u32,
    motion: &Isometry3<f64>,
    covariance: &PoseCovariance,
    share: f64,
) -> KeyframeOffset {
    let share = share.clamp(0.0, 1.0);
    let (linear, angular) = se3::log(motion);
    KeyframeOffset {
        keyframe,
        motion: se3::exp(&(linear * share), &(angular * share)),
        covariance: PoseCovariance::from_matrix(&(covariance.matrix() * share)),
    }
}

/// Whether a motion keeps the plane.
fn is_level(motion: &Isometry3<f64>) -> bool {
    let axis = motion.rotation.imag();
    motion.translation.z == 0.0 && axis.x == 0.0 && axis.y == 0.0
}
