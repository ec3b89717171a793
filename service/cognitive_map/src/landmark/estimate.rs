//! Where a landmark is, after any number of sightings.

use nalgebra::{Matrix3, Point3};

use crate::state::state_of_struct;

/// Steps of the search for the best weight.
const WEIGHT_STEPS: u32 = 16;

/// A position with its covariance, both in `map`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PositionEstimate {
    /// Position \[m\].
    pub(crate) position: Point3<f64>,
    /// Covariance \[m²\], exactly symmetric.
    pub(crate) covariance: Matrix3<f64>,
}

state_of_struct!(PositionEstimate {
    position,
    covariance
});

impl PositionEstimate {
    /// Fuses two estimates whose errors may be correlated in any way, as those of sightings from one
    /// drifting trajectory are: covariance intersection (Julier & Uhlmann 1997).
    ///
    /// ```text
    /// Σ⁻¹ = ω Σ₁⁻¹ + (1 − ω) Σ₂⁻¹      Σ⁻¹ p = ω Σ₁⁻¹ p₁ + (1 − ω) Σ₂⁻¹ p₂
    /// ```
    ///
    /// ω is the one of 0, 1/16, … 1 with the least trace of Σ, so the result is never worse than
    /// either estimate; of equal ones the largest, so that a sighting that adds nothing moves nothing.
    pub(crate) fn intersect(&self, other: &Self) -> Self {
        let informations = inverse(&self.covariance).zip(inverse(&other.covariance));
        let mut best = *self;
        if other.covariance.trace() < best.covariance.trace() {
            best = *other;
        }
        let Some((own, others)) = informations else {
            return best; // a covariance too large or too thin to invert
        };
        for step in (1..WEIGHT_STEPS).rev() {
            let weight = f64::from(step) / f64::from(WEIGHT_STEPS);
            let Some(covariance) = inverse(&(own * weight + others * (1.0 - weight))) else {
                continue;
            };
            if covariance.trace() < best.covariance.trace() {
                // As a correction of the first position, so that far away no digits are lost.
                let innovation = other.position - self.position;
                let correction = covariance * (others * (1.0 - weight)) * innovation;
                best = Self {
                    position: self.position + correction,
                    covariance,
                };
            }
        }
        best
    }
}

/// Without the asymmetry of rounding.
pub(super) fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    (matrix + matrix.transpose()) * 0.5
}

/// Inverse of a positive definite matrix; `None` when it is none to working precision.
fn inverse(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let inverse = matrix.cholesky()?.inverse();
    inverse
        .iter()
        .all(|entry| entry.is_finite())
        .then(|| symmetric(&inverse))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PoseCovariance;
    use crate::landmark::seen;
    use crate::sample::{Relation, RelativePosition};
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn estimate(position: [f64; 3], variances: [f64; 3], turn: [f64; 3]) -> PositionEstimate {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let rotation = rotation.to_rotation_matrix().into_inner();
        let covariance =
            rotation * Matrix3::from_diagonal(&variances.into()) * rotation.transpose();
        PositionEstimate {
            position: position.into(),
            covariance: symmetric(&covariance),
        }
    }

    fn any_estimate() -> impl Strategy<Value = PositionEstimate> {
        let variance = prop_oneof![1e-6..1e-3, 1e-3..1.0, 1.0..1e4];
        (
            prop::array::uniform3(-10.0..10.0),
            prop::array::uniform3(variance),
            prop::array::uniform3(-2.0..2.0),
        )
            .prop_map(|(position, variances, turn)| estimate(position, variances, turn))
    }

    proptest! {
        #[test]
        fn fusion_is_never_worse_than_either(a in any_estimate(), b in any_estimate()) {
            let fused = a.intersect(&b);
            let least = a.covariance.trace().min(b.covariance.trace());
            prop_assert!(fused.covariance.trace() <= least);
            prop_assert!(fused.covariance.cholesky().is_some());
            prop_assert_eq!(fused.covariance, fused.covariance.transpose());
        }

        /// The defining law: whatever the correlation of the errors, the fused covariance does not
        /// promise more than it keeps. Errors with covariances Σ₁, Σ₂ and the largest possible
        /// correlation ±1 along a direction have the fused variance (|a| ± |b|)² there.
        #[test]
        fn fusion_is_consistent_under_full_correlation(
            a in any_estimate(), b in any_estimate(), direction in prop::array::uniform3(-1.0..1.0),
        ) {
            let mut moved = a;
            moved.position = b.position;
            let fused = moved.intersect(&b);
            let information = inverse(&b.covariance).unwrap();
            // The gain of b, read back from where the fused position goes when b moves.
            let gain = Matrix3::from_fn(|row, column| {
                let mut shifted = b;
                shifted.position[column] += 1.0;
                (moved.intersect(&shifted).position - fused.position)[row]
            });
            let rest = Matrix3::identity() - gain;
            let direction = Vector3::from(direction);
            let own = (rest.transpose() * direction).dot(&(a.covariance * (rest.transpose() * direction)));
            let others =
                (gain.transpose() * direction).dot(&(b.covariance * (gain.transpose() * direction)));
            let worst = (own.max(0.0).sqrt() + others.max(0.0).sqrt()).powi(2);
            let promised = direction.dot(&(fused.covariance * direction));
            prop_assert!(information.trace() > 0.0);
            prop_assert!(promised >= worst * (1.0 - 1e-6) - 1e-9, "{promised} < {worst}");
        }
    }

    #[test]
    fn exact_and_contradictory_sightings_do_no_harm() {
        let at = |x: f64| {
            let exact = RelativePosition::new([x, 0.0, 0.0], [0.0; 3]).unwrap();
            seen(
                &Relation::Position(exact),
                &Isometry3::identity(),
                &PoseCovariance::zero(),
            )
        };
        let fused = at(1.0).intersect(&at(2.0));
        assert!((1.0..=2.0).contains(&fused.position.x));
        assert!(fused.covariance.iter().all(|entry| entry.is_finite()));
        let endless = estimate([0.0; 3], [f64::INFINITY; 3], [0.0; 3]);
        assert_eq!(at(1.0).intersect(&endless), at(1.0));
    }
}
