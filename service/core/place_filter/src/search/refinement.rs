//! A pose that explains best what was sensed, and how much better than anywhere.

use std::f64::consts::TAU;

use geometry::{OUT_OF_PLANE, se3};
use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use super::Seeker;
use super::evidence::{Judged, evidence};
use crate::field::{Field, around, expect};
use crate::follow::point_by_pose;
use crate::tuning::search as tuning;
use crate::window::Node;

/// Information that holds a component \[1/m², 1/rad²\].
const HELD: f64 = 1e12;

/// A pose after refinement.
pub(super) struct Refined {
    /// The body now.
    pub(super) body: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub(super) covariance: Matrix6<f64>,
    /// Log odds of this pose against all others and against a way outside the map \[nats\].
    pub(super) log_odds: f64,
    /// Mean of the squared residuals, in their variances.
    pub(super) misfit: f64,
    /// Length of the latest step.
    pub(super) step: f64,
}

/// Normal equations of the levels at a pose, and what they say.
struct Equations {
    information: Matrix6<f64>,
    gradient: Vector6<f64>,
    /// Part of the information that errors of the slopes make up.
    doubt: Matrix6<f64>,
    /// Of the vertical.
    log_odds: f64,
    misfit: f64,
    levels: Vec<Judged>,
}

/// Refines a pose of the frame of motion by so many steps of Gauss and Newton, and weighs it
/// (Laplace's approximation):
///
/// ```text
/// ln p(levels | map) − ln p(levels | anywhere) ≈ s(x̂) − tilt²/2τ² + ½ ln|2πΣ| + ln p(x)
/// ```
///
/// with the prior p(x) uniform in the box about all places and over headings.
pub(super) fn refine(
    pose: &Isometry3<f64>,
    used: &[&Node],
    seeker: &Seeker<'_>,
    field: &dyn Field,
    rounds: usize,
) -> Option<Refined> {
    let upright = seeker
        .upright
        .iter()
        .min_by(|a, b| tilt(pose, a).norm().total_cmp(&tilt(pose, b).norm()))?;
    let mut body = pose * seeker.in_odom;
    let mut at = equations(&body, used, seeker, upright, field);
    let mut step = Vector6::zeros();
    for _ in 0..rounds {
        let mut damped = at.information;
        for k in 0..6 {
            damped[(k, k)] += if k < 3 { 4.0 } else { 10.0 };
        }
        step = damped.cholesky()?.solve(&at.gradient);
        body = se3::plus(&body, &step);
        at = equations(&body, used, seeker, upright, field);
    }
    let covariance = doubtful(&at).cholesky()?.inverse();
    let extent_m = field.extent_m();
    let (volume, dimensions, held) = if seeker.is_planar {
        (extent_m.x * extent_m.y, 3.0, 3.0 * HELD.ln())
    } else {
        let tilts = TAU * tuning::TILT_SD_RAD.powi(2);
        (extent_m.product() * tilts, 6.0, 0.0)
    };
    let half_log_determinant = 0.5 * (held - at.information.determinant().ln());
    let occam = half_log_determinant + 0.5 * dimensions * TAU.ln() - (volume * TAU).ln();
    let log_odds = at.log_odds + evidence(&at.levels) + occam;
    log_odds.is_finite().then_some(Refined {
        body,
        covariance,
        log_odds,
        misfit: at.misfit,
        step: step.norm(),
    })
}

/// The information without what errors of the slopes make up, along each of its axes in units of
/// metres and radians, and not less than what is known without any level.
fn doubtful(at: &Equations) -> Matrix6<f64> {
    let mut axes = at.information.symmetric_eigen();
    for k in 0..6 {
        let axis = axes.eigenvectors.column(k);
        let made_up = (axis.transpose() * at.doubt * axis)[(0, 0)];
        axes.eigenvalues[k] = (axes.eigenvalues[k] - made_up).max(1e-3);
    }
    axes.recompose()
}

/// Where the vertical of the frame of motion points in the map, beside the vertical.
fn tilt(pose: &Isometry3<f64>, upright: &UnitQuaternion<f64>) -> nalgebra::Vector2<f64> {
    let up = pose.rotation * (upright.inverse() * Vector3::z());
    up.xy()
}

