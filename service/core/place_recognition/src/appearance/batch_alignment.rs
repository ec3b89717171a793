//! Batch alignment: a pose by all queries at once.
//!
//! Consecutive queries have correlated errors: the views about them leave the same part open, and
//! odometry errs in the same way. The correlations follow from the Gaussian process. With queries Y
//! (rows) from points x along the way, views U from points p, and the kernel K between views, k
//! between views and queries, κ between queries:
//!
//! ```text
//! R = Y − kᵀK⁻¹U      C = κ − kᵀK⁻¹k + D      cost = ½ n (ln |C| + tr C⁻¹RRᵀ)
//! ```
//!
//! (Rasmussen & Williams 2006, Eq. 2.24 and 5.8), with effective dimension n. D is the odometry
//! error of the points: |d|²/ℓ² of a random walk back from the newest query. A query is an outlier
//! if its leave-one-out residual (C⁻¹RRᵀC⁻¹)ᵢᵢ / (C⁻¹)ᵢᵢ, 1 on average (Sundararajan & Keerthi
//! 2001), is large: it may be anything. Where all residuals are larger than expected, the
//! covariance grows by the same factor.

use geometry::se3::{plus, twist};
use geometry::{carried_by_pose, symmetric};
use nalgebra::{DMatrix, Isometry3, Matrix6, Point3, Vector6};

use super::descriptor_process::{ReferenceView, ReferenceViews, kernel_matrices, nearest};
use super::view_alignment::{LocalQuery, Prior, ViewAlignment};
use crate::descriptor::cosine;
use crate::tuning::batch as tuning;
use crate::views::Kernel;

/// The queries of a channel, and the views about them.
struct ChannelBatch<'a> {
    kernel: Kernel,
    queries: Vec<LocalQuery<'a>>,
    points: Vec<Point3<f64>>,
    /// K⁻¹.
    inverse: DMatrix<f64>,
    /// `UUᵀ`.
    gram: DMatrix<f64>,
    /// `UYᵀ`.
    cross: DMatrix<f64>,
    /// `YYᵀ`.
    own: DMatrix<f64>,
}

/// All queries, by channel.
pub(crate) struct BatchAlignment<'a> {
    batches: Vec<ChannelBatch<'a>>,
    is_planar: bool,
}

/// Residuals of a channel at a pose.
struct Fit {
    /// K⁻¹k.
    weights: DMatrix<f64>,
    /// `RRᵀ`.
    off: DMatrix<f64>,
    /// C⁻¹.
    precision: DMatrix<f64>,
    cost: f64,
}

/// An aligned pose with its cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BatchPose {
    pub(crate) pose: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub(crate) covariance: Matrix6<f64>,
    /// Negative log likelihood of the queries up to a constant that is common to near poses
    /// \[nats\].
    pub(crate) cost: f64,
    /// Factor of the covariance by which residuals are larger than expected; at least 1.
    pub(crate) inflation: f64,
}

impl<'a> ChannelBatch<'a> {
    /// The queries of a channel and the views about them at a pose; `None` if there are none.
    fn of(
        channel: u8,
        queries: &[LocalQuery<'a>],
        views: &ReferenceViews<'a>,
        pose: &Isometry3<f64>,
    ) -> Option<Self> {
        let queries: Vec<LocalQuery<'a>> = queries
            .iter()
            .filter(|query| query.channel == channel)
            .copied()
            .collect();
        let kernel = queries.first()?.kernel?;
        let way: Vec<Point3<f64>> = queries.iter().map(|query| pose * query.at).collect();
        let distance_squared = |seen: &ReferenceView<'_>| {
            let squared = way.iter().map(|at| (seen.at - at).norm_squared());
            squared.fold(f64::INFINITY, f64::min)
        };
        let views = views
            .iter()
            .filter(|(of, _)| *of == channel)
            .map(|(_, seen)| (distance_squared(seen), seen));
        let near = nearest(views, kernel, tuning::VIEWS_MAX);
        let (inverse, gram) = kernel_matrices(&near, kernel)?;
        let cross = DMatrix::from_fn(near.len(), queries.len(), |row, column| {
            cosine(near[row].vector, queries[column].vector)
        });
        let own = DMatrix::from_fn(queries.len(), queries.len(), |row, column| {
            cosine(queries[row].vector, queries[column].vector)
        });
        Some(Self {
            kernel,
            points: near.iter().map(|seen| seen.at).collect(),
            inverse,
            gram,
            cross,
            own,
            queries,
        })
    }

