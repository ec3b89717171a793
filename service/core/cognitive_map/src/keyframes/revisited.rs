//! An agent sees something, and has come where something like it was seen.

use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

use super::field::{Glimpse, Prior, Scene, Seen, Settled, together, weighed};
use super::graph::{Beside, KeyframeGraph, Moment, beside};
use super::revisit::{Felt, NEAR, OPEN_DISTANCES, OPEN_RAD, Passage, View, lay_roughly, twist};
use super::tie::Standing;
use crate::input::Descriptor;
use geometry::{PoseCovariance, se3};

/// A revisit says nothing of an agent whose place is surer than the revisit by this factor.
const SURER: f64 = 2.0;

/// Deviations from one another beyond which two stretches are not one place.
const AWAY: f64 = 6.0;
/// What the views along a stretch say at least for where they are laid \[nats\].
const AGREE: f64 = 3.0;

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

impl KeyframeGraph {
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
        // What only looks like a place far away is not looked at any longer.
        let reach_m = self.revisits.reach_m(passage.channel()).unwrap_or(0.0);
        if expected.translation.vector.norm() > AWAY * either[0] + 2.0 * reach_m {
            return false;
        }
        let Some((transform, covariance)) = self.lay_over(passage, &expected, either) else {
            return false;
        };
        let own = spread(&viewed.covariance)[0];
        if own * SURER < spread(&covariance)[0] {
            return false;
        }
        let is_kept = self.tie_beside(&now, &then, &transform, &covariance, Standing::Accepted);
        self.fresh_matches += u32::from(is_kept);
        self.agreed += u32::from(is_kept);
        is_kept
    }

    /// Lays the present stretch of a passage among the views of the earlier one; answers the earlier reference in the frame of the
    /// present one, with the covariance of the error on its right. `spread` says how well that was known before \[m, rad\].
    fn lay_over(
        &self,
        passage: &Passage,
        expected: &Isometry3<f64>,
        spread: [f64; 2],
    ) -> Option<(Isometry3<f64>, PoseCovariance)> {
        let (now, then) = (
            passage.now.in_odom.inverse(),
            passage.then.in_odom.inverse(),
        );
        let earlier: Vec<&View> = self
            .revisits
            .views
            .iter()
            .filter(|view| passage.is_beside(view))
            .collect();
        let channel = passage.channel();
        let kernel = self.revisits.kernel(channel)?;
        let reach = OPEN_DISTANCES * kernel.length_m;
        let views: Vec<(u8, Seen<'_>)> = earlier
            .iter()
            .map(|view| {
                let at = then * Point3::from(view.in_odom.translation.vector);
                let vector = &*view.vector;
                (view.channel, Seen { at, vector })
            })
            .collect();
        let glimpses = passage.looks.iter().map(|look| Glimpse {
            at: now * Point3::from(look.in_odom.translation.vector),
            drift_m: 0.0,
            channel,
            kernel: Some(kernel),
            vector: &look.vector,
        });
        let scene = Scene {
            glimpses: glimpses.collect(),
            views: |_: &[Point3<f64>]| views.clone(),
            is_planar: self.is_planar(passage.now.agent),
        };
        let inverse = |sd: f64| 1.0 / (sd * sd).max(1e-12);
        let (shift, turn) = (inverse(spread[0]), inverse(spread[1]));
        let information = Vector6::new(shift, shift, shift, turn, turn, turn);
        let prior = Prior {
            pose: Some(expected.inverse()),
            information: Matrix6::from_diagonal(&information),
            open: Matrix6::from_diagonal(&Vector6::new(
                1.0 / reach.powi(2),
                1.0 / reach.powi(2),
                1.0 / reach.powi(2),
                1.0 / OPEN_RAD.powi(2),
                1.0 / OPEN_RAD.powi(2),
                1.0 / OPEN_RAD.powi(2),
            )),
        };
        let mut settled: Vec<(Settled, f64)> = lay_roughly(passage, expected, spread)
            .iter()
            .filter_map(|start| scene.settle(&start.inverse(), &prior))
            .map(|settled| {
                let off = twist(&(expected * settled.pose));
                let cost = off.dot(&information.component_mul(&off));
                (settled, cost)
            })
            .filter(|(settled, cost)| settled.evidence.total() > AGREE && *cost < NEAR)
            .collect();
        let best = settled
            .iter()
            .map(|(settled, cost)| settled.evidence.total() - 0.5 * cost)
            .max_by(f64::total_cmp)?;
        for (settled, cost) in &mut settled {
            *cost = (settled.evidence.total() - 0.5 * *cost - best).exp();
        }
        let (pose, covariance) = together(&weighed(&settled));
        // The error ξ of T = T̂ exp(ξ) is −Ad(T̂) ξ of its inverse.
        let adjoint = se3::adjoint(&pose);
        let covariance = adjoint * covariance * adjoint.transpose();
        let covariance = (covariance + covariance.transpose()) * 0.5;
        Some((pose.inverse(), PoseCovariance::from_matrix(&covariance)))
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
