//! Sightings of the keyframe graph: those of landmarks, and those of other agents, which wait until
//! both have moved up to them.

use nalgebra::Vector3;

use super::graph::{KeyframeGraph, Moment};
use super::list::unlink;
use super::sighting::{PendingSighting, Seen, SeenPoint, Sighting};
use super::tuning;
use crate::input::{Label, Relation};
use state::NONE;

impl KeyframeGraph {
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
        if self.pending.len() >= tuning::PENDING_MAX {
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
    pub(super) fn resolve_pending(&mut self) {
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
                .is_none_or(|stamp| stamp.saturating_sub(pending.stamp_ns) < tuning::PENDING_NS)
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

    /// Adds a sighting to the lists of its keyframe and of the one that it shows. It is merged with
    /// one of the same landmark; in a full list it replaces the least certain one. Answers whether
    /// there is one more.
    pub(super) fn add_sighting(&mut self, mut sighting: Sighting) -> bool {
        let revision = self.revision;
        let Some(keyframe) = self.keyframes.get(sighting.keyframe) else {
            return false;
        };
        let (mut number, first) = (keyframe.sightings, keyframe.sightings);
        let (mut count, mut least_certain) = (0, (0.0, NONE));
        while let Some(other) = self.sightings.get(number) {
            let is_same = matches!(other.shown, Seen::Landmark(_)) && other.shown == sighting.shown;
            if is_same {
                let joined = other.point.mean(&sighting.point);
                if let (Some(point), Some(other)) =
                    (joined, self.sightings.get_mut(number, revision))
                {
                    other.point = point;
                }
                return false;
            }
            let spread = other.point.covariance().trace();
            if spread > least_certain.0 {
                least_certain = (spread, number);
            }
            count += 1;
            number = other.next;
        }
        let is_crowded = count >= tuning::SIGHTINGS_PER_KEYFRAME_MAX
            || self.sightings.len() >= self.settings.sightings_max as usize;
        if is_crowded
            && (least_certain.1 == NONE || sighting.point.covariance().trace() >= least_certain.0)
        {
            return false;
        }
        if is_crowded {
            self.remove_sighting(least_certain.1);
        }
        let first = if first == least_certain.1 && is_crowded {
            self.keyframes
                .get(sighting.keyframe)
                .map_or(NONE, |keyframe| keyframe.sightings)
        } else {
            first
        };
        sighting.next = first;
        let shown = match sighting.shown {
            Seen::Agent(target, _) => target,
            Seen::Landmark(_) => NONE,
        };
        sighting.next_shown = self
            .keyframes
            .get(shown)
            .map_or(NONE, |keyframe| keyframe.shown);
        let at = sighting.keyframe;
        let number = self.sightings.insert(sighting, revision);
        if let Some(keyframe) = self.keyframes.get_mut(at, revision) {
            keyframe.sightings = number;
        }
        if let Some(keyframe) = self.keyframes.get_mut(shown, revision) {
            keyframe.shown = number;
        }
        true
    }

    /// Removes a sighting; answers it.
    pub(super) fn remove_sighting(&mut self, number: u32) -> Option<Sighting> {
        let sighting = self.sightings.get(number)?.clone();
        let revision = self.revision;
        let slab = &mut self.sightings;
        if let Some(keyframe) = self.keyframes.get_mut(sighting.keyframe, revision) {
            let next = |sighting: &Sighting| sighting.next;
            let set_next = |sighting: &mut Sighting, number| sighting.next = number;
            let head = &mut keyframe.sightings;
            unlink(slab, head, number, sighting.next, revision, next, set_next);
        }
        if let Seen::Agent(target, _) = sighting.shown
            && let Some(keyframe) = self.keyframes.get_mut(target, revision)
        {
            let next = |sighting: &Sighting| sighting.next_shown;
            let set_next = |sighting: &mut Sighting, number| sighting.next_shown = number;
            let head = &mut keyframe.shown;
            unlink(
                slab,
                head,
                number,
                sighting.next_shown,
                revision,
                next,
                set_next,
            );
        }
        self.sightings.remove(number, self.revision);
        if let Seen::Landmark(landmark) = sighting.shown {
            self.landmarks.release(landmark, self.revision);
        }
        Some(sighting)
    }
}
