//! Anchors one after the other, and what hangs on them.

use nalgebra::Isometry3;

use super::anchor::Anchor;
use super::graph::{KeyframeGraph, REST, SIGHTINGS_PER_ANCHOR_MAX};
use super::sighting::{Shown, Sighting};
use super::tie::{Standing, Tie};
use geometry::is_within;
use geometry::{MotionSum, PoseCovariance};
use state::NONE;

impl KeyframeGraph {
    /// A new anchor where an agent is; its latest one if there is no room for another.
    pub(super) fn anchor_anew(&mut self, agent: u32) -> u32 {
        if self.anchors.len() >= self.settings.anchors_max as usize {
            self.thin();
        }
        let revision = self.revision;
        let Some(life) = self.lives.get(agent as usize) else {
            return NONE;
        };
        let newest = life.newest;
        if self.anchors.len() >= self.settings.anchors_max as usize {
            return newest;
        }
        let is_first = newest == NONE || life.is_cut;
        let founds = life.founds;
        // An agent that rests came here before now.
        let rests =
            !life.is_fresh && is_within(&life.rest.inv_mul(life.since.motion()), REST.0, REST.1);
        let (seq, stamp_ns) = if rests {
            (life.rest_seq, life.rest_ns)
        } else {
            (life.seq, life.stamp_ns)
        };
        let (motion, covariance, calibrated) = if is_first {
            let nothing = (Isometry3::identity(), PoseCovariance::zero());
            (nothing.0, nothing.1, life.calibrated.without_motion())
        } else {
            (
                *life.since.motion(),
                life.since.covariance(),
                life.calibrated,
            )
        };
        let anchor = Anchor {
            agent,
            previous: newest,
            next: NONE,
            sightings: NONE,
            shown: NONE,
            ties: NONE,
            moorings: NONE,
            session: life.session,
            seq,
            until_seq: life.seq,
            stamp_ns,
            until_ns: life.stamp_ns,
            is_in_map: life.is_in_map,
            pose: life.pose,
            motion,
            covariance,
            calibrated,
            begins: is_first,
            unevenness_m: 0.0,
        };
        let (until_seq, until_ns, pose) = (life.until_seq, life.until_ns, life.pose);
        let number = self.anchors.insert(anchor, revision);
        if let Some(previous) = self.anchors.get_mut(newest, revision) {
            previous.next = number;
            (previous.until_seq, previous.until_ns) = (until_seq, until_ns);
        }
        if let Some(life) = self.lives.get_mut(agent as usize, revision) {
            life.newest = number;
            life.is_cut = false;
            life.is_fresh = false;
            life.founds = false;
            life.since = MotionSum::default();
            life.calibrated = life.calibrated.without_motion();
            (life.until_seq, life.until_ns) = (life.seq, life.stamp_ns);
            life.rest = Isometry3::identity();
            (life.rest_seq, life.rest_ns) = (seq, stamp_ns);
        }
        self.pass_milestone(agent, number);
        if founds {
            self.tie_to_map(number, pose, &PoseCovariance::zero(), Standing::Origin);
        }
        number
    }

    /// The earliest anchor of an agent; [`NONE`] if it has none. Walks the whole chain.
    pub(super) fn first_of(&self, agent: u32) -> u32 {
        let newest = self.lives.get(agent as usize).map(|life| life.newest);
        let mut number = newest.unwrap_or(NONE);
        while let Some(anchor) = self.anchors.get(number) {
            if anchor.previous == NONE {
                break;
            }
            number = anchor.previous;
        }
        number
    }

    /// The pose in the map of an anchor of an agent that is in it.
    pub(super) fn in_map(&self, number: u32) -> Option<Isometry3<f64>> {
        let anchor = self.anchors.get(number)?;
        if anchor.is_in_map {
            return Some(anchor.pose);
        }
        let life = self.lives.get(anchor.agent as usize)?;
        Some(life.own_frame.unwrap_or_default() * anchor.pose)
    }

    /// Ties an anchor to the map.
    pub(super) fn tie_to_map(
        &mut self,
        anchor: u32,
        at: Isometry3<f64>,
        covariance: &PoseCovariance,
        standing: Standing,
    ) {
        let tie = Tie {
            from: NONE,
            to: anchor,
            next_from: NONE,
            next_to: NONE,
            transform: at,
            covariance: *covariance,
            standing,
        };
        self.tie(tie);
    }

