//! A pose that explains best what was sensed, and how much better than anywhere.

use std::f64::consts::TAU;

use geometry::{OUT_OF_PLANE, se3};
use nalgebra::{
    DMatrix, Isometry3, Matrix3, Matrix6, Point3, SMatrix, SVector, UnitQuaternion, Vector2,
    Vector3, Vector6,
};

use super::Seeker;
use super::channel_of_way::{ChannelOfWay, channels, density};
use crate::field::Field;
use crate::follow::point_by_pose;
use crate::tuning::search as tuning;
use crate::window::Node;

/// Information that holds a component \[1/m², 1/rad²\].
const HELD: f64 = 1e12;

/// Components of the error of the body, then of what odometry was off by.
type Vector9 = SVector<f64, 9>;
type Matrix9 = SMatrix<f64, 9, 9>;

/// A pose of the frame of motion after refinement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined {
    pub(super) pose: Isometry3<f64>,
    /// What odometry was off by, in its deviations.
    drift: Vector3<f64>,
    information: Matrix9,
    /// Log odds of this pose against all others and against a way outside the map \[nats\].
    pub(super) log_odds: f64,
    /// Mean of the squared residuals, in their variances.
    pub(super) misfit: f64,
    /// Length of the latest step.
    pub(super) step: f64,
}

/// Normal equations of the levels at a pose, and what they say.
struct Equations {
    information: Matrix9,
    gradient: Vector9,
    log_odds: f64,
    misfit: f64,
}

/// The levels of a way and the places about one pose of it.
pub(super) struct Way<'a> {
    channels: Vec<ChannelOfWay>,
    seeker: &'a Seeker<'a>,
    upright: &'a UnitQuaternion<f64>,
    /// Variance of the vertical about each axis \[rad²\].
    tilt_variance: f64,
    extent_m: Vector3<f64>,
}

impl<'a> Way<'a> {
    /// The nodes `used`, with at most so many places about them if the frame of motion lies at
    /// `pose`.
    pub(super) fn new(
        pose: &Isometry3<f64>,
        used: &[&Node],
        seeker: &'a Seeker<'a>,
        field: &dyn Field,
        most: usize,
    ) -> Option<Self> {
        let upright = seeker
            .upright
            .iter()
            .min_by(|a, b| tilt(pose, a).norm().total_cmp(&tilt(pose, b).norm()))?;
        Some(Self {
            channels: channels(pose, used, field, most),
            seeker,
            upright,
            tilt_variance: tilt_variance(
                seeker.upright_sd_rad,
                used.last().map_or(0.0, |node| node.way_m),
            ),
            extent_m: field.extent_m(),
        })
    }

    /// Refines a pose of the frame of motion by so many steps of Gauss and Newton, and weighs it
    /// (Laplace's approximation):
    ///
    /// ```text
    /// ln p(levels | map) − ln p(levels | anywhere)
    ///     ≈ s(x̂) − tilt²/2τ² − u²/2 + ½ ln|2πΣ| + ln p(x)
    /// s = Σ ln((1 − ε) N(r; 0, C) / N(v; 0, K) + ε)
    /// ```
    ///
    /// with the prior p(x) uniform in the box about all places and over headings, and s summed over
    /// channels, with residuals r, levels v, and K of the channel's kernel. A sensor that lies says
    /// ln ε at worst. Odometry is off by u, which is refined with the pose.
    pub(super) fn refine(&self, pose: &Isometry3<f64>, rounds: usize) -> Option<Refined> {
        let mut body = pose * self.seeker.in_odom;
        let mut drift = Vector3::zeros();
        let mut at = self.equations(&body, &drift)?;
        let mut step = Vector6::zeros();
        for _ in 0..rounds {
            let mut damped = at.information;
            for k in 0..6 {
                damped[(k, k)] += if k < 3 { 4.0 } else { 10.0 };
            }
            let mut all = damped.cholesky()?.solve(&at.gradient);
            let far = all.fixed_rows::<3>(0).norm() / tuning::STEP_MAX_M;
            all /= far.max(1.0);
            step = all.fixed_rows::<6>(0).into_owned();
            body = se3::plus(&body, &step);
            drift += all.fixed_rows::<3>(6);
            at = self.equations(&body, &drift)?;
        }
        let (volume, dimensions, held) = if self.seeker.is_planar {
            (self.extent_m.x * self.extent_m.y, 3.0, 3.0 * HELD.ln())
        } else {
            let tilts = TAU * self.tilt_variance;
            (self.extent_m.product() * tilts, 6.0, 0.0)
        };
        let half_log_determinant = 0.5 * (held - at.information.determinant().ln());
        let occam = half_log_determinant + 0.5 * dimensions * TAU.ln() - (volume * TAU).ln();
        let log_odds = at.log_odds + occam.min(0.0);
        log_odds.is_finite().then(|| Refined {
            pose: body * self.seeker.in_odom.inverse(),
            drift,
            information: at.information,
            log_odds,
            misfit: at.misfit,
            step: step.norm(),
        })
    }

