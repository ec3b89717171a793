//! Instants of an agent, between keyframes.

use geometry::{PoseCovariance, is_within, se3};
use nalgebra::Isometry3;
use place_recognition::SampleKey;

use super::graph::{KeyframeGraph, Moment};
use super::tuning;

/// An instant between keyframes: a keyframe, the motion from there, and the covariance of its
/// error.
pub(super) struct KeyframeOffset {
    pub(super) keyframe: u32,
    pub(super) motion: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
}

impl KeyframeGraph {
    /// Notes the present sample and pose of an agent that has not moved.
    pub(super) fn note(&mut self, moment: &Moment) {
        let revision = self.revision;
        let Some(track) = self.tracks.get_mut(moment.agent as usize, revision) else {
            return;
        };
        track.pose = moment.pose;
        track.seq = moment.seq;
        track.stamp_ns = track.stamp_ns.max(moment.stamp_ns);
        if !track.needs_keyframe
            && is_within(
                track.since.motion(),
                tuning::REST_WITHIN.0,
                tuning::REST_WITHIN.1,
            )
        {
            (track.until_seq, track.until_ns) = (track.seq, track.stamp_ns);
        }
    }

    /// The present instant of an agent: at its latest keyframe if that is near, or at a new one.
    pub(super) fn here(&mut self, agent: u32) -> Option<KeyframeOffset> {
        let track = self.tracks.get(agent as usize)?;
        let (length_m, angle_rad) = self.settings.attached_within();
        if track.needs_keyframe || !is_within(track.since.motion(), length_m, angle_rad) {
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
    pub(super) fn at_stamp(&mut self, agent: u32, stamp_ns: i64) -> Option<KeyframeOffset> {
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
        for _ in 0..tuning::LOOK_BACK_MAX {
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

    pub(super) fn at_sample(&self, sample: SampleKey) -> Option<KeyframeOffset> {
        self.at_seq(sample.agent, sample.session, sample.seq)
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
