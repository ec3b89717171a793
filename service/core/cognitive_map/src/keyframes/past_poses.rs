//! Poses of the past: what place recognition asks of the keyframe graph.

use geometry::{PoseCovariance, se3};
use nalgebra::Isometry3;
use place_recognition::{Keyframes, Relocalised, Revisit, SampleKey};

use super::graph::{Beside, KeyframeGraph, beside};

impl Keyframes for KeyframeGraph {
    fn pose_at(&self, sample: SampleKey) -> Option<Isometry3<f64>> {
        self.pose_of(&self.at_sample(sample)?)
    }

    fn motion_between(&self, from: SampleKey, to: SampleKey) -> Option<Isometry3<f64>> {
        let pose = |sample: SampleKey| {
            let beside = self.at_sample(sample)?;
            Some(self.anchors.get(beside.anchor)?.pose * beside.motion)
        };
        Some(pose(from)?.inv_mul(&pose(to)?))
    }

    fn is_planar(&self, agent: u32) -> bool {
        let own = self.lives.get(agent as usize);
        own.is_some_and(|life| life.is_planar)
            && self
                .lives
                .iter()
                .all(|life| life.is_planar || !life.is_in_map)
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
        if let Some(life) = self.lives.get_mut(agent as usize, self.revision) {
            life.is_cut = true;
            life.pose = at.copied().unwrap_or(life.pose);
        }
        self.anchor_anew(agent);
    }

    /// Adds a loop closure from where an agent was found to a remembered sample, accepted at once.
    pub(super) fn tie_to_recognised(
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
        let life = self.lives.get(agent as usize);
        life.is_some_and(|life| life.is_in_map && !life.is_fresh)
    }

    /// Number of the latest sample of an agent.
    pub(super) fn latest_seq(&self, agent: u32) -> u64 {
        self.lives.get(agent as usize).map_or(0, |life| life.seq)
    }

    /// The session that an agent is in.
    pub(super) fn session(&self, agent: u32) -> u32 {
        self.lives
            .get(agent as usize)
            .map_or(0, |life| life.session)
    }

    /// Pose in the map of a place beside a keyframe; `None` if it lies in no map.
    pub(super) fn pose_of(&self, beside: &Beside) -> Option<Isometry3<f64>> {
        let anchor = self.anchors.get(beside.anchor)?;
        let life = self.lives.get(anchor.agent as usize)?;
        let pose = anchor.pose * beside.motion;
        if anchor.is_in_map {
            Some(pose)
        } else {
            Some(life.own_frame? * pose)
        }
    }

    fn at_sample(&self, sample: SampleKey) -> Option<Beside> {
        self.at_seq(sample.agent, sample.session, sample.seq)
    }

    /// Where an agent was at a sample of a session. Walks back to it from the next milestone.
    pub(super) fn at_seq(&self, agent: u32, session: u32, seq: u64) -> Option<Beside> {
        let life = self.lives.get(agent as usize)?;
        if session > life.session || (session == life.session && seq > life.seq) {
            return None;
        }
        let mut later = (life.seq, *life.since.motion(), life.since.covariance());
        let (mut number, mut until_seq) = (life.newest, life.until_seq);
        if let Some(milestone) = self.anchors.get(self.milestone_after(agent, session, seq)) {
            if milestone.begins && milestone.session == session {
                return None;
            }
            later = (milestone.seq, milestone.motion, milestone.covariance);
            number = milestone.previous;
            until_seq = self.anchors.get(number)?.until_seq;
        }
        loop {
            let anchor = self.anchors.get(number)?;
            if anchor.session < session {
                return None;
            }
            if anchor.session == session && anchor.seq <= seq {
                let (end, motion, covariance) = later;
                let way = end.saturating_sub(until_seq).max(1) as f64;
                let share = seq.saturating_sub(until_seq) as f64 / way;
                return Some(beside(number, &motion, &covariance, share));
            }
            if anchor.begins && anchor.session == session {
                return None;
            }
            later = (anchor.seq, anchor.motion, anchor.covariance);
            number = anchor.previous;
            until_seq = self.anchors.get(number)?.until_seq;
        }
    }
}
