//! Landmarks that come into a frame's joint estimate: for the first time, or back from the archive.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Vector3, Vector6};

use super::frame::{Frame, LANDMARK_DIM, LandmarkState};
use super::innovation::{PointInnovation, seen_at};
use super::landmark_archive::ArchivedLandmark;
use super::landmark_evidence::LandmarkEvidence;
use super::measurement_update::{Measurement, PastPose, point_block};
use super::observers::Observers;
use super::tuning::{ARCHIVE_GAIN_MIN_M2, ARCHIVE_GATE};
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
        self.make_room();
        if self.members[measurement.observer].state.is_doubted()
            && let Some(archived) = self.archive.remove(label)
        {
            // A doubted observer corrects itself by the archived estimate.
            self.restore(label, &archived);
            return self.update_by_landmark(measurement, label);
        }
        let Some(sighted) = self.sighted(measurement) else {
            return Outcome::nothing();
        };
        let mut variance = Vector6::zeros();
        variance.fixed_rows_mut::<3>(0).copy_from(&sighted.variance);
        Outcome {
            verdict: self.learn_landmark(measurement, label, &sighted.point, &sighted.noise),
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
        let Some(archived) = self.archive.remove(label) else {
            return Verdict::Learned;
        };
        let verdict = self.fuse_archived(measurement, offset, &archived);
        if verdict.is_accepted() {
            self.confirm(label);
        }
        verdict
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
        self.confirm(label);
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
            evidence: LandmarkEvidence::default(),
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
}