    /// Covariance of the error on the right of the body at a refined pose.
    ///
    /// The information counts without what errors of the slopes make up, along each of its axes in
    /// units of metres and radians, and not less than what is known without any level: a field that
    /// is the same along a line must not tell where along it.
    pub(super) fn covariance(&self, refined: &Refined) -> Option<Matrix6<f64>> {
        let doubt = self.doubt(refined)?;
        let all = refined.information.cholesky()?.inverse();
        let information = all
            .fixed_view::<6, 6>(0, 0)
            .into_owned()
            .cholesky()?
            .inverse();
        let mut axes = information.symmetric_eigen();
        for k in 0..6 {
            let axis = axes.eigenvectors.column(k);
            let made_up = (axis.transpose() * doubt * axis)[(0, 0)];
            axes.eigenvalues[k] = (axes.eigenvalues[k] - made_up).max(1e-3);
        }
        Some(axes.recompose().cholesky()?.inverse())
    }

    /// Part of the information that errors of the slopes make up.
    fn doubt(&self, refined: &Refined) -> Option<Matrix6<f64>> {
        let mut doubt = Matrix6::zeros();
        let body = refined.pose * self.seeker.in_odom;
        for channel in &self.channels {
            let by_pose = self.by_pose(&body, channel);
            let expected = channel.expect(&refined.pose, &refined.drift);
            let inverse = expected.covariance.cholesky()?.inverse();
            for (axis, errors) in channel.made_up_slopes(&refined.pose)?.iter().enumerate() {
                let weights = inverse.component_mul(errors);
                let rows = DMatrix::from_fn(by_pose.len(), 6, |k, by| by_pose[k][(axis, by)]);
                let made_up = rows.transpose() * weights * rows;
                doubt += made_up.fixed_view::<6, 6>(0, 0) * tuning::DOUBT;
            }
        }
        if self.seeker.is_planar {
            for k in OUT_OF_PLANE {
                doubt.row_mut(k).fill(0.0);
                doubt.column_mut(k).fill(0.0);
            }
        }
        Some(doubt)
    }

    /// How the points at which a channel was sensed move with the error of the body and with what
    /// odometry was off by.
    fn by_pose(&self, body: &Isometry3<f64>, channel: &ChannelOfWay) -> Vec<SMatrix<f64, 3, 9>> {
        let to_body = self.seeker.in_odom.inverse();
        let rotation = body.rotation.to_rotation_matrix();
        let by_pose = |(at, drift_m): (&Point3<f64>, f64)| {
            let mut by_pose = SMatrix::<f64, 3, 9>::zeros();
            let of_body = point_by_pose(rotation.matrix(), &(to_body * at).coords);
            by_pose.fixed_view_mut::<3, 6>(0, 0).copy_from(&of_body);
            let of_drift = Matrix3::from_diagonal_element(drift_m);
            by_pose.fixed_view_mut::<3, 3>(0, 6).copy_from(&of_drift);
            by_pose
        };
        channel.points().map(by_pose).collect()
    }

