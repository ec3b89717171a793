//! Loop closures: constraints between keyframes of one place. A closure is accepted while it agrees
//! with the map or with other closures.

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector6};

use super::constraint::{ClosureState, Constraint};
use super::graph::{KeyframeGraph, Moment};
use super::instant::KeyframeOffset;
use super::refined::{Among, Graph};
use super::sighting::{SeenPoint, stated_variance};
use super::sparsification::composed;
use super::tuning;
use crate::input::Relation;
use geometry::{PoseCovariance, is_somewhere, se3, upper_triangle};
use pose_graph::{Graduation, Marginals, RelaxationSettings, Relaxed};
use state::NONE;

/// The pose of an agent after a relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// Number of the agent.
    pub agent: u32,
    /// Its pose now, in the map.
    pub pose: Isometry3<f64>,
    /// Covariance of that pose; `None` where nothing determines it.
    pub covariance: Option<PoseCovariance>,
}

/// A pending closure, with what it is compared by.
struct Candidate {
    constraint: u32,
    agent: u32,
    stamp_ns: i64,
    transform: Isometry3<f64>,
    /// Poses of its ends, and variances of odometry up to them since their chains began \[m²,
    /// rad²\].
    ends: [Isometry3<f64>; 2],
    variances: [[f64; 2]; 2],
    /// Its largest variances of shift and rotation \[m², rad²\].
    own: [f64; 2],
}

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
        let session = self.session(moment.agent);
        let Some(then) = self.at_seq(moment.agent, session, earlier_seq) else {
            return false;
        };
        let place = |offset: &KeyframeOffset| {
            let keyframe = self.keyframes.get(offset.keyframe);
            keyframe.map(|keyframe| keyframe.pose * offset.motion)
        };
        let (Some(pose_now), Some(pose_then)) = (place(&now), place(&then)) else {
            return false;
        };
        let (seen, noise) = seen_pose(relation, &pose_now.inv_mul(&pose_then));
        let is_kept = self.add_closure(&now, &then, &seen, &noise, ClosureState::Pending);
        self.schedule.new_closures += u32::from(is_kept);
        is_kept
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
        if self.constraints.len() >= self.settings.constraints_max as usize {
            let doubtful = |constraint: &&(u32, &Constraint)| {
                matches!(
                    constraint.1.state,
                    ClosureState::Pending | ClosureState::Refuted
                )
            };
            let oldest = self
                .constraints
                .iter()
                .find(|constraint| doubtful(&constraint))
                .map(|(at, _)| at);
            oldest.map(|at| self.remove_constraint(at));
        }
        self.add_constraint(constraint) != NONE
    }

    /// Adds a closure that is accepted at once.
    pub(super) fn accept(
        &mut self,
        now: &KeyframeOffset,
        then: &KeyframeOffset,
        seen: &Isometry3<f64>,
        noise: &PoseCovariance,
    ) {
        let is_kept = self.add_closure(now, then, seen, noise, ClosureState::Accepted);
        self.schedule.new_closures += u32::from(is_kept);
        self.schedule.accepted += u32::from(is_kept);
    }

    /// Number of accepted closures.
    pub fn n_matches_believed(&self) -> usize {
        let constraints = self.constraints.iter();
        constraints
            .filter(|(_, constraint)| constraint.state == ClosureState::Accepted)
            .count()
    }

    /// Whether closures are new, and enough records have come in since the last relaxation to pay
    /// for another one.
    pub fn is_due(&self) -> bool {
        self.schedule.new_closures > 0
            && self.schedule.records as usize >= self.keyframes.len() / tuning::KEYFRAMES_PER_RECORD
    }

    /// Relaxes the graph with the closures that agree, moves the keyframes, and answers the poses
    /// of the agents in the map; nothing if no closure was accepted or rejected.
    ///
    /// To be called at points that the record stream fixes, as [`is_due`](Self::is_due) does: then
    /// the same records give the same map.
    pub fn relax(&mut self) -> Vec<Correction> {
        self.schedule.records = 0;
        self.schedule.new_closures = 0;
        let agreed = std::mem::take(&mut self.schedule.accepted) as usize;
        let mut coarse = self.coarse();
        let judged = coarse.accept_consistent();
        let (graph, _, refuted) = coarse.relaxed();
        if agreed + judged + refuted == 0 {
            return Vec::new();
        }
        let marginals = graph.map.marginals();
        let corrections = coarse.corrections(&graph, &marginals);
        coarse.move_keyframes(&graph);
        self.adopt(&coarse);
        corrections
    }

    /// The relaxed graph, after closures that do not fit into it were rejected; and their number.
    /// Moves the keyframes: for a copy.
    pub(super) fn relaxed(&mut self) -> (Graph, Relaxed, usize) {
        let mut refuted = 0;
        let revision = self.revision;
        let refuted_chi2 = self.settings.refuted_chi2();
        let mut rounds = 0;
        loop {
            rounds += 1;
            let mut graph = self.graph(Among::Believed);
            let mut settings = settings();
            if self.fits(&graph) {
                settings.graduation = Graduation::None;
            }
            let relaxed = graph.map.relax(&settings);
            let before = refuted;
            for number in 0..self.constraints.numbers() {
                let link = graph.constraints.get(number as usize).copied().flatten();
                let squared = link.map_or(0.0, |link| graph.map.squared_error(link));
                if squared > refuted_chi2
                    && let Some(constraint) = self.constraints.get(number)
                    && constraint.state == ClosureState::Accepted
                    && let Some(constraint) = self.constraints.get_mut(number, revision)
                {
                    constraint.state = ClosureState::Refuted;
                    refuted += 1;
                }
            }
            if refuted == before || rounds >= tuning::RELAXATION_ROUNDS_MAX {
                return (graph, relaxed, refuted);
            }
            self.move_keyframes(&graph);
        }
    }

    /// Whether all accepted closures are within the range of their kernels.
    fn fits(&self, graph: &Graph) -> bool {
        let links = graph.constraints.iter().zip(0..);
        links
            .filter_map(|(link, number)| Some(((*link)?, self.constraints.get(number)?)))
            .filter(|(_, constraint)| constraint.state == ClosureState::Accepted)
            .all(|(link, _)| graph.map.squared_error(link) <= self.settings.refuted_chi2())
    }

    /// Accepts pending closures that agree with the map or with one another; answers their number.
    /// Moves the keyframes to where all accepted closures have them: for a copy.
    pub(super) fn accept_consistent(&mut self) -> usize {
        if !self
            .constraints
            .iter()
            .any(|(_, constraint)| waits(constraint))
        {
            return 0;
        }
        let believed = self.graph(Among::Believed);
        let marginals = believed.map.marginals();
        // With kernels that begin wide, all closures together find the map that most of them agree
        // with.
        let mut all = self.graph(Among::All);
        all.map.relax(&settings());
        let gate_chi2 = self.settings.closure_gate_chi2;
        let path_variances = self.path_variances();
        let mut accepted = Vec::new();
        let mut candidates = Vec::new();
        for (number, constraint) in self
            .constraints
            .iter()
            .filter(|(_, constraint)| constraint.is_match())
        {
            let Some(link) = all.constraints.get(number as usize).copied().flatten() else {
                continue;
            };
            if waits(constraint) && agrees_with(constraint, &believed, &marginals, gate_chi2) {
                accepted.push(number);
            } else if all.map.squared_error(link) <= gate_chi2 {
                candidates.extend(self.candidate(number, constraint, &all, &path_variances));
            }
        }
        candidates
            .sort_by_key(|candidate| (candidate.agent, candidate.stamp_ns, candidate.constraint));
        let mut partners = vec![0; candidates.len()];
        for later in 0..candidates.len() {
            for earlier in later.saturating_sub(tuning::CLOSURES_COMPARED)..later {
                if candidates[later].agrees(&candidates[earlier], gate_chi2) {
                    partners[later] += 1;
                    partners[earlier] += 1;
                }
            }
        }
        let supported = candidates
            .iter()
            .zip(partners)
            .filter(|(candidate, partners)| {
                *partners >= tuning::PARTNERS_MIN
                    && self
                        .constraints
                        .get(candidate.constraint)
                        .is_some_and(waits)
            });
        accepted.extend(supported.map(|(candidate, _)| candidate.constraint));
        let revision = self.revision;
        for &number in &accepted {
            if let Some(constraint) = self.constraints.get_mut(number, revision) {
                constraint.state = ClosureState::Accepted;
            }
        }
        if self.fits(&all) {
            self.move_keyframes(&all);
        }
        accepted.len()
    }

    /// The data by which a closure is compared, with its ends as a graph has them.
    fn candidate(
        &self,
        number: u32,
        constraint: &Constraint,
        graph: &Graph,
        path_variances: &[[f64; 2]],
    ) -> Option<Candidate> {
        let node = |number: u32| graph.poses.get(number as usize).copied().flatten();
        let from = self.keyframes.get(constraint.from)?;
        let diagonal = constraint.covariance.matrix().diagonal();
        Some(Candidate {
            constraint: number,
            agent: from.agent,
            stamp_ns: from.stamp_ns,
            transform: constraint.transform,
            ends: [
                *graph.map.pose(node(constraint.from)?),
                *graph.map.pose(node(constraint.to)?),
            ],
            variances: [
                *path_variances.get(constraint.from as usize)?,
                *path_variances.get(constraint.to as usize)?,
            ],
            own: [diagonal.rows(0, 3).max(), diagonal.rows(3, 3).max()],
        })
    }

    /// Variances of odometry up to each keyframe since its agent's chain began \[m², rad²\].
    fn path_variances(&self) -> Vec<[f64; 2]> {
        let mut path_variances = vec![[0.0; 2]; self.keyframes.numbers() as usize];
        for (agent, _) in (0..).zip(self.tracks.iter()) {
            let mut number = self.first_keyframe(agent);
            let mut way = [0.0; 2];
            while let Some(keyframe) = self.keyframes.get(number) {
                let diagonal = keyframe.covariance.matrix().diagonal();
                way[0] += diagonal.rows(0, 3).max();
                way[1] += diagonal.rows(3, 3).max();
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

    /// The poses of the agents in the map in a relaxed graph.
    fn corrections(&self, graph: &Graph, marginals: &Marginals<'_>) -> Vec<Correction> {
        let mut corrections = Vec::new();
        for (agent, track) in (0..).zip(self.tracks.iter()) {
            let node = graph.poses.get(track.newest as usize).copied().flatten();
            let Some(node) = node.filter(|_| !track.needs_keyframe) else {
                continue;
            };
            let covariance = marginals.pose(node).map(|covariance| {
                composed(&covariance, track.since.motion(), &track.since.covariance())
            });
            corrections.push(Correction {
                agent,
                pose: graph.map.pose(node) * track.since.motion(),
                covariance,
            });
        }
        corrections
    }

    /// Moves the keyframes to their poses in a relaxed graph.
    fn move_keyframes(&mut self, graph: &Graph) {
        let revision = self.revision;
        for number in 0..self.keyframes.numbers() {
            let node = graph.poses.get(number as usize).copied().flatten();
            let pose = node.map(|node| graph.map.pose(node));
            let Some(pose) = pose.filter(|pose| is_somewhere(&pose.translation.vector)) else {
                continue;
            };
            if let Some(keyframe) = self.keyframes.get_mut(number, revision) {
                keyframe.pose = *pose;
                keyframe.is_in_map = true;
            }
        }
    }
}

/// Whether a closure is pending, or was rejected and may be accepted again.
fn waits(constraint: &Constraint) -> bool {
    matches!(
        constraint.state,
        ClosureState::Pending | ClosureState::Refuted
    )
}

/// Settings of a relaxation with closures.
fn settings() -> RelaxationSettings {
    RelaxationSettings {
        graduation: Graduation::FromWide,
        ..RelaxationSettings::default()
    }
}

/// Whether the map is about as certain of the relative pose as a closure, and agrees.
fn agrees_with(
    constraint: &Constraint,
    graph: &Graph,
    marginals: &Marginals<'_>,
    gate_chi2: f64,
) -> bool {
    let node = |number: u32| graph.poses.get(number as usize).copied().flatten();
    let (Some(from), Some(to)) = (node(constraint.from), node(constraint.to)) else {
        return false;
    };
    let own = constraint.covariance.matrix();
    let least = tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
    let expected = graph.map.pose(from).inv_mul(graph.map.pose(to));
    let (linear, angular) = se3::log(&expected.inv_mul(&constraint.transform));
    let off = Vector6::from_iterator(linear.iter().chain(angular.iter()).copied());
    // One that is too far off in one direction is so for every map that is sure enough: its
    // covariance, which takes long to find, need not be known.
    let least_certain = tuning::UNCERTAINTY_RATIO_MAX * tuning::UNCERTAINTY_RATIO_MAX + 1.0;
    if (0..6).any(|k| off[k] * off[k] > gate_chi2 * least_certain * (own[(k, k)] + least)) {
        return false;
    }
    let Some(spread) = marginals.relative_pose(from, to) else {
        return false;
    };
    let is_known = (0..6).all(|k| {
        spread.matrix()[(k, k)]
            <= tuning::UNCERTAINTY_RATIO_MAX * tuning::UNCERTAINTY_RATIO_MAX * (own[(k, k)] + least)
    });
    let whole = spread.matrix() + own + Matrix6::from_diagonal_element(least);
    let inverse = whole.try_inverse();
    is_known && inverse.is_some_and(|inverse| off.dot(&(inverse * off)) <= gate_chi2)
}

impl Candidate {
    /// Whether two matches agree, by the ways between their ends.
    ///
    /// ```text
    /// A now ── match ──> A then
    ///   │                  │           the ways along the chains, and both matches, close up
    /// B now ── match ──> B then
    /// ```
    fn agrees(&self, other: &Self, gate_chi2: f64) -> bool {
        if self.agent != other.agent {
            return false;
        }
        let between = |end: usize| {
            let way = other.ends[end].inv_mul(&self.ends[end]);
            let [a, b] = [self.variances[end], other.variances[end]];
            (way, [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()])
        };
        let (now, now_variance) = between(0);
        let (then, then_variance) = between(1);
        let by_other = now.inverse() * other.transform * then;
        let error = by_other.inv_mul(&self.transform);
        let [mut shift, mut turn] =
            [0, 1].map(|k| self.own[k] + other.own[k] + now_variance[k] + then_variance[k]);
        // Rotation errors of odometry and of the closures move the ends.
        let lever = now.translation.vector.norm() + then.translation.vector.norm();
        shift += turn * lever * lever;
        shift += tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        turn += tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        let squared =
            error.translation.vector.norm_squared() / shift + error.rotation.angle().powi(2) / turn;
        // Two closures that would agree wherever they were are no evidence for each other.
        let own = self.own[0] + other.own[0] + tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        let telling = (4.0 * tuning::UNCERTAINTY_RATIO_MAX * tuning::UNCERTAINTY_RATIO_MAX * own)
            .max(tuning::CERTAIN_SD_M * tuning::CERTAIN_SD_M);
        squared <= gate_chi2 && shift <= telling
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
        PoseCovariance::from_upper_triangle(&upper_triangle(&matrix)),
    )
}