/// The equations at a pose of the body.
fn equations(
    body: &Isometry3<f64>,
    used: &[&Node],
    seeker: &Seeker<'_>,
    upright: &UnitQuaternion<f64>,
    field: &dyn Field,
) -> Equations {
    let to_body = seeker.in_odom.inverse();
    let rotation = *body.rotation.to_rotation_matrix().matrix();
    let mut sums = Equations {
        information: Matrix6::zeros(),
        gradient: Vector6::zeros(),
        doubt: Matrix6::zeros(),
        log_odds: 0.0,
        misfit: 0.0,
        levels: Vec::new(),
    };
    let mut supports = Vec::new();
    let mut parts = 0.0;
    let end_m = used.last().map_or(0.0, |node| node.way_m);
    for (k, node) in used.iter().enumerate() {
        let Some(first) = node.felt.first() else {
            continue;
        };
        let next = used.get(k + 1).or_else(|| used.get(k.wrapping_sub(1)));
        let apart_m = next.map_or(0.0, |next| (next.way_m - node.way_m).abs());
        let drift_m2 = (tuning::DRIFT * (end_m - node.way_m)).powi(2);
        let at = body * to_body * first.at;
        let near = around(field, &at, &node.felt, tuning::SUPPORTS);
        for felt in &node.felt {
            let Some(kernel) = field.kernel(felt.channel) else {
                continue;
            };
            let lever = to_body * felt.at;
            let at = body * lever;
            let Some(expected) = expect(field, &near, felt.channel, &at, &mut supports) else {
                continue;
            };
            let residual = felt.value - expected.mean;
            let drifted = kernel.squared_slope() * drift_m2;
            let left = expected.variance + drifted;
            let variance = kernel.nugget + left;
            sums.levels.push(Judged {
                channel: felt.channel,
                kernel: *kernel,
                at: felt.at,
                value: felt.value - kernel.mean,
                residual,
                left,
            });
            let far = (residual * residual / variance).sqrt();
            let trust = (tuning::HUBER_SD / far).min(1.0);
            let part = (apart_m / (2.0 * tuning::ALIKE * kernel.length_m)).clamp(1e-3, 1.0);
            let by_pose = point_by_pose(&rotation, &lever.coords);
            let row = expected.slope.transpose() * by_pose;
            sums.misfit += part * (residual * residual / variance).min(6.25);
            parts += part;
            let weight = trust / (kernel.nugget + left / part);
            sums.information += row.transpose() * row * weight;
            // A slope that is no larger than its error says nothing: a field that is the same along
            // a line must not tell where along it.
            let unsure = Matrix3::from_diagonal(&expected.slope_variance);
            sums.doubt += by_pose.transpose() * unsure * by_pose * weight;
            sums.gradient += row.transpose() * (residual * weight);
        }
    }
    sums.misfit = if parts > 0.0 {
        sums.misfit / parts
    } else {
        0.0
    };
    // No pose is farther off than this, which keeps the equations solvable.
    for k in 0..6 {
        sums.information[(k, k)] += if k < 3 { 1e-3 } else { 0.1 };
    }
    hold_upright(&mut sums, body, seeker, upright);
    sums
}

/// Adds what is known of the vertical.
fn hold_upright(
    sums: &mut Equations,
    body: &Isometry3<f64>,
    seeker: &Seeker<'_>,
    upright: &UnitQuaternion<f64>,
) {
    if seeker.is_planar {
        for k in OUT_OF_PLANE {
            sums.information.row_mut(k).fill(0.0);
            sums.information.column_mut(k).fill(0.0);
            sums.information[(k, k)] = HELD;
            sums.doubt.row_mut(k).fill(0.0);
            sums.doubt.column_mut(k).fill(0.0);
            sums.gradient[k] = 0.0;
        }
        return;
    }
    let off = tilt(&(body * seeker.in_odom.inverse()), upright);
    let rotation = *body.rotation.to_rotation_matrix().matrix();
    let weight = tuning::TILT_SD_RAD.powi(-2);
    // Turned by δ, the vertical moves by δ × z.
    for (by, axis, sign) in [(off.x, 1, 1.0), (off.y, 0, -1.0)] {
        let mut row = Vector6::zeros();
        row.fixed_rows_mut::<3>(3)
            .copy_from(&(rotation.row(axis).transpose() * sign));
        sums.information += row * row.transpose() * weight;
        sums.gradient -= row * (by * weight);
        sums.log_odds -= 0.5 * by * by * weight;
    }
}
