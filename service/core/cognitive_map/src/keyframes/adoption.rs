//! Relaxations while samples come in: begun at one record, in force at a later one.

use std::borrow::Cow;
use std::sync::Arc;

use super::constraint::composed;
use super::constraints::Schedule;
use super::graph::KeyframeGraph;
use super::live_estimates::LiveEstimates;
use super::map::KeyframeMap;
use super::meanwhile::Meanwhile;
use super::pending_relaxation::PendingRelaxation;
use super::relaxation::Correction;
use super::relaxation_job::RelaxationJob;
use super::relaxation_outcome::RelaxationOutcome;
use super::tuning;

impl KeyframeMap {
    /// Begins a relaxation if one is due and none is under way. The graph goes on, and with a later
    /// record [`go_on_relaxing`](Self::go_on_relaxing) brings the outcome into force. `agent` and
    /// `stamp_ns` are those of the present record; `live` answers where the estimator has
    /// the agents and landmarks of the map.
    pub fn begin_relaxation(
        &mut self,
        agent: u32,
        stamp_ns: i64,
        live: impl FnOnce() -> LiveEstimates,
    ) {
        let has_views = !self.graph.is_tied_by_sightings() && self.recognition.views().is_due();
        let is_due = self.graph.is_due() || has_views;
        if self.pending.is_some() || !is_due {
            return;
        }
        let views = if has_views {
            self.recognition.take_due_views()
        } else {
            None
        };
        let job = RelaxationJob::new(&self.graph, views, live());
        self.pending = Some(PendingRelaxation::Awaited(job));
        if self.graph.is_due() {
            // What comes from now on is for the next one.
            self.graph.constraints.schedule = Schedule::default();
        }
        let mut meanwhile = Meanwhile::default();
        meanwhile.note(agent, stamp_ns);
        self.graph.meanwhile = Some(Box::new(meanwhile));
    }

    /// The relaxation whose outcome is not in force yet: for somebody who computes it beside the
    /// map.
    pub fn relaxation(&self) -> Option<&RelaxationJob> {
        match self.pending.as_ref()? {
            PendingRelaxation::Awaited(job) => Some(job),
            PendingRelaxation::InForce(..) => None,
        }
    }

    /// Counts a record of an agent. With the record at which a relaxation comes into force, answers
    /// where the agents are by it. When that is depends on the records alone.
    pub fn go_on_relaxing(&mut self, agent: u32, stamp_ns: i64) -> Vec<Correction> {
        let mut corrections = Vec::new();
        if let Some(PendingRelaxation::Awaited(job)) = &self.pending {
            let n_keyframes = self.graph.n_keyframes();
            let Some(meanwhile) = &mut self.graph.meanwhile else {
                return corrections; // never: both begin and end together
            };
            meanwhile.note(agent, stamp_ns);
            if !meanwhile.is_over(agent, stamp_ns, n_keyframes) {
                return corrections;
            }
            let outcome = Arc::clone(job.outcome());
            corrections = self.graph.bring_into_force(&outcome);
            self.pending = Some(PendingRelaxation::InForce(outcome, 0));
        }
        self.move_keyframes(tuning::KEYFRAMES_MOVED_PER_RECORD);
        corrections
    }

    /// The graph with all keyframes moved that a relaxation in force moves.
    pub fn settled(&self) -> Cow<'_, KeyframeGraph> {
        if !matches!(self.pending, Some(PendingRelaxation::InForce(..))) {
            return Cow::Borrowed(&self.graph);
        }
        let mut settled = self.clone();
        settled.move_keyframes(usize::MAX);
        Cow::Owned(settled.graph)
    }

    /// Moves the next keyframes of an outcome in force. Once all have moved, it is over.
    fn move_keyframes(&mut self, most: usize) {
        let Some(PendingRelaxation::InForce(outcome, next)) = &mut self.pending else {
            return;
        };
        let rest = outcome.poses.get(*next as usize..).unwrap_or_default();
        let some = &rest[..rest.len().min(most)];
        for (number, pose) in some {
            self.graph.put(*number, pose);
        }
        *next = next.saturating_add(u32::try_from(some.len()).unwrap_or(u32::MAX));
        if some.len() == rest.len() {
            if !outcome.is_empty() {
                self.graph.attachments.check_all();
            }
            (self.pending, self.graph.meanwhile) = (None, None);
        }
    }
}

