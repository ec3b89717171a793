//! A learned map's surface: curved patches about its places.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3, Point3, Unit, Vector2, Vector3};

use super::contact::Contact;
use super::model::ModelPlace;

/// Neighbours by which the density of places is told: their number varies by a third.
const DENSITY_NEIGHBOURS: usize = 10;
/// Neighbours by which a place is smoothed.
pub(super) const SMOOTH_NEIGHBOURS: usize = 16;
/// Normals within 45° are of one patch; beyond lies an edge.
pub(super) const PATCH_COS: f64 = 0.707;
/// Reach of a facet along the surface, as a standard deviation, per spacing of places: so wide that the
/// sum over random places is even to two fifths.
const TANGENT_PER_SPACING: f64 = 0.55;
/// No patch turns farther than this sine, 53°, within its reach.
const BENT_MAX: f64 = 0.8;
/// Standard deviation of a normal about an edge or seam \[rad\], 20°.
pub(super) const ROUGH_RAD: f64 = 0.35;
/// How much wider than the patch's the depths about an edge or seam are, as a standard deviation.
pub(super) const ROUGH_DEPTH: f64 = 2.0;
/// Facets count up to here along the surface, as half a squared number of deviations.
pub(super) const ALONG_MAX: f64 = 3.0;
/// A facet stands for no more than so many times the usual area: beyond, nothing is known.
const AREA_MAX: f64 = 4.0;
/// A facet scatters no more than so many times the usual variance.
const SPREAD_MAX: f64 = 16.0;
/// Weight of what is usual on the map in a facet's own scatter, in neighbours.
const SHRINK: f64 = 4.0;

/// A curved patch of surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) position: Point3<f64>,
    pub(super) normal: Vector3<f64>,
    /// The place's own normal, not smoothed: of what lies about an edge.
    pub(super) own_normal: Vector3<f64>,
    /// The normal at a small displacement u is `normal` + `bend` u.
    pub(super) bend: Matrix3<f64>,
    /// Its greatest curvature, either way \[1/m\].
    curve: f64,
    /// Variance of the surface about the patch, along the normal \[m²\].
    pub(super) depth_m2: f64,
    /// Variance of the normal about the patch's, per axis \[rad²\].
    pub(super) angle: f64,
    /// Area that the place stands for \[m²\].
    pub(super) area_m2: f64,
    /// Reach along the surface, as a variance \[m²\].
    pub(super) tangent_m2: f64,
    /// Number of the place it comes from.
    pub(super) place: u32,
}

/// How a point and its normal lie against a facet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Against {
    /// Height above the patch \[m\].
    pub(super) depth_m: f64,
    /// Squared distance along it \[m²\].
    pub(super) along_m2: f64,
    /// The patch's normal there.
    pub(super) normal: Vector3<f64>,
    /// Direction in which `depth_m` is measured.
    pub(super) through: Vector3<f64>,
}

impl Facet {
    /// A point against the patch. The height is that over the plane that halves the angle between the normals
    /// at both ends, which is exact on a sphere or a cylinder (Rusinkiewicz 2019, "A symmetric objective
    /// function for ICP").
    pub(super) fn against(&self, point: &Point3<f64>) -> Against {
        let apart = point - self.position;
        // The bend lies across the normal: on a circle of radius r it is the chord's part along the
        // tangent over r, the sine of the turn.
        let mut bent = self.bend * apart;
        let mut sine2 = bent.norm_squared();
        if sine2 > BENT_MAX * BENT_MAX {
            bent *= BENT_MAX / sine2.sqrt();
            sine2 = BENT_MAX * BENT_MAX;
        }
        let cosine = (1.0 - sine2).sqrt();
        let normal = self.normal * cosine + bent;
        let through = (self.normal + normal) / (2.0 + 2.0 * cosine).sqrt();
        let depth_m = apart.dot(&through);
        Against {
            depth_m,
            along_m2: (apart.norm_squared() - depth_m * depth_m).max(0.0),
            normal,
            through,
        }
    }

    /// Variance of a contact's normal about the patch's, along the direction in which the patch bends most
    /// \[rad²\]. A contact is not where it seems to be, and where the surface bends its normal is that of
    /// elsewhere.
    pub(super) fn angle_along(&self, noise: &Noise) -> f64 {
        (self.angle + noise.normal + noise.position_m2 * self.curve * self.curve) * noise.widen
    }
}

/// The noise of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// Variance of the position per axis \[m²\].
    pub(super) position_m2: f64,
    /// Variance of the normal per axis \[rad²\].
    pub(super) normal: f64,
    /// What all variances are multiplied by: above 1 while the pose is still rough.
    pub(super) widen: f64,
}

