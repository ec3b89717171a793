//! Loop closures: constraints between keyframes of one place. A closure is accepted while it agrees
//! with the map or with other closures.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector6};
use place_recognition::{Relocalised, Revisit, SampleKey, ViewLog, ViewMatch};

use super::constraint::{ClosureState, Constraint, composed};
use super::constraints::Schedule;
use super::graph::KeyframeGraph;
use super::instant::KeyframeOffset;
use super::live_estimates::LiveEstimates;
use super::matching::Matching;
use super::moment::Moment;
use super::relaxation::{Correction, RelaxationCopy};
use super::seen_point::{SeenPoint, stated_variance};
use super::tuning;
use crate::input::Relation;
use geometry::{PoseCovariance, se3, symmetric};
use state::NONE;

impl KeyframeGraph {
    /// Adds a loop closure that an agent states: it is where it was at an earlier sample of its
    /// session. The relation is the pose of the body then as seen from now. Answers whether that
    /// sample is remembered.
    ///
    /// The closure is pending until [`relax`](Self::relax) finds it in agreement.
    pub fn closure(&mut self, moment: &Moment, earlier_seq: u64, relation: &Relation) -> bool {
        self.note(moment);
        let Some(now) = self.here(moment.agent) else {
            return false;
        };
        let session = self.chains.session(moment.agent);
        let Some(then) = self.chains.at_seq(moment.agent, session, earlier_seq) else {
            return false;
        };
        let place = |offset: &KeyframeOffset| self.chains.own_pose_of(offset);
        let (Some(pose_now), Some(pose_then)) = (place(&now), place(&then)) else {
            return false;
        };
        let (seen, noise) = seen_pose(relation, &pose_now.inv_mul(&pose_then));
        let is_kept = self.add_closure(&now, &then, &seen, &noise, ClosureState::Pending);
        self.constraints.schedule.new_closures += u32::from(is_kept);
        is_kept
    }

    /// Adds a loop closure for a revisit, accepted at once: many views agree.
    pub(super) fn close(&mut self, revisit: &Revisit) {
        let ends = [revisit.now, revisit.then].map(|sample| self.chains.at_sample(sample));
        let [Some(now), Some(then)] = &ends else {
            return; // forgotten
        };
        self.accept(now, then, &revisit.transform, &revisit.covariance);
    }

    /// Adds a loop closure from where an agent was found to a remembered sample, accepted at once.
    pub(super) fn close_to_recognised(
        &mut self,
        agent: u32,
        similar: Option<SampleKey>,
        found: &Relocalised,
    ) {
        let then = similar.and_then(|similar| self.chains.at_sample(similar));
        let (Some(now), Some(then)) = (self.here(agent), then) else {
            return;
        };
        let Some(there) = self.chains.pose_of(&then) else {
            return;
        };
        let seen = found.pose.inv_mul(&there);
        let adjoint = se3::adjoint(&seen.inverse());
        let covariance = adjoint * found.covariance.matrix() * adjoint.transpose();
        let covariance = PoseCovariance::from_matrix(&symmetric(&covariance));
        self.accept(&now, &then, &seen, &covariance);
    }

    /// Adds a closure that is accepted at once.
    fn accept(
        &mut self,
        now: &KeyframeOffset,
        then: &KeyframeOffset,
        seen: &Isometry3<f64>,
        noise: &PoseCovariance,
    ) {
        let is_kept = self.add_closure(now, then, seen, noise, ClosureState::Accepted);
        self.constraints.schedule.new_closures += u32::from(is_kept);
        self.constraints.schedule.accepted += u32::from(is_kept);
    }

    /// Adds a closure between two instants; answers whether there is room for it.
    fn add_closure(
        &mut self,
        now: &KeyframeOffset,
        then: &KeyframeOffset,
        seen: &Isometry3<f64>,
        noise: &PoseCovariance,
        state: ClosureState,
    ) -> bool {
        let from_now = composed(&now.covariance, seen, noise);
        let both = PoseCovariance::from_matrix(&(from_now.matrix() + then.covariance.matrix()));
        let back = then.motion.inverse();
        let constraint = Constraint {
            from: now.keyframe,
            to: then.keyframe,
            next_from: NONE,
            next_to: NONE,
            transform: now.motion * seen * back,
            covariance: both.after_motion(&back, &Vector6::zeros()),
            state,
        };
        if self.constraints.slab.len() >= self.settings.constraints_max as usize {
            self.remove_constraint(self.constraints.first_candidate());
        }
        self.add_constraint(constraint) != NONE
    }

    /// Number of matches of views by which the past is relaxed.
    pub fn n_view_matches(&self) -> usize {
        self.matches.len()
    }

    /// Matches of views by which the past is relaxed.
    pub fn view_matches(&self) -> &[ViewMatch] {
        &self.matches
    }

    /// Number of accepted closures.
    pub fn n_closures_accepted(&self) -> usize {
        self.constraints.n_accepted()
    }

    /// Whether closures are new or what was seen says more of the past, and enough records have
    /// come in since the last relaxation to pay for another one.
    pub fn is_due(&self) -> bool {
        let schedule = &self.constraints.schedule;
        (schedule.new_closures > 0 || self.has_seen_news())
            && schedule.records as usize >= self.n_keyframes() / tuning::KEYFRAMES_PER_RECORD
    }

