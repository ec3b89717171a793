//! How honest covariances are: errors against what they promise.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix2, Matrix3, Rotation3, Vector3};
use serde::Serialize;

/// Normalised estimation errors squared of poses in the plane, per component.
///
/// For an error e of covariance P, eᵀ P⁻¹ e over the number of components; its mean is 1 where the
/// covariances are honest, and more where they are too small. Truth and estimate are in one frame:
/// where the first robot stands when it starts defines it, so an error of the whole map counts, and
/// has its share of every covariance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nees {
    /// Of x, y and the position.
    of_positions: [f64; 3],
    n_positions: f64,
    /// Of the heading and the pose.
    of_poses: [f64; 2],
    n_poses: f64,
}

/// Means of [`Nees`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NeesMeans {
    /// Of the position along x of the map.
    pub x: f64,
    /// Of the position along y of the map.
    pub y: f64,
    /// Of x and y together.
    pub position: f64,
    /// Of the heading, where it is known.
    pub heading: Option<f64>,
    /// Of all three together.
    pub pose: Option<f64>,
}

impl Nees {
    /// Takes in a true position and an estimated pose with the covariance of its error, along and
    /// about its own axes. One whose covariance has no inverse does not count.
    pub fn add_position(
        &mut self,
        truth_m: &Vector3<f64>,
        estimate: &Isometry3<f64>,
        covariance: &PoseCovariance,
    ) {
        let Some(squared) = squared_distance(truth_m, estimate, covariance) else {
            return;
        };
        let spread = in_map(estimate, covariance);
        let error = truth_m - estimate.translation.vector;
        let alone = |k: usize| error[k] * error[k] / spread[(k, k)];
        let all = [alone(0), alone(1), squared / 2.0];
        add_up(&mut self.of_positions, all);
        self.n_positions += 1.0;
    }

    /// The same of a true pose.
    pub fn add(
        &mut self,
        truth: &Isometry3<f64>,
        estimate: &Isometry3<f64>,
        covariance: &PoseCovariance,
    ) {
        self.add_position(&truth.translation.vector, estimate, covariance);
        let spread = in_map(estimate, covariance);
        let Some(inverse) = spread.try_inverse() else {
            return;
        };
        let off_m = truth.translation.vector - estimate.translation.vector;
        let turn_rad = estimate
            .rotation
            .rotation_to(&truth.rotation)
            .scaled_axis()
            .z;
        let error = Vector3::new(off_m.x, off_m.y, turn_rad);
        let heading = turn_rad * turn_rad / spread[(2, 2)];
        add_up(
            &mut self.of_poses,
            [heading, error.dot(&(inverse * error)) / 3.0],
        );
        self.n_poses += 1.0;
    }

    /// Takes in what another has.
    pub fn add_all(&mut self, other: &Self) {
        add_up(&mut self.of_positions, other.of_positions);
        add_up(&mut self.of_poses, other.of_poses);
        self.n_positions += other.n_positions;
        self.n_poses += other.n_poses;
    }

    /// The means; none of nothing.
    pub fn means(&self) -> Option<NeesMeans> {
        let [x, y, position] = self.of_positions.map(|sum| sum / self.n_positions);
        let of_pose = |sum: f64| (self.n_poses > 0.0).then_some(sum / self.n_poses);
        (self.n_positions > 0.0).then_some(NeesMeans {
            x,
            y,
            position,
            heading: of_pose(self.of_poses[0]),
            pose: of_pose(self.of_poses[1]),
        })
    }
}

/// Squared Mahalanobis distance of a true position \[m\] from an estimated pose in the plane, by
/// the covariance of the estimate's error along and about its own axes; `None` if that has no
/// inverse. Where covariances are honest it is distributed as χ² of two degrees of freedom.
pub fn squared_distance(
    truth_m: &Vector3<f64>,
    estimate: &Isometry3<f64>,
    covariance: &PoseCovariance,
) -> Option<f64> {
    let spread = in_map(estimate, covariance);
    let of_position: Matrix2<f64> = spread.fixed_view::<2, 2>(0, 0).into_owned();
    let inverse = of_position.try_inverse()?;
    let error = (truth_m - estimate.translation.vector).xy();
    Some(error.dot(&(inverse * error)))
}

/// The covariance in the plane (x, y, heading), along the axes of the map.
fn in_map(estimate: &Isometry3<f64>, covariance: &PoseCovariance) -> Matrix3<f64> {
    let (_, _, heading) = estimate.rotation.euler_angles();
    let axes = Rotation3::from_axis_angle(&Vector3::z_axis(), heading).into_inner();
    axes * geometry::planar_part(covariance.matrix()) * axes.transpose()
}

fn add_up<const N: usize>(sums: &mut [f64; N], more: [f64; N]) {
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum += more;
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
        assert!((means.heading.unwrap() - heading).abs() < 1e-9);
        assert!((means.pose.unwrap() - (8.0 + heading) / 3.0).abs() < 1e-9);
    }

    #[test]
    fn headings_that_are_not_known_do_not_count() {
        let sd = Vector6::new(0.1, 0.1, 0.0, 0.0, 0.0, 0.02);
        let covariance = PoseCovariance::from_sd(&sd);
        let mut nees = Nees::default();
        nees.add_position(
            &Vector3::new(0.1, 0.0, 0.0),
            &Isometry3::identity(),
            &covariance,
        );
        let one = nees.means().unwrap();
        assert!((one.position - 0.5).abs() < 1e-9 && one.heading.is_none());
        let mut both = Nees::default();
        both.add(
            &Isometry3::rotation(Vector3::z() * 0.02),
            &Isometry3::identity(),
            &covariance,
        );
        both.add_all(&nees);
        let two = both.means().unwrap();
        assert!((two.x - 0.5).abs() < 1e-9 && (two.heading.unwrap() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_known_without_error_does_not_count() {
        let mut nees = Nees::default();
        let here = Isometry3::identity();
        nees.add(&here, &here, &PoseCovariance::zero());
        assert_eq!(nees.means(), None);
    }
}
