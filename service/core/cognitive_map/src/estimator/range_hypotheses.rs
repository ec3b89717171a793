//! Where a landmark may be of which nothing but distances is known.
//!
//! One distance puts a landmark on a sphere about the antenna, of a planar robot on the rings of
//! that sphere at some heights. It is kept as a sum of Gaussians, which motion moves and further
//! distances weigh and correct, until all that are left lie together (sums of Gaussians for
//! beacons: Blanco, Fernández-Madrigal & González 2008). A point and its mirror image on the other
//! side of a straight way stay apart until the robot turns.
//!
//! All is relative to the body, so that it does not matter where in the map the robot is, nor how
//! sure that is. Only what odometry gets wrong between two distances blurs it.

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::tuning::{
    DIRECTION_DISTANCE_MIN_M, RANGE_CURVED_MAX, RANGE_DOF, RANGE_HEIGHT_MAX_M,
    RANGE_JOIN_ANGLE_RAD, RANGE_JOIN_MASS, RANGE_JOIN_SAG, RANGE_LAYER_RAD, RANGE_LAYERS,
    RANGE_OUTLYING_SQUARE, RANGE_OVERLAP, RANGE_POINTS_MAX, RANGE_REFLECTED,
    RANGE_REFLECTION_MAX_M, RANGE_RING_POINTS, RANGE_SPHERE_POINTS, RANGE_TRIAL_MIN,
    RANGE_WEIGHT_MIN,
};
use crate::input::Range;
use geometry::{MotionSum, seen_by_pose, symmetric};

/// One of the places where a landmark may be, in the body frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PointHypothesis {
    pub(super) log_weight: f64,
    pub(super) position: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
}

/// The places where a landmark may be, as of its latest distance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RangeHypotheses {
    pub(super) points: Vec<PointHypothesis>,
    /// The body's motion since then.
    pub(super) motion: MotionSum,
    /// The distance of the agent that was taken in last.
    pub(super) used: u64,
    /// The way since the first distance \[m\].
    pub(super) path_m: f64,
    /// Distances that were taken in after the first, and how many of them fit none of the places.
    pub(super) taken: u32,
    pub(super) outlying: u32,
    /// Log of the density of these, by all places together.
    pub(super) log_evidence: f64,
    /// How far off the landmark is at most, for distances are never too short \[m\].
    pub(super) at_most_m: f64,
}

/// Where a landmark is, in the body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RangedPoint {
    pub(super) position: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
}

/// The distance of an uncertain point from the antenna.
///
/// With the direction u and the curvature C = (1 − uuᵀ) / d of the distance, of a point with the
/// covariance P (the second-order filter of Athans, Wishner & Bertolini 1968):
///
/// ```text
/// E d = d̂ + b      b = ½ tr(C P)      var d = uᵀ P u + ½ tr((C P)²)
/// ```
///
/// Where the covariance may be too wide, b is, too, and in one direction: there it counts as noise,
/// b² beside the variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ExpectedRange {
    pub(super) direction: Vector3<f64>,
    /// The distance of the point that is expected, and b² \[m, m²\].
    pub(super) distance_m: f64,
    pub(super) bias_square: f64,
    /// Part of the variance that is linear in the point's error \[m²\].
    pub(super) linear: f64,
    /// The part that is not \[m²\].
    pub(super) curved: f64,
}

impl ExpectedRange {
    /// Of a point at `apart` from the antenna. `None` where it has no direction.
    pub(super) fn new(apart: &Vector3<f64>, covariance: &Matrix3<f64>) -> Option<Self> {
        let distance_m = apart.norm();
        if distance_m.is_nan() || distance_m < DIRECTION_DISTANCE_MIN_M {
            return None;
        }
        let direction = apart / distance_m;
        let across = Matrix3::identity() - direction * direction.transpose();
        let bent = across * covariance / distance_m;
        Some(Self {
            direction,
            distance_m,
            bias_square: (0.5 * bent.trace()).powi(2),
            linear: direction.dot(&(covariance * direction)),
            curved: 0.5 * (bent * bent).trace().max(0.0),
        })
    }
}

/// Factor of the variance of a distance whose squared innovation is so many times what is
/// expected: that of Student's t (Lange, Little & Taylor 1989).
pub(super) fn loss_of_weight(square: f64) -> f64 {
    ((RANGE_DOF + square) / (RANGE_DOF + 1.0)).max(1.0)
}

impl RangeHypotheses {
    /// Of a first distance, with its variance \[m²\].
    pub(super) fn new(range: &Range, variance: f64, is_planar: bool) -> Self {
        Self {
            points: places(range, variance, is_planar),
            motion: MotionSum::default(),
            path_m: 0.0,
            used: 0,
            taken: 0,
            outlying: 0,
            log_evidence: 0.0,
            at_most_m: range.range_m() + 3.0 * variance.sqrt(),
        }
    }

