//! The error of a rotation, modulo an object's own symmetries.

use cognitive_map::geometry::se3;
use nalgebra::{Isometry3, Matrix6, Point3, UnitQuaternion, Vector3, Vector6};

use super::cloud::Cloud;

/// Points by which a symmetry is told.
const POINTS: usize = 200;
/// Points among which the nearest is looked for.
const TARGETS: usize = 4096;
/// Steps of refining.
const STEPS: usize = 30;

/// The angle \[rad\] between an estimated pose and the true one, or the true one moved by a symmetry of
/// the object.
///
/// The error D = estimate⁻¹ truth, in the object's frame, is refined to the nearest motion D* that lays
/// the object upon itself. If what is left between the two surfaces is below `tolerance_m`
/// (root mean square), D* is a symmetry, and the error is D without it; otherwise all of D.
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
        }
        // What a scan has once only, a dent or a label's edge, is a tenth of the surface at most.
        squares.sort_by(f64::total_cmp);
        squares.truncate(squares.len() * 9 / 10);
        rms_m = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        let Some(cholesky) = matrix.cholesky() else {
            break;
        };
        let step = cholesky.solve(&right);
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

fn every(cloud: &Cloud, most: usize) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let step = cloud.points.len().div_ceil(most).max(1);
    let points = cloud.points.iter().step_by(step);
    points
        .map(|(point, normal)| (*point, normal.into_inner()))
        .collect()
}
