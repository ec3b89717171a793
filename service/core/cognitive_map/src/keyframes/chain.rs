//! Chains of keyframes, and the lists of sightings and constraints of a keyframe.

use nalgebra::Isometry3;

use super::constraint::{ClosureState, Constraint};
use super::graph::{KeyframeGraph, REST, SIGHTINGS_PER_KEYFRAME_MAX};
use super::keyframe::Keyframe;
use super::sighting::{Seen, Sighting};
use geometry::is_within;
use geometry::{MotionSum, PoseCovariance};
use state::NONE;

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
            && is_within(&track.rest.inv_mul(track.since.motion()), REST.0, REST.1);
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

    /// Constrains a keyframe to the map.
    pub(super) fn constrain_to_map(
        &mut self,
        keyframe: u32,
        at: Isometry3<f64>,
        covariance: &PoseCovariance,
        state: ClosureState,
    ) {
        let constraint = Constraint {
            from: NONE,
            to: keyframe,
            next_from: NONE,
            next_to: NONE,
            transform: at,
            covariance: *covariance,
            state,
        };
        self.add_constraint(constraint);
    }

    /// Adds a constraint; answers its number, or [`NONE`] if memory is full or an end is gone.
    pub(super) fn add_constraint(&mut self, mut constraint: Constraint) -> u32 {
        let revision = self.revision;
        let (from, to) = (constraint.from, constraint.to);
        let is_there = |number: u32| self.keyframes.get(number).is_some();
        if self.constraints.len() >= self.settings.constraints_max as usize
            || !is_there(to)
            || (from != NONE && !is_there(from))
            || from == to
        {
            return NONE;
        }
        constraint.next_to = self
            .keyframes
            .get(to)
            .map_or(NONE, |keyframe| keyframe.constraints);
        constraint.next_from = self
            .keyframes
            .get(from)
            .map_or(NONE, |keyframe| keyframe.constraints);
        let number = self.constraints.insert(constraint, revision);
        for end in [from, to] {
            if let Some(keyframe) = self.keyframes.get_mut(end, revision) {
                keyframe.constraints = number;
            }
        }
        number
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
        let is_crowded = count >= SIGHTINGS_PER_KEYFRAME_MAX
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
        self.unlink_sighting(sighting.keyframe, number, sighting.next);
        if let Seen::Agent(target, _) = sighting.shown {
            self.unlink_target(target, number, sighting.next_shown);
        }
        self.sightings.remove(number, self.revision);
        if let Seen::Landmark(landmark) = sighting.shown {
            self.landmarks.release(landmark, self.revision);
        }
        Some(sighting)
    }

    fn unlink_sighting(&mut self, keyframe: u32, gone: u32, next: u32) {
        let revision = self.revision;
        let Some(keyframe) = self.keyframes.get_mut(keyframe, revision) else {
            return;
        };
        if keyframe.sightings == gone {
            keyframe.sightings = next;
            return;
        }
        let mut number = keyframe.sightings;
        while let Some(sighting) = self.sightings.get(number) {
            if sighting.next == gone {
                if let Some(sighting) = self.sightings.get_mut(number, revision) {
                    sighting.next = next;
                }
                return;
            }
            number = sighting.next;
        }
    }

    fn unlink_target(&mut self, keyframe: u32, gone: u32, next: u32) {
        let revision = self.revision;
        let Some(keyframe) = self.keyframes.get_mut(keyframe, revision) else {
            return;
        };
        if keyframe.shown == gone {
            keyframe.shown = next;
            return;
        }
        let mut number = keyframe.shown;
        while let Some(sighting) = self.sightings.get(number) {
            if sighting.next_shown == gone {
                if let Some(sighting) = self.sightings.get_mut(number, revision) {
                    sighting.next_shown = next;
                }
                return;
            }
            number = sighting.next_shown;
        }
    }

    /// Removes a constraint; answers it.
    pub(super) fn remove_constraint(&mut self, number: u32) -> Option<Constraint> {
        let revision = self.revision;
        let constraint = self.constraints.get(number)?.clone();
        for (end, next) in [
            (constraint.from, constraint.next_from),
            (constraint.to, constraint.next_to),
        ] {
            let Some(keyframe) = self.keyframes.get_mut(end, revision) else {
                continue;
            };
            if keyframe.constraints == number {
                keyframe.constraints = next;
                continue;
            }
            let mut at = keyframe.constraints;
            while let Some(other) = self.constraints.get_mut(at, revision) {
                let follower = if other.from == end {
                    &mut other.next_from
                } else {
                    &mut other.next_to
                };
                if *follower == number {
                    *follower = next;
                    break;
                }
                at = *follower;
            }
        }
        self.constraints.remove(number, revision)
    }

    /// The number of the constraint after another one in the list of a keyframe.
    pub(super) fn next_constraint(&self, number: u32, keyframe: u32) -> u32 {
        self.constraints.get(number).map_or(NONE, |constraint| {
            if constraint.from == keyframe {
                constraint.next_from
            } else {
                constraint.next_to
            }
        })
    }
}
