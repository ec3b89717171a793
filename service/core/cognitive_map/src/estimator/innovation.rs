//! What a sighting says against what the estimate expects.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, SVector, Vector3};

use super::tuning::{
    CIRCLE_VARIANCE_MAX, DIRECTION_DISTANCE_MIN_M, SIGHTING_SD_MIN, VAGUE_BEARING_SD_RAD,
};
use crate::input::{Range, RangeBearing, Relation, RelativePose, RelativePosition};
use geometry::se3;

/// A sighting of a point, linearised about where the observer and the point are thought to be.
///
/// All is a function of the point in the observer's frame, d = Rᵀ (p − x).
#[derive(Clone, Copy, Debug)]
pub(super) struct PointInnovation {
    /// Seen minus expected, in three independent components.
    pub(super) residual: Vector3<f64>,
    /// Derivative of the expected components by d.
    pub(super) by_point: Matrix3<f64>,
    /// Variance of each component as the sighting states it.
    pub(super) variance: Vector3<f64>,
    /// Length of d \[m\].
    pub(super) distance_m: f64,
    /// Whether the components are a distance and two angles, and not three lengths.
    pub(super) is_polar: bool,
}

impl PointInnovation {
    /// Of a sighting, if the point is expected at d. `None` where it has no direction, and of a
    /// distance alone.
    pub(super) fn new(relation: &Relation, expected: &Vector3<f64>) -> Option<Self> {
        match relation {
            Relation::Position(seen) => Some(Self::of_position(seen, expected)),
            Relation::RangeBearing(seen) => Self::of_range_and_bearing(seen, expected),
            Relation::Pose(seen) => {
                let rotation = seen.pose().rotation.to_rotation_matrix().into_inner();
                let sd = seen.noise().sd().fixed_rows::<3>(0).into_owned();
                let residual = rotation.transpose() * (seen.pose().translation.vector - expected);
                Some(Self {
                    residual,
                    by_point: rotation.transpose(),
                    variance: variances(&sd),
                    distance_m: expected.norm(),
                    is_polar: false,
                })
            }
            Relation::Range(_) => None,
        }
    }

    fn of_position(seen: &RelativePosition, expected: &Vector3<f64>) -> Self {
        Self {
            residual: seen.translation_m() - expected,
            by_point: Matrix3::identity(),
            variance: variances(seen.sd_m()),
            distance_m: expected.norm(),
            is_polar: false,
        }
    }

    /// By distance and direction. The angles are taken about the seen direction, along growing
    /// azimuth and elevation, where they are linear also above and below the observer:
    ///
    /// ```text
    /// α = atan2(e_α·d, e_r·d)      ε = atan2(e_ε·d, h)      h = hypot(e_r·d, e_α·d)
    /// ```
    fn of_range_and_bearing(seen: &RangeBearing, expected: &Vector3<f64>) -> Option<Self> {
        let (forward, left, up, cos_elevation) = seen.directions();
        let distance_m = expected.norm();
        let (ahead, aside, above) = (forward.dot(expected), left.dot(expected), up.dot(expected));
        let level = ahead.hypot(aside);
        if level < DIRECTION_DISTANCE_MIN_M {
            return None;
        }
        let residual = Vector3::new(
            seen.range_m() - distance_m,
            -aside.atan2(ahead),
            -above.atan2(level),
        );
        let by_range = expected / distance_m;
        let by_azimuth = (left * ahead - forward * aside) / (level * level);
        let by_elevation = (up * level - (forward * ahead + left * aside) * (above / level))
            / (distance_m * distance_m);
        let by_point = Matrix3::from_rows(&[
            by_range.transpose(),
            by_azimuth.transpose(),
            by_elevation.transpose(),
        ]);
        let bearing = seen.bearing_sd_rad();
        // Azimuth turns the direction by cos ε of it; overhead the second order is left.
        let across = bearing * cos_elevation.hypot(bearing.min(1.0));
        let mut variance = variances(&Vector3::new(seen.range_sd_m(), across, bearing));
        for k in 1..3 {
            variance[k] = on_the_circle(variance[k]);
        }
        Some(Self {
            residual,
            by_point,
            variance,
            distance_m,
            is_polar: true,
        })
    }
}

/// A sighting without the direction that it hardly states: a distance alone.
///
/// Of a bearing with a deviation of some radians, the linear update would make as much as of a
/// length with such a deviation, while on the circle it says next to nothing; and where the target
/// is new, no Gaussian has the shape of a ring.
pub(super) fn as_far_as_it_says(relation: &Relation) -> Relation {
    let Relation::RangeBearing(seen) = relation else {
        return *relation;
    };
    if seen.bearing_sd_rad() < VAGUE_BEARING_SD_RAD {
        return *relation;
    }
    let range = Range::new(seen.range_m(), seen.range_sd_m(), [0.0; 3]);
    range.map_or(*relation, Relation::Range)
}

/// The variance on a line of what an angle with this variance says, which the circle wraps around:
/// the inverse of the Fisher information of the wrapped normal distribution, to first order in
/// small variances and in small resultants,
///
/// ```text
/// 1/I = sinh σ²      I → 1/σ²  for σ → 0      I → 2 exp(−σ²)  for σ → ∞
/// ```
pub(super) fn on_the_circle(variance: f64) -> f64 {
    variance.min(CIRCLE_VARIANCE_MAX).sinh()
}

/// Where a sighting puts its target, in the observer's frame, and the covariance there; `None` of a
/// distance alone.
pub(super) fn seen_at(relation: &Relation) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let point = match relation {
        Relation::Position(seen) => *seen.translation_m(),
        Relation::RangeBearing(seen) => {
            seen.directions().0 * seen.range_m().max(DIRECTION_DISTANCE_MIN_M)
        }
        Relation::Pose(seen) => seen.pose().translation.vector,
        Relation::Range(_) => return None,
    };
    let covariance = PointInnovation::new(relation, &point).and_then(|innovation| {
        let inverse = innovation.by_point.try_inverse()?;
        Some(inverse * Matrix3::from_diagonal(&innovation.variance) * inverse.transpose())
    });
    Some((point, covariance.unwrap_or_else(Matrix3::identity)))
}

/// A sighting of a full pose, linearised: residual of the target's pose, derivatives by the errors
/// of the observer's and of the target's pose, and variances.
pub(super) fn pose_innovation(
    seen: &RelativePose,
    observer: &Isometry3<f64>,
    target: &Isometry3<f64>,
) -> (SVector<f64, 6>, Matrix6<f64>, Matrix6<f64>, SVector<f64, 6>) {
    // exp(residual) takes the expected relative pose to the seen one.
    let expected = observer.inv_mul(target);
    let residual = se3::twist(&expected.inv_mul(seen.pose()));
    let by_observer = -se3::adjoint(&expected.inverse());
    let sd = seen.noise().sd();
    let mut variance = sd.map(|sd| sd.max(SIGHTING_SD_MIN).powi(2));
    for k in 3..6 {
        variance[k] = on_the_circle(variance[k]);
    }
    (residual, by_observer, SMatrix::identity(), variance)
}

/// Squares, never quite zero.
fn variances(sd: &Vector3<f64>) -> Vector3<f64> {
    sd.map(|sd| sd.max(SIGHTING_SD_MIN).powi(2))
}
