//! The coarse graph: few keyframes, relaxed while samples come in.

use nalgebra::Isometry3;

use super::constraint::ClosureState;
use super::graph::KeyframeGraph;
use super::tuning;
use geometry::is_within;
use state::{NONE, Slab};

impl KeyframeGraph {
    /// A copy with one keyframe a step, and those with sightings, at the begin of a stretch, and
    /// the latest ones. Keyframes and constraints keep their numbers.
    pub(super) fn coarse(&self) -> Self {
        let mut coarse = self.clone();
        // Attachments move with the keyframes afterwards.
        coarse.attachments.slab = Slab::default();
        for agent in 0..self.tracks.len() {
            let newest = self.tracks.get(agent).map_or(NONE, |track| track.newest);
            let mut way = Isometry3::identity();
            let mut number = newest;
            while let Some(keyframe) = coarse.keyframes.get(number) {
                let (motion, previous) = (keyframe.motion, keyframe.previous);
                // The chain is walked from its end, since removals change the neighbours.
                if number == newest
                    || coarse.must_stay(number)
                    || !is_within(&way, tuning::COARSE_STEP.0, tuning::COARSE_STEP.1)
                {
                    way = motion;
                } else {
                    coarse.dissolve(number);
                    way = motion * way;
                }
                number = previous;
            }
        }
        coarse.drop_old_candidates();
        coarse
    }

    /// Removes pending closures but the latest ones.
    fn drop_old_candidates(&mut self) {
        let mut pending: Vec<(i64, u32)> = self
            .constraints
            .iter()
            .filter(|(_, constraint)| {
                matches!(
                    constraint.state,
                    ClosureState::Pending | ClosureState::Refuted
                )
            })
            .filter_map(|(number, constraint)| {
                Some((self.keyframes.get(constraint.from)?.stamp_ns, number))
            })
            .collect();
        pending.sort_unstable();
        let n_old = pending.len().saturating_sub(tuning::COARSE_PENDING_MAX);
        for &(_, number) in &pending[..n_old] {
            self.remove_constraint(number);
        }
    }

    /// Whether a keyframe must stay in the coarse graph.
    fn must_stay(&self, number: u32) -> bool {
        let Some(keyframe) = self.keyframes.get(number) else {
            return true;
        };
        let goes_on = self
            .keyframes
            .get(keyframe.next)
            .is_some_and(|next| !next.begins);
        if keyframe.begins || !goes_on || keyframe.sightings != NONE || keyframe.shown != NONE {
            return true;
        }
        let mut at = keyframe.constraints;
        while let Some(constraint) = self.constraints.get(at) {
            if matches!(
                constraint.state,
                ClosureState::Origin | ClosureState::Stated
            ) {
                return true;
            }
            at = self.next_constraint(at, number);
        }
        false
    }

    /// Moves the keyframes as in a relaxed coarse copy, and adopts the states of its closures.
    /// Keyframes between two of the copy move with the earlier one.
    pub(super) fn adopt(&mut self, coarse: &Self) {
        let revision = self.revision;
        for number in 0..self.constraints.numbers() {
            let state = coarse
                .constraints
                .get(number)
                .map(|constraint| constraint.state);
            if let (Some(state), Some(constraint)) = (state, self.constraints.get(number))
                && state != constraint.state
                && let Some(constraint) = self.constraints.get_mut(number, revision)
            {
                constraint.state = state;
            }
        }
        self.check_attachments();
        for agent in 0..self.tracks.len() {
            let Some(track) = self.tracks.get(agent) else {
                continue;
            };
            if !track.is_in_map {
                continue;
            }
            // Keyframes since the last one of the coarse graph, on the way back.
            let mut behind: Vec<u32> = Vec::new();
            let mut number = track.newest;
            while let Some(keyframe) = self.keyframes.get(number) {
                let previous = keyframe.previous;
                behind.push(number);
                if let (Some(key), Some(was)) = (coarse.keyframes.get(number), self.in_map(number))
                {
                    let moved = key.pose * was.inverse();
                    for number in behind.drain(..) {
                        self.move_keyframe(number, &moved);
                    }
                }
                number = previous;
            }
            let newest = self.tracks.get(agent).map_or(NONE, |track| track.newest);
            let pose = self.keyframes.get(newest).map(|keyframe| keyframe.pose);
            if let (Some(pose), Some(track)) = (pose, self.tracks.get_mut(agent, revision)) {
                track.pose = pose * track.since.motion();
            }
        }
    }

    fn move_keyframe(&mut self, number: u32, moved: &Isometry3<f64>) {
        let was = self.in_map(number);
        if let (Some(was), Some(keyframe)) = (was, self.keyframes.get_mut(number, self.revision)) {
            keyframe.pose = moved * was;
            keyframe.pose.rotation.renormalize_fast();
            keyframe.is_in_map = true;
        }
    }
}
