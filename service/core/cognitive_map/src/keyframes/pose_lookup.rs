//! Poses of the past: what place recognition asks of the keyframe graph.

use geometry::{PoseCovariance, se3};
use nalgebra::Isometry3;
use place_recognition::{Keyframes, Relocalised, Revisit, SampleKey};

use super::graph::KeyframeGraph;

impl Keyframes for KeyframeGraph {
    fn pose_at(&self, sample: SampleKey) -> Option<Isometry3<f64>> {
        self.pose_of(&self.at_sample(sample)?)
    }

    fn motion_between(&self, from: SampleKey, to: SampleKey) -> Option<Isometry3<f64>> {
        let pose = |sample: SampleKey| {
            let offset = self.at_sample(sample)?;
            Some(self.keyframes.get(offset.keyframe)?.pose * offset.motion)
        };
        Some(pose(from)?.inv_mul(&pose(to)?))
    }

    fn is_planar(&self, agent: u32) -> bool {
        let own = self.tracks.get(agent as usize);
        own.is_some_and(|track| track.is_planar)
            && self
                .tracks
                .iter()
                .all(|track| track.is_planar || !track.is_in_map)
    }
}

impl KeyframeGraph {
    /// Adds a loop closure for a revisit, accepted at once: many views agree.
    pub(super) fn close(&mut self, revisit: &Revisit) {
        let (now, then) = (self.at_sample(revisit.now), self.at_sample(revisit.then));
        let (Some(now), Some(then)) = (now, then) else {
            return; // forgotten
        };
        let (seen, noise) = (&revisit.transform, &revisit.covariance);
        self.accept(&now, &then, seen, noise);
    }

    /// A new stretch of an agent, there if a pose is given: no motion leads to it.
    pub(super) fn begin_stretch(&mut self, agent: u32, at: Option<&Isometry3<f64>>) {
        if let Some(track) = self.tracks.get_mut(agent as usize, self.revision) {
            track.begins_anew = true;
            track.pose = at.copied().unwrap_or(track.pose);
        }
        self.add_keyframe(agent);
    }

    /// Adds a loop closure from where an agent was found to a remembered sample, accepted at once.
    pub(super) fn close_to_recognised(
        &mut self,
        agent: u32,
        similar: Option<SampleKey>,
        found: &Relocalised,
    ) {
        let then = similar.and_then(|similar| self.at_sample(similar));
        let (Some(now), Some(then)) = (self.here(agent), then) else {
            return;
        };
        let Some(there) = self.pose_of(&then) else {
            return;
        };
        let seen = found.pose.inv_mul(&there);
        let adjoint = se3::adjoint(&seen.inverse());
        let covariance = adjoint * found.covariance.matrix() * adjoint.transpose();
        let covariance =
            PoseCovariance::from_matrix(&((covariance + covariance.transpose()) * 0.5));
        self.accept(&now, &then, &seen, &covariance);
    }

    /// Whether an agent in the map has a keyframe in its session.
    pub(super) fn has_keyframe_in_map(&self, agent: u32) -> bool {
        let track = self.tracks.get(agent as usize);
        track.is_some_and(|track| track.is_in_map && !track.needs_keyframe)
    }

    /// Number of the latest sample of an agent.
    pub(super) fn latest_seq(&self, agent: u32) -> u64 {
        self.tracks.get(agent as usize).map_or(0, |track| track.seq)
    }

    /// The session that an agent is in.
    pub(super) fn session(&self, agent: u32) -> u32 {
        self.tracks
            .get(agent as usize)
            .map_or(0, |track| track.session)
    }
}
