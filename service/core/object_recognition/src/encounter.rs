//! How a contact meets a surface.

use std::f64::consts::{FRAC_1_PI, TAU};

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Point3, Vector3, Vector6};

use super::facet::{ALONG_MAX, Facet, Noise, ROUGH_DEPTH, ROUGH_RAD};
use super::strain::Height;

/// Share of contacts that are as the smooth surface foretells them; the rest are about edges and seams.
const SMOOTH_SHARE: f64 = 0.85;
/// A facet counts up to here in depth, as a squared number of deviations.
const DEPTH_MAX: f64 = 100.0;
/// Facets whose normals are within 60° of the contact's are of its side.
const SIDE_COS: f64 = 0.5;
/// Part of the curvature of the coverage that holds a step back.
const HOLD: f64 = 0.25;

/// The surface where a contact meets it: what the facets there foretell together.
///
/// Each counts by its part in what lies there, and those whose normals are like the contact's before others, so that
/// edges stay sharp (robust implicit moving least squares: Öztireli, Guennebaud, Gross 2009).
#[derive(Clone, Copy, Debug)]
pub(super) struct Encounter {
    /// Part of the surface that lies there: about 1 well within it, 0 beyond its edges.
    coverage: f64,
    /// Gradient of the logarithm of `coverage` \[1/m\].
    pull: Vector3<f64>,
    /// Curvature of the same \[1/m²\].
    hold: f64,
    /// Height over the surface \[m\].
    depth_m: f64,
    /// Variance of the surface itself \[m²\].
    depth_m2: f64,
    /// The surface's normal there.
    normal: Vector3<f64>,
    /// How the normal changes along the surface \[1/m\].
    bend: Matrix3<f64>,
    /// Variance of the normal about the surface's, per axis \[rad²\].
    angle: f64,
    /// Likelihood of the percepts there, against anywhere.
    felt: f64,
    /// Density of a contact about an edge or seam, with its percepts.
    rough: f64,
}

/// Sums over facets.
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
    felt: f64,
    rough: f64,
}

/// Densities of a contact per metre of depth and steradian, and what their logarithms' curvatures are made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Densities {
    /// As the smooth surface foretells it.
    tight: f64,
    /// About an edge or seam.
    loose: f64,
    /// Variance of the depth \[m²\].
    depth_m2: f64,
    /// Inverse covariance of the normal, for `tight` and for `loose`.
    precisions: [Matrix3<f64>; 2],
}

/// What a contact says of a motion on the pose's left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) information: Matrix6<f64>,
    /// How the map's edges hold a step back.
    pub(super) held: Matrix6<f64>,
    pub(super) gradient: Vector6<f64>,
}