impl KeyframeGraph {
    /// Changes the closures of an outcome, moves the agents with their latest keyframes, and
    /// answers where the agents are.
    pub(super) fn bring_into_force(&mut self, outcome: &RelaxationOutcome) -> Vec<Correction> {
        let revision = self.revision;
        let is_later = |number| { self.meanwhile.iter() }.any(|m| m.constraints.contains(&number));
        let judged = outcome.states.iter().copied();
        let judged: Vec<_> = judged.filter(|(number, _)| !is_later(*number)).collect();
        for (number, state) in judged {
            if let Some(constraint) = self.constraints.slab.get_mut(number, revision) {
                constraint.state = state;
            }
        }
        if let Some(matches) = &outcome.matches {
            self.matches = matches.clone().into();
        }
        if let Some(learned) = &outcome.learned {
            self.learned = learned.clone().into();
        }
        if let Some(view_maps) = &outcome.view_maps {
            self.set_view_maps(view_maps.clone());
        }
        for (agent, _) in (0..).zip(0..self.chains.tracks.len()) {
            self.move_latest(agent, outcome);
        }
        for &(agent, turn_noise) in &outcome.turn_noises {
            if let Some(track) = self.track_mut(agent) {
                track.turn_noise = turn_noise;
            }
        }
        let is_by_views = !self.matches.is_empty();
        for correction in &outcome.corrections {
            if let Some(track) = self.track_mut(correction.agent) {
                track.is_calibrated_by_views = is_by_views;
            }
        }
        let carried_on = |correction| self.carried_on(correction);
        { outcome.corrections.iter() }
            .filter_map(carried_on)
            .collect()
    }

    /// Moves the keyframes of an agent that came after the snapshot, with the last one before.
    /// Those of a stretch that began since lie where the agent was put.
    fn move_latest(&mut self, agent: u32, outcome: &RelaxationOutcome) {
        let Some(track) = self.chains.track(agent).filter(|track| track.is_in_map()) else {
            return;
        };
        let (newest, revision) = (track.newest, self.revision);
        let mut later = Vec::new();
        let mut number = newest;
        while self.is_apart(number)
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
        self.put(number, &pose);
        for &number in &later {
            self.chains.move_in_map(number, &moved, revision);
        }
        if let Some(meanwhile) = &mut self.meanwhile {
            meanwhile.keyframes.insert(number);
        }
        let goes_on = number == newest || later.contains(&newest);
        let is_cut = { self.meanwhile.iter() }.any(|m| m.motion(agent).is_none());
        let pose = self.chains.keyframes.get(newest).map(|newest| newest.pose);
        if goes_on
            && !is_cut
            && let (Some(pose), Some(track)) = (pose, self.track_mut(agent))
        {
            track.pose = pose * track.since.motion();
        }
    }

    /// Puts a keyframe of a snapshot where a relaxation has it, unless its number has become
    /// another one's.
    fn put(&mut self, number: u32, pose: &nalgebra::Isometry3<f64>) {
        if !self.is_apart(number) {
            self.chains.put(number, pose, self.revision);
        }
    }

    /// Whether the relaxation under way does not concern the keyframe of a number.
    fn is_apart(&self, number: u32) -> bool {
        { self.meanwhile.iter() }.any(|meanwhile| meanwhile.keyframes.contains(&number))
    }

    /// A correction of an agent as it was when a relaxation began, carried on by its motion since;
    /// none if it was put elsewhere.
    fn carried_on(&self, correction: &Correction) -> Option<Correction> {
        let since = self.meanwhile.as_ref()?.motion(correction.agent)?;
        let mut estimate = correction.estimate;
        estimate.pose *= since.motion();
        estimate.pose.rotation.renormalize_fast();
        let (motion, noise) = (since.motion(), since.covariance());
        estimate.covariance = composed(&estimate.covariance, motion, &noise);
        Some(Correction {
            estimate,
            ..*correction
        })
    }
}

#[cfg(test)]
mod tests;