    /// A further distance, with its variance \[m²\]. If most of them fit none of the places, the
    /// beacon is elsewhere by now: then they begin anew with this one.
    pub(super) fn update(&mut self, range: &Range, variance: f64, is_planar: bool) {
        self.carry_over_motion();
        let mut least = f64::INFINITY;
        for point in &mut self.points {
            least = least.min(point.update(range, variance));
        }
        self.log_evidence += self.prune();
        self.taken += 1;
        if !self.points.is_empty() {
            self.suppose_reflections(range, variance, is_planar);
        }
        self.at_most_m = self.at_most_m.min(range.range_m() + 3.0 * variance.sqrt());
        self.outlying += u32::from(least > RANGE_OUTLYING_SQUARE);
        if self.taken >= RANGE_TRIAL_MIN && 2 * self.outlying > self.taken || self.points.is_empty()
        {
            let used = self.used;
            *self = Self::new(range, variance, is_planar);
            self.used = used;
        }
    }

    /// All distances before this one may have been those of reflections: adds the places where the
    /// landmark may be by this one alone, as far as that is probable beside the others. Reflected
    /// distances are too long, so this one is no longer than they admit.
    fn suppose_reflections(&mut self, range: &Range, variance: f64, is_planar: bool) {
        let log_density = (RANGE_REFLECTED / RANGE_REFLECTION_MAX_M).ln();
        let log_mass = f64::from(self.taken) * log_density - self.log_evidence;
        let least = RANGE_WEIGHT_MIN.ln();
        if log_mass <= least || range.range_m() > self.at_most_m + 3.0 * variance.sqrt() {
            return;
        }
        let mut added = places(range, variance, is_planar);
        let room = RANGE_POINTS_MAX.saturating_sub(added.len());
        if added[0].log_weight + log_mass <= least || (self.points.len() > room && log_mass < 0.0) {
            return;
        }
        for point in &mut added {
            point.log_weight += log_mass;
        }
        let more = |one: &PointHypothesis, other: &PointHypothesis| {
            other.log_weight.total_cmp(&one.log_weight)
        };
        if self.points.len() > room {
            self.points.sort_by(more);
            self.points.truncate(room);
        }
        self.points.append(&mut added);
        self.log_evidence += self.normalise();
    }

    /// Moves the places to the body frame as it is now.
    fn carry_over_motion(&mut self) {
        let motion = std::mem::take(&mut self.motion);
        let path_m = motion.motion().translation.vector.norm();
        self.path_m += path_m;
        self.at_most_m += path_m;
        let back = motion.motion().inverse();
        let turn = back.rotation.to_rotation_matrix().into_inner();
        let noise = *motion.covariance().matrix();
        for point in &mut self.points {
            point.position = back.transform_vector(&point.position) + back.translation.vector;
            let by_noise = seen_by_pose(&point.position);
            let moved = turn * point.covariance * turn.transpose();
            point.covariance = symmetric(&(moved + by_noise * noise * by_noise.transpose()));
        }
    }

    /// Drops the places that next to nothing speaks for; the weights of the others sum to one.
    /// Answers the log of what they summed to.
    fn prune(&mut self) -> f64 {
        self.points.retain(|point| point.log_weight.is_finite());
        let total = self.normalise();
        let least = RANGE_WEIGHT_MIN.ln();
        self.points.retain(|point| point.log_weight > least);
        total + self.normalise()
    }

    /// Makes the weights sum to one; answers the log of what they summed to.
    fn normalise(&mut self) -> f64 {
        let weights = self.points.iter().map(|point| point.log_weight);
        let most = weights.clone().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = weights.map(|weight| (weight - most).exp()).sum();
        let total = most + sum.ln();
        for point in &mut self.points {
            point.log_weight -= total;
        }
        total
    }

