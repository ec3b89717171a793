//! The record itself, and what is told to it.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::anchor::Anchor;
use super::landmarks::Landmarks;
use super::life::Life;
use super::milestones::Milestones;
use super::mooring::Mooring;
use super::settings::KeyframeSettings;
use super::sighting::{SeenPoint, Shown, Sighting};
use super::tie::{Standing, Tie};
use crate::estimator::Calibrated;
use crate::input::{Label, Relation, StartPose};
use geometry::{PoseCovariance, is_within, se3};
use state::PagedVec;
use state::state_of_struct;
use state::{NONE, Slab};

/// Motion after which there is a new anchor in any case \[m, rad\]: between two, a pose is interpolated.
const STEP: (f64, f64) = (0.1, 0.1);
/// Motion since an anchor up to which sightings are still attached to it \[m, rad\].
const NEAR: (f64, f64) = (0.02, 0.02);
/// Motion that counts as rest \[m, rad\].
pub(super) const REST: (f64, f64) = (0.005, 0.005);
/// Rest after which there is a new anchor where the agent rests \[ns\].
const REST_NS: i64 = 1_000_000_000;
/// Sightings of agents that wait for the other agent's motion to come up to them.
const WAITING_MAX: usize = 64;
/// How long they wait, by the observer's clock \[ns\].
const PATIENCE_NS: i64 = 2_000_000_000;
/// How many anchors back a sighting may show an agent.
const LOOK_BACK_MAX: usize = 256;
/// Sightings made at one anchor.
pub(super) const SIGHTINGS_PER_ANCHOR_MAX: usize = 32;

/// A moment of an agent.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Number of the agent.
    pub agent: u32,
    /// Number of the sample within the agent's session.
    pub seq: u64,
    /// Its stamp \[ns\].
    pub stamp_ns: i64,
    /// Where the agent is thought to be after it, in the frame in which the agent is estimated. Only the start of a
    /// relaxation depends on it.
    pub pose: Isometry3<f64>,
}

/// A sighting of an agent that has not moved up to it yet.
#[derive(Clone, Debug)]
pub(super) struct Waiting {
    pub(super) anchor: u32,
    pub(super) observer: u32,
    pub(super) target: u32,
    pub(super) stamp_ns: i64,
    pub(super) point: SeenPoint,
}

state_of_struct!(Waiting {
    anchor,
    observer,
    target,
    stamp_ns,
    point
});

/// What agents did and saw, as a graph that can be relaxed: the past, to be smoothed.
///
/// It is told every motion and sighting, and answers with [`refine`](Self::refine), a pure function of what it was told.
/// A clone is a snapshot that shares all pages.
#[derive(Clone, Debug)]
pub struct KeyframeGraph {
    pub(super) settings: KeyframeSettings,
    /// Of the changes that are made now; for checkpoints only.
    pub(super) revision: u64,
    pub(super) lives: PagedVec<Life, 4>,
    pub(super) anchors: Slab<Anchor, 32>,
    pub(super) sightings: Slab<Sighting, 64>,
    pub(super) ties: Slab<Tie, 32>,
    pub(super) landmarks: Landmarks,
    /// What lies beside anchors, by number.
    pub(super) moorings: Slab<Mooring, 32>,
    /// The latest mooring that was looked at, and how many are to be since anchors were moved.
    pub(super) swung: u32,
    pub(super) adrift: u32,
    pub(super) waiting: Vec<Waiting>,
    /// The number of the anchor at which the search for what may be thinned goes on.
    pub(super) hand: u32,
    /// Motions told since the last relaxation, and matches.
    pub(super) told: u32,
    pub(super) fresh_matches: u32,
    /// Matches believed since then without waiting.
    pub(super) agreed: u32,
    pub(super) milestones: Milestones,
}

/// A place between anchors: an anchor, the motion from there, and the covariance of its error.
pub(super) struct Beside {
    pub(super) anchor: u32,
    pub(super) motion: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
}

impl KeyframeGraph {
    /// Without any agent.
    pub fn new(settings: KeyframeSettings) -> Self {
        Self {
            settings,
            revision: 1,
            lives: PagedVec::default(),
            anchors: Slab::default(),
            sightings: Slab::default(),
            ties: Slab::default(),
            landmarks: Landmarks::default(),
            moorings: Slab::default(),
            swung: 0,
            adrift: 0,
            waiting: Vec::new(),
            hand: 0,
            told: 0,
            fresh_matches: 0,
            agreed: 0,
            milestones: Milestones::default(),
        }
    }