    /// Residuals at a pose, where each query has an additional variance.
    fn fit(&self, pose: &Isometry3<f64>, outlier: &[f64]) -> Option<Fit> {
        let way: Vec<Point3<f64>> = self.queries.iter().map(|query| pose * query.at).collect();
        let count = way.len();
        let kernel = DMatrix::from_fn(self.points.len(), count, |row, column| {
            self.kernel
                .at((self.points[row] - way[column]).norm_squared())
        });
        let weights = &self.inverse * &kernel;
        let known = kernel.transpose() * &weights;
        let open = DMatrix::from_fn(count, count, |row, column| {
            let between = if row == column {
                1.0 + outlier[row]
            } else {
                self.kernel.at((way[row] - way[column]).norm_squared())
            };
            // Odometry between the newest query and the later one of the two errs for both.
            let drift_m = self.queries[row].drift_m.min(self.queries[column].drift_m);
            between - known[(row, column)] + (drift_m / self.kernel.length_m).powi(2)
        });
        let expected = weights.transpose() * &self.cross;
        let off = &self.own - &expected - expected.transpose()
            + weights.transpose() * (&self.gram * &weights);
        let factor = open.cholesky()?;
        let log_det = 2.0
            * factor
                .l_dirty()
                .diagonal()
                .iter()
                .map(|x| x.ln())
                .sum::<f64>();
        let precision = factor.inverse();
        let cost = 0.5 * self.kernel.numbers * (log_det + precision.dot(&off));
        cost.is_finite().then_some(Fit {
            weights,
            off,
            precision,
            cost,
        })
    }

    /// Gradient and Hessian of the cost (Gauss–Newton, right perturbation).
    fn normal_equations(&self, pose: &Isometry3<f64>, fit: &Fit) -> (Vector6<f64>, Matrix6<f64>) {
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let (views, queries) = (self.points.len(), self.queries.len());
        let length_squared = self.kernel.length_m.powi(2);
        // ∂k/∂(ρ, φ) of each query: columns 6i to 6i + 5.
        let mut slopes = DMatrix::zeros(views, 6 * queries);
        for (number, query) in self.queries.iter().enumerate() {
            let at = pose * query.at;
            let lever = carried_by_pose(&rotation, &query.at.coords);
            for (row, point) in self.points.iter().enumerate() {
                let apart = at - point;
                let slope = -self.kernel.at(apart.norm_squared()) / length_squared;
                let moves = apart.transpose() * lever * slope;
                slopes
                    .fixed_view_mut::<1, 6>(row, 6 * number)
                    .copy_from(&moves);
            }
        }
        let numbers = self.kernel.numbers;
        let log_odds = &self.inverse * (&self.cross - &self.gram * &fit.weights);
        let log_odds = log_odds * &fit.precision;
        let spread = &self.inverse * (&self.gram * (&self.inverse * &slopes));
        let (mut gradient, mut hessian) = (Vector6::zeros(), Matrix6::zeros());
        for one in 0..queries {
            let own = slopes.fixed_columns::<6>(6 * one);
            gradient -= own.transpose() * log_odds.column(one) * numbers;
            let mut shared = spread.fixed_columns::<6>(0) * fit.precision[(one, 0)];
            for other in 1..queries {
                shared += spread.fixed_columns::<6>(6 * other) * fit.precision[(one, other)];
            }
            hessian += own.transpose() * shared * numbers;
        }
        (gradient, symmetric(&hessian))
    }

    /// Additional variance of each query at a pose: that of outliers.
    fn outlier(&self, pose: &Isometry3<f64>) -> Option<Vec<f64>> {
        let count = self.queries.len();
        let mut outlier = vec![0.0; count];
        let mut left = (tuning::STRAY_MAX * count as f64).floor();
        while left >= 1.0 {
            let fit = self.fit(pose, &outlier)?;
            let log_odds = &fit.precision * &fit.off;
            let off = |k: usize| log_odds.row(k).dot(&fit.precision.row(k)) / fit.precision[(k, k)];
            let worst = (0..count).map(|k| (k, off(k)));
            let Some((worst, off)) = worst.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            if off <= tuning::OFF_MAX || outlier[worst] > 0.0 {
                break;
            }
            outlier[worst] = tuning::ANYTHING;
            left -= 1.0;
        }
        Some(outlier)
    }
}

