//! Relaxations while samples come in: begun at one record, in force at a later one.

use super::constraints::Schedule;
use super::graph::KeyframeGraph;
use super::pending_relaxation::{PendingRelaxation, Stage};
use super::relaxation::Correction;
use super::relaxation_job::RelaxationJob;
use super::relaxation_outcome::RelaxationOutcome;
use super::tuning;

impl KeyframeGraph {
    /// Begins a relaxation if one is due and none is under way. The graph goes on, and with a later
    /// record [`go_on_relaxing`](Self::go_on_relaxing) brings the outcome into force. `agent` and
    /// `stamp_ns` are those of the present record.
    pub fn begin_relaxation(&mut self, agent: u32, stamp_ns: i64) {
        if self.pending.is_some() || !self.is_due() {
            return;
        }
        let mut pending = PendingRelaxation::new(RelaxationJob::new(self));
        // What comes from now on is for the next one.
        self.constraints.schedule = Schedule::default();
        pending.note(agent, stamp_ns);
        self.pending = Some(Box::new(pending));
    }

    /// The relaxation whose outcome is not in force yet: for somebody who computes it beside the
    /// map.
    pub fn relaxation(&self) -> Option<&RelaxationJob> {
        match &self.pending.as_ref()?.stage {
            Stage::Awaited(job) => Some(job),
            Stage::InForce(..) => None,
        }
    }

    /// Counts a record of an agent. With the record at which a relaxation comes into force, answers
    /// where the agents are by it. When that is depends on the records alone.
    pub fn go_on_relaxing(&mut self, agent: u32, stamp_ns: i64) -> Vec<Correction> {
        let Some(mut pending) = self.pending.take() else {
            return Vec::new();
        };
        let mut corrections = Vec::new();
        if let Some(outcome) = pending.outcome_with(agent, stamp_ns) {
            if outcome.is_empty() {
                return corrections;
            }
            self.bring_into_force(&mut pending, &outcome);
            let carried_on = |correction| pending.carried_on(correction);
            corrections = { outcome.corrections.iter() }
                .filter_map(carried_on)
                .collect();
            pending.stage = Stage::InForce(outcome, 0);
        }
        let is_over = self.move_some(&mut pending, tuning::KEYFRAMES_MOVED_PER_RECORD);
        self.pending = (!is_over).then_some(pending);
        corrections
    }

    /// The graph with all keyframes moved that a relaxation in force moves.
    pub(super) fn settled(&self) -> Self {
        let mut settled = self.clone();
        if let Some(mut pending) = settled.pending.take() {
            settled.move_some(&mut pending, usize::MAX);
        }
        settled
    }

    /// Changes the closures of an outcome, and moves the agents with their latest keyframes.
    fn bring_into_force(&mut self, pending: &mut PendingRelaxation, outcome: &RelaxationOutcome) {
        let revision = self.revision;
        for &(number, state) in &outcome.states {
            if !pending.constraints_apart.contains(&number)
                && let Some(constraint) = self.constraints.slab.get_mut(number, revision)
            {
                constraint.state = state;
            }
        }
        for (agent, _) in (0..).zip(0..self.chains.tracks.len()) {
            self.move_latest(agent, pending, outcome);
        }
    }

    /// Moves the keyframes of an agent that came after the snapshot, with the last one before.
    /// Those of a stretch that began since lie where the agent was put.
    fn move_latest(
        &mut self,
        agent: u32,
        pending: &mut PendingRelaxation,
        outcome: &RelaxationOutcome,
    ) {
        let Some(track) = self.chains.track(agent).filter(|track| track.is_in_map()) else {
            return;
        };
        let (newest, revision) = (track.newest, self.revision);
        let mut later = Vec::new();
        let mut number = newest;
        while pending.keyframes_apart.contains(&number)
            && let Some(keyframe) = self.chains.keyframes.get(number)
        {
            later.push(number);
            if keyframe.begins {
                later.clear();
            }
            number = keyframe.previous;
        }
        let (Some(pose), Some(was)) = (outcome.pose(number), self.chains.in_map(number)) else {
            return;
        };
        let moved = pose * was.inverse();
        self.chains.put(number, &pose, revision);
        pending.keyframes_apart.insert(number);
        for &number in &later {
            self.chains.move_in_map(number, &moved, revision);
        }
        let goes_on = number == newest || later.contains(&newest);
        let pose = self.chains.keyframes.get(newest).map(|newest| newest.pose);
        if goes_on
            && !pending.is_cut(agent)
            && let (Some(pose), Some(track)) = (pose, self.chains.track_mut(agent, revision))
        {
            track.pose = pose * track.since.motion();
        }
    }

    /// Moves some of the keyframes of an outcome in force; answers whether none is left.
    fn move_some(&mut self, pending: &mut PendingRelaxation, most: usize) -> bool {
        let Stage::InForce(outcome, next) = &mut pending.stage else {
            return false;
        };
        let rest = outcome.poses.get(*next as usize..).unwrap_or_default();
        let some = &rest[..rest.len().min(most)];
        for (number, pose) in some {
            if !pending.keyframes_apart.contains(number) {
                self.chains.put(*number, pose, self.revision);
            }
        }
        *next = next.saturating_add(u32::try_from(some.len()).unwrap_or(u32::MAX));
        let is_over = some.len() == rest.len();
        if is_over {
            self.attachments.check_all();
        }
        is_over
    }
}

#[cfg(test)]
mod tests;
