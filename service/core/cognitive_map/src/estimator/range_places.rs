//! The places where a landmark may be by one distance: rings or a sphere about the antenna.

use nalgebra::{Matrix3, Vector3};

use super::noise_part::NoisePart;
use super::tuning::{
    DIRECTION_DISTANCE_MIN_M, RANGE_HEIGHT_MAX_M, RANGE_LAYER_RAD, RANGE_LAYERS, RANGE_OVERLAP,
    RANGE_RING_POINTS, RANGE_SPHERE_POINTS,
};
use crate::input::Range;
use geometry::symmetric;

/// One of the places where a landmark may be, in the body frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PointHypothesis {
    pub(super) log_weight: f64,
    pub(super) position: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
    /// How much of the noise that is assumed of turns is supposed to be there.
    pub(super) noise_part: NoisePart,
}

/// The odometry of a robot that measures distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct OdometryKind {
    pub(super) is_planar: bool,
    pub(super) states_noise: bool,
}

impl OdometryKind {
    /// How much of the assumed noise may be there, with the logarithms of the probabilities. Noise
    /// that is stated is.
    fn noise_parts(self) -> Vec<(NoisePart, f64)> {
        if self.states_noise {
            return vec![(NoisePart::All, 0.0)];
        }
        let with_prior = |part: NoisePart| (part, part.log_prior());
        NoisePart::EACH.map(with_prior).to_vec()
    }
}

/// Where a landmark may be by one distance: all places are as probable, each with every part of
/// the assumed noise.
pub(super) fn places(range: &Range, variance: f64, odometry: OdometryKind) -> Vec<PointHypothesis> {
    let places = if odometry.is_planar {
        rings(range, variance)
    } else {
        sphere(range, variance)
    };
    let even = (places.len() as f64).ln();
    let mut points = Vec::new();
    for (noise_part, log_prior) in odometry.noise_parts() {
        points.extend(places.iter().map(|place| PointHypothesis {
            log_weight: log_prior - even,
            noise_part,
            ..place.clone()
        }));
    }
    points
}

/// Rings about the antenna, in planes above it. What lies below it looks the same to a planar
/// robot.
fn rings(range: &Range, variance: f64) -> Vec<PointHypothesis> {
    let range_m = range.range_m().max(DIRECTION_DISTANCE_MIN_M);
    let mut points = Vec::new();
    for layer in 0..RANGE_LAYERS {
        let (sin, cos) = (RANGE_LAYER_RAD * f64::from(layer)).sin_cos();
        let (height, radius) = (range_m * sin, range_m * cos);
        if layer > 0 && height > RANGE_HEIGHT_MAX_M {
            break;
        }
        // As dense everywhere, so that every height is as probable.
        let n = (f64::from(RANGE_RING_POINTS) * cos).ceil();
        let spacing = std::f64::consts::TAU / n;
        let upwards = (RANGE_OVERLAP * RANGE_LAYER_RAD * range_m).min(0.5 * RANGE_HEIGHT_MAX_M);
        let sd = [RANGE_OVERLAP * spacing * radius, upwards];
        for k in (0..RANGE_RING_POINTS).map(f64::from).take_while(|&k| k < n) {
            let (sin, cos) = (spacing * k).sin_cos();
            let ahead = Vector3::new(radius * cos, radius * sin, height);
            let along = Vector3::new(-sin, cos, 0.0);
            points.push(hypothesis(range, variance, &ahead, &along, sd));
        }
    }
    points
}

/// Points spread evenly over a sphere about the antenna (the lattice of Fibonacci; González 2010).
fn sphere(range: &Range, variance: f64) -> Vec<PointHypothesis> {
    let range_m = range.range_m().max(DIRECTION_DISTANCE_MIN_M);
    let n = f64::from(RANGE_SPHERE_POINTS);
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let spacing = range_m * (4.0 * std::f64::consts::PI / n).sqrt();
    let point = |k: u32| {
        let height = 1.0 - (2.0 * f64::from(k) + 1.0) / n;
        let (sin, cos) = (golden * f64::from(k)).sin_cos();
        let level = (1.0 - height * height).sqrt();
        let ahead = Vector3::new(level * cos, level * sin, height) * range_m;
        let along = Vector3::new(-sin, cos, 0.0);
        let sd = [RANGE_OVERLAP * spacing; 2];
        hypothesis(range, variance, &ahead, &along, sd)
    };
    (0..RANGE_SPHERE_POINTS).map(point).collect()
}

/// A place at `ahead` of the antenna: uncertain by the distance's variance in that direction, and
/// by `sd` along a level direction and across both.
fn hypothesis(
    range: &Range,
    variance: f64,
    ahead: &Vector3<f64>,
    along: &Vector3<f64>,
    sd: [f64; 2],
) -> PointHypothesis {
    let direction = ahead.normalize();
    let axes = Matrix3::from_columns(&[direction, *along, direction.cross(along)]);
    let variances = Vector3::new(variance, sd[0] * sd[0], sd[1] * sd[1]);
    PointHypothesis {
        log_weight: 0.0,
        noise_part: NoisePart::All,
        position: range.antenna_m() + ahead,
        covariance: symmetric(&(axes * Matrix3::from_diagonal(&variances) * axes.transpose())),
    }
}