impl<'a, About: Fn(&[Point3<f64>]) -> ReferenceViews<'a>> ViewAlignment<'a, About> {
    /// The batch of all queries, with the views about a pose; `None` if there are none.
    pub(crate) fn whole(&self, pose: &Isometry3<f64>) -> Option<BatchAlignment<'a>> {
        let views = (self.views)(&self.way(pose));
        let mut channels: Vec<u8> = self.queries.iter().map(|each| each.channel).collect();
        channels.sort_unstable();
        channels.dedup();
        let batches: Vec<ChannelBatch<'_>> = channels
            .iter()
            .filter_map(|&channel| ChannelBatch::of(channel, &self.queries, &views, pose))
            .collect();
        (!batches.is_empty()).then_some(BatchAlignment {
            batches,
            is_planar: self.is_planar,
        })
    }
}

impl BatchAlignment<'_> {
    /// Minimises the cost from a pose in so many steps at most.
    pub(crate) fn align(
        &self,
        start: &Isometry3<f64>,
        prior: &Prior,
        steps: usize,
    ) -> Option<BatchPose> {
        let mut pose = *start;
        let outliers = self.outliers(&pose)?;
        let mut fits = self.fits(&pose, &outliers)?;
        for _ in 0..steps {
            let (gradient, hessian) = self.normal_equations(&pose, &fits, prior);
            let mut step = -hessian.cholesky()?.solve(&gradient);
            let mut is_better = false;
            for _ in 0..tuning::HALVED_MAX {
                let there = plus(&pose, &step);
                if let Some(found) = self.fits(&there, &outliers)
                    && cost(&found) < cost(&fits)
                {
                    (pose, fits, is_better) = (there, found, true);
                    break;
                }
                step *= 0.5;
            }
            if !is_better || step.norm() < tuning::AT_REST {
                break;
            }
        }
        self.solution(pose, &fits, prior)
    }

    /// Gradient and Hessian with the prior; out of the plane nothing moves.
    fn normal_equations(
        &self,
        pose: &Isometry3<f64>,
        fits: &[Fit],
        prior: &Prior,
    ) -> (Vector6<f64>, Matrix6<f64>) {
        let off = prior.pose.map(|expected| twist(&expected.inv_mul(pose)));
        let mut gradient = prior.information * off.unwrap_or_default();
        let mut hessian = prior.information;
        for (batch, fit) in self.batches.iter().zip(fits) {
            let (normal_equations, stiff) = batch.normal_equations(pose, fit);
            gradient += normal_equations;
            hessian += stiff;
        }
        if self.is_planar {
            geometry::hold_in_plane(&mut gradient, &mut hessian, |k| prior.open[(k, k)]);
        }
        (gradient, hessian)
    }

    /// The pose with its covariance and cost.
    fn solution(&self, pose: Isometry3<f64>, fits: &[Fit], prior: &Prior) -> Option<BatchPose> {
        let mut hessian = Matrix6::zeros();
        let (mut off, mut count) = (0.0, 0.0);
        for (batch, fit) in self.batches.iter().zip(fits) {
            hessian += batch.normal_equations(&pose, fit).1;
            off += fit.precision.dot(&fit.off);
            count += batch.queries.len() as f64;
        }
        let inflation = (off / count).max(1.0);
        let mut covariance = (hessian / inflation + prior.open).try_inverse()?;
        if self.is_planar {
            geometry::clear_out_of_plane(&mut covariance);
        }
        let is_sound = pose.translation.vector.iter().all(|x| x.is_finite());
        is_sound.then_some(BatchPose {
            pose,
            covariance: symmetric(&covariance),
            cost: cost(fits),
            inflation,
        })
    }

    fn outliers(&self, pose: &Isometry3<f64>) -> Option<Vec<Vec<f64>>> {
        self.batches
            .iter()
            .map(|batch| batch.outlier(pose))
            .collect()
    }

    fn fits(&self, pose: &Isometry3<f64>, outliers: &[Vec<f64>]) -> Option<Vec<Fit>> {
        let batches = self.batches.iter().zip(outliers);
        batches
            .map(|(batch, outlier)| batch.fit(pose, outlier))
            .collect()
    }
}

