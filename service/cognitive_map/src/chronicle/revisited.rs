//! An agent sees something, and has come where something like it was seen.

use nalgebra::Isometry3;

use super::chronicle::{Beside, Chronicle, Moment, beside};
use super::revisit::{Felt, Fit, Passage};
use super::tie::Standing;
use crate::geometry::PoseCovariance;
use crate::sample::Descriptor;

/// A revisit says nothing of an agent whose place is surer than the revisit by this factor.
const SURER: f64 = 2.0;

/// What an agent saw, and where it was.
#[derive(Clone, Copy, Debug)]
pub struct Viewed<'a> {
    /// What it saw.
    pub descriptor: &'a Descriptor,
    /// Where it was by motion alone, since its session began.
    pub in_odom: Isometry3<f64>,
    /// Covariance of its pose in the map.
    pub covariance: PoseCovariance,
}

impl Chronicle {
    /// An agent in the map saw something. At the end of a stretch along which it saw what was seen on an earlier one, the two
    /// are tied together by a match that is believed at once: many views agree.
    pub fn viewed(&mut self, moment: &Moment, viewed: &Viewed<'_>) {
        self.note(moment);
        let is_there = self
            .lives
            .get(moment.agent as usize)
            .is_some_and(|life| life.is_in_map && !life.is_fresh);
        if !is_there {
            return;
        }
        let felt = Felt {
            agent: moment.agent,
            session: self.session(moment.agent),
            seq: moment.seq,
            in_odom: viewed.in_odom,
            in_map: moment.pose.translation.vector.into(),
            spread: spread(&viewed.covariance),
        };
        let revision = self.revision;
        for passage in self.revisits.feel(&felt, viewed.descriptor, revision) {
            self.revisited(&passage, viewed);
        }
    }

    /// Ties the two stretches of a passage together, if that says something new; answers whether it does.
    fn revisited(&mut self, passage: &Passage, viewed: &Viewed<'_>) -> bool {
        let place = |reference: &super::revisit::Reference| {
            let beside = self.at_seq(reference.agent, reference.session, reference.seq)?;
            let anchor = self.anchors.get(beside.anchor)?;
            Some((anchor.pose * beside.motion, beside))
        };
        let (Some((pose_now, now)), Some((pose_then, then))) =
            (place(&passage.now), place(&passage.then))
        else {
            return false; // forgotten
        };
        let expected = pose_now.inv_mul(&pose_then);
        let either = [0, 1].map(|k| passage.now.spread[k].hypot(passage.then.spread[k]));
        let Some(fit) = Fit::of(passage, &expected, either) else {
            return false;
        };
        let own = spread(&viewed.covariance)[0];
        if own * SURER < spread(&fit.covariance)[0] {
            return false;
        }
        let is_kept = self.tie_beside(
            &now,
            &then,
            &fit.transform,
            &fit.covariance,
            Standing::Accepted,
        );
        self.fresh_matches += u32::from(is_kept);
        self.agreed += u32::from(is_kept);
        is_kept
    }

    /// The run that an agent is in.
    pub(super) fn session(&self, agent: u32) -> u32 {
        self.lives
            .get(agent as usize)
            .map_or(0, |life| life.session)
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

/// Roots of the traces of both halves of a pose's covariance \[m, rad\].
fn spread(covariance: &PoseCovariance) -> [f64; 2] {
    let diagonal = covariance.matrix().diagonal();
    [0, 3].map(|from| diagonal.rows(from, 3).sum().max(0.0).sqrt())
}