impl Noise {
    /// A contact's.
    pub(super) fn of(contact: &Contact, widen: f64) -> Self {
        Self {
            position_m2: contact.variance_m2(),
            normal: contact.normal_sd_rad * contact.normal_sd_rad,
            widen,
        }
    }
}

/// One place's neighbours on its side of the surface: squared distance and number, nearest first.
type Neighbours = Vec<(f64, u32)>;

/// The facets of places with normals; places without are left out.
pub(super) fn facets(places: &[ModelPlace]) -> Vec<Facet> {
    let oriented: Vec<_> = (0u32..)
        .zip(places)
        .filter_map(|(number, place)| Some((number, place, place.normal()?)))
        .collect();
    let raw: Vec<Raw> = oriented
        .iter()
        .map(|(number, place, normal)| Raw {
            place: *number,
            position: place.position_m,
            normal: *normal,
            count: place.count,
            noise_m2: place.variance_m2 / (place.count * place.count),
            noise_normal: place.normal_variance / (place.count * place.count),
        })
        .collect();
    let neighbours: Vec<_> = (0..raw.len()).map(|at| neighbours(&raw, at)).collect();
    let fits: Vec<_> = (0..raw.len())
        .map(|at| fit(&raw, at, &neighbours[at]))
        .collect();
    // The scatter of few neighbours is itself uncertain; what is usual on the map steadies it.
    let usual_depth = median(fits.iter().map(|fit| fit.depth_m2));
    let usual_angle = median(fits.iter().map(|fit| fit.angle));
    let usual_area = median(fits.iter().map(|fit| fit.area_m2));
    let shrunk = |own: f64, mean: f64, weight: f64| {
        (own.min(SPREAD_MAX * mean) * weight + mean * SHRINK) / (weight + SHRINK)
    };
    fits.iter()
        .zip(&raw)
        .map(|(fit, raw)| Facet {
            position: fit.position,
            normal: fit.normal,
            own_normal: raw.normal.into_inner(),
            bend: fit.bend,
            curve: fit.curve,
            depth_m2: (shrunk(fit.depth_m2, usual_depth, fit.weight) - raw.noise_m2).max(0.0)
                + raw.noise_m2 / (0.5 * fit.weight + 1.0),
            angle: (shrunk(fit.angle, usual_angle, fit.weight) - raw.noise_normal).max(0.0)
                + raw.noise_normal / (0.5 * fit.weight + 1.0)
                + 1e-6,
            area_m2: fit.area_m2.min(AREA_MAX * usual_area),
            tangent_m2: TANGENT_PER_SPACING.powi(2) * fit.area_m2.min(AREA_MAX * usual_area),
            place: raw.place,
        })
        .collect()
}

/// The middle one; zero of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

struct Raw {
    place: u32,
    position: Point3<f64>,
    normal: Unit<Vector3<f64>>,
    count: f64,
    noise_m2: f64,
    noise_normal: f64,
}

struct Fit {
    position: Point3<f64>,
    normal: Vector3<f64>,
    bend: Matrix3<f64>,
    curve: f64,
    depth_m2: f64,
    angle: f64,
    area_m2: f64,
    weight: f64,
}

fn neighbours(raw: &[Raw], at: usize) -> Neighbours {
    let own = &raw[at];
    let mut all: Neighbours = (0u32..)
        .zip(raw)
        .filter(|(other, _)| *other as usize != at)
        .map(|(other, near)| ((near.position - own.position).norm_squared(), other))
        .collect();
    let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    // Of something thin or round, few of those about it are on its side; farther ones are not its
    // neighbours.
    let about = (3 * SMOOTH_NEIGHBOURS).min(all.len());
    if about < all.len() {
        all.select_nth_unstable_by(about, order);
        all.truncate(about);
    }
    all.retain(|(_, near)| raw[*near as usize].normal.dot(&own.normal) > PATCH_COS);
    all.sort_by(order);
    all.truncate(SMOOTH_NEIGHBOURS);
    all
}