    /// The one place that is left, if it is certain enough for the joint estimate, which is linear:
    /// an arc of its deviation σ must differ from its tangent, by σ²/2d, by less than a part of the
    /// deviation of a distance. A way longer than the distance hardly tells more than odometry
    /// loses meanwhile: then a wider arc will do, up to an angle.
    pub(super) fn decided(
        &self,
        range: &Range,
        variance: f64,
        is_planar: bool,
    ) -> Option<RangedPoint> {
        let later = |best: &PointHypothesis, next: &PointHypothesis| {
            next.log_weight.total_cmp(&best.log_weight).is_gt()
        };
        let best = self
            .points
            .iter()
            .reduce(|best, next| if later(best, next) { next } else { best })?;
        let distance_m = (best.position - range.antenna_m()).norm();
        let linear = 2.0 * RANGE_JOIN_SAG * distance_m * variance.sqrt();
        let ways = (self.path_m / distance_m.max(DIRECTION_DISTANCE_MIN_M)).max(1.0);
        let widest = (RANGE_JOIN_ANGLE_RAD * distance_m).powi(2);
        let most = (linear * ways * ways).min(widest.max(linear));
        let flat = |apart: Vector3<f64>| {
            if is_planar {
                apart.xy().norm_squared()
            } else {
                apart.norm_squared()
            }
        };
        let near = |point: &&PointHypothesis| flat(point.position - best.position) < 9.0 * most;
        let near: Vec<&PointHypothesis> = self.points.iter().filter(near).collect();
        let mass: f64 = near.iter().map(|point| point.log_weight.exp()).sum();
        if mass < RANGE_JOIN_MASS {
            return None;
        }
        let weigh = |point: &PointHypothesis| point.log_weight.exp() / mass;
        let position: Vector3<f64> = near.iter().map(|point| point.position * weigh(point)).sum();
        let spread = |point: &&PointHypothesis| {
            let apart = point.position - position;
            (point.covariance + apart * apart.transpose()) * weigh(point)
        };
        let covariance: Matrix3<f64> = symmetric(&near.iter().map(spread).sum::<Matrix3<f64>>());
        let largest = if is_planar {
            // What is above or below a planar robot is not for it to know.
            let level: Matrix2<f64> = covariance.fixed_view::<2, 2>(0, 0).into_owned();
            level.symmetric_eigenvalues().max()
        } else if covariance.iter().all(|entry| entry.is_finite()) {
            covariance.symmetric_eigenvalues().max()
        } else {
            f64::INFINITY
        };
        (largest < most).then_some(RangedPoint {
            position,
            covariance,
        })
    }
}

impl PointHypothesis {
    /// Takes in a distance; answers its squared innovation in units of its variance.
    ///
    /// It is direct with the probability β and else says nothing, so that the place becomes the
    /// Gaussian of the same moments as both cases together (Bar-Shalom & Tse 1975).
    fn update(&mut self, range: &Range, variance: f64) -> f64 {
        let apart = self.position - range.antenna_m();
        let Some(expected) = ExpectedRange::new(&apart, &self.covariance) else {
            return f64::INFINITY;
        };
        let innovation = range.range_m() - expected.distance_m;
        // A place wider than its ring is round would learn nothing any more, and grow for ever.
        let curved = (expected.curved + expected.bias_square).min(RANGE_CURVED_MAX * variance);
        let noise = variance + curved;
        let square = innovation * innovation / (expected.linear + noise);
        let density = RangeDensity::new(innovation, expected.linear + noise);
        self.log_weight += density.total().ln();
        let direct = density.direct_share();
        let total = expected.linear + noise * loss_of_weight(square);
        let gain = self.covariance * expected.direction / total;
        self.position += gain * (direct * innovation);
        let spread = (1.0 - direct) * innovation * innovation - total;
        self.covariance =
            symmetric(&(self.covariance + gain * gain.transpose() * (direct * spread)));
        square
    }
}

/// Density of an innovation of a distance \[1/m\]: mostly Student's t with four degrees of freedom,
/// and sometimes anything that is too long.
#[derive(Clone, Copy, Debug)]
pub(super) struct RangeDensity {
    direct: f64,
    reflected: f64,
}

impl RangeDensity {
    /// Of an innovation \[m\] with this variance \[m²\].
    pub(super) fn new(innovation: f64, variance: f64) -> Self {
        let square = innovation * innovation / variance;
        let direct =
            0.375 * (1.0 + square / RANGE_DOF).powf(-0.5 * (RANGE_DOF + 1.0)) / variance.sqrt();
        let reflected = if innovation > 0.0 {
            RANGE_REFLECTION_MAX_M.recip()
        } else {
            0.0
        };
        Self {
            direct: (1.0 - RANGE_REFLECTED) * direct,
            reflected: RANGE_REFLECTED * reflected,
        }
    }

    fn total(&self) -> f64 {
        self.direct + self.reflected
    }

    /// Probability that the distance was no reflection.
    pub(super) fn direct_share(&self) -> f64 {
        if self.reflected > 0.0 {
            self.direct / self.total()
        } else {
            1.0
        }
    }
}

/// Where a landmark may be by one distance, with equal weights.
fn places(range: &Range, variance: f64, is_planar: bool) -> Vec<PointHypothesis> {
    let mut points = if is_planar {
        rings(range, variance)
    } else {
        sphere(range, variance)
    };
    let log_weight = -(points.len() as f64).ln();
    for point in &mut points {
        point.log_weight = log_weight;
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
        position: range.antenna_m() + ahead,
        covariance: symmetric(&(axes * Matrix3::from_diagonal(&variances) * axes.transpose())),
    }
}
