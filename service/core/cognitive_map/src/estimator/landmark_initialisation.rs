//! Landmarks that are not estimated jointly when they are seen: new ones take their place from the
//! sighting, archived ones come back (`landmark_return`).

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Vector3, Vector6};

use super::frame::{Frame, LandmarkState};
use super::innovation::{PointInnovation, seen_at};
use super::landmark_evidence::LandmarkEvidence;
use super::measurement_update::{Measurement, PastPose};
use super::observers::Observers;
use super::verdict::{Outcome, Verdict};
use crate::input::Label;
use geometry::{seen_by_pose, symmetric};

/// Where a sighting sees its target, in the observer's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SightedPoint {
    pub(super) point: Vector3<f64>,
    /// Covariance of the point.
    pub(super) noise: Matrix3<f64>,
    /// Variances of the sighting's components.
    pub(super) variance: Vector3<f64>,
}

impl Frame {
    /// A landmark that is not among those estimated jointly.
    pub(super) fn initialise_landmark(
        &mut self,
        measurement: &Measurement<'_>,
        label: &Label,
    ) -> Outcome {
        if let Some(outcome) = self.update_by_archived(measurement.observer, label, |frame| {
            frame.update_by_landmark(measurement, label)
        }) {
            return outcome;
        }
        self.make_room();
        let Some(sighted) = self.sighted(measurement) else {
            return Outcome::nothing();
        };
        let mut variance = Vector6::zeros();
        variance.fixed_rows_mut::<3>(0).copy_from(&sighted.variance);
        self.learn_landmark(measurement, label, &sighted.point, &sighted.noise);
        Outcome {
            verdict: Verdict::Learned,
            variance,
        }
    }

    /// Where a sighting sees its target, in the observer's frame.
    pub(super) fn sighted(&self, measurement: &Measurement<'_>) -> Option<SightedPoint> {
        let (point, stated) = seen_at(measurement.relation)?;
        let mut sighted = SightedPoint {
            point,
            noise: stated,
            variance: Vector3::zeros(),
        };
        let Some(innovation) = PointInnovation::new(measurement.relation, &point) else {
            return Some(sighted);
        };
        let innovation = self.as_sensed(measurement, innovation);
        let sensor = &self.members[measurement.observer].state.sensor;
        sighted.variance = sensor.variance(&innovation, None, measurement.parameters);
        if let Some(inverse) = innovation.by_point.try_inverse() {
            let components = Matrix3::from_diagonal(&sighted.variance);
            sighted.noise = inverse * components * inverse.transpose();
        }
        Some(sighted)
    }

    /// A landmark turned out to be at a point of the observer's frame, with this covariance there
    /// beside that of the observer's pose.
    pub(super) fn learn_landmark(
        &mut self,
        measurement: &Measurement<'_>,
        label: &Label,
        point: &Vector3<f64>,
        noise: &Matrix3<f64>,
    ) {
        let member = &self.members[measurement.observer];
        let past = PastPose::new(member, measurement.back);
        let world = past.pose.rotation.to_rotation_matrix().into_inner();
        let noise = world * noise * world.transpose();
        let by_pose = -(world * seen_by_pose(point));
        let offset = self
            .covariance
            .append(&[past.block(&by_pose)], &symmetric(&noise));
        let mut observers = Observers::default();
        observers.note(self.members[measurement.observer].agent);
        let landmark = LandmarkState {
            number: self.numbered,
            position: past.pose * Point3::from(*point),
            offset,
            used: self.sightings,
            is_anchor: false,
            evidence: LandmarkEvidence::default(),
            observers,
        };
        self.numbered += 1;
        Arc::make_mut(&mut self.landmarks).insert(label.clone(), landmark);
    }
}