    /// Says under which revision changes are noted from now on: a checkpoint since a revision holds the later ones.
    pub fn set_revision(&mut self, revision: u64) {
        self.revision = revision;
    }

    /// Number of anchors.
    pub fn n_anchors(&self) -> usize {
        self.anchors.len()
    }

    /// Number of sightings, those joined into one counted once.
    pub fn n_sightings(&self) -> usize {
        self.sightings.len()
    }

    /// A new agent, in a frame of its own; answers its number, counted from 0.
    pub fn enrol(&mut self) -> u32 {
        let agent = u32::try_from(self.lives.len()).unwrap_or(NONE);
        self.lives.push(Life::new(), self.revision);
        agent
    }

    /// The frame of an agent is that of the map: its first anchor stays where it is.
    pub fn found(&mut self, agent: u32) {
        let Some(life) = self.lives.get(agent as usize) else {
            return;
        };
        if life.is_in_map {
            return;
        }
        self.placed(agent, &Isometry3::identity());
        let first = self.first_of(agent);
        if let Some(anchor) = self.anchors.get(first) {
            let at = anchor.pose;
            self.tie_to_map(first, at, &PoseCovariance::zero(), Standing::Origin);
        } else if let Some(life) = self.lives.get_mut(agent as usize, self.revision) {
            life.founds = true;
        }
    }

    /// The frame in which an agent was estimated turned out to lie in the map, there. All its anchors move with it.
    pub fn placed(&mut self, agent: u32, frame: &Isometry3<f64>) {
        let revision = self.revision;
        let Some(life) = self.lives.get_mut(agent as usize, revision) else {
            return;
        };
        if !life.is_in_map {
            life.own_frame = Some(*frame);
            life.is_in_map = true;
            life.pose = frame * life.pose;
        }
    }

    /// The frame in which an agent was estimated turned out to lie in another one that is not the map's, there. Walks the
    /// whole chain of the agent; anchors from before it was set aside stay in the map.
    pub fn carried(&mut self, agent: u32, frame: &Isometry3<f64>) {
        let revision = self.revision;
        let Some(life) = self.lives.get_mut(agent as usize, revision) else {
            return;
        };
        if life.is_in_map {
            return;
        }
        life.pose = frame * life.pose;
        let mut number = life.newest;
        while let Some(anchor) = self.anchors.get_mut(number, revision) {
            if !anchor.is_in_map {
                anchor.pose = frame * anchor.pose;
            }
            number = anchor.previous;
        }
    }

    /// An agent was told where it stands in the map. If it was in the map already, it has been put there: what it did
    /// before does not lead there.
    pub fn start_pose(&mut self, moment: &Moment, start: &StartPose) {
        let Some(life) = self.lives.get(moment.agent as usize) else {
            return;
        };
        let was_in_map = life.is_in_map;
        let own_frame = start.pose() * life.pose.inverse();
        self.placed(moment.agent, &own_frame);
        self.note(moment);
        let revision = self.revision;
        let Some(life) = self.lives.get_mut(moment.agent as usize, revision) else {
            return;
        };
        life.pose = *start.pose();
        life.is_cut |= was_in_map;
        life.founds = false;
        life.is_planar &= is_level(start.pose());
        let anchor = self.anchor_anew(moment.agent);
        let covariance = PoseCovariance::from_sd(start.noise().sd());
        self.tie_to_map(anchor, *start.pose(), &covariance, Standing::Stated);
    }

    /// A new session of an agent: it may have been moved by about `sd` \[m, m, m, rad, rad, rad\] since its latest sample.
    pub fn restart(&mut self, agent: u32, sd: &Vector6<f64>) {
        let revision = self.revision;
        let Some(life) = self.lives.get(agent as usize) else {
            return;
        };
        if life.newest != NONE && *life.since.motion() != Isometry3::identity() {
            self.anchor_anew(agent);
        }
        let Some(life) = self.lives.get_mut(agent as usize, revision) else {
            return;
        };
        life.session += 1;
        life.is_fresh = true;
        life.since.inflate(&sd.component_mul(sd));
        self.waiting
            .retain(|waiting| waiting.observer != agent && waiting.target != agent);
    }

