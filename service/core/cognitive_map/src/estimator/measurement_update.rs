//! Measurement update of a frame by a sighting.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, SMatrix, SVector, Vector3, Vector6};

use super::agent_slot::AgentState;
use super::covariance::Projection;
use super::frame::{Frame, LANDMARK_DIM, LandmarkState, Member};
use super::innovation::{PointInnovation, pose_innovation, seen_at};
use super::jacobian::Block;
use super::landmark_archive::ArchivedLandmark;
use super::observers::Observers;
use super::parameters::Parameters;
use super::sensor::SightingTarget;
use super::tuning::{
    ARCHIVE_GAIN_MIN_M2, ARCHIVE_GATE, ODD_SD, REFUSED_TO_FORGET, REFUSED_TO_WIDEN, WIDENED_SD,
};
use super::verdict::{Outcome, Verdict};
use crate::input::{Label, Relation, RelativePose};
use geometry::{beside, se3, seen_by_pose, symmetric};

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
        let to_body = past
            .pose
            .rotation
            .to_rotation_matrix()
            .into_inner()
            .transpose();
        let innovation = self.as_sensed(measurement, innovation);
        let blocks = [
            past.block(&(innovation.by_point * seen_by_pose(&expected))),
            point_block(landmark.offset, &(innovation.by_point * to_body)),
        ];
        let seen = SightingTarget::Landmark(landmark.number);
        let scope = CorrectionScope {
            corrected: self.corrected_by(measurement.observer),
            counts: true,
        };
        let outcome = self.update_by_point(measurement, &blocks, &innovation, seen, &scope);
        let observer_refused = self.members[measurement.observer].state.refused;
        let sightings = self.sightings;
        let agent = self.members[measurement.observer].agent;
        let is_doubted = self.members[measurement.observer].state.is_doubted();
        if let Some(landmark) = Arc::make_mut(&mut self.landmarks).get_mut(label) {
            landmark.used = sightings;
            // Who is doubted speaks neither against a landmark nor for it.
            if outcome.verdict != Verdict::Refused {
                landmark.observers.note(agent);
            }
            if !is_doubted {
                let is_refused = outcome.verdict == Verdict::Refused;
                landmark.refused = if is_refused { landmark.refused + 1 } else { 0 };
            }
            // Of an agent that contradicts everything, the landmark is not to blame.
            if landmark.refused >= REFUSED_TO_FORGET && observer_refused < REFUSED_TO_WIDEN / 2 {
                self.forget(label);
            }
        }
        self.widen_if_refused(measurement.observer);
        outcome
    }

    /// A sighting with the variances that the observer's sensor turns out to have at least.
    fn as_sensed(&self, measurement: &Measurement<'_>, seen: PointInnovation) -> PointInnovation {
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
        let scope = CorrectionScope { corrected, counts };
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

    /// A landmark that is not among those estimated jointly.
    fn initialise_landmark(&mut self, measurement: &Measurement<'_>, label: &Label) -> Outcome {
        self.make_room();
        if self.members[measurement.observer].state.is_doubted()
            && let Some(archived) = self.archive.remove(label)
        {
            // A doubted observer corrects itself by the archived estimate.
            self.restore(label, &archived);
            return self.update_by_landmark(measurement, label);
        }
        let member = &self.members[measurement.observer];
        let Some((point, stated)) = seen_at(measurement.relation) else {
            return Outcome::nothing();
        };
        let mut variance = Vector6::zeros();
        let noise = PointInnovation::new(measurement.relation, &point).and_then(|innovation| {
            let innovation = self.as_sensed(measurement, innovation);
            let sensor = &member.state.sensor;
            let components = sensor.variance(&innovation, None, measurement.parameters);
            variance.fixed_rows_mut::<3>(0).copy_from(&components);
            let inverse = innovation.by_point.try_inverse()?;
            Some(inverse * Matrix3::from_diagonal(&components) * inverse.transpose())
        });
        let noise = noise.unwrap_or(stated);
        Outcome {
            verdict: self.learn_landmark(measurement, label, &point, &noise),
            variance,
        }
    }

    /// A landmark turned out to be at a point of the observer's frame, with this covariance there
    /// beside that of the observer's pose.
    pub(super) fn learn_landmark(
        &mut self,
        measurement: &Measurement<'_>,
        label: &Label,
        point: &Vector3<f64>,
        noise: &Matrix3<f64>,
    ) -> Verdict {
        let member = &self.members[measurement.observer];
        let past = PastPose::new(member, measurement.back);
        let world = past.pose.rotation.to_rotation_matrix().into_inner();
        let noise = world * noise * world.transpose();
        let by_pose = -(world * seen_by_pose(point));
        let offset = self
            .covariance
            .append(&[past.block(&by_pose)], &symmetric(&noise));
        // The observers of an archived landmark are not known any more.
        let mut observers = if self.archive.contains(label) {
            Observers::unknown()
        } else {
            Observers::default()
        };
        observers.note(self.members[measurement.observer].agent);
        let position = past.pose * Point3::from(*point);
        self.insert_landmark(label, position, offset, observers);
        match self.archive.remove(label) {
            None => Verdict::Learned,
            Some(archived) => self.fuse_archived(measurement, offset, &archived),
        }
    }

    /// Restores an archived landmark with its own covariance, correlated with nothing.
    pub(super) fn restore(&mut self, label: &Label, archived: &ArchivedLandmark) {
        let offset = self.covariance.grow(LANDMARK_DIM);
        self.covariance.set_diagonal(offset, &archived.covariance);
        let mut observers = Observers::default();
        match archived.only {
            Some(agent) => observers.note(agent),
            None => observers = Observers::unknown(),
        }
        self.insert_landmark(label, archived.position, offset, observers);
    }

    /// Numbers a landmark whose error begins at an offset.
    fn insert_landmark(
        &mut self,
        label: &Label,
        position: Point3<f64>,
        offset: usize,
        observers: Observers,
    ) {
        let landmark = LandmarkState {
            number: self.numbered,
            position,
            offset,
            used: self.sightings,
            refused: 0,
            observers,
        };
        self.numbered += 1;
        Arc::make_mut(&mut self.landmarks).insert(label.clone(), landmark);
    }

    /// A landmark came back whose earlier estimate may be correlated with everything.
    ///
    /// Its own estimate becomes the covariance intersection (Julier & Uhlmann 1997) of the new and
    /// the old one, with the weight ½; what it gains by that is passed on to the rest:
    ///
    /// ```text
    /// R⁻¹ = ½ (Σ_old⁻¹ − Σ_new⁻¹), as far as that is positive
    /// ```
    fn fuse_archived(
        &mut self,
        measurement: &Measurement<'_>,
        offset: usize,
        archived: &ArchivedLandmark,
    ) -> Verdict {
        let accepted = Verdict::Accepted {
            nis: 0.0,
            components: 0,
        };
        let own: Matrix3<f64> = self.covariance.block(offset, offset);
        let inverses = own.try_inverse().zip(archived.covariance.try_inverse());
        let Some((own_information, old_information)) = inverses else {
            return accepted;
        };
        let gain = symmetric(&((old_information - own_information) * 0.5));
        if !gain.iter().all(|entry| entry.is_finite()) {
            return accepted; // of such a matrix the search for eigenvalues need not end
        }
        let gain = gain.symmetric_eigen();
        let variances = gain.eigenvalues.map(|information| {
            1.0 / information.clamp(ARCHIVE_GAIN_MIN_M2, 1.0 / ARCHIVE_GAIN_MIN_M2)
        });
        let axes = gain.eigenvectors;
        let block = point_block(offset, &axes.transpose());
        let projection = self.covariance.project(&[block]);
        let here = self
            .landmarks
            .values()
            .find(|landmark| landmark.offset == offset);
        let Some(here) = here.map(|landmark| landmark.position) else {
            return accepted;
        };
        let innovation = axes.transpose() * (archived.position - here);
        let spread = projection.spread;
        let far = (0..3).any(|k| {
            let expected = spread[(k, k)] + 2.0 * archived.covariance.trace();
            innovation[k] * innovation[k] > ARCHIVE_GATE * ARCHIVE_GATE * expected
        });
        if far {
            return Verdict::Refused;
        }
        let s = spread + Matrix3::from_diagonal(&variances);
        let all = self.covariance.all();
        if let Some(correction) = self.covariance.update(projection, &innovation, &s, &all) {
            self.correct(measurement.observer, &correction, measurement.parameters);
        }
        accepted
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

    /// Lets an agent whose sightings contradict the estimate search farther around.
    pub(super) fn widen_if_refused(&mut self, observer: usize) {
        if self.members[observer].state.refused >= REFUSED_TO_WIDEN {
            self.members[observer].state_mut().refused = 0;
            self.widen(observer, WIDENED_SD.0, WIDENED_SD.1);
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
            let fits = is_accepted && are_within(parameters.soft.max(ODD_SD));
            observer.weigh(!is_accepted, fits);
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
