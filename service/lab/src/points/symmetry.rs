//! The error of a rotation, modulo an object's own symmetries.

use geometry::se3;
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, UnitQuaternion, Vector3, Vector6};

use super::cloud::Cloud;

/// Points by which a symmetry is told.
const POINTS: usize = 200;
/// Points among which the nearest is looked for.
const TARGETS: usize = 4096;
/// Steps of refining.
const STEPS: usize = 12;
/// A small turn that moves the surface through itself by less than this part of the way that its
/// points go is about an axis of symmetry: dents and labels do not make a can's turn about its axis
/// one that can be told.
const THROUGH_MIN: f64 = 0.2;

/// The angle \[rad\] between an estimated pose and the true one, or the true one moved by a
/// symmetry of the object.
///
/// The error D = estimate⁻¹ truth, in the object's frame, is refined to the nearest motion D* that
/// lays the object upon itself; turns about an axis of symmetry are left as they are. If what is
/// left between the two surfaces is below `tolerance_m` (root mean square), D* is a symmetry, and
/// the error is D without it; otherwise all of D.
pub(super) fn error_rad(
    cloud: &Cloud,
    estimate: &Isometry3<f64>,
    truth: &Isometry3<f64>,
    tolerance_m: f64,
) -> f64 {
    let error = estimate * truth.inverse();
    let plain = error.rotation.angle();
    let middle = cloud
        .points
        .iter()
        .fold(Vector3::zeros(), |sum, p| sum + p.0.coords)
        / cloud.points.len() as f64;
    // A symmetry does not move the middle; the estimate's shift is no part of the rotation's error.
    let to = nalgebra::Translation3::from(middle);
    let mut pose = to * error.rotation * to.inverse();
    let sources = every(cloud, POINTS);
    let targets = every(cloud, TARGETS);
    let mut rms_m = f64::INFINITY;
    for _ in 0..STEPS {
        let mut matrix = Matrix6::from_diagonal_element(1e-9);
        let mut right = Vector6::zeros();
        let mut ways = Matrix3::zeros();
        let mut squares = Vec::with_capacity(sources.len());
        for (point, normal) in &sources {
            let moved = pose * point;
            let turned = pose * normal;
            let near = targets
                .iter()
                .filter(|target| target.1.dot(&turned) > 0.5)
                .map(|target| ((target.0 - moved).norm_squared(), target))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, near)) = near else {
                squares.push(1.0);
                continue;
            };
            let through = (near.1 + turned).normalize();
            let depth = (moved - near.0).dot(&through);
            squares.push(depth * depth);
            let lever = (moved.coords - middle).cross(&through);
            let row = Vector6::new(through.x, through.y, through.z, lever.x, lever.y, lever.z);
            matrix += row * row.transpose();
            right -= row * depth;
            let arm = moved.coords - middle;
            ways += Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
        }
        // What a scan has once only, a dent or a label's edge, is a tenth of the surface at most.
        squares.sort_by(f64::total_cmp);
        squares.truncate(squares.len() * 9 / 10);
        rms_m = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        let Some(step) = step(&matrix, &right, &ways) else {
            break;
        };
        let turn = se3::exp(
            &step.fixed_rows::<3>(0).into(),
            &step.fixed_rows::<3>(3).into(),
        );
        pose = to * turn * to.inverse() * pose;
    }
    if rms_m < tolerance_m {
        let rest: UnitQuaternion<f64> = error.rotation * pose.rotation.inverse();
        rest.angle().min(plain)
    } else {
        plain
    }
}

