//! How honest covariances are: errors against what they promise.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix2, Matrix3, Rotation3, Vector2, Vector3};
use serde::Serialize;

/// Normalised estimation errors squared of poses in the plane, per component.
///
/// For an error e of covariance P, eᵀ P⁻¹ e over the number of components; its mean is 1 where the
/// covariances are honest, and more where they are too small. Truth and estimate are in one frame:
/// where the first robot stands when it starts defines it, so an error of the whole map counts, and
/// has its share of every covariance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nees {
    sums: [f64; 5],
    count: f64,
}

/// Means of [`Nees`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NeesMeans {
    /// Of the position along x of the map.
    pub x: f64,
    /// Of the position along y of the map.
    pub y: f64,
    /// Of the heading.
    pub heading: f64,
    /// Of x and y together.
    pub position: f64,
    /// Of all three together.
    pub pose: f64,
}

impl Nees {
    /// Takes in a true pose and an estimated one with the covariance of its error, along and about
    /// its own axes. One whose covariance has no inverse does not count.
    pub fn add(
        &mut self,
        truth: &Isometry3<f64>,
        estimate: &Isometry3<f64>,
        covariance: &PoseCovariance,
    ) {
        let off = estimate.inv_mul(truth);
        let (ahead, turn) = (off.translation.vector, off.rotation.scaled_axis().z);
        let (_, _, heading) = estimate.rotation.euler_angles();
        let axes = Rotation3::from_axis_angle(&Vector3::z_axis(), heading).into_inner();
        let error = axes * Vector3::new(ahead.x, ahead.y, turn);
        let own = geometry::planar_part(covariance.matrix());
        let spread: Matrix3<f64> = axes * own * axes.transpose();
        let of_position: Matrix2<f64> = spread.fixed_view::<2, 2>(0, 0).into_owned();
        let inverses = of_position.try_inverse().zip(spread.try_inverse());
        let Some((of_position, of_pose)) = inverses else {
            return;
        };
        let position = Vector2::new(error.x, error.y);
        let alone = |k: usize| error[k] * error[k] / spread[(k, k)];
        let squares = [
            alone(0),
            alone(1),
            alone(2),
            position.dot(&(of_position * position)) / 2.0,
            error.dot(&(of_pose * error)) / 3.0,
        ];
        for (sum, square) in self.sums.iter_mut().zip(squares) {
            *sum += square;
        }
        self.count += 1.0;
    }

    /// Takes in what another has.
    pub fn add_all(&mut self, other: &Self) {
        for (sum, more) in self.sums.iter_mut().zip(other.sums) {
            *sum += more;
        }
        self.count += other.count;
    }

    /// The means; none of nothing.
    pub fn means(&self) -> Option<NeesMeans> {
        let [x, y, heading, position, pose] = self.sums.map(|sum| sum / self.count);
        (self.count > 0.0).then_some(NeesMeans {
            x,
            y,
            heading,
            position,
            pose,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn errors_are_counted_in_their_deviations_along_the_axes_of_the_map() {
        // It heads along y; what is ahead of it is more uncertain than what is aside.
        let quarter = Vector3::z() * std::f64::consts::FRAC_PI_2;
        let estimate = Isometry3::new(Vector3::new(3.0, -1.0, 0.0), quarter);
        let truth = Isometry3::new(Vector3::new(3.1, -0.6, 0.0), quarter * 1.02);
        let sd = Vector6::new(0.2, 0.05, 0.0, 0.0, 0.0, 0.02);
        let mut nees = Nees::default();
        nees.add(&truth, &estimate, &PoseCovariance::from_sd(&sd));
        let means = nees.means().unwrap();
        assert!((means.x - 4.0).abs() < 1e-9 && (means.y - 4.0).abs() < 1e-9);
        assert!((means.position - 4.0).abs() < 1e-9);
        let heading = (0.01 * std::f64::consts::PI / 0.02).powi(2);
        assert!((means.heading - heading).abs() < 1e-9);
        assert!((means.pose - (8.0 + heading) / 3.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_known_without_error_does_not_count() {
        let mut nees = Nees::default();
        let here = Isometry3::identity();
        nees.add(&here, &here, &PoseCovariance::zero());
        assert_eq!(nees.means(), None);
    }
}
