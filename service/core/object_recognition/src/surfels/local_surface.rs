//! The surface near one contact, blended from surfels, and the density of the contact.

use std::f64::consts::{FRAC_1_PI, TAU};

use geometry::{beside, from_blocks, se3};
use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

use crate::surfels::deformation_test::Height;
use crate::surfels::surfel::{ContactNoise, Surfel};
use crate::tuning::{
    ALONG_MAX, DEPTH_MAX, EDGE_DAMPING, EDGE_DEPTH, EDGE_NORMAL_RAD, SAME_SIDE_COS, SMOOTH_SHARE,
};

/// The surface where a contact lies: a weighted mean of the surfels there.
///
/// Surfels whose normals are like the contact's have more weight, so that edges stay sharp (robust
/// implicit moving least squares: Öztireli, Guennebaud, Gross 2009, "Feature preserving point set
/// surfaces based on non-linear kernel regression").
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalSurface {
    /// Sum of the surfels' densities: about 1 within the surface, 0 beyond its edges.
    coverage: f64,
    /// Gradient of the logarithm of `coverage` \[1/m\].
    coverage_gradient: Vector3<f64>,
    /// Curvature of the same \[1/m²\].
    coverage_curvature: f64,
    /// Height over the surface \[m\].
    depth_m: f64,
    /// Variance of the surface itself \[m²\].
    depth_m2: f64,
    /// The surface's normal there.
    normal: Vector3<f64>,
    /// Change of the normal along the surface (shape operator) \[1/m\].
    bend: Matrix3<f64>,
    /// Variance of the normal about the surface's, per axis \[rad²\].
    angle: f64,
    /// Likelihood ratio of the percepts: there, against anywhere.
    percept_ratio: f64,
    /// Density of a contact about an edge or seam, times that of its percepts.
    rough: f64,
}

/// Sums over surfels.
#[derive(Default)]
struct Sums {
    cover: f64,
    pull: Vector3<f64>,
    hold: f64,
    weight: f64,
    depth_m: f64,
    depth_m2: f64,
    normal: Vector3<f64>,
    bend: Matrix3<f64>,
    angle: f64,
    percept_ratio: f64,
    rough: f64,
}

/// Densities of a contact per metre of depth and steradian, and what their logarithms' curvatures
/// are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Densities {
    /// On the smooth surface.
    smooth: f64,
    /// About an edge or seam.
    edge: f64,
    /// Variance of the depth \[m²\].
    depth_m2: f64,
    /// Inverse covariance of the normal, for `smooth` and for `edge`.
    precisions: [Matrix3<f64>; 2],
}

/// A contact's terms of the normal equations of a motion on the pose's left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionTerms {
    pub(crate) information: Matrix6<f64>,
    /// Damping by the curvature of the coverage.
    pub(crate) damping: Matrix6<f64>,
    pub(crate) gradient: Vector6<f64>,
}

