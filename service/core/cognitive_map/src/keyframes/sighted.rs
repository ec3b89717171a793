//! Sightings that are added to the keyframe graph.

use nalgebra::Vector3;

use super::graph::KeyframeGraph;
use super::instant::KeyframeOffset;
use super::moment::Moment;
use super::sighting::{Seen, SeenPoint, Sighting};
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
        if let Some(landmark) = self.sightings.landmarks.show(label, self.revision) {
            self.remember_sighting(here.keyframe, Seen::Landmark(landmark), point);
        }
    }

    /// Adds a sighting of another agent, perhaps at an instant that is over. Both agents have moved
    /// up to it: until then the estimator keeps it.
    pub fn sighted(
        &mut self,
        observer: u32,
        target: u32,
        stamp_ns: i64,
        relation: &Relation,
        variance: &Vector3<f64>,
    ) {
        if observer == target || self.chains.track(target).is_none() {
            return;
        }
        let Some(here) = self.at_stamp(observer, stamp_ns) else {
            return; // too long ago
        };
        let Some(there) = self.at_stamp(target, stamp_ns) else {
            return; // too long ago
        };
        let mut point = SeenPoint::new(relation, variance).before(&here.motion, &here.covariance);
        let keyframes = &self.chains.keyframes;
        let (Some(from), Some(to)) = (keyframes.get(here.keyframe), keyframes.get(there.keyframe))
        else {
            return;
        };
        // Noise of the motion from the keyframe, in the frame of the observer.
        let turn = from.pose.rotation.inverse() * to.pose.rotation * there.motion.rotation;
        let turn = turn.to_rotation_matrix().into_inner();
        let spread = { there.covariance.matrix() }
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        point.fresh += turn * spread * turn.transpose();
        let lever = there.motion.translation.vector;
        self.remember_sighting(here.keyframe, Seen::Agent(there.keyframe, lever), point);
    }

    /// The present instant of an agent: at its latest keyframe if that is near, or at a new one.
    pub(super) fn here(&mut self, agent: u32) -> Option<KeyframeOffset> {
        let attached = self.settings.attached_within();
        let track = self.chains.track(agent)?;
        if track.needs_keyframe || !track.is_near(attached) {
            self.add_keyframe(agent);
        }
        let revision = self.revision;
        let track = self.chains.track(agent)?;
        let at = track.pose * track.since.motion().inverse();
        let (newest, is_in_map) = (track.newest, track.is_in_map());
        let here = KeyframeOffset {
            keyframe: newest,
            motion: *track.since.motion(),
            covariance: track.since.covariance(),
        };
        // The estimator has corrected the pose since.
        let keyframe = self.chains.keyframes.get_mut(newest, revision)?;
        (keyframe.pose, keyframe.is_in_map) = (at, is_in_map);
        Some(here)
    }

    /// An instant of an agent, if it was not long ago.
    fn at_stamp(&mut self, agent: u32, stamp_ns: i64) -> Option<KeyframeOffset> {
        if stamp_ns >= self.chains.track(agent)?.stamp_ns {
            return self.here(agent);
        }
        self.chains.at_past_stamp(agent, stamp_ns)
    }

    /// Adds a sighting; where memory is full, another one makes room for it.
    fn remember_sighting(&mut self, keyframe: u32, shown: Seen, point: SeenPoint) {
        let is_full = |this: &Self| this.n_sightings() >= this.settings.sightings_max as usize;
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
            self.sightings.landmarks.release(landmark, self.revision);
        }
    }

    /// Adds a sighting to the lists of its keyframes; answers whether there is one more.
    pub(super) fn add_sighting(&mut self, sighting: Sighting) -> bool {
        let (keyframes, most) = (&mut self.chains.keyframes, self.settings.sightings_max);
        self.sightings.add(sighting, keyframes, most, self.revision)
    }

    /// Removes a sighting.
    pub(super) fn remove_sighting(&mut self, number: u32) {
        let keyframes = &mut self.chains.keyframes;
        self.sightings.remove(number, keyframes, self.revision);
    }

    /// Merges landmarks: of each pair of names the first is given up. Walks all sightings.
    pub fn merge_landmarks(&mut self, names: &[(Label, Label)]) {
        self.sightings.merge_landmarks(names, self.revision);
    }
}
