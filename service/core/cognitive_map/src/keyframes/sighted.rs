//! Sightings that are added to the keyframe graph.

use nalgebra::Vector3;

use super::graph::KeyframeGraph;
use super::instant::KeyframeOffset;
use super::moment::Moment;
use super::observation::Observation;
use super::seen_point::SeenPoint;
use super::seen_range::SeenRange;
use super::sighting::{Seen, Sighting};
use crate::input::{Label, Range, Relation};
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
        let seen = Observation::Point(SeenPoint::new(relation, variance));
        self.count_point();
        self.observe_landmark(moment, label, &seen);
    }

    /// Adds a distance of a landmark, with its variance \[m²\], and where the landmark is in the
    /// body frame by the estimate. One whose place was never known is kept, and does not count.
    pub fn landmark_range(
        &mut self,
        moment: &Moment,
        label: &Label,
        range: &Range,
        variance: f64,
        at: Option<Vector3<f64>>,
    ) {
        let seen = Observation::Range(SeenRange::new(range, variance, at));
        self.count_range(at.is_some());
        self.observe_landmark(moment, label, &seen);
    }

    fn count_range(&mut self, is_place_known: bool) {
        let schedule = &mut self.constraints.schedule;
        schedule.ranges = schedule.ranges.saturating_add(u32::from(is_place_known));
    }

    fn count_point(&mut self) {
        let schedule = &mut self.constraints.schedule;
        schedule.points = schedule.points.saturating_add(1);
    }

    /// A landmark was found by distances that had corrected nothing: the past is to be relaxed by
    /// them.
    pub fn found_by_ranges(&mut self) {
        let schedule = &mut self.constraints.schedule;
        schedule.found = schedule.found.saturating_add(1);
    }

    /// Adds what an agent measures of a landmark.
    fn observe_landmark(&mut self, moment: &Moment, label: &Label, seen: &Observation) {
        self.note(moment);
        let Some(here) = self.here(moment.agent) else {
            return;
        };
        let seen = seen.before(&here.motion, &here.covariance);
        if let Some(landmark) = self.sightings.landmarks.show(label, self.revision) {
            self.remember_sighting(here.keyframe, Seen::Landmark(landmark), seen);
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
        let keyframes = &self.chains.keyframes;
        let (Some(from), Some(to)) = (keyframes.get(here.keyframe), keyframes.get(there.keyframe))
        else {
            return;
        };
        let seen = match relation {
            Relation::Range(range) => {
                let shown = to.pose * there.motion;
                let seen = (from.pose * here.motion).inverse() * shown;
                let at = Some(seen.translation.vector);
                Observation::Range(SeenRange::new(range, variance[0], at))
            }
            _ => Observation::Point(SeenPoint::new(relation, variance)),
        };
        let mut seen = seen.before(&here.motion, &here.covariance);
        let is_range = matches!(seen, Observation::Range(_));
        // Noise of the motion from the keyframe, in the frame of the observer.
        let turn = from.pose.rotation.inverse() * to.pose.rotation * there.motion.rotation;
        let turn = turn.to_rotation_matrix().into_inner();
        let spread = { there.covariance.matrix() }
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        seen.add_noise(&(turn * spread * turn.transpose()));
        let lever = there.motion.translation.vector;
        self.remember_sighting(here.keyframe, Seen::Agent(there.keyframe, lever), seen);
        if is_range {
            self.count_range(true);
        } else {
            self.count_point();
        }
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
    fn remember_sighting(&mut self, keyframe: u32, shown: Seen, seen: Observation) {
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
            seen,
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