impl LocalSurface {
    /// At a point, of these surfels. `normal` is the contact's, in the model's axes, and `percept`
    /// the likelihood ratio of its percepts at a surfel. `None` where there is no surface.
    pub(crate) fn new<'a>(
        point: &Point3<f64>,
        normal: Option<&Vector3<f64>>,
        noise: &ContactNoise,
        surfels: impl Iterator<Item = &'a Surfel> + Clone,
        percept: impl Fn(&Surfel) -> f64,
    ) -> Option<Self> {
        let side = match normal {
            Some(normal) => *normal,
            None => nearest_normal(point, noise, surfels.clone())?,
        };
        let mut sums = Sums::default();
        for surfel in surfels {
            let against = surfel.against(point);
            let agreement = side.dot(&against.normal);
            let tangent = surfel.tangent_m2 + noise.position_m2;
            let along = 0.5 * against.along_m2 / tangent;
            let depth = (surfel.depth_m2 + noise.position_m2) * noise.widen;
            let squared = against.depth_m * against.depth_m / depth;
            if agreement < 0.0 || along > ALONG_MAX || squared > DEPTH_MAX {
                continue;
            }
            let ratio = percept(surfel);
            let cover = surfel.area_m2 / (tangent * TAU) * (-along).exp();
            let off = normal.map(|normal| (normal - surfel.place_normal).norm_squared());
            sums.rough += cover * ratio * edge_density(squared, off, depth, noise);
            if agreement < SAME_SIDE_COS {
                continue;
            }
            let beside = point - surfel.position - against.through * against.depth_m;
            sums.cover += cover;
            sums.pull -= beside * (cover / tangent);
            sums.hold += cover / tangent;
            // 2 (1 − cos) is the squared angle.
            let weight = cover * ((agreement - 1.0) / (EDGE_NORMAL_RAD * EDGE_NORMAL_RAD)).exp();
            sums.weight += weight;
            sums.depth_m += weight * against.depth_m;
            sums.depth_m2 += weight * surfel.depth_m2;
            sums.normal += against.normal * weight;
            sums.bend += surfel.bend * weight;
            sums.angle += weight * surfel.angle;
            sums.percept_ratio += weight * ratio;
        }
        (sums.weight > 0.0).then(|| sums.surface())
    }

    /// Densities of the contact.
    pub(crate) fn densities(
        &self,
        normal: Option<&Vector3<f64>>,
        noise: &ContactNoise,
    ) -> Densities {
        let depth_m2 = (self.depth_m2 + noise.position_m2) * noise.widen;
        let squared = self.depth_m * self.depth_m / depth_m2;
        let weight = SMOOTH_SHARE * self.coverage * self.percept_ratio / (depth_m2 * TAU).sqrt();
        let mut densities = Densities {
            smooth: weight * (-0.5 * squared).exp() * 0.25 * FRAC_1_PI,
            edge: (1.0 - SMOOTH_SHARE) * self.rough,
            depth_m2,
            precisions: [Matrix3::zeros(); 2],
        };
        if let Some(normal) = normal {
            // The noise of the position turns the normal where the surface is curved.
            let own = (self.angle + noise.normal) * noise.widen;
            let turned = self.bend * self.bend.transpose() * (noise.position_m2 * noise.widen);
            let covariance = Matrix3::from_diagonal_element(own) + turned;
            // Two of three dimensions count: along the normal the variance is `own` alone.
            let across = covariance.determinant() / own;
            let precision = covariance.try_inverse();
            let precision = precision.unwrap_or(Matrix3::from_diagonal_element(1.0 / own));
            let off = normal - self.normal;
            densities.smooth *= 2.0 / across.sqrt() * (-0.5 * off.dot(&(precision * off))).exp();
            let edge = 1.0 / edge_normal_variance(noise);
            densities.precisions = [precision, Matrix3::from_diagonal_element(edge)];
        }
        densities
    }

    /// Height of the contact at this point, if `share` of its density is the model's.
    pub(crate) fn height(&self, point: &Point3<f64>, densities: &Densities, share: f64) -> Height {
        Height {
            point: *point,
            normal: self.normal,
            depth_m: self.depth_m,
            variance_m2: densities.depth_m2,
            model_share: self.depth_m2 / densities.depth_m2,
            share: densities.shares()[0] * share,
        }
    }

    /// The contact's terms for a motion, if `share` of its density is the model's.
    pub(crate) fn motion(
        &self,
        point: &Point3<f64>,
        normal: Option<&Vector3<f64>>,
        densities: &Densities,
        share: f64,
    ) -> MotionTerms {
        let [smooth, edge] = densities.shares().map(|own| own * share);
        let row = se3::join(&self.normal, &point.coords.cross(&self.normal));
        let weight = (smooth + edge / (EDGE_DEPTH * EDGE_DEPTH)) / densities.depth_m2;
        let mut information = row * row.transpose() * weight;
        let mut gradient = row * (-weight * self.depth_m);
        let lever = point.coords.cross_matrix();
        if let Some(normal) = normal {
            // A motion turns the contact's normal, and moves it to another normal of the surface.
            let turn = self.bend * lever - normal.cross_matrix();
            let jacobian = beside(&-self.bend, &turn);
            let [own, wide] = densities.precisions;
            let weighed = (own * smooth + wide * edge) * jacobian;
            information += jacobian.transpose() * weighed;
            gradient -= weighed.transpose() * (normal - self.normal);
        }
        // Beyond an edge all surfels pull the same way; within the surface their pulls cancel.
        gradient += se3::join(
            &self.coverage_gradient,
            &point.coords.cross(&self.coverage_gradient),
        ) * share;
        let damping = from_blocks(&Matrix3::identity(), &-lever, &lever, &-(lever * lever));
        MotionTerms {
            information,
            damping: damping * (share * self.coverage_curvature),
            gradient,
        }
    }
}

impl Densities {
    /// Of the contact, smooth surface or edge.
    pub(crate) fn sum(&self) -> f64 {
        self.smooth + self.edge
    }

    fn shares(&self) -> [f64; 2] {
        let sum = self.sum().max(f64::MIN_POSITIVE);
        [self.smooth / sum, self.edge / sum]
    }
}

impl Sums {
    fn surface(self) -> LocalSurface {
        let share = 1.0 / self.weight;
        LocalSurface {
            coverage: self.cover,
            coverage_gradient: self.pull / self.cover,
            coverage_curvature: EDGE_DAMPING * self.hold / self.cover,
            depth_m: self.depth_m * share,
            depth_m2: self.depth_m2 * share,
            normal: (self.normal * share).normalize(),
            bend: self.bend * share,
            angle: self.angle * share,
            percept_ratio: self.percept_ratio * share,
            rough: self.rough,
        }
    }
}

/// The side of a contact without a normal: that of the surfel with the least Mahalanobis distance.
fn nearest_normal<'a>(
    point: &Point3<f64>,
    noise: &ContactNoise,
    surfels: impl Iterator<Item = &'a Surfel>,
) -> Option<Vector3<f64>> {
    let apart = surfels.map(|surfel| {
        let against = surfel.against(point);
        let depth = against.depth_m * against.depth_m / (surfel.depth_m2 + noise.position_m2);
        let along = against.along_m2 / (surfel.tangent_m2 + noise.position_m2);
        (depth + along, surfel.normal)
    });
    { apart.min_by(|a, b| a.0.total_cmp(&b.0)) }.map(|nearest| nearest.1)
}

/// Density of a contact about an edge or seam, per metre of depth and steradian.
///
/// `squared` is the squared depth in deviations, `depth` its variance \[m²\], and `off` the squared
/// distance of the contact's normal from the place's.
fn edge_density(squared: f64, off: Option<f64>, depth: f64, noise: &ContactNoise) -> f64 {
    let variance = depth * EDGE_DEPTH * EDGE_DEPTH;
    let deep = (-0.5 * squared / (EDGE_DEPTH * EDGE_DEPTH)).exp() / (variance * TAU).sqrt();
    let wide = edge_normal_variance(noise);
    deep * off.map_or(0.25 * FRAC_1_PI, |off| {
        (-0.5 * off / wide).exp() / (wide * TAU)
    })
}

/// Variance of a normal about an edge or seam, per axis \[rad²\].
fn edge_normal_variance(noise: &ContactNoise) -> f64 {
    noise.normal * noise.widen + EDGE_NORMAL_RAD * EDGE_NORMAL_RAD
}