/// The step that minimises, without turns about axes of symmetry. `ways` are the squared ways of
/// the points per squared turn.
fn step(matrix: &Matrix6<f64>, right: &Vector6<f64>, ways: &Matrix3<f64>) -> Option<Vector6<f64>> {
    // The shift that goes best with each turn is eliminated.
    let shifts = matrix.fixed_view::<3, 3>(0, 0).try_inverse()?;
    let across = matrix.fixed_view::<3, 3>(3, 0) * shifts;
    let turns = matrix.fixed_view::<3, 3>(3, 3) - across * matrix.fixed_view::<3, 3>(0, 3);
    let pull = right.fixed_rows::<3>(3) - across * right.fixed_rows::<3>(0);
    let eigen = turns.symmetric_eigen();
    let mut turn = Vector3::zeros();
    for (axis, through) in eigen
        .eigenvectors
        .column_iter()
        .zip(eigen.eigenvalues.iter())
    {
        let way = axis.dot(&(ways * axis));
        if *through > THROUGH_MIN * THROUGH_MIN * way {
            turn += axis * (axis.dot(&pull) / through);
        }
    }
    let shift = shifts * (right.fixed_rows::<3>(0) - matrix.fixed_view::<3, 3>(0, 3) * turn);
    Some(Vector6::new(
        shift.x, shift.y, shift.z, turn.x, turn.y, turn.z,
    ))
}

fn every(cloud: &Cloud, most: usize) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let step = cloud.points.len().div_ceil(most).max(1);
    let points = cloud.points.iter().step_by(step);
    points
        .map(|(point, normal)| (*point, normal.into_inner()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, Unit};

    /// Points on a cylinder (or, with corners, a prism of four sides) 0.1 m high, 0.06 m wide, with
    /// one lid.
    fn shape(corners: bool) -> Cloud {
        let mut points = Vec::new();
        for k in 0..60 {
            let angle = std::f64::consts::TAU * f64::from(k) / 60.0;
            let (sin, cos) = angle.sin_cos();
            let (out, normal) = if corners {
                let most = sin.abs().max(cos.abs());
                let normal = if cos.abs() >= sin.abs() {
                    Vector3::new(cos.signum(), 0.0, 0.0)
                } else {
                    Vector3::new(0.0, sin.signum(), 0.0)
                };
                (0.03 / most, normal)
            } else {
                (0.03, Vector3::new(cos, sin, 0.0))
            };
            for height in 0..30 {
                let z = f64::from(height) / 300.0;
                let at = Point3::new(out * cos, out * sin, z);
                points.push((at, Unit::new_normalize(normal)));
            }
            for ring in 0..10 {
                let part = f64::from(ring) / 10.0;
                let at = Point3::new(part * out * cos, part * out * sin, 0.1);
                points.push((at, Vector3::z_axis()));
            }
        }
        Cloud {
            name: String::new(),
            points,
        }
    }

    fn error_deg(cloud: &Cloud, turn: Vector3<f64>) -> f64 {
        let truth = Isometry3::from_parts(
            Translation3::new(1.0, -2.0, 0.5),
            UnitQuaternion::new(Vector3::new(0.3, 2.0, -1.0)),
        );
        let off = Isometry3::from_parts(
            Translation3::new(0.001, 0.0, -0.001),
            UnitQuaternion::new(turn),
        );
        error_rad(cloud, &(off * truth), &truth, 0.002).to_degrees()
    }

    #[test]
    fn only_turns_that_can_be_told_are_errors() {
        let (can, prism) = (shape(false), shape(true));
        for turn in [-2.5, -0.7, 0.04, 1.0, 3.1] {
            assert!(error_deg(&can, Vector3::z() * turn) < 0.5, "{turn}");
        }
        let tilt = error_deg(&can, Vector3::x() * 0.05);
        assert!((tilt - 0.05_f64.to_degrees()).abs() < 0.5, "{tilt}");
        let upside_down = error_deg(&can, Vector3::x() * std::f64::consts::PI);
        assert!(upside_down > 170.0, "{upside_down}");
        let quarter = error_deg(&prism, Vector3::z() * std::f64::consts::FRAC_PI_2);
        assert!(quarter < 0.5, "{quarter}");
        for turn in [-0.1, 0.1, 1.67] {
            let error = error_deg(&prism, Vector3::z() * turn);
            assert!(
                (error - 0.1_f64.to_degrees()).abs() < 0.6,
                "{turn}: {error}"
            );
        }
    }
}