    /// Whether what was seen says more of the past than it did at the last relaxation: a landmark
    /// was found by distances, or enough of the past is new. A full graph, too, has new keyframes:
    /// others went for them.
    ///
    /// The live estimate corrects where an agent is, and not where it was: places that were founded
    /// while it was off move with the past. It takes a distance in where it then thinks that
    /// everything is, and the first ones not at all.
    fn has_seen_news(&self) -> bool {
        let schedule = &self.constraints.schedule;
        let new = f64::from(schedule.keyframes);
        let is_much_new = new >= tuning::NEWLY_SEEN * self.n_keyframes() as f64;
        schedule.found > 0 || (schedule.ranges.max(schedule.points) > 0 && is_much_new)
    }

    /// Relaxes the graph with the closures that agree, moves the keyframes, and answers the poses
    /// of the agents in the map; nothing if no closure was accepted or rejected, and no distances
    /// came: what else was seen has corrected the live estimates already.
    ///
    /// To be called at points that the record stream fixes, as [`is_due`](Self::is_due) does: then
    /// the same records give the same map.
    pub fn relax(&mut self) -> Vec<Correction> {
        self.relax_matched(None, &LiveEstimates::default())
    }

    /// The same, after views, if any are given, were matched anew. What moves keyframes alone is
    /// held by the live estimates.
    pub(super) fn relax_matched(
        &mut self,
        views: Option<&ViewLog>,
        live: &LiveEstimates,
    ) -> Vec<Correction> {
        let is_due = views.is_none() || self.is_due();
        let mut coarse = RelaxationCopy::coarse(self);
        let is_matched = views.is_some_and(|log| coarse.match_views(log, live_matching(log)));
        self.learned = Arc::clone(&coarse.graph().learned);
        self.view_maps = coarse.graph().view_maps.clone();
        if !is_due && !is_matched {
            return Vec::new(); // closures wait for their own time
        }
        let schedule = std::mem::take(&mut self.constraints.schedule);
        let is_undecided = coarse.accepted().next().is_none();
        let mut judged = Vec::new();
        if is_undecided && coarse.is_noise_open() && self.has_many_more_closures(&schedule) {
            judged = coarse.judged_anew();
            judged.retain(|copy| copy.accepted().next().is_some());
        } else {
            coarse.accept_consistent();
        }
        let is_nothing_new = is_undecided && coarse.accepted().next().is_none();
        let is_settled = schedule.accepted == 0 && schedule.ranges == 0 && !is_matched;
        if is_nothing_new && judged.is_empty() && is_settled && schedule.points == 0 {
            return Vec::new();
        }
        let accepted = |copy: &RelaxationCopy| -> BTreeSet<u32> {
            copy.accepted().map(|(number, _)| number).collect()
        };
        let before = accepted(&RelaxationCopy::whole(self));
        let mut best = None;
        if is_settled && judged.is_empty() && accepted(&coarse) == before {
            let held = RelaxationCopy::most_probable(coarse.held(live), Vec::new());
            best = Some(held).filter(|best| accepted(&best.copy) == before);
        }
        let best = best.unwrap_or_else(|| RelaxationCopy::most_probable(coarse, judged));
        let now = accepted(&best.copy);
        let is_seen_alone = is_settled && before == now;
        if is_seen_alone && schedule.points == 0 {
            return Vec::new();
        }
        self.adopt(best.copy.graph());
        if is_seen_alone {
            return Vec::new();
        }
        best.corrections(is_matched || !now.is_subset(&before))
    }

    /// Whether there are many closures, and their number has grown by two fifths, or a multiple of
    /// that, with those that came since the last relaxation.
    fn has_many_more_closures(&self, since: &Schedule) -> bool {
        let all = self.constraints.slab.iter();
        let n_now = all.filter(|(_, one)| one.is_closure()).count() as u64;
        let n_then = n_now.saturating_sub(u64::from(since.new_closures));
        let half_octaves = |n: u64| (n * n).checked_ilog2();
        n_now >= tuning::CLOSURES_SUPPOSED_MIN && half_octaves(n_now) != half_octaves(n_then)
    }

    /// Moves the keyframes as in a relaxed coarse copy, and adopts the states of its closures.
    /// Keyframes between two of the copy move with the earlier one.
    fn adopt(&mut self, coarse: &Self) {
        self.constraints.adopt(&coarse.constraints, self.revision);
        self.matches = Arc::clone(&coarse.matches);
        self.attachments.check_all();
        for (agent, _) in (0..).zip(0..self.chains.tracks.len()) {
            self.chains.adopt(agent, &coarse.chains, self.revision);
        }
    }
}

/// How the views of a log are matched while samples come in.
fn live_matching(log: &ViewLog) -> &'static Matching {
    if log.is_much_longer() {
        &tuning::LIVE_MATCHING_ANEW
    } else {
        &tuning::LIVE_MATCHING
    }
}

/// The earlier pose by a relation, and its covariance. A rotation that the relation lacks is taken
/// from `expected`.
fn seen_pose(relation: &Relation, expected: &Isometry3<f64>) -> (Isometry3<f64>, PoseCovariance) {
    if let Relation::Pose(seen) = relation {
        return (*seen.pose(), PoseCovariance::from_sd(seen.noise().sd()));
    }
    let point = SeenPoint::new(relation, &stated_variance(relation));
    let rotation: UnitQuaternion<f64> = expected.rotation;
    let turn = rotation.to_rotation_matrix().into_inner();
    let mut matrix =
        Matrix6::from_diagonal_element(tuning::UNKNOWN_ANGLE_SD_RAD * tuning::UNKNOWN_ANGLE_SD_RAD);
    let spread = turn.transpose() * point.fresh * turn;
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&spread);
    (
        Isometry3::from_parts(point.position.into(), rotation),
        PoseCovariance::from_upper_part(&matrix),
    )
}
