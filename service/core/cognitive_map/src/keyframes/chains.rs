//! The chains of keyframes, one for each agent, and their index.

use nalgebra::Isometry3;

use super::agent_track::AgentTrack;
use super::bridge::bridge;
use super::keyframe::{Keyframe, KeyframeSlab};
use super::keyframe_index::{IndexEntry, KeyframeIndex};
use super::tuning;
use geometry::is_somewhere;
use state::{NONE, PagedVec};

/// The chains of keyframes, one for each agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Chains {
    /// The end of each agent's chain.
    pub(super) tracks: PagedVec<AgentTrack, 4>,
    pub(super) keyframes: KeyframeSlab,
    /// Sweep cursor: the number of the keyframe at which sparsification goes on.
    pub(super) sweep: u32,
    index: KeyframeIndex,
}

impl Chains {
    /// The end of an agent's chain.
    pub(super) fn track(&self, agent: u32) -> Option<&AgentTrack> {
        self.tracks.get(agent as usize)
    }

    /// The same, to be changed.
    pub(super) fn track_mut(&mut self, agent: u32, revision: u64) -> Option<&mut AgentTrack> {
        self.tracks.get_mut(agent as usize, revision)
    }

    /// The session that an agent is in.
    pub(super) fn session(&self, agent: u32) -> u32 {
        self.track(agent).map_or(0, |track| track.session)
    }

    /// The keyframes of an agent with their numbers, the latest first.
    pub(super) fn of_agent(&self, agent: u32) -> impl Iterator<Item = (u32, &Keyframe)> {
        let newest = self.track(agent).map_or(NONE, |track| track.newest);
        self.back_from(newest)
    }

    /// A keyframe, and those of its agent before it.
    pub(super) fn back_from(&self, number: u32) -> impl Iterator<Item = (u32, &Keyframe)> {
        let item = |number: u32| Some((number, self.keyframes.get(number)?));
        std::iter::successors(item(number), move |(_, keyframe)| item(keyframe.previous))
    }

    /// A keyframe, and those of its agent after it.
    pub(super) fn on_from(&self, number: u32) -> impl Iterator<Item = (u32, &Keyframe)> {
        let item = |number: u32| Some((number, self.keyframes.get(number)?));
        std::iter::successors(item(number), move |(_, keyframe)| item(keyframe.next))
    }

    /// The earliest keyframe of an agent; [`NONE`] if it has none. Walks the whole chain.
    pub(super) fn first(&self, agent: u32) -> u32 {
        self.of_agent(agent)
            .last()
            .map_or(NONE, |(number, _)| number)
    }

    /// Appends a keyframe where an agent is; answers its number.
    pub(super) fn append(&mut self, agent: u32, revision: u64) -> u32 {
        let Some(track) = self.tracks.get_mut(agent as usize, revision) else {
            return NONE;
        };
        let keyframe = track.next_keyframe(agent);
        let start = (keyframe.seq, keyframe.stamp_ns);
        let number = self.keyframes.insert(keyframe, revision);
        if let Some(previous) = self.keyframes.get_mut(track.newest, revision) {
            previous.next = number;
            (previous.until_seq, previous.until_ns) = (track.until_seq, track.until_ns);
        }
        track.begin_after(number, start);
        self.index_keyframe(agent, number);
        number
    }

    /// Pose of a keyframe in the map, if its agent is in it.
    pub(super) fn in_map(&self, number: u32) -> Option<Isometry3<f64>> {
        let keyframe = self.keyframes.get(number)?;
        if keyframe.is_in_map {
            return Some(keyframe.pose);
        }
        let track = self.track(keyframe.agent)?;
        Some(track.own_frame.0.unwrap_or_default() * keyframe.pose)
    }

    /// Puts a keyframe of the map somewhere else. One whose agent has left the map for a frame of
    /// its own stays.
    pub(super) fn put(&mut self, number: u32, pose: &Isometry3<f64>, revision: u64) {
        if self.in_map(number).is_some()
            && let Some(keyframe) = self.keyframes.get_mut(number, revision)
        {
            (keyframe.pose, keyframe.is_in_map) = (*pose, true);
        }
    }

    /// Moves a keyframe by a motion of the map's frame.
    pub(super) fn move_in_map(&mut self, number: u32, moved: &Isometry3<f64>, revision: u64) {
        let was = self.in_map(number);
        if let (Some(was), Some(keyframe)) = (was, self.keyframes.get_mut(number, revision)) {
            keyframe.pose = moved * was;
            keyframe.pose.rotation.renormalize_fast();
            keyframe.is_in_map = true;
        }
    }

