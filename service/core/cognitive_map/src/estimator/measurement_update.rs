//! Measurement update of a frame by a sighting.

use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, SVector, Vector3};

use super::agent_slot::AgentState;
use super::covariance::Projection;
use super::frame::{Frame, LANDMARK_DIM, Member};
use super::innovation::{PointInnovation, pose_innovation};
use super::jacobian::Block;
use super::parameters::Parameters;
use super::sensor::SightingTarget;
use super::tuning::ODD_SD;
use super::verdict::{Outcome, Verdict};
use crate::input::{Label, Relation, RelativePose};
use geometry::{beside, se3, seen_by_pose};

/// A sighting of a frame's member: who, how it moved since, when, and what it saw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measurement<'a> {
    /// Index of the observer among the members.
    pub(super) observer: usize,
    /// The observer's motion since then.
    pub(super) back: &'a Isometry3<f64>,
    pub(super) stamp_ns: i64,
    pub(super) relation: &'a Relation,
    pub(super) parameters: &'a Parameters,
}

impl Frame {
    /// A landmark was seen.
    pub(super) fn update_by_landmark(
        &mut self,
        measurement: &Measurement<'_>,
        label: &Label,
    ) -> Outcome {
        self.flush();
        let past = PastPose::new(&self.members[measurement.observer], measurement.back);
        let Some(landmark) = self.landmarks.get(label) else {
            return self.initialise_landmark(measurement, label);
        };
        let expected = past.pose.inverse_transform_point(&landmark.position).coords;
        let Some(innovation) = PointInnovation::new(measurement.relation, &expected) else {
            return Outcome::nothing();
        };
        let innovation = self.as_sensed(measurement, innovation);
        let blocks = past.landmark_blocks(&expected, landmark.offset, &innovation);
        let seen = SightingTarget::Landmark(landmark.number);
        let scope = CorrectionScope {
            corrected: self.corrected_by(measurement.observer),
            counts: true,
            is_confirmed: landmark.evidence.is_confirmed,
        };
        let outcome = self.update_by_point(measurement, &blocks, &innovation, seen, &scope);
        self.weigh_landmark(measurement, label, outcome.verdict);
        self.note_sighting(measurement, label, outcome.verdict);
        self.doubt_pose(measurement, outcome.verdict);
        outcome
    }

    /// A sighting with the variances that the observer's sensor turns out to have at least.
    pub(super) fn as_sensed(
        &self,
        measurement: &Measurement<'_>,
        seen: PointInnovation,
    ) -> PointInnovation {
        let observer = &self.members[measurement.observer];
        observer.filter().noise.understated.as_sensed(seen)
    }

    /// Another member was seen, which has moved by `back` since.
    pub(super) fn update_by_member(
        &mut self,
        measurement: &Measurement<'_>,
        target: usize,
        back: &Isometry3<f64>,
    ) -> Outcome {
        self.flush();
        let past = PastPose::new(&self.members[measurement.observer], measurement.back);
        let other = PastPose::new(&self.members[target], back);
        let (corrected, counts) = self.corrected_between(measurement.observer, target);
        let scope = CorrectionScope {
            corrected,
            counts,
            is_confirmed: true,
        };
        let outcome = if let Relation::Pose(seen) = measurement.relation {
            self.update_by_pose(measurement, [&past, &other], seen, &scope)
        } else {
            let expected = past.pose.inv_mul(&other.pose).translation.vector;
            let Some(innovation) = PointInnovation::new(measurement.relation, &expected) else {
                return Outcome::nothing();
            };
            let innovation = self.as_sensed(measurement, innovation);
            let relative = past.pose.rotation.inverse() * other.pose.rotation;
            let turn = relative.to_rotation_matrix().into_inner();
            let by_target = beside(&(innovation.by_point * turn), &Matrix3::zeros());
            let blocks = [
                past.block(&(innovation.by_point * seen_by_pose(&expected))),
                other.block(&by_target),
            ];
            let seen = SightingTarget::Agent(self.members[target].agent.into());
            self.update_by_point(measurement, &blocks, &innovation, seen, &scope)
        };
        self.widen_if_refused(measurement.observer);
        outcome
    }

    /// Weighs an innovation and takes it in.
    fn update_by_point(
        &mut self,
        measurement: &Measurement<'_>,
        blocks: &[Block<3>],
        innovation: &PointInnovation,
        seen: SightingTarget,
        scope: &CorrectionScope,
    ) -> Outcome {
        let parameters = measurement.parameters;
        let projection = self.covariance.project(blocks);
        let member = self.members[measurement.observer].state_mut();
        let mut variance =
            member
                .sensor
                .variance(innovation, Some((&seen, measurement.stamp_ns)), parameters);
        let mut outcome = Outcome::nothing();
        // The past takes together what was seen from one place, and counts it once.
        let once = member.sensor.variance(innovation, None, parameters);
        outcome.variance.fixed_rows_mut::<3>(0).copy_from(&once);
        let spread = projection.spread.diagonal();
        let Some(squares) = scope.judge(
            &innovation.residual,
            &(spread + variance),
            member,
            parameters,
        ) else {
            return outcome;
        };
        member
            .sensor
            .note(seen, measurement.stamp_ns, innovation, &spread, &variance);
        // A planar robot's elevations are no measurements.
        let is_flat =
            member.filter.is_planar && innovation.is_polar && innovation.residual[2] == 0.0;
        let components: u32 = if is_flat { 2 } else { 3 };
        let nis = squares.iter().take(components as usize).sum();
        variance.component_mul_assign(&parameters.loss_of_weight(&squares));
        self.take_in(
            measurement,
            projection,
            &innovation.residual,
            &variance,
            scope,
        );
        outcome.verdict = Verdict::Accepted { nis, components };
        outcome
    }