impl Encounter {
    /// Of a contact at a point with these facets; `normal` is the contact's, in the map's axes, and `percept` the
    /// likelihood of its percepts at a facet. `None` where there is no surface.
    pub(super) fn new<'a>(
        point: &Point3<f64>,
        normal: Option<&Vector3<f64>>,
        noise: &Noise,
        facets: impl Iterator<Item = &'a Facet> + Clone,
        percept: impl Fn(&Facet) -> f64,
    ) -> Option<Self> {
        let side = match normal {
            Some(normal) => *normal,
            None => nearest_normal(point, noise, facets.clone())?,
        };
        let mut sums = Sums::default();
        for facet in facets {
            let against = facet.against(point);
            let agreement = side.dot(&against.normal);
            let tangent = facet.tangent_m2 + noise.position_m2;
            let along = 0.5 * against.along_m2 / tangent;
            let depth = (facet.depth_m2 + noise.position_m2) * noise.widen;
            let squared = against.depth_m * against.depth_m / depth;
            if agreement < 0.0 || along > ALONG_MAX || squared > DEPTH_MAX {
                continue;
            }
            let felt = percept(facet);
            let cover = facet.area_m2 / (tangent * TAU) * (-along).exp();
            let off = normal.map(|normal| (normal - facet.own_normal).norm_squared());
            sums.rough += cover * felt * rough(squared, off, depth, noise);
            if agreement < SIDE_COS {
                continue;
            }
            let beside = point - facet.position - against.through * against.depth_m;
            sums.cover += cover;
            sums.pull -= beside * (cover / tangent);
            sums.hold += cover / tangent;
            // 2 (1 − cos) is the squared angle.
            let weight = cover * ((agreement - 1.0) / (ROUGH_RAD * ROUGH_RAD)).exp();
            sums.weight += weight;
            sums.depth_m += weight * against.depth_m;
            sums.depth_m2 += weight * facet.depth_m2;
            sums.normal += against.normal * weight;
            sums.bend += facet.bend * weight;
            sums.angle += weight * facet.angle;
            sums.felt += weight * felt;
        }
        (sums.weight > 0.0).then(|| sums.encounter())
    }

    /// Densities of the contact.
    pub(super) fn densities(&self, normal: Option<&Vector3<f64>>, noise: &Noise) -> Densities {
        let depth_m2 = (self.depth_m2 + noise.position_m2) * noise.widen;
        let squared = self.depth_m * self.depth_m / depth_m2;
        let weight = SMOOTH_SHARE * self.coverage * self.felt / (depth_m2 * TAU).sqrt();
        let mut densities = Densities {
            tight: weight * (-0.5 * squared).exp() * 0.25 * FRAC_1_PI,
            loose: (1.0 - SMOOTH_SHARE) * self.rough,
            depth_m2,
            precisions: [Matrix3::zeros(); 2],
        };
        if let Some(normal) = normal {
            // A contact is not where it seems to be, and where the surface bends its normal is that of
            // elsewhere.
            let own = (self.angle + noise.normal) * noise.widen;
            let turned = self.bend * self.bend.transpose() * (noise.position_m2 * noise.widen);
            let covariance = Matrix3::from_diagonal_element(own) + turned;
            // Of the three directions one is the normal's own, in which `own` is all.
            let across = covariance.determinant() / own;
            let precision = covariance.try_inverse();
            let precision = precision.unwrap_or(Matrix3::from_diagonal_element(1.0 / own));
            let off = normal - self.normal;
            densities.tight *= 2.0 / across.sqrt() * (-0.5 * off.dot(&(precision * off))).exp();
            let loose = 1.0 / rough_rad2(noise);
            densities.precisions = [precision, Matrix3::from_diagonal_element(loose)];
        }
        densities
    }

    /// How high the contact at this point lies, if `share` of its density is the map's.
    pub(super) fn height(&self, point: &Point3<f64>, densities: &Densities, share: f64) -> Height {
        Height {
            point: *point,
            normal: self.normal,
            depth_m: self.depth_m,
            variance_m2: densities.depth_m2,
            map_share: self.depth_m2 / densities.depth_m2,
            share: densities.shares()[0] * share,
        }
    }

    /// What the contact says of a motion, if `share` of its density is the map's.
    pub(super) fn motion(
        &self,
        point: &Point3<f64>,
        normal: Option<&Vector3<f64>>,
        densities: &Densities,
        share: f64,
    ) -> Motion {
        let [tight, loose] = densities.shares().map(|own| own * share);
        let six = |linear: &Vector3<f64>, angular: &Vector3<f64>| {
            let mut six = Vector6::zeros();
            six.fixed_rows_mut::<3>(0).copy_from(linear);
            six.fixed_rows_mut::<3>(3).copy_from(angular);
            six
        };
        let row = six(&self.normal, &point.coords.cross(&self.normal));
        let weight = (tight + loose / (ROUGH_DEPTH * ROUGH_DEPTH)) / densities.depth_m2;
        let mut information = row * row.transpose() * weight;
        let mut gradient = row * (-weight * self.depth_m);
        let lever = point.coords.cross_matrix();
        if let Some(normal) = normal {
            // A motion turns the contact's normal, and moves it to where the surface's is another.
            let mut jacobian = Matrix3x6::zeros();
            let turn = self.bend * lever - normal.cross_matrix();
            jacobian.fixed_columns_mut::<3>(0).copy_from(&-self.bend);
            jacobian.fixed_columns_mut::<3>(3).copy_from(&turn);
            let [own, wide] = densities.precisions;
            let weighed = (own * tight + wide * loose) * jacobian;
            information += jacobian.transpose() * weighed;
            gradient -= weighed.transpose() * (normal - self.normal);
        }
        // Beyond the map's edge the facets all pull the same way; within, their pulls cancel.
        gradient += six(&self.pull, &point.coords.cross(&self.pull)) * share;
        let mut held = Matrix6::zeros();
        held.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(1.0);
        held.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&-(lever * lever));
        held.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lever);
        held.fixed_view_mut::<3, 3>(3, 0).copy_from(&lever);
        Motion {
            information,
            held: held * (share * self.hold),
            gradient,
        }
    }
}

impl Densities {
    /// Of the contact, however it came about.
    pub(super) fn sum(&self) -> f64 {
        self.tight + self.loose
    }

    fn shares(&self) -> [f64; 2] {
        let sum = self.sum().max(f64::MIN_POSITIVE);
        [self.tight / sum, self.loose / sum]
    }
}

impl Sums {
    fn encounter(self) -> Encounter {
        let share = 1.0 / self.weight;
        Encounter {
            coverage: self.cover,
            pull: self.pull / self.cover,
            hold: HOLD * self.hold / self.cover,
            depth_m: self.depth_m * share,
            depth_m2: self.depth_m2 * share,
            normal: (self.normal * share).normalize(),
            bend: self.bend * share,
            angle: self.angle * share,
            felt: self.felt * share,
            rough: self.rough,
        }
    }
}

/// The side of a contact that has no normal: of the facet that it is nearest to, in depth and along.
fn nearest_normal<'a>(
    point: &Point3<f64>,
    noise: &Noise,
    facets: impl Iterator<Item = &'a Facet>,
) -> Option<Vector3<f64>> {
    let apart = facets.map(|facet| {
        let against = facet.against(point);
        let depth = against.depth_m * against.depth_m / (facet.depth_m2 + noise.position_m2);
        let along = against.along_m2 / (facet.tangent_m2 + noise.position_m2);
        (depth + along, facet.normal)
    });
    { apart.min_by(|a, b| a.0.total_cmp(&b.0)) }.map(|nearest| nearest.1)
}

/// Density per metre of depth and steradian of a contact about an edge or seam: `squared` depths in deviations, of
/// variance `depth` \[m²\], with a normal whose squared distance from the place's is `off`.
fn rough(squared: f64, off: Option<f64>, depth: f64, noise: &Noise) -> f64 {
    let variance = depth * ROUGH_DEPTH * ROUGH_DEPTH;
    let deep = (-0.5 * squared / (ROUGH_DEPTH * ROUGH_DEPTH)).exp() / (variance * TAU).sqrt();
    let wide = rough_rad2(noise);
    deep * off.map_or(0.25 * FRAC_1_PI, |off| {
        (-0.5 * off / wide).exp() / (wide * TAU)
    })
}

/// Variance of a normal about an edge or seam, per axis \[rad²\].
fn rough_rad2(noise: &Noise) -> f64 {
    noise.normal * noise.widen + ROUGH_RAD * ROUGH_RAD
}
