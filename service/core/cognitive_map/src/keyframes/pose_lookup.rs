//! Poses of the past: what place recognition asks of the keyframe graph.

use geometry::{PoseCovariance, se3};
use nalgebra::Isometry3;
use place_recognition::{Keyframes, Relocalised, Revisit, SampleKey};

use super::graph::{KeyframeGraph, KeyframeOffset, offset};

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

    /// Pose in the map of a place beside a keyframe; `None` if it lies in no map.
    pub(super) fn pose_of(&self, offset: &KeyframeOffset) -> Option<Isometry3<f64>> {
        let keyframe = self.keyframes.get(offset.keyframe)?;
        let track = self.tracks.get(keyframe.agent as usize)?;
        let pose = keyframe.pose * offset.motion;
        if keyframe.is_in_map {
            Some(pose)
        } else {
            Some(track.own_frame? * pose)
        }
    }

    fn at_sample(&self, sample: SampleKey) -> Option<KeyframeOffset> {
        self.at_seq(sample.agent, sample.session, sample.seq)
    }

    /// Where an agent was at a sample of a session. Walks back to it from the next index entry.
    pub(super) fn at_seq(&self, agent: u32, session: u32, seq: u64) -> Option<KeyframeOffset> {
        let track = self.tracks.get(agent as usize)?;
        if session > track.session || (session == track.session && seq > track.seq) {
            return None;
        }
        let mut later = (track.seq, *track.since.motion(), track.since.covariance());
        let (mut number, mut until_seq) = (track.newest, track.until_seq);
        if let Some(entry) = self
            .keyframes
            .get(self.first_indexed_after(agent, session, seq))
        {
            if entry.begins && entry.session == session {
                return None;
            }
            later = (entry.seq, entry.motion, entry.covariance);
            number = entry.previous;
            until_seq = self.keyframes.get(number)?.until_seq;
        }
        loop {
            let keyframe = self.keyframes.get(number)?;
            if keyframe.session < session {
                return None;
            }
            if keyframe.session == session && keyframe.seq <= seq {
                let (end, motion, covariance) = later;
                let way = end.saturating_sub(until_seq).max(1) as f64;
                let share = seq.saturating_sub(until_seq) as f64 / way;
                return Some(offset(number, &motion, &covariance, share));
            }
            if keyframe.begins && keyframe.session == session {
                return None;
            }
            later = (keyframe.seq, keyframe.motion, keyframe.covariance);
            number = keyframe.previous;
            until_seq = self.keyframes.get(number)?.until_seq;
        }
    }
}