    /// A full pose of another member was seen.
    fn update_by_pose(
        &mut self,
        measurement: &Measurement<'_>,
        [past, other]: [&PastPose; 2],
        seen: &RelativePose,
        scope: &CorrectionScope,
    ) -> Outcome {
        let (residual, by_observer, by_target, variance) =
            pose_innovation(seen, &past.pose, &other.pose);
        let blocks = [past.block(&by_observer), other.block(&by_target)];
        let projection = self.covariance.project(&blocks);
        let spread: SVector<f64, 6> = projection.spread.diagonal();
        let parameters = measurement.parameters;
        let member = self.members[measurement.observer].state_mut();
        let mut outcome = Outcome {
            verdict: Verdict::Refused,
            variance,
        };
        let Some(squares) = scope.judge(&residual, &(spread + variance), member, parameters) else {
            return outcome;
        };
        let loss = parameters.loss_of_weight(&squares);
        let weighted = variance.component_mul(&loss);
        self.take_in(measurement, projection, &residual, &weighted, scope);
        outcome.verdict = Verdict::Accepted {
            nis: squares.sum(),
            components: 6,
        };
        outcome
    }

    /// Corrects what a sighting may correct, with these variances of its components.
    pub(super) fn take_in<const M: usize>(
        &mut self,
        measurement: &Measurement<'_>,
        projection: Projection<M>,
        residual: &SVector<f64, M>,
        variance: &SVector<f64, M>,
        scope: &CorrectionScope,
    ) {
        let s = projection.spread + SMatrix::from_diagonal(variance);
        let (joint, corrected) = (&mut self.covariance, &scope.corrected);
        if let Some(correction) = joint.update(projection, residual, &s, corrected) {
            self.correct(measurement.observer, &correction, measurement.parameters);
        }
    }
}

/// What a sighting may do.
#[derive(Clone, Debug)]
pub(super) struct CorrectionScope {
    /// The components that it corrects.
    pub(super) corrected: Range<usize>,
    /// Whether it speaks for or against its observer.
    pub(super) counts: bool,
    /// Whether the target is known to be where it is expected, so that a refused sighting may be
    /// because the observer is somewhere else.
    pub(super) is_confirmed: bool,
}

impl CorrectionScope {
    /// The squared innovations in units of their variances, if none is beyond the gate: one that is
    /// not a number is, too. Counts for or against the observer.
    pub(super) fn judge<const M: usize>(
        &self,
        residual: &SVector<f64, M>,
        expected: &SVector<f64, M>,
        observer: &mut AgentState,
        parameters: &Parameters,
    ) -> Option<SVector<f64, M>> {
        let squares = residual.component_mul(residual).component_div(expected);
        let are_within = |most: f64| squares.iter().all(|square| square.sqrt() <= most);
        let is_accepted = are_within(parameters.gate);
        if self.counts {
            if is_accepted {
                observer.accept(are_within(parameters.soft.max(ODD_SD)));
            } else {
                observer.refuse(self.is_confirmed);
            }
        }
        is_accepted.then_some(squares)
    }
}

/// A member at an instant.
#[derive(Clone, Debug)]
pub(super) struct PastPose {
    pub(super) pose: Isometry3<f64>,
    /// Jacobian of the pose error then with respect to the pose error now.
    by_now: Matrix6<f64>,
    offset: usize,
}

impl PastPose {
    pub(super) fn new(member: &Member, back: &Isometry3<f64>) -> Self {
        Self {
            pose: member.filter().pose * back.inverse(),
            by_now: se3::adjoint(back),
            offset: member.offset,
        }
    }

    /// What an innovation of a landmark says of its position and of the pose.
    pub(super) fn landmark_blocks(
        &self,
        expected: &Vector3<f64>,
        offset: usize,
        innovation: &PointInnovation,
    ) -> [Block<3>; 2] {
        let to_body = self.pose.rotation.inverse().to_rotation_matrix();
        let by_landmark = innovation.by_point * to_body.into_inner();
        [
            self.block(&(innovation.by_point * seen_by_pose(expected))),
            point_block(offset, &by_landmark),
        ]
    }

    pub(super) fn block<const M: usize>(&self, jacobian: &SMatrix<f64, M, 6>) -> Block<M> {
        Block {
            offset: self.offset,
            width: 6,
            jacobian: jacobian * self.by_now,
        }
    }
}

/// The part of a Jacobian that belongs to a landmark.
pub(super) fn point_block(offset: usize, jacobian: &Matrix3<f64>) -> Block<3> {
    Block {
        offset,
        width: LANDMARK_DIM,
        jacobian: beside(jacobian, &Matrix3::zeros()),
    }
}
