//! A pose that explains best what was sensed, and how much better than anywhere.

use std::f64::consts::TAU;

use geometry::{OUT_OF_PLANE, se3};
use nalgebra::{
    DMatrix, Isometry3, Matrix6, SMatrix, SVector, UnitQuaternion, Vector2, Vector3, Vector6,
};

use super::Seeker;
use super::channel_of_way::{ChannelOfWay, channels, density, symmetric};
use crate::field::Field;
use crate::linear::{LANES, factor_upper, solve_upper};
use crate::tuning::search as tuning;
use crate::window::Node;

/// Information that holds a component \[1/m², 1/rad²\].
const HELD: f64 = 1e12;
/// Where the residual stands in the row of a level, after the Jacobian.
const RESIDUAL: usize = 9;

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
        let to_body = self.seeker.in_odom.inverse();
        let to_axes = (refined.pose * self.seeker.in_odom).rotation.inverse();
        for channel in &self.channels {
            let expected = channel.expect(&refined.pose, &refined.drift);
            let covariance = symmetric(&expected.covariance, channel.felt().len());
            let inverse = covariance.cholesky()?.inverse();
            for (axis, errors) in channel.made_up_slopes(&refined.pose)?.iter().enumerate() {
                let weights = inverse.component_mul(errors);
                let slope = to_axes * Vector3::ith(axis, 1.0);
                let felt = channel.felt().iter();
                let rows: Vec<_> = felt
                    .map(|felt| point_by_body(&slope, &(to_body * felt.at).coords).transpose())
                    .collect();
                let rows = DMatrix::from_fn(rows.len(), 6, |k, by| rows[k][by]);
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
            self.add(channel, (body, &pose, drift), &mut sums)?;
            count += channel.felt().len() as f64;
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

    /// Adds what a channel says.
    fn add(
        &self,
        channel: &ChannelOfWay,
        (body, pose, drift): (&Isometry3<f64>, &Isometry3<f64>, &Vector3<f64>),
        sums: &mut Equations,
    ) -> Option<()> {
        let expected = channel.expect(pose, drift);
        let (to_body, to_axes) = (self.seeker.in_odom.inverse(), body.rotation.inverse());
        // Of each level its Jacobian, and its residual.
        let mut rows = [[0.0; LANES]; LANES];
        for (k, (row, felt)) in rows.iter_mut().zip(channel.felt()).enumerate() {
            let slope = Vector3::from(expected.slopes.map(|axis| axis[k]));
            let by_body = point_by_body(&(to_axes * slope), &(to_body * felt.at).coords);
            row[..6].copy_from_slice(by_body.as_slice());
            row[6..9].copy_from_slice((slope * felt.drift_m).as_slice());
            row[RESIDUAL] = expected.residuals[k];
        }
        let rows = &mut rows[..channel.felt().len()];
        let mut factor = expected.covariance;
        let mut inverse = [0.0; LANES];
        let mut products = [[0.0; LANES]; RESIDUAL + 1];
        let is_definite = simd::dispatch(
            #[inline(always)]
            || {
                let is_definite = factor_upper(&mut factor, &mut inverse, rows.len());
                solve_upper(&factor, &inverse, rows);
                for row in rows.iter() {
                    let weight = (tuning::HUBER_SD / row[RESIDUAL].abs()).min(1.0);
                    for (products, factor) in products.iter_mut().zip(row) {
                        for lane in 0..LANES {
                            products[lane] += factor * weight * row[lane];
                        }
                    }
                }
                is_definite
            },
        );
        if !is_definite {
            return None;
        }
        // Rounded differently on both sides of its diagonal, the products are not quite symmetric.
        sums.information += Matrix9::from_fn(|a, b| products[a.min(b)][a.max(b)]);
        sums.gradient += Vector9::from_fn(|k, _| products[RESIDUAL][k]);
        let residuals = || rows.iter().map(|row| &row[RESIDUAL]);
        let squared = residuals().map(|residual| (residual * residual).min(6.25));
        sums.misfit += squared.sum::<f64>();
        let log_root: f64 = (0..rows.len()).map(|k| factor[k][k].ln()).sum();
        let odds = density(residuals()) - log_root - channel.anywhere();
        sums.log_odds += ((1.0 - tuning::LIES) * odds.exp() + tuning::LIES).ln();
        Some(())
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

/// Change of a level with the error on the right of the pose of the body, by its slope and where it
/// was sensed \[m\], both in axes of the body.
fn point_by_body(slope: &Vector3<f64>, lever: &Vector3<f64>) -> Vector6<f64> {
    let turned = lever.cross(slope);
    Vector6::new(slope.x, slope.y, slope.z, turned.x, turned.y, turned.z)
}