    /// An agent moved by an increment in its own frame before, with these variances of the error on its right \[m², m²,
    /// m², rad², rad², rad²\]; `calibrated` says how the increment was corrected.
    pub fn motion(
        &mut self,
        moment: &Moment,
        increment: &Isometry3<f64>,
        variance: &Vector6<f64>,
        calibrated: &Calibrated,
    ) {
        let agent = moment.agent;
        self.told = self.told.saturating_add(1);
        let Some(life) = self.lives.get(agent as usize) else {
            return;
        };
        if life.is_fresh {
            // The first anchor lies where the agent was before it moved.
            self.note(&Moment {
                pose: moment.pose * increment.inverse(),
                ..*moment
            });
            self.anchor_anew(agent);
        }
        let revision = self.revision;
        let Some(life) = self.lives.get_mut(agent as usize, revision) else {
            return;
        };
        life.go(increment, variance, calibrated);
        life.is_planar &= is_level(increment);
        life.pose = moment.pose;
        (life.seq, life.stamp_ns) = (moment.seq, moment.stamp_ns);
        if is_within(life.since.motion(), REST.0, REST.1) {
            (life.until_seq, life.until_ns) = (moment.seq, moment.stamp_ns);
        }
        let is_step = !is_within(life.since.motion(), STEP.0, STEP.1);
        let mut rests = false;
        if is_within(&life.rest.inv_mul(life.since.motion()), REST.0, REST.1) {
            rests = !is_within(life.since.motion(), NEAR.0, NEAR.1)
                && moment.stamp_ns.saturating_sub(life.rest_ns) >= REST_NS;
        } else {
            life.rest = *life.since.motion();
            (life.rest_seq, life.rest_ns) = (moment.seq, moment.stamp_ns);
        }
        if is_step || rests {
            self.anchor_anew(agent);
        }
        if !self.waiting.is_empty() {
            self.settle();
        }
    }