    /// Moves the keyframes of an agent of the map as in a copy with some of them. Those between two
    /// of the copy lie where their motions most likely lead from the one to the other.
    pub(super) fn adopt(&mut self, agent: u32, copy: &Self, revision: u64) {
        let Some(newest) = self.track(agent).filter(|track| track.is_in_map()) else {
            return;
        };
        let newest = newest.newest;
        // From an earlier keyframe to the one that was looked at before it.
        let (mut between, mut later): (Vec<u32>, u32) = (Vec::new(), NONE);
        let mut number = newest;
        while let Some(keyframe) = self.keyframes.get(number) {
            let previous = keyframe.previous;
            if let Some(pose) = copy.in_map(number) {
                self.put_somewhere(number, &pose, revision);
                self.put_between(number, &between, later, revision);
                (between, later) = (Vec::new(), number);
            } else {
                between.push(number);
            }
            number = previous;
        }
        let pose = self.keyframes.get(newest).map(|keyframe| keyframe.pose);
        let turn_noise = copy.track(agent).map_or(1.0, |track| track.turn_noise);
        if let (Some(pose), Some(track)) = (pose, self.track_mut(agent, revision)) {
            track.turn_noise = turn_noise;
            track.pose = pose * track.since.motion();
        }
    }

    /// Puts keyframes, the last one first, on the way between two that have been put somewhere.
    fn put_between(&mut self, from: u32, numbers: &[u32], to: u32, revision: u64) {
        if numbers.is_empty() {
            return;
        }
        let keyframe = |number: u32| self.keyframes.get(number);
        let (Some(from), Some(to)) = (keyframe(from), keyframe(to)) else {
            return;
        };
        let passed = numbers.iter().rev().filter_map(|number| keyframe(*number));
        let motions = passed
            .chain([to])
            .map(|keyframe| (keyframe.motion, keyframe.covariance));
        let poses = bridge(&from.pose, &motions.collect::<Vec<_>>(), &to.pose);
        for (number, pose) in numbers.iter().rev().zip(&poses) {
            self.put_somewhere(*number, pose, revision);
        }
    }

    /// Puts a keyframe where it turns out to be, unless that is nowhere: motions may be as large as
    /// numbers are.
    fn put_somewhere(&mut self, number: u32, pose: &Isometry3<f64>, revision: u64) {
        let is_turn = pose.rotation.coords.iter().all(|x| x.is_finite());
        if is_turn && is_somewhere(&pose.translation.vector) {
            self.put(number, pose, revision);
        }
    }

    /// The number of the keyframe that sparsification examines next.
    pub(super) fn next_of_sweep(&mut self) -> u32 {
        let number = self.sweep;
        self.sweep = (self.sweep + 1) % self.keyframes.numbers();
        number
    }

    /// Variances of odometry up to each keyframe since its agent's chain began \[m², rad²\].
    pub(super) fn path_variances(&self) -> Vec<[f64; 2]> {
        let mut path_variances = vec![[0.0; 2]; self.keyframes.numbers() as usize];
        for (agent, track) in (0..).zip(self.tracks.iter()) {
            let turn_noise = track.turn_noise;
            let mut number = self.first(agent);
            let mut way = [0.0; 2];
            while let Some(keyframe) = self.keyframes.get(number) {
                let diagonal = keyframe.covariance.matrix().diagonal();
                way[0] += diagonal.rows(0, 3).max();
                way[1] += diagonal.rows(3, 3).max() * turn_noise * turn_noise;
                // No motion is known between two stretches.
                if keyframe.begins {
                    way[0] += tuning::UNKNOWN_MOTION_VARIANCE_M2;
                }
                path_variances[number as usize] = way;
                number = keyframe.next;
            }
        }
        path_variances
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
        for (agent, _) in (0..).zip(0..self.tracks.len()) {
            let chain: Vec<u32> = self.of_agent(agent).map(|(number, _)| number).collect();
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

    /// Whether all numbers lead somewhere, and the chains hold each keyframe once.
    pub(super) fn is_sound(&self) -> bool {
        self.keyframes.is_sound()
            && self.sweep <= self.keyframes.numbers()
            && self.holds_each_once()
    }

    fn holds_each_once(&self) -> bool {
        let mut visited = 0;
        for (agent, track) in (0..).zip(self.tracks.iter()) {
            let (mut number, mut next) = (track.newest, NONE);
            while number != NONE {
                let Some(keyframe) = self.keyframes.get(number) else {
                    return false;
                };
                visited += 1;
                if keyframe.next != next
                    || keyframe.agent != agent
                    || visited > self.keyframes.len()
                {
                    return false;
                }
                (next, number) = (number, keyframe.previous);
            }
        }
        visited == self.keyframes.len()
    }
}

/// Whether the keyframe of an index entry is still there.
fn is_valid(keyframes: &KeyframeSlab, agent: u32, entry: &IndexEntry) -> bool {
    keyframes.get(entry.keyframe).is_some_and(|keyframe| {
        (keyframe.agent, keyframe.session, keyframe.seq) == (agent, entry.session, entry.seq)
    })
}