    /// Remembers a tie; answers its number, or [`NONE`] if there is no room or an end is no more.
    pub(super) fn tie(&mut self, mut tie: Tie) -> u32 {
        let revision = self.revision;
        let (from, to) = (tie.from, tie.to);
        let is_there = |number: u32| self.anchors.get(number).is_some();
        if self.ties.len() >= self.settings.ties_max as usize
            || !is_there(to)
            || (from != NONE && !is_there(from))
            || from == to
        {
            return NONE;
        }
        tie.next_to = self.anchors.get(to).map_or(NONE, |anchor| anchor.ties);
        tie.next_from = self.anchors.get(from).map_or(NONE, |anchor| anchor.ties);
        let number = self.ties.insert(tie, revision);
        for end in [from, to] {
            if let Some(anchor) = self.anchors.get_mut(end, revision) {
                anchor.ties = number;
            }
        }
        number
    }

    /// Hangs a sighting on its anchor, and on the one that it shows. One of the same landmark there is joined with it;
    /// where there are many, the vaguest goes. Answers whether the sighting is one more.
    pub(super) fn attach(&mut self, mut sighting: Sighting) -> bool {
        let revision = self.revision;
        let Some(anchor) = self.anchors.get(sighting.anchor) else {
            return false;
        };
        let (mut number, first) = (anchor.sightings, anchor.sightings);
        let (mut count, mut vaguest) = (0, (0.0, NONE));
        while let Some(other) = self.sightings.get(number) {
            let is_same =
                matches!(other.shown, Shown::Landmark(_)) && other.shown == sighting.shown;
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
            if spread > vaguest.0 {
                vaguest = (spread, number);
            }
            count += 1;
            number = other.next;
        }
        let is_crowded = count >= SIGHTINGS_PER_ANCHOR_MAX
            || self.sightings.len() >= self.settings.sightings_max as usize;
        if is_crowded && (vaguest.1 == NONE || sighting.point.covariance().trace() >= vaguest.0) {
            return false;
        }
        if is_crowded {
            self.detach(vaguest.1);
        }
        let first = if first == vaguest.1 && is_crowded {
            self.anchors
                .get(sighting.anchor)
                .map_or(NONE, |anchor| anchor.sightings)
        } else {
            first
        };
        sighting.next = first;
        let shown = match sighting.shown {
            Shown::Agent(target, _) => target,
            Shown::Landmark(_) => NONE,
        };
        sighting.next_shown = self.anchors.get(shown).map_or(NONE, |anchor| anchor.shown);
        let at = sighting.anchor;
        let number = self.sightings.insert(sighting, revision);
        if let Some(anchor) = self.anchors.get_mut(at, revision) {
            anchor.sightings = number;
        }
        if let Some(anchor) = self.anchors.get_mut(shown, revision) {
            anchor.shown = number;
        }
        true
    }

    /// Takes a sighting off its anchors and forgets it; answers it.
    pub(super) fn detach(&mut self, number: u32) -> Option<Sighting> {
        let sighting = self.sightings.get(number)?.clone();
        self.unlink_sighting(sighting.anchor, number, sighting.next);
        if let Shown::Agent(target, _) = sighting.shown {
            self.unlink_shown(target, number, sighting.next_shown);
        }
        self.sightings.remove(number, self.revision);
        if let Shown::Landmark(landmark) = sighting.shown {
            self.landmarks.release(landmark, self.revision);
        }
        Some(sighting)
    }

    fn unlink_sighting(&mut self, anchor: u32, gone: u32, next: u32) {
        let revision = self.revision;
        let Some(anchor) = self.anchors.get_mut(anchor, revision) else {
            return;
        };
        if anchor.sightings == gone {
            anchor.sightings = next;
            return;
        }
        let mut number = anchor.sightings;
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

    fn unlink_shown(&mut self, anchor: u32, gone: u32, next: u32) {
        let revision = self.revision;
        let Some(anchor) = self.anchors.get_mut(anchor, revision) else {
            return;
        };
        if anchor.shown == gone {
            anchor.shown = next;
            return;
        }
        let mut number = anchor.shown;
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

    /// Takes a tie off its anchors and forgets it; answers it.
    pub(super) fn untie(&mut self, number: u32) -> Option<Tie> {
        let revision = self.revision;
        let tie = self.ties.get(number)?.clone();
        for (end, next) in [(tie.from, tie.next_from), (tie.to, tie.next_to)] {
            let Some(anchor) = self.anchors.get_mut(end, revision) else {
                continue;
            };
            if anchor.ties == number {
                anchor.ties = next;
                continue;
            }
            let mut at = anchor.ties;
            while let Some(other) = self.ties.get_mut(at, revision) {
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
        self.ties.remove(number, revision)
    }

    /// The number of the tie after one of an anchor's ties.
    pub(super) fn next_tie(&self, number: u32, anchor: u32) -> u32 {
        self.ties.get(number).map_or(NONE, |tie| {
            if tie.from == anchor {
                tie.next_from
            } else {
                tie.next_to
            }
        })
    }
}
