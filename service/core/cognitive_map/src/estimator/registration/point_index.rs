//! Index of a frame's landmarks by position.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::{GATE, UncertainPoint};

/// The landmarks of the older frame in the order of x, with how densely they lie.
#[derive(Clone, Debug)]
pub(in super::super) struct PointIndex<'a> {
    points: &'a [UncertainPoint],
    /// Numbers in the order of x.
    order: Vec<usize>,
    /// The largest variance of one \[m²\].
    variance_max: f64,
    /// In a plane or in space \[1/m², 1/m³\].
    density: f64,
    is_planar: bool,
}

/// Landmarks of the older and of the newer frame that coincide under a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Correspondence {
    pub(super) older: usize,
    pub(super) newer: usize,
    /// Their distance \[m\].
    pub(super) distance_m: f64,
    /// Variance of that along an axis \[m²\].
    pub(super) variance: f64,
    /// Its square over the variance.
    pub(super) square: f64,
}

impl Correspondence {
    /// Whether one of the landmarks is in both pairs.
    fn shares_with(&self, other: &Self) -> bool {
        self.older == other.older || self.newer == other.newer
    }
}

impl<'a> PointIndex<'a> {
    pub(in super::super) fn new(points: &'a [UncertainPoint], is_planar: bool) -> Self {
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|&a, &b| points[a].position.x.total_cmp(&points[b].position.x));
        let variances = points.iter().map(|point| point.variance);
        Self {
            points,
            order,
            variance_max: variances.fold(0.0, f64::max),
            density: density(points, is_planar),
            is_planar,
        }
    }

    /// The landmarks that a motion lays over some of these, the nearest first; where landmarks lie
    /// close to one another, more than one. `spread` is the variance that the motion's own error
    /// adds at a point \[m²\].
    pub(super) fn pairs(
        &self,
        pose: &Isometry3<f64>,
        newer: &[UncertainPoint],
        spread: &dyn Fn(&Point3<f64>) -> f64,
        correspondences: &mut Vec<Correspondence>,
    ) {
        correspondences.clear();
        for (number, point) in newer.iter().enumerate() {
            let here = pose * point.position;
            let own = point.variance + spread(&here);
            let reach = GATE * (own + self.variance_max).sqrt();
            let x_of = |at: &usize| self.points[*at].position.x;
            let first = self.order.partition_point(|at| x_of(at) < here.x - reach);
            let near = self.order[first..].iter();
            for &older in near.take_while(|at| x_of(at) <= here.x + reach) {
                let other = &self.points[older];
                let squared = (other.position - here).norm_squared();
                let variance = own + other.variance;
                if squared <= GATE * GATE * variance {
                    correspondences.push(Correspondence {
                        older,
                        newer: number,
                        distance_m: squared.sqrt(),
                        variance,
                        square: squared / variance,
                    });
                }
            }
        }
        correspondences.sort_by(|a, b| {
            let order = a.square.total_cmp(&b.square);
            order.then((a.newer, a.older).cmp(&(b.newer, b.older)))
        });
    }

    /// Radius of the area or volume in which there is one of these on the average \[m\].
    pub(super) fn spacing_m(&self) -> f64 {
        if self.is_planar {
            (self.density * std::f64::consts::PI).recip().sqrt()
        } else {
            (self.density * 4.0 / 3.0 * std::f64::consts::PI)
                .recip()
                .cbrt()
        }
    }

    /// Probability that something that lies anywhere among these is within a distance of one of
    /// them.
    pub(in super::super) fn chance_within(&self, distance_m: f64) -> f64 {
        let within = if self.is_planar {
            std::f64::consts::PI * distance_m.powi(2)
        } else {
            4.0 / 3.0 * std::f64::consts::PI * distance_m.powi(3)
        };
        (self.density * within).min(1.0)
    }
}

/// Leaves the nearest pairs, each landmark in one.
pub(super) fn one_to_one(correspondences: &mut Vec<Correspondence>) {
    let mut taken = 0;
    for at in 0..correspondences.len() {
        let correspondence = correspondences[at];
        if !correspondences[..taken]
            .iter()
            .any(|other| other.shares_with(&correspondence))
        {
            correspondences[taken] = correspondence;
            taken += 1;
        }
    }
    correspondences.truncate(taken);
}

/// How many landmarks there are by area or volume, that of the ellipse or ellipsoid with their
/// spread: 4π √det Σ, (4/3)π 5^{3/2} √det Σ. What is known of each is part of its thickness.
fn density(points: &[UncertainPoint], is_planar: bool) -> f64 {
    let n = points.len().max(1) as f64;
    let sum: Vector3<f64> = points.iter().map(|point| point.position.coords).sum();
    let centre = sum / n;
    let mut spread = Matrix3::zeros();
    for point in points {
        let off = point.position.coords - centre;
        spread += (off * off.transpose() + Matrix3::from_diagonal_element(point.variance)) / n;
    }
    let extent = if is_planar {
        let plane = spread.fixed_view::<2, 2>(0, 0).determinant();
        4.0 * std::f64::consts::PI * plane.max(0.0).sqrt()
    } else {
        let root = spread.determinant().max(0.0).sqrt();
        4.0 / 3.0 * std::f64::consts::PI * 5.0_f64.powf(1.5) * root
    };
    n / extent
}
