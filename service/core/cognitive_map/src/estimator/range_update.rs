//! Measurement update of a frame by a distance alone.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Vector1, Vector3};

use super::frame::Frame;
use super::jacobian::Block;
use super::measurement_update::{CorrectionScope, Measurement, PastPose, point_block};
use super::noise_part::NoiseEvidence;
use super::odometry_noise::Told;
use super::range_hypotheses::{ExpectedRange, RangeDensity, loss_of_weight};
use super::range_places::OdometryKind;
use super::sensor::SightingTarget;
use super::tuning::{
    RANGE_INFORMATION_MIN, RANGE_JOIN_WIDENING, RANGE_TOO_LONG_SQUARE, RANGES_TOO_LONG_MAX,
    REFUSED_TO_FORGET, REFUSED_TO_WIDEN,
};
use super::verdict::{Outcome, Verdict};
use crate::input::{Label, Range};
use geometry::{beside, seen_by_pose};

/// The part of a distance's information that is left when it is direct with this probability β, and
/// else says nothing.
///
/// Its innovation ν then counts with the gain β, and what is not known of it adds to the covariance
/// (Bar-Shalom & Tse 1975):
///
/// ```text
/// P⁺ = P − (β − β (1 − β) ν² / S) K S Kᵀ
/// ```
fn information_left(direct: f64, innovation_m: f64, total: f64) -> f64 {
    1.0 - (1.0 - direct) * innovation_m * innovation_m / total
}

/// A target of a distance, as the estimate has it.
struct Ranged {
    /// Where it is expected in the observer's frame \[m\].
    expected: Vector3<f64>,
    /// How that depends on the errors of the observer and of the target.
    blocks: [Block<3>; 2],
    seen: SightingTarget,
}

impl Frame {
    /// The distance of a landmark was measured.
    ///
    /// Of one that is not known the agent keeps where it may be; it joins the estimate when that is
    /// one place.
    pub(super) fn update_by_landmark_range(
        &mut self,
        measurement: &Measurement<'_>,
        range: &Range,
        label: &Label,
    ) -> Outcome {
        self.flush();
        let past = PastPose::new(&self.members[measurement.observer], measurement.back);
        let Some(landmark) = self.landmarks.get(label) else {
            let returned = self.update_by_archived(measurement.observer, label, |frame| {
                frame.update_by_landmark_range(measurement, range, label)
            });
            return returned
                .unwrap_or_else(|| self.range_unknown_landmark(measurement, range, label));
        };
        let expected = past.pose.inverse_transform_point(&landmark.position).coords;
        let turn = past.pose.rotation.to_rotation_matrix().into_inner();
        let target = Ranged {
            expected,
            blocks: [
                past.block(&seen_by_pose(&expected)),
                point_block(landmark.offset, &turn.transpose()),
            ],
            seen: SightingTarget::Landmark(landmark.number),
        };
        let scope = CorrectionScope {
            corrected: self.corrected_by(measurement.observer),
            counts: true,
            is_confirmed: landmark.evidence.is_confirmed,
        };
        let outcome = self.update_by_range(measurement, range, &target, &scope);
        self.weigh_ranged_landmark(measurement.observer, label, outcome.verdict);
        self.widen_if_refused(measurement.observer);
        outcome
    }

    /// The distance of another member was measured, which has moved by `back` since.
    pub(super) fn update_by_member_range(
        &mut self,
        measurement: &Measurement<'_>,
        range: &Range,
        target: usize,
        back: &Isometry3<f64>,
    ) -> Outcome {
        self.flush();
        let past = PastPose::new(&self.members[measurement.observer], measurement.back);
        let other = PastPose::new(&self.members[target], back);
        let (corrected, counts) = self.corrected_between(measurement.observer, target);
        let relative = past.pose.inv_mul(&other.pose);
        let expected = relative.translation.vector;
        let turn = relative.rotation.to_rotation_matrix().into_inner();
        let target = Ranged {
            expected,
            blocks: [
                past.block(&seen_by_pose(&expected)),
                other.block(&beside(&turn, &Matrix3::zeros())),
            ],
            seen: SightingTarget::Agent(self.members[target].agent.into()),
        };
        let scope = CorrectionScope {
            corrected,
            counts,
            is_confirmed: true,
        };
        let outcome = self.update_by_range(measurement, range, &target, &scope);
        self.widen_if_refused(measurement.observer);
        outcome
    }

