//! View alignment: the pose that explains queries along a way best, by the views about it.
//!
//! A query with residual q where the variance is e has, against a place that nobody has seen, the
//! log odds
//!
//! ```text
//! s = ln((1 − ε) exp(min(½ n τ (1 − q − ln e), G)) + ε)      where something is known, else 0
//! ```
//!
//! with effective dimension n, of which the part τ counts, since queries within the kernel's length
//! have correlated errors. ε is the probability of an outlier, and G bounds the evidence of one
//! query. Where the map is thin the log odds are 0, so a pose does not gain by how well its
//! surroundings are known.

use geometry::se3::{plus, twist};
use geometry::{carried_by_pose, symmetric};
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

use super::descriptor_process::{DescriptorProcess, ReferenceView, ReferenceViews};
use crate::tuning::{alignment as tuning, ranges};
use crate::views::Kernel;

/// A query along a way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalQuery<'a> {
    /// Position in the frame of the body whose pose is sought.
    pub(crate) at: Point3<f64>,
    /// Standard deviation of the position \[m\].
    pub(crate) drift_m: f64,
    pub(crate) channel: u8,
    pub(crate) kernel: Option<Kernel>,
    pub(crate) vector: &'a [f32],
}

/// The queries along a way, and how to find the views about them.
pub(crate) struct ViewAlignment<'a, About> {
    pub(crate) queries: Vec<LocalQuery<'a>>,
    pub(crate) views: About,
    pub(crate) is_planar: bool,
}

/// What is known of a pose besides the views.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prior {
    /// The expected pose, if any.
    pub(crate) pose: Option<Isometry3<f64>>,
    /// Information about the error on its right \[m⁻², rad⁻²\].
    pub(crate) information: Matrix6<f64>,
    /// Information of an unknown pose. The covariance of an aligned pose counts this and the views
    /// only.
    pub(crate) open: Matrix6<f64>,
}

impl Prior {
    /// Inverse variances of a pose, the same for all shifts \[m⁻²\] and for all turns \[rad⁻²\].
    pub(crate) fn diagonal(shift: f64, turn: f64) -> Vector6<f64> {
        Vector6::new(shift, shift, shift, turn, turn, turn)
    }

    /// Inverse variances of a pose by its standard deviations \[m, rad\].
    pub(crate) fn inverse_variances([shift, turn]: [f64; 2]) -> Vector6<f64> {
        let inverse = |sd: f64| 1.0 / (sd * sd).max(1e-12);
        Self::diagonal(inverse(shift), inverse(turn))
    }

    /// Information of an unknown pose within some distances of this length \[m\].
    pub(crate) fn unknown(distance_m: f64) -> Matrix6<f64> {
        let shift = 1.0 / (ranges::OPEN_DISTANCES * distance_m).powi(2);
        let turn = 1.0 / ranges::OPEN_RAD.powi(2);
        Matrix6::from_diagonal(&Self::diagonal(shift, turn))
    }
}

/// An aligned pose.
#[derive(Clone, Debug)]
pub(crate) struct AlignedPose {
    pub(crate) pose: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub(crate) covariance: Matrix6<f64>,
    pub(crate) evidence: Evidence,
}

/// Log odds of each query at a pose; `None` where nothing is known.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    pub(crate) queries: Vec<Option<f64>>,
}

impl LocalQuery<'_> {
    /// Effective dimension of the query beside others at this distance.
    pub(crate) fn numbers(&self, spacing_m: f64) -> f64 {
        self.kernel.map_or(0.0, |kernel| {
            kernel.numbers * (0.5 * spacing_m / kernel.length_m).min(tuning::COUNTED_MAX)
        })
    }
}