/// Least squares of the neighbours' normals and heights, twice, the second time with those that do not
/// fit weighed down.
fn fit(raw: &[Raw], at: usize, neighbours: &Neighbours) -> Fit {
    let own = &raw[at];
    let radius_m2 = |count: usize| {
        neighbours
            .get(count - 1)
            .or(neighbours.last())
            .map_or(0.0, |n| n.0)
    };
    let nth = DENSITY_NEIGHBOURS.min(neighbours.len()).max(1);
    // A disc that holds n other places has n − 1 per its area (the n-th is on its rim).
    let area_m2 = PI * radius_m2(nth) / (nth as f64 - 0.5).max(0.5);
    // Noise spreads places off the surface: a patch must be wider than that, or it fits the noise.
    let scale_m2 = (0.5 * radius_m2(SMOOTH_NEIGHBOURS))
        .max(4.0 * own.noise_m2)
        .max(1e-18);
    let mut fit = Fit {
        position: own.position,
        normal: own.normal.into_inner(),
        bend: Matrix3::zeros(),
        curve: 0.0,
        depth_m2: own.noise_m2,
        angle: own.noise_normal,
        area_m2: area_m2.max(1e-18),
        weight: 0.0,
    };
    let mut robust = vec![1.0; neighbours.len()];
    for _ in 0..2 {
        let (east, north) = tangents(&fit.normal);
        let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&east), v.dot(&north));
        let weigh = |(squared, other): &(f64, u32), robust: f64| {
            raw[*other as usize].count * (-0.5 * squared / scale_m2).exp() * robust
        };
        // Tangential parts of the normals: ν = a + S u, with the own normal at u = 0.
        let base = own.normal;
        let mut normal_matrix = Matrix3::zeros();
        let mut right = [Vector3::zeros(); 2];
        let mut put = |u: Vector2<f64>, nu: Vector2<f64>, weight: f64| {
            let row = Vector3::new(1.0, u.x, u.y);
            normal_matrix += row * row.transpose() * weight;
            right[0] += row * (nu.x * weight);
            right[1] += row * (nu.y * weight);
        };
        put(flat(&(own.position - fit.position)), flat(&base), own.count);
        for (near, robust) in neighbours.iter().zip(&robust) {
            let other = &raw[near.1 as usize];
            put(
                flat(&(other.position - fit.position)),
                flat(&other.normal),
                weigh(near, *robust),
            );
        }
        // A ridge of a tenth of a neighbour at one scale: without neighbours the patch is flat.
        normal_matrix[(1, 1)] += 0.1 * scale_m2;
        normal_matrix[(2, 2)] += 0.1 * scale_m2;
        let Some(inverse) = normal_matrix.try_inverse() else {
            break;
        };
        let (x, y) = (inverse * right[0], inverse * right[1]);
        let shape = Matrix2::new(x.y, 0.5 * (x.z + y.y), 0.5 * (x.z + y.y), y.z);
        let normal = (fit.normal + east * x.x + north * y.x).normalize();
        let axes = nalgebra::Matrix3x2::from_columns(&[east, north]);
        fit.bend = axes * shape * axes.transpose();
        fit.normal = normal;
        fit.curve = shape.symmetric_eigenvalues().amax();
        // Heights of the places over the patch, and how they scatter.
        let facet = fit.facet();
        let own_height = facet.against(&own.position).depth_m;
        let (mut sum, mut heights) = (own.count, own.count * own_height);
        for (near, robust) in neighbours.iter().zip(&robust) {
            let weight = weigh(near, *robust);
            sum += weight;
            heights += weight * facet.against(&raw[near.1 as usize].position).depth_m;
        }
        fit.position += fit.normal * (heights / sum);
        let facet = fit.facet();
        let (mut sum, mut depth, mut angle) = (0.0, 0.0, 0.0);
        for (near, robust) in neighbours.iter().zip(&robust) {
            let other = &raw[near.1 as usize];
            let weight = weigh(near, *robust);
            let against = facet.against(&other.position);
            sum += weight;
            depth += weight * against.depth_m * against.depth_m;
            angle += weight * (1.0 - other.normal.dot(&against.normal));
        }
        if sum > 0.0 {
            fit.weight = sum;
            fit.depth_m2 = depth / sum;
            // 2 (1 − cos) is the squared angle, of two axes.
            fit.angle = angle / sum;
        }
        for (near, robust) in neighbours.iter().zip(&mut robust) {
            let other = &raw[near.1 as usize];
            let against = facet.against(&other.position);
            let angle = (1.0 - other.normal.dot(&against.normal)) / (fit.angle + 1e-9);
            let depth = against.depth_m * against.depth_m / (fit.depth_m2 + 1e-18);
            *robust = 1.0 / (1.0 + 0.25 * (angle + depth));
        }
    }
    fit
}

impl Fit {
    fn facet(&self) -> Facet {
        Facet {
            position: self.position,
            normal: self.normal,
            own_normal: self.normal,
            bend: self.bend,
            curve: self.curve,
            depth_m2: self.depth_m2,
            angle: self.angle,
            area_m2: self.area_m2,
            tangent_m2: self.area_m2,
            place: 0,
        }
    }
}

/// Two unit vectors across a unit vector and each other.
pub(super) fn tangents(normal: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    // Across the axis that is most across.
    let axis = normal.iamin();
    let mut least = Vector3::zeros();
    least[axis] = 1.0;
    let east = normal.cross(&least).normalize();
    (east, normal.cross(&east))
}