    /// The distance of a landmark was measured whose place is not known.
    fn range_unknown_landmark(
        &mut self,
        measurement: &Measurement<'_>,
        range: &Range,
        label: &Label,
    ) -> Outcome {
        let member = &mut self.members[measurement.observer];
        let state = member.state_mut();
        let odometry = OdometryKind {
            is_planar: state.filter.is_planar,
            states_noise: state.filter.noise.is_stated,
        };
        let variance = state.range_sensor.variance(range.range_sd_m());
        let decided = state.ranging.take_in(label, range, variance, odometry);
        let verdict = decided.map_or(Verdict::Pending, |point| {
            self.learn_turn_noise(measurement, point.turn_noise);
            self.make_room();
            let noise = point.covariance * RANGE_JOIN_WIDENING;
            self.learn_landmark(measurement, label, &point.position, &noise);
            // Many distances have found it.
            self.confirm(label);
            Verdict::Learned
        });
        if verdict != Verdict::Pending {
            let observer = self.members[measurement.observer].state_mut();
            observer.ranging.forget(label);
        }
        let mut outcome = Outcome::nothing();
        (outcome.verdict, outcome.variance[0]) = (verdict, variance);
        outcome
    }

    /// A landmark was found by its distances alone, which says something of the observer's
    /// odometry.
    fn learn_turn_noise(&mut self, measurement: &Measurement<'_>, seen: Option<NoiseEvidence>) {
        let state = self.members[measurement.observer].state_mut();
        if let Some(seen) = seen
            && !state.is_doubted()
        {
            state.filter.noise.learn_turns(seen);
            self.take_back_noise(measurement.observer, measurement.stamp_ns, Told::ByBeacon);
        }
    }

    /// Weighs a distance and takes it in.
    ///
    /// What the estimate expects is taken to second order, so that a distance does not count for
    /// more than it says where the direction of its target is uncertain. A reflection makes a
    /// distance too long and never too short: one that is far too long is left out and speaks
    /// against nobody.
    fn update_by_range(
        &mut self,
        measurement: &Measurement<'_>,
        range: &Range,
        target: &Ranged,
        scope: &CorrectionScope,
    ) -> Outcome {
        let mut outcome = Outcome::nothing();
        let relative = self.covariance.project(&target.blocks).spread;
        let apart = target.expected - range.antenna_m();
        let member = self.members[measurement.observer].state_mut();
        let variance = member.range_sensor.variance(range.range_sd_m());
        outcome.variance[0] = variance;
        let Some(expected) = ExpectedRange::new(&apart, &relative) else {
            return outcome;
        };
        let along = target.blocks.map(|block| Block {
            offset: block.offset,
            width: block.width,
            jacobian: expected.direction.transpose() * block.jacobian,
        });
        let projection = self.covariance.project(&along);
        let curved = expected.curved + expected.bias_square;
        let spread = projection.spread[(0, 0)] + curved;
        let residual = range.range_m() - expected.distance_m;
        let square = residual * residual / (spread + variance);
        let known = projection.spread[(0, 0)];
        let total = known + (variance + curved) * loss_of_weight(square);
        let direct = RangeDensity::new(residual, spread + variance).direct_share();
        let left = information_left(direct, residual, total);
        let member = self.members[measurement.observer].state_mut();
        if residual > 0.0 && (square > RANGE_TOO_LONG_SQUARE || left < RANGE_INFORMATION_MIN) {
            member.too_long += 1;
            if member.too_long <= RANGES_TOO_LONG_MAX {
                outcome.verdict = Verdict::Reflected;
                return outcome;
            }
        } else {
            member.too_long = 0;
        }
        let residual = Vector1::new(residual);
        let judged = scope.judge(
            &residual,
            &Vector1::new(spread + variance),
            member,
            measurement.parameters,
        );
        if judged.is_none() {
            return outcome;
        }
        let sd_m = range.range_sd_m();
        let (seen, stamp_ns) = (target.seen.clone(), measurement.stamp_ns);
        member
            .range_sensor
            .note(seen, stamp_ns, sd_m, residual[0], spread);
        let weighted = total / (direct * left.max(RANGE_INFORMATION_MIN)) - known;
        let weighted = Vector1::new(weighted);
        self.take_in(measurement, projection, &residual, &weighted, scope);
        outcome.verdict = Verdict::Accepted {
            nis: square,
            components: 1,
        };
        outcome
    }

    /// Notes for or against a landmark what became of a distance to it.
    fn weigh_ranged_landmark(&mut self, observer: usize, label: &Label, verdict: Verdict) {
        let sightings = self.sightings;
        let member = &self.members[observer];
        let (agent, refused) = (member.agent, member.state.refused);
        let is_doubted = member.state.is_doubted();
        let Some(landmark) = Arc::make_mut(&mut self.landmarks).get_mut(label) else {
            return;
        };
        landmark.used = sightings;
        if verdict.is_accepted() {
            landmark.observers.note(agent);
        }
        if is_doubted {
            return; // who is doubted speaks neither against a landmark nor for it
        }
        match verdict {
            Verdict::Refused | Verdict::Reflected => landmark.evidence.refused_ranges += 1,
            _ => landmark.evidence.refused_ranges = 0,
        }
        // Of an agent that contradicts everything, the landmark is not to blame.
        let most = match verdict {
            Verdict::Reflected => RANGES_TOO_LONG_MAX,
            _ => REFUSED_TO_FORGET,
        };
        if landmark.evidence.refused_ranges >= most && refused < REFUSED_TO_WIDEN / 2 {
            self.forget(label);
        }
    }
}