fn cost(fits: &[Fit]) -> f64 {
    fits.iter().map(|fit| fit.cost).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const NUMBERS: usize = 64;
    const KERNEL: Kernel = Kernel {
        cosine: 0.99,
        length_m: 1.0,
        numbers: 64.0,
    };

    /// Numbers that look random, in [−1, 1].
    fn hash(k: usize) -> f64 {
        2.0 * (((k as f64 + 1.0) * 12.9898).sin() * 43_758.545_3)
            .fract()
            .abs()
            - 1.0
    }

    /// A view of a smooth scenery, of length 1: waves of about the kernel's length.
    fn view(at: &Point3<f64>) -> Vec<f32> {
        let wave = |k: usize, axis: usize| hash(3 * k + axis) * 3.0_f64.sqrt();
        let number = |k: usize| {
            let along = wave(k, 0) * at.x + wave(k, 1) * at.y + wave(k, 2) * at.z;
            (along + std::f64::consts::PI * hash(1000 + k)).cos()
        };
        let numbers: Vec<f64> = (0..NUMBERS).map(number).collect();
        let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a view needs no more digits"
        )]
        let short = |x: &f64| (x / length) as f32;
        numbers.iter().map(short).collect()
    }

    /// A way that bends, about the frame of the body.
    fn way() -> Vec<Point3<f64>> {
        let point = |k: u32| {
            let angle_rad = 0.15 * f64::from(k);
            Point3::new(angle_rad.sin(), 1.0 - angle_rad.cos(), 0.3 * angle_rad)
        };
        (0..14).map(point).collect()
    }

    fn truth() -> Isometry3<f64> {
        Isometry3::new(Vector3::new(0.4, -0.3, 0.1), Vector3::new(0.2, -0.4, 0.7))
    }

    /// Aligns the way from beside the truth; some of its queries show something else.
    fn aligned(outliers: &[usize]) -> BatchPose {
        let points: Vec<Point3<f64>> = (0..120)
            .map(|k| Point3::from(Vector3::from_fn(|axis, _| 1.8 * hash(5000 + 3 * k + axis))))
            .collect();
        let vectors: Vec<Vec<f32>> = points.iter().map(view).collect();
        let queries: Vec<Vec<f32>> = way()
            .iter()
            .enumerate()
            .map(|(k, at)| {
                let elsewhere = Point3::new(40.0 + 7.0 * k as f64, 90.0, 3.0);
                let is_outlier = outliers.contains(&k);
                view(&if is_outlier { elsewhere } else { truth() * at })
            })
            .collect();
        let queries = way()
            .into_iter()
            .zip(&queries)
            .map(|(at, vector)| LocalQuery {
                at,
                drift_m: 0.0,
                channel: 0,
                kernel: Some(KERNEL),
                vector,
            });
        let alignment = ViewAlignment {
            queries: queries.collect(),
            views: |_: &[Point3<f64>]| {
                let seen = points.iter().zip(&vectors);
                seen.map(|(&at, vector)| (0, ReferenceView { at, vector }))
                    .collect()
            },
            is_planar: false,
        };
        let open = Matrix6::identity() * 0.01;
        let prior = Prior {
            pose: None,
            information: open,
            open,
        };
        let beside = Isometry3::new(Vector3::new(0.1, -0.05, 0.08), Vector3::new(0.1, 0.0, 0.15));
        let start = truth() * beside;
        alignment
            .whole(&start)
            .unwrap()
            .align(&start, &prior, 12)
            .unwrap()
    }

    #[test]
    fn a_way_comes_to_rest_where_it_was_gone() {
        let aligned = aligned(&[]);
        let off = twist(&truth().inv_mul(&aligned.pose));
        assert!(off.rows(0, 3).norm() < 0.03, "{off}");
        assert!(off.rows(3, 3).norm() < 0.1, "{off}");
        let squared = off.dot(&(aligned.covariance.try_inverse().unwrap() * off));
        assert!(squared < 33.0, "{squared}");
    }

    #[test]
    fn views_of_something_else_move_it_by_little() {
        let (clean, with_outliers) = (aligned(&[]), aligned(&[3, 9]));
        let off = twist(&clean.pose.inv_mul(&with_outliers.pose));
        assert!(off.norm() < 0.05, "{off}");
        assert!(with_outliers.inflation < 1.5, "{}", with_outliers.inflation);
        assert!(with_outliers.covariance.trace() > clean.covariance.trace());
    }
}