    /// The equations at a pose of the body.
    fn equations(&self, body: &Isometry3<f64>, drift: &Vector3<f64>) -> Option<Equations> {
        let pose = body * self.seeker.in_odom.inverse();
        let mut sums = Equations {
            information: Matrix9::zeros(),
            gradient: Vector9::zeros(),
            log_odds: 0.0,
            misfit: 0.0,
        };
        if self.channels.is_empty() {
            return None;
        }
        let mut count = 0.0;
        for channel in &self.channels {
            let expected = channel.expect(&pose, drift);
            let by_pose = self.by_pose(body, channel);
            let mut jacobian = DMatrix::zeros(by_pose.len(), 9);
            for (k, (slope, by_pose)) in expected.slopes.iter().zip(&by_pose).enumerate() {
                jacobian
                    .fixed_view_mut::<1, 9>(k, 0)
                    .copy_from(&(slope.transpose() * by_pose));
            }
            let factor = expected.covariance.cholesky()?.unpack();
            let independent = factor.solve_lower_triangular(&expected.residuals)?;
            let rows = factor.solve_lower_triangular(&jacobian)?;
            for (residual, row) in independent.iter().zip(rows.row_iter()) {
                let weight = (tuning::HUBER_SD / residual.abs()).min(1.0);
                let row = row.fixed_columns::<9>(0);
                sums.information += row.transpose() * row * weight;
                sums.gradient += row.transpose() * (residual * weight);
                sums.misfit += (residual * residual).min(6.25);
                count += 1.0;
            }
            let log_root: f64 = factor.diagonal().iter().map(|entry| entry.ln()).sum();
            let odds = density(&independent) - log_root - channel.anywhere();
            sums.log_odds += ((1.0 - tuning::LIES) * odds.exp() + tuning::LIES).ln();
        }
        sums.misfit /= f64::max(count, 1.0);
        // No pose is farther off than this, which keeps the equations solvable.
        for k in 0..6 {
            sums.information[(k, k)] += if k < 3 { 1e-3 } else { 0.1 };
        }
        for k in 0..3 {
            sums.information[(6 + k, 6 + k)] += 1.0;
            sums.gradient[6 + k] -= drift[k];
        }
        sums.log_odds -= 0.5 * drift.norm_squared();
        self.hold_upright(&mut sums, body);
        Some(sums)
    }

    /// Adds what is known of the vertical.
    fn hold_upright(&self, sums: &mut Equations, body: &Isometry3<f64>) {
        if self.seeker.is_planar {
            for k in OUT_OF_PLANE {
                sums.information.row_mut(k).fill(0.0);
                sums.information.column_mut(k).fill(0.0);
                sums.information[(k, k)] = HELD;
                sums.gradient[k] = 0.0;
            }
            return;
        }
        let off = tilt(&(body * self.seeker.in_odom.inverse()), self.upright);
        let rotation = *body.rotation.to_rotation_matrix().matrix();
        let weight = self.tilt_variance.recip();
        // Turned by δ, the vertical moves by δ × z.
        for (by, axis, sign) in [(off.x, 1, 1.0), (off.y, 0, -1.0)] {
            let mut row = Vector9::zeros();
            row.fixed_rows_mut::<3>(3)
                .copy_from(&(rotation.row(axis).transpose() * sign));
            sums.information += row * row.transpose() * weight;
            sums.gradient -= row * (by * weight);
            sums.log_odds -= 0.5 * by * by * weight;
        }
    }
}

/// Variance of the vertical about each axis after a way \[rad²\]: gyroscopes drift.
fn tilt_variance(sd_rad: f64, way_m: f64) -> f64 {
    let grown = sd_rad.powi(2) + tuning::TILT_PER_M * way_m;
    grown.min(tuning::TILT_SD_MAX_RAD.powi(2))
}

/// Where the vertical of the frame of motion points in the map, beside the vertical.
fn tilt(pose: &Isometry3<f64>, upright: &UnitQuaternion<f64>) -> Vector2<f64> {
    let up = pose.rotation * (upright.inverse() * Vector3::z());
    up.xy()
}
