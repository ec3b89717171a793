//! Where a landmark may be of which nothing but distances is known.
//!
//! One distance puts a landmark on a sphere about the antenna, of a planar robot on the rings of
//! that sphere at some heights. It is kept as a sum of Gaussians, which motion moves and further
//! distances weigh and correct, until all that are left lie together (sums of Gaussians for
//! beacons: Blanco, Fernández-Madrigal & González 2008). A point and its mirror image on the other
//! side of a straight way stay apart until the robot turns.
//!
//! Odometry that does not state its noise may turn far better than is assumed, and beacons far
//! away are lost in what is assumed. So each place is held with several parts of that noise, and
//! the distances weigh them as they weigh the places.
//!
//! All is relative to the body, so that it does not matter where in the map the robot is, nor how
//! sure that is. Only what odometry gets wrong between two distances blurs it.

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::doubtful_motion::DoubtfulMotion;
use super::noise_part::{NoiseEvidence, NoisePart};
use super::range_places::{OdometryKind, PointHypothesis, places};
use super::tuning::{
    DIRECTION_DISTANCE_MIN_M, RANGE_CURVED_MAX, RANGE_DECIDED_MIN, RANGE_DOF, RANGE_JOIN_ANGLE_RAD,
    RANGE_JOIN_MASS, RANGE_JOIN_SAG, RANGE_OUTLYING_SQUARE, RANGE_POINTS_MAX, RANGE_REFLECTED,
    RANGE_REFLECTION_MAX_M, RANGE_TRIAL_MIN, RANGE_WEIGHT_MIN,
};
use crate::input::Range;
use geometry::{seen_by_pose, symmetric};

/// The places where a landmark may be, as of its latest distance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RangeHypotheses {
    pub(super) points: Vec<PointHypothesis>,
    /// The body's motion since then.
    pub(super) motion: DoubtfulMotion,
    /// The distance of the agent that was taken in last.
    pub(super) used: u64,
    /// The way since the first distance \[m\].
    pub(super) path_m: f64,
    /// Distances that were taken in after the first, and how many of them fit none of the places.
    pub(super) taken: u32,
    pub(super) outlying: u32,
    /// Distances in a row that left one place, the same one or another.
    pub(super) decided: u32,
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
    /// What finding it says of the noise that is assumed of turns, of odometry that states none.
    pub(super) turn_noise: Option<NoiseEvidence>,
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
    pub(super) fn new(range: &Range, variance: f64, odometry: OdometryKind) -> Self {
        Self {
            points: places(range, variance, odometry),
            motion: DoubtfulMotion::default(),
            path_m: 0.0,
            used: 0,
            taken: 0,
            outlying: 0,
            decided: 0,
            log_evidence: 0.0,
            at_most_m: range.range_m() + 3.0 * variance.sqrt(),
        }
    }

    /// A further distance, with its variance \[m²\]. If most of them fit none of the places, the
    /// beacon is elsewhere by now: then they begin anew with this one.
    pub(super) fn update(&mut self, range: &Range, variance: f64, odometry: OdometryKind) {
        self.carry_over_motion();
        if odometry.states_noise {
            self.suppose_all_noise();
        }
        let mut least = f64::INFINITY;
        for point in &mut self.points {
            least = least.min(point.update(range, variance));
        }
        self.log_evidence += self.prune();
        self.taken += 1;
        if !self.points.is_empty() {
            self.suppose_reflections(range, variance, odometry);
        }
        self.at_most_m = self.at_most_m.min(range.range_m() + 3.0 * variance.sqrt());
        self.outlying += u32::from(least > RANGE_OUTLYING_SQUARE);
        if self.taken >= RANGE_TRIAL_MIN && 2 * self.outlying > self.taken || self.points.is_empty()
        {
            let used = self.used;
            *self = Self::new(range, variance, odometry);
            self.used = used;
        }
    }

    /// All distances before this one may have been those of reflections: adds the places where the
    /// landmark may be by this one alone, as far as that is probable beside the others. Reflected
    /// distances are too long, so this one is no longer than they admit.
    fn suppose_reflections(&mut self, range: &Range, variance: f64, odometry: OdometryKind) {
        let log_density = (RANGE_REFLECTED / RANGE_REFLECTION_MAX_M).ln();
        let log_mass = f64::from(self.taken) * log_density - self.log_evidence;
        let least = RANGE_WEIGHT_MIN.ln();
        if log_mass <= least || range.range_m() > self.at_most_m + 3.0 * variance.sqrt() {
            return;
        }
        let mut added = places(range, variance, odometry);
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

    /// Odometry states its noise: all of it is there. The evidence is that of the places which
    /// supposed so.
    fn suppose_all_noise(&mut self) {
        if self
            .points
            .iter()
            .any(|point| point.noise_part != NoisePart::All)
        {
            self.points
                .retain(|point| point.noise_part == NoisePart::All);
            self.log_evidence += self.normalise() - NoisePart::All.log_prior();
        }
    }

    /// Moves the places to the body frame as it is now.
    fn carry_over_motion(&mut self) {
        let motion = std::mem::take(&mut self.motion);
        let path_m = motion.motion().translation.vector.norm();
        self.path_m += path_m;
        self.at_most_m += path_m;
        let back = motion.motion().inverse();
        let turn = back.rotation.to_rotation_matrix().into_inner();
        let [certain, assumed] = motion.covariances();
        for point in &mut self.points {
            point.position = back.transform_vector(&point.position) + back.translation.vector;
            let by_noise = seen_by_pose(&point.position);
            let noise = certain + assumed * point.noise_part.factor();
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

    /// What the distances say of the noise that is assumed of turns.
    fn turn_noise(&self) -> Option<NoiseEvidence> {
        NoiseEvidence::of_weights(NoisePart::EACH.map(|part| {
            let held = self.points.iter().filter(|point| point.noise_part == part);
            held.map(|point| point.log_weight.exp()).sum()
        }))
    }

    /// The one place that is left, if the latest distances all left one.
    pub(super) fn decide(
        &mut self,
        range: &Range,
        variance: f64,
        odometry: OdometryKind,
    ) -> Option<RangedPoint> {
        let point = self.point_left(range, variance, odometry);
        self.decided = point.map_or(0, |_| self.decided.saturating_add(1));
        point.filter(|_| self.decided >= RANGE_DECIDED_MIN)
    }

    /// The one place that is left, if it is certain enough for the joint estimate, which is linear:
    /// an arc of its deviation σ must differ from its tangent, by σ²/2d, by less than a part of the
    /// deviation of a distance. A way longer than the distance hardly tells more than odometry
    /// loses meanwhile: then a wider arc will do, up to an angle.
    fn point_left(
        &self,
        range: &Range,
        variance: f64,
        odometry: OdometryKind,
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
            if odometry.is_planar {
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
        let largest = if odometry.is_planar {
            // What is above or below a planar robot is not for it to know.
            let level: Matrix2<f64> = covariance.fixed_view::<2, 2>(0, 0).into_owned();
            level.symmetric_eigenvalues().max()
        } else if covariance.iter().all(|entry| entry.is_finite()) {
            covariance.symmetric_eigenvalues().max()
        } else {
            f64::INFINITY
        };
        (largest < most).then(|| RangedPoint {
            position,
            covariance,
            turn_noise: (!odometry.states_noise)
                .then(|| self.turn_noise())
                .flatten(),
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
        // Turns that were not read, and a height that is not known, take a place along its sphere,
        // where its distance stays as sure.
        let across = RangeDensity::new(innovation, expected.linear + variance);
        self.log_weight += across.total().ln();
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