    /// An agent saw a landmark. `variance` is that of the relation's components: along the axes, or of distance, azimuth
    /// and elevation; the angles are those by which the seen direction is off.
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
            self.sight(here.anchor, Shown::Landmark(landmark), point);
        }
    }

    /// An agent saw another one at an instant that may be over. It is taken in as soon as both have moved up to it.
    pub fn sighted(
        &mut self,
        observer: u32,
        target: u32,
        stamp_ns: i64,
        relation: &Relation,
        variance: &Vector3<f64>,
    ) {
        if observer == target || target as usize >= self.lives.len() {
            return;
        }
        let Some(here) = self.at_stamp(observer, stamp_ns) else {
            return; // too long ago
        };
        if self.waiting.len() >= WAITING_MAX {
            self.waiting.remove(0);
        }
        self.waiting.push(Waiting {
            anchor: here.anchor,
            observer,
            target,
            stamp_ns,
            point: SeenPoint::new(relation, variance).before(&here.motion, &here.covariance),
        });
        self.settle();
    }

    /// Takes in the waiting sightings whose time has come.
    fn settle(&mut self) {
        for waiting in std::mem::take(&mut self.waiting) {
            let stamp_ns = |agent: u32| {
                let life = self.lives.get(agent as usize);
                life.filter(|life| life.newest != NONE)
                    .map(|life| life.stamp_ns)
            };
            if stamp_ns(waiting.target).is_some_and(|stamp| stamp >= waiting.stamp_ns) {
                self.show(&waiting);
            } else if stamp_ns(waiting.observer)
                .is_none_or(|stamp| stamp.saturating_sub(waiting.stamp_ns) < PATIENCE_NS)
            {
                self.waiting.push(waiting);
            }
        }
    }

    /// Takes in a sighting of an agent.
    fn show(&mut self, waiting: &Waiting) {
        let Some(there) = self.at_stamp(waiting.target, waiting.stamp_ns) else {
            return; // too long ago
        };
        let (Some(observer), Some(target)) = (
            self.anchors.get(waiting.anchor),
            self.anchors.get(there.anchor),
        ) else {
            return;
        };
        // What the way from the anchor adds to the error, in the frame of the observer.
        let turn = observer.pose.rotation.inverse() * target.pose.rotation * there.motion.rotation;
        let turn = turn.to_rotation_matrix().into_inner();
        let spread = there
            .covariance
            .matrix()
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        let point = SeenPoint {
            fresh: waiting.point.fresh + turn * spread * turn.transpose(),
            ..waiting.point
        };
        let lever = there.motion.translation.vector;
        self.sight(waiting.anchor, Shown::Agent(there.anchor, lever), point);
    }

    /// Remembers a sighting; where memory is full, another one makes room for it.
    fn sight(&mut self, anchor: u32, shown: Shown, point: SeenPoint) {
        let is_full = |this: &Self| this.sightings.len() >= this.settings.sightings_max as usize;
        if is_full(self) {
            self.thin();
        }
        if is_full(self) {
            self.forget_vaguest();
        }
        let sighting = Sighting {
            anchor,
            next: NONE,
            shown,
            next_shown: NONE,
            point,
        };
        if !self.attach(sighting)
            && let Shown::Landmark(landmark) = shown
        {
            self.landmarks.release(landmark, self.revision);
        }
    }

    /// The agent is at a moment, without having moved.
    pub(super) fn note(&mut self, moment: &Moment) {
        let revision = self.revision;
        let Some(life) = self.lives.get_mut(moment.agent as usize, revision) else {
            return;
        };
        life.pose = moment.pose;
        life.seq = moment.seq;
        life.stamp_ns = life.stamp_ns.max(moment.stamp_ns);
        if !life.is_fresh && is_within(life.since.motion(), REST.0, REST.1) {
            (life.until_seq, life.until_ns) = (life.seq, life.stamp_ns);
        }
    }

    /// Where an agent is: at its latest anchor, if that is near, or at a new one.
    pub(super) fn here(&mut self, agent: u32) -> Option<Beside> {
        let life = self.lives.get(agent as usize)?;
        if life.is_fresh || !is_within(life.since.motion(), NEAR.0, NEAR.1) {
            self.anchor_anew(agent);
        }
        let revision = self.revision;
        let life = self.lives.get(agent as usize)?;
        let at = life.pose * life.since.motion().inverse();
        let (newest, is_in_map) = (life.newest, life.is_in_map);
        let here = Beside {
            anchor: newest,
            motion: *life.since.motion(),
            covariance: life.since.covariance(),
        };
        // What is seen now has corrected the pose.
        let anchor = self.anchors.get_mut(newest, revision)?;
        (anchor.pose, anchor.is_in_map) = (at, is_in_map);
        Some(here)
    }

    /// Where an agent was at an instant that is over, if that was not long ago.
    fn at_stamp(&mut self, agent: u32, stamp_ns: i64) -> Option<Beside> {
        let life = self.lives.get(agent as usize)?;
        if stamp_ns >= life.stamp_ns {
            return self.here(agent);
        }
        let mut later = (life.stamp_ns, *life.since.motion(), life.since.covariance());
        let (mut number, mut until_ns) = (life.newest, life.until_ns);
        for _ in 0..LOOK_BACK_MAX {
            let anchor = self.anchors.get(number)?;
            if anchor.stamp_ns <= stamp_ns {
                let (end_ns, motion, covariance) = later;
                let way_ns = end_ns.saturating_sub(until_ns).max(1) as f64;
                let share = stamp_ns.saturating_sub(until_ns) as f64 / way_ns;
                return Some(beside(number, &motion, &covariance, share));
            }
            later = (anchor.stamp_ns, anchor.motion, anchor.covariance);
            number = anchor.previous;
            until_ns = self.anchors.get(number)?.until_ns;
        }
        None
    }
}

/// A place on the way that begins at an anchor, after a share of it.
pub(super) fn beside(
    anchor: u32,
    motion: &Isometry3<f64>,
    covariance: &PoseCovariance,
    share: f64,
) -> Beside {
    let share = share.clamp(0.0, 1.0);
    let (linear, angular) = se3::log(motion);
    Beside {
        anchor,
        motion: se3::exp(&(linear * share), &(angular * share)),
        covariance: PoseCovariance::from_matrix(&(covariance.matrix() * share)),
    }
}

/// Whether a motion keeps the plane.
fn is_level(motion: &Isometry3<f64>) -> bool {
    let axis = motion.rotation.imag();
    motion.translation.z == 0.0 && axis.x == 0.0 && axis.y == 0.0
}
