//! Following an agent that is known about: what its levels say of its pose, and against it.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix3x6, RowVector6, Vector3};
use state::state_of_struct;

use crate::field::{Field, around, expect};
use crate::kernel::log_density;
use crate::tuning::{follow as tuning, predict};
use crate::window::Node;

/// What a level says of the pose of the body: a measurement of one component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Its channel.
    pub channel: u8,
    /// Change of the level with the error on the right of the pose.
    pub jacobian: RowVector6<f64>,
    /// The level less what is expected.
    pub residual: f64,
    /// Variance of that at a pose without error.
    pub variance: f64,
    /// Variance that nobody gets below by it: places that the agent itself has taught are no surer
    /// than it was.
    pub floor: f64,
    /// The same as `variance` for the level alone, not for its share among others that err alike.
    alone: f64,
    /// Log density of the level where nothing is known \[nats\].
    anywhere: f64,
    /// Part of independent evidence that it is.
    part: f64,
}

/// What a measurement met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Variance of the residual by the error of the pose.
    pub spread: f64,
}

/// How well a sense of an agent fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sense {
    channel: u8,
    /// Mean square of its residuals lately, in their variances.
    ratio: f64,
    /// Evidence against the pose since nothing spoke for it \[nats\] (Page 1954).
    against: f64,
}

state_of_struct!(Sense {
    channel,
    ratio,
    against
});

/// How well the senses of an agent fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Senses {
    all: Vec<Sense>,
}

state_of_struct!(Senses { all });

/// What the levels of a node say of the pose of the body now, which is `pose` with `covariance`,
/// and `in_odom` by motion alone. Nodes follow one another at `step_m`.
pub(crate) fn measurements(
    node: &Node,
    (pose, covariance): (&Isometry3<f64>, &PoseCovariance),
    in_odom: &Isometry3<f64>,
    step_m: f64,
    field: &dyn Field,
    senses: &Senses,
) -> Vec<Measurement> {
    let Some(first) = node.felt.first() else {
        return Vec::new();
    };
    let to_body = in_odom.inverse();
    let rotation = pose.rotation.to_rotation_matrix();
    let at = pose * to_body * first.at;
    let near = around(field, &at, &node.felt, predict::SUPPORTS);
    let mut supports = Vec::with_capacity(near.len());
    let sd_m = axis_sd_m(covariance);
    let measured = node.felt.iter().filter_map(|felt| {
        let kernel = field.kernel(felt.channel)?;
        if sd_m > tuning::NEAR * kernel.length_m {
            return None;
        }
        let lever = to_body * felt.at;
        let at = pose * lever;
        let expected = expect(field, &near, felt.channel, &at, &mut supports)?;
        let by_pose = point_by_pose(rotation.matrix(), &lever.coords);
        let part = (step_m / (tuning::ALIKE * kernel.length_m)).min(1.0);
        // What the slope leaves out, of a field that is curved.
        let curved = 0.75 * kernel.sill * (sd_m / kernel.length_m).powi(4);
        let own_m2 = supports
            .iter()
            .map(|support| support.own_m2)
            .fold(0.0, f64::max);
        Some(Measurement {
            channel: felt.channel,
            jacobian: expected.slope.transpose() * by_pose,
            residual: felt.value - expected.mean,
            variance: (kernel.nugget + expected.variance / part + curved)
                * senses.ratio(felt.channel).max(1.0),
            floor: expected.slope.norm_squared() * own_m2,
            alone: kernel.nugget + expected.variance + curved,
            anywhere: kernel.anywhere(felt.value),
            part,
        })
    });
    measured.collect()
}

/// Largest standard deviation of a position along an axis of the body \[m\].
fn axis_sd_m(covariance: &PoseCovariance) -> f64 {
    let diagonal = covariance.matrix().diagonal();
    diagonal.fixed_rows::<3>(0).max().max(0.0).sqrt()
}

/// Jacobian of a point of the body with respect to the error on the right of the pose.
pub(crate) fn point_by_pose(
    rotation: &nalgebra::Matrix3<f64>,
    lever: &Vector3<f64>,
) -> Matrix3x6<f64> {
    let mut jacobian = Matrix3x6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation);
    let turned = -rotation * lever.cross_matrix();
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&turned);
    jacobian
}

impl Senses {
    /// Mean square of a channel's residuals lately, in their variances.
    fn ratio(&self, channel: u8) -> f64 {
        let sense = self.all.iter().find(|sense| sense.channel == channel);
        sense.map_or(1.0, |sense| sense.ratio)
    }

    /// Takes in what measurements met; answers whether together they contradict the pose. One
    /// sensor that lies does not.
    pub(crate) fn judge(&mut self, measured: &[(Measurement, Measured)]) -> bool {
        for (measurement, met) in measured {
            let sense = self.sense(measurement.channel);
            let variance = measurement.alone + met.spread;
            let squared = measurement.residual.powi(2) / variance;
            sense.ratio += tuning::RATIO_SHARE * (squared.min(tuning::RATIO_MAX) - sense.ratio);
            let here = log_density(measurement.residual, variance);
            let odds = (here - measurement.anywhere).clamp(-tuning::ONE, tuning::ONE);
            let against = sense.against - measurement.part * odds;
            sense.against = against.clamp(0.0, tuning::AGAINST.1);
        }
        let (most, enough) = tuning::AGAINST;
        let cap = if self.all.len() == 1 { enough } else { most };
        let sum: f64 = self.all.iter().map(|sense| sense.against.min(cap)).sum();
        let many = self.all.iter().filter(|sense| sense.against >= 0.3 * most);
        sum >= enough && 2 * many.count() > self.all.len()
    }

    fn sense(&mut self, channel: u8) -> &mut Sense {
        let found = self.all.iter().position(|sense| sense.channel == channel);
        let index = found.unwrap_or_else(|| {
            self.all.push(Sense {
                channel,
                ratio: 1.0,
                against: 0.0,
            });
            self.all.len() - 1
        });
        &mut self.all[index]
    }

    /// Nothing speaks against the pose any more.
    pub(crate) fn settle(&mut self) {
        for sense in &mut self.all {
            sense.against = 0.0;
        }
    }
}