impl<'a, About: Fn(&[Point3<f64>]) -> ReferenceViews<'a>> ViewAlignment<'a, About> {
    /// Positions of the queries for a pose of the body.
    pub(super) fn way(&self, pose: &Isometry3<f64>) -> Vec<Point3<f64>> {
        self.queries.iter().map(|each| pose * each.at).collect()
    }

    /// The process about each query at a pose.
    fn about(&self, pose: &Isometry3<f64>) -> Vec<Option<DescriptorProcess>> {
        let way = self.way(pose);
        let views = (self.views)(&way);
        let each = way.iter().zip(&self.queries);
        each.map(|(at, query)| {
            let of_channel = |(channel, seen): &(u8, ReferenceView<'a>)| {
                (*channel == query.channel).then_some(*seen)
            };
            let views: Vec<ReferenceView<'_>> = views.iter().filter_map(of_channel).collect();
            DescriptorProcess::of(query.vector, at, &views, query.kernel?)
        })
        .collect()
    }

    /// Mean distance between consecutive queries \[m\].
    fn spacing_m(&self) -> f64 {
        let ways = self
            .queries
            .windows(2)
            .map(|pair| (pair[1].at - pair[0].at).norm());
        ways.sum::<f64>() / (self.queries.len().max(2) - 1) as f64
    }

    /// Aligns from a pose (Gauss–Newton).
    pub(crate) fn align(&self, start: &Isometry3<f64>, prior: &Prior) -> Option<AlignedPose> {
        let mut pose = *start;
        let mut about = self.about(&pose);
        for _ in 0..tuning::ROUNDS.0 {
            let begun = pose;
            for _ in 0..tuning::ROUNDS.1 {
                let (gradient, hessian) = self.normal_equations(&pose, &about, prior);
                let Some(factor) = hessian.cholesky() else {
                    break;
                };
                pose = plus(&pose, &-factor.solve(&gradient));
            }
            if twist(&begun.inv_mul(&pose)).norm() < tuning::AT_REST {
                break;
            }
            about = self.about(&pose);
        }
        let (_, hessian) = self.normal_equations(&pose, &about, prior);
        let mut covariance = (hessian - prior.information + prior.open).try_inverse()?;
        if self.is_planar {
            geometry::clear_out_of_plane(&mut covariance);
        }
        let is_sound = pose.translation.vector.iter().all(|x| x.is_finite());
        is_sound.then(|| AlignedPose {
            pose,
            covariance: symmetric(&covariance),
            evidence: self.evidence(&pose, &about),
        })
    }

    /// Gradient and Hessian of the cost (right perturbation).
    fn normal_equations(
        &self,
        pose: &Isometry3<f64>,
        about: &[Option<DescriptorProcess>],
        prior: &Prior,
    ) -> (Vector6<f64>, Matrix6<f64>) {
        let spacing_m = self.spacing_m();
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let off = prior.pose.map(|expected| twist(&expected.inv_mul(pose)));
        let mut gradient = prior.information * off.unwrap_or_default();
        let mut hessian = Matrix6::zeros();
        for (query, near) in self.queries.iter().zip(about) {
            let at = pose * query.at;
            let Some(near) = near else { continue };
            let Some(expected) = near.expect(&at, query.drift_m) else {
                continue;
            };
            let weight = query.numbers(spacing_m) / (1.0 + (expected.off / tuning::SOFT).powi(2));
            let lever = carried_by_pose(&rotation, &query.at.coords);
            gradient += lever.transpose() * expected.gradient * weight;
            hessian += lever.transpose() * expected.hessian * lever * weight;
        }
        if self.is_planar {
            geometry::hold_in_plane(&mut gradient, &mut hessian, |_| 0.0);
        }
        (gradient, hessian + prior.information)
    }

    fn evidence(&self, pose: &Isometry3<f64>, about: &[Option<DescriptorProcess>]) -> Evidence {
        let spacing_m = self.spacing_m();
        let say = |(query, near): (&LocalQuery<'_>, &Option<DescriptorProcess>)| {
            let expected = near.as_ref()?.expect(&(pose * query.at), query.drift_m)?;
            Some(log_odds(
                query.numbers(spacing_m),
                expected.open,
                expected.off,
            ))
        };
        Evidence {
            queries: self.queries.iter().zip(about).map(say).collect(),
        }
    }
}

/// Log odds of a query at a point against a place that nobody has seen \[nats\], by its effective
/// dimension, the variance, and the squared residual.
pub(crate) fn log_odds(numbers: f64, open: f64, off: f64) -> f64 {
    let evidence = 0.5 * numbers * (1.0 - off - open.ln());
    ((1.0 - tuning::WRONG) * evidence.min(tuning::EVIDENCE_MAX).exp() + tuning::WRONG).ln()
}

impl Evidence {
    /// Log odds of the pose against a place that nobody has seen \[nats\].
    pub(crate) fn total(&self) -> f64 {
        self.queries.iter().flatten().sum()
    }

    /// Log odds against another pose. A query that can be judged at one of the two only counts
    /// little: a room that looks the same may be known less well.
    pub(crate) fn against(&self, other: &Self) -> f64 {
        let say = |(own, other): (&Option<f64>, &Option<f64>)| match (own, other) {
            (Some(own), Some(other)) => own - other,
            (Some(own), None) => own.min(tuning::OPEN),
            (None, Some(other)) => -other.min(tuning::OPEN),
            (None, None) => 0.0,
        };
        self.queries.iter().zip(&other.queries).map(say).sum()
    }
}

/// Aligned poses with their covariances and weights.
pub(crate) fn weighted(poses: &[(AlignedPose, f64)]) -> Vec<(Isometry3<f64>, Matrix6<f64>, f64)> {
    let each = poses.iter();
    each.map(|(aligned, weight)| (aligned.pose, aligned.covariance, *weight))
        .collect()
}

/// Mean and covariance of a mixture of poses with covariances and weights.
pub(crate) fn mixture(
    poses: &[(Isometry3<f64>, Matrix6<f64>, f64)],
) -> (Isometry3<f64>, Matrix6<f64>) {
    let base = poses[0].0;
    let whole: f64 = poses.iter().map(|(.., weight)| weight).sum();
    let (mut mean, mut second) = (Vector6::zeros(), Matrix6::zeros());
    for (pose, covariance, weight) in poses {
        let off = twist(&base.inv_mul(pose));
        mean += off * (*weight / whole);
        second += (covariance + off * off.transpose()) * (*weight / whole);
    }
    let covariance = second - mean * mean.transpose();
    (plus(&base, &mean), symmetric(&covariance))
}
