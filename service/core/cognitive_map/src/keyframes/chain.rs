//! The chains of keyframes, one for each agent, and their index.

use nalgebra::Isometry3;

use super::constraint::ClosureState;
use super::graph::KeyframeGraph;
use super::keyframe::Keyframe;
use super::keyframe_index::IndexEntry;
use super::tuning;
use geometry::{MotionSum, PoseCovariance, is_within};
use state::{NONE, Slab};

impl KeyframeGraph {
    /// Adds a keyframe where an agent is; answers its number, or that of the latest one if memory
    /// is full.
    pub(super) fn add_keyframe(&mut self, agent: u32) -> u32 {
        if self.keyframes.len() >= self.settings.keyframes_max as usize {
            self.sparsify();
        }
        let revision = self.revision;
        let Some(track) = self.tracks.get(agent as usize) else {
            return NONE;
        };
        let newest = track.newest;
        if self.keyframes.len() >= self.settings.keyframes_max as usize {
            return newest;
        }
        let is_first = newest == NONE || track.begins_anew;
        let is_origin = track.is_origin;
        // An agent at rest came here earlier.
        let rests = !track.needs_keyframe
            && is_within(
                &track.rest.inv_mul(track.since.motion()),
                tuning::REST_WITHIN.0,
                tuning::REST_WITHIN.1,
            );
        let (seq, stamp_ns) = if rests {
            (track.rest_seq, track.rest_ns)
        } else {
            (track.seq, track.stamp_ns)
        };
        let (motion, covariance, calibrated) = if is_first {
            let nothing = (Isometry3::identity(), PoseCovariance::zero());
            (nothing.0, nothing.1, track.calibrated.without_motion())
        } else {
            (
                *track.since.motion(),
                track.since.covariance(),
                track.calibrated,
            )
        };
        let keyframe = Keyframe {
            agent,
            previous: newest,
            next: NONE,
            sightings: NONE,
            shown: NONE,
            constraints: NONE,
            attachments: NONE,
            session: track.session,
            seq,
            until_seq: track.seq,
            stamp_ns,
            until_ns: track.stamp_ns,
            is_in_map: track.is_in_map,
            pose: track.pose,
            motion,
            covariance,
            calibrated,
            begins: is_first,
            unevenness_m: 0.0,
        };
        let (until_seq, until_ns, pose) = (track.until_seq, track.until_ns, track.pose);
        let number = self.keyframes.insert(keyframe, revision);
        if let Some(previous) = self.keyframes.get_mut(newest, revision) {
            previous.next = number;
            (previous.until_seq, previous.until_ns) = (until_seq, until_ns);
        }
        if let Some(track) = self.tracks.get_mut(agent as usize, revision) {
            track.newest = number;
            track.begins_anew = false;
            track.needs_keyframe = false;
            track.is_origin = false;
            track.since = MotionSum::default();
            track.calibrated = track.calibrated.without_motion();
            (track.until_seq, track.until_ns) = (track.seq, track.stamp_ns);
            track.rest = Isometry3::identity();
            (track.rest_seq, track.rest_ns) = (seq, stamp_ns);
        }
        self.index_keyframe(agent, number);
        if is_origin {
            self.constrain_to_map(number, pose, &PoseCovariance::zero(), ClosureState::Origin);
        }
        number
    }

    /// The earliest keyframe of an agent; [`NONE`] if it has none. Walks the whole chain.
    pub(super) fn first_keyframe(&self, agent: u32) -> u32 {
        let newest = self.tracks.get(agent as usize).map(|track| track.newest);
        let mut number = newest.unwrap_or(NONE);
        while let Some(keyframe) = self.keyframes.get(number) {
            if keyframe.previous == NONE {
                break;
            }
            number = keyframe.previous;
        }
        number
    }

    /// Pose of a keyframe in the map, if its agent is in it.
    pub(super) fn in_map(&self, number: u32) -> Option<Isometry3<f64>> {
        let keyframe = self.keyframes.get(number)?;
        if keyframe.is_in_map {
            return Some(keyframe.pose);
        }
        let track = self.tracks.get(keyframe.agent as usize)?;
        Some(track.own_frame.unwrap_or_default() * keyframe.pose)
    }

    /// Adds a keyframe to the index.
    fn index_keyframe(&mut self, agent: u32, number: u32) {
        let Some(keyframe) = self.keyframes.get(number) else {
            return;
        };
        let entry = IndexEntry {
            session: keyframe.session,
            seq: keyframe.seq,
            keyframe: number,
        };
        let (keyframes, count) = (&self.keyframes, self.keyframes.len());
        let is_valid = |entry: &IndexEntry| is_valid(keyframes, agent, entry);
        self.index.add(agent, entry, count, is_valid);
    }

    /// Builds the index of chains that were read from a checkpoint.
    pub(super) fn rebuild_index(&mut self) {
        for agent in 0..self.tracks.len() {
            let newest = self.tracks.get(agent).map_or(NONE, |track| track.newest);
            let mut chain = Vec::new();
            let mut number = newest;
            while let Some(keyframe) = self.keyframes.get(number) {
                chain.push(number);
                number = keyframe.previous;
            }
            let agent = u32::try_from(agent).unwrap_or(NONE);
            for &number in chain.iter().rev() {
                self.index_keyframe(agent, number);
            }
        }
    }

    /// The earliest indexed keyframe of an agent after a sample; [`NONE`] if there is none.
    pub(super) fn first_indexed_after(&self, agent: u32, session: u32, seq: u64) -> u32 {
        let is_valid = |entry: &IndexEntry| is_valid(&self.keyframes, agent, entry);
        self.index.first_after(agent, session, seq, is_valid)
    }
}

/// Whether the keyframe of an index entry is still there.
fn is_valid(keyframes: &Slab<Keyframe, 32>, agent: u32, entry: &IndexEntry) -> bool {
    keyframes.get(entry.keyframe).is_some_and(|keyframe| {
        (keyframe.agent, keyframe.session, keyframe.seq) == (agent, entry.session, entry.seq)
    })
}
