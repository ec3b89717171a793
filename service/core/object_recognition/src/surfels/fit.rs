//! Fits a surfel to every place with a normal, by weighted least squares over its neighbours.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Point3, Unit, Vector2, Vector3};

use crate::model::ModelPlace;
use crate::numeric::median;
use crate::surfels::surfel::Surfel;
use crate::tuning::{
    AREA_MAX, CURVATURE_RIDGE, DENSITY_NEIGHBOURS, FIT_NEIGHBOURS, FIT_WIDTH_MIN,
    ROBUST_PER_SQUARE, SCATTER_MAX, SHRINKAGE, SMOOTH_COS, TANGENT_PER_SPACING,
};

/// Neighbours of one place on its side of the surface: squared distance and number, nearest first.
type Neighbours = Vec<(f64, u32)>;

/// The surfels of all places with a normal.
pub(crate) fn surfels(places: &[ModelPlace]) -> Vec<Surfel> {
    let oriented: Vec<_> = (0u32..)
        .zip(places)
        .filter_map(|(number, place)| Some((number, place, place.normal()?)))
        .collect();
    let places: Vec<OrientedPlace> = oriented
        .iter()
        .map(|(number, place, normal)| OrientedPlace {
            place: *number,
            position: place.position_m,
            normal: *normal,
            count: place.count,
            noise_m2: place.variance_m2 / (place.count * place.count),
            noise_normal: place.normal_variance / (place.count * place.count),
        })
        .collect();
    let neighbours: Vec<_> = (0..oriented.len())
        .map(|at| neighbours(&places, at))
        .collect();
    let fits: Vec<_> = (0..oriented.len())
        .map(|at| fit(&places, at, &neighbours[at]))
        .collect();
    // The scatter of few neighbours is itself uncertain: it is shrunk towards the median.
    let usual_depth = median(fits.iter().map(|fit| fit.depth_m2).collect());
    let usual_angle = median(fits.iter().map(|fit| fit.angle).collect());
    let usual_area = median(fits.iter().map(|fit| fit.area_m2).collect());
    let shrunk = |own: f64, mean: f64, weight: f64| {
        (own.min(SCATTER_MAX * mean) * weight + mean * SHRINKAGE) / (weight + SHRINKAGE)
    };
    fits.iter()
        .zip(&places)
        .map(|(fit, own)| Surfel {
            position: fit.position,
            normal: fit.normal,
            place_normal: own.normal.into_inner(),
            bend: fit.bend,
            curve: fit.curve,
            depth_m2: (shrunk(fit.depth_m2, usual_depth, fit.weight) - own.noise_m2).max(0.0)
                + own.noise_m2 / (0.5 * fit.weight + 1.0),
            angle: (shrunk(fit.angle, usual_angle, fit.weight) - own.noise_normal).max(0.0)
                + own.noise_normal / (0.5 * fit.weight + 1.0)
                + 1e-6,
            area_m2: fit.area_m2.min(AREA_MAX * usual_area),
            tangent_m2: TANGENT_PER_SPACING.powi(2) * fit.area_m2.min(AREA_MAX * usual_area),
            place: own.place,
        })
        .collect()
}

/// A place with a normal.
struct OrientedPlace {
    place: u32,
    position: Point3<f64>,
    normal: Unit<Vector3<f64>>,
    count: f64,
    noise_m2: f64,
    noise_normal: f64,
}

/// A surfel while it is fitted.
struct SurfelFit {
    position: Point3<f64>,
    normal: Vector3<f64>,
    bend: Matrix3<f64>,
    curve: f64,
    depth_m2: f64,
    angle: f64,
    area_m2: f64,
    weight: f64,
}

fn neighbours(places: &[OrientedPlace], at: usize) -> Neighbours {
    let own = &places[at];
    let mut all: Neighbours = (0u32..)
        .zip(places)
        .filter(|(other, _)| *other as usize != at)
        .map(|(other, near)| ((near.position - own.position).norm_squared(), other))
        .collect();
    let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    // On thin or round shapes few of the nearest places lie on one side. Farther ones are no
    // neighbours all the same.
    let about = (3 * FIT_NEIGHBOURS).min(all.len());
    if about < all.len() {
        all.select_nth_unstable_by(about, order);
        all.truncate(about);
    }
    all.retain(|(_, near)| places[*near as usize].normal.dot(&own.normal) > SMOOTH_COS);
    all.sort_by(order);
    all.truncate(FIT_NEIGHBOURS);
    all
}

/// Weighted least squares of the neighbours' normals and heights, in two passes: the second one
/// gives outliers a smaller weight.
fn fit(places: &[OrientedPlace], at: usize, neighbours: &Neighbours) -> SurfelFit {
    let own = &places[at];
    let radius_m2 = |count: usize| {
        neighbours
            .get(count - 1)
            .or(neighbours.last())
            .map_or(0.0, |neighbour| neighbour.0)
    };
    let nth = DENSITY_NEIGHBOURS.min(neighbours.len()).max(1);
    // The n-th place lies on the disc's rim and counts half.
    let area_m2 = PI * radius_m2(nth) / (nth as f64 - 0.5).max(0.5);
    let scale_m2 = (0.5 * radius_m2(FIT_NEIGHBOURS))
        .max(FIT_WIDTH_MIN * own.noise_m2)
        .max(1e-18);
    let mut fit = SurfelFit {
        position: own.position,
        normal: own.normal.into_inner(),
        bend: Matrix3::zeros(),
        curve: 0.0,
        depth_m2: own.noise_m2,
        angle: own.noise_normal,
        area_m2: area_m2.max(1e-18),
        weight: 0.0,
    };
    let weigh = |(squared, other): &(f64, u32), robust: f64| {
        places[*other as usize].count * (-0.5 * squared / scale_m2).exp() * robust
    };
    let mut robust = vec![1.0; neighbours.len()];
    for _ in 0..2 {
        let near: Vec<(&OrientedPlace, f64)> = { neighbours.iter().zip(&robust) }
            .map(|(near, robust)| (&places[near.1 as usize], weigh(near, *robust)))
            .collect();
        if !fit.turn_and_bend(own, &near, scale_m2) {
            break;
        }
        fit.lift(own, &near);
        fit.scatter(&near);
        let surfel = fit.surfel();
        for (near, robust) in neighbours.iter().zip(&mut robust) {
            let other = &places[near.1 as usize];
            let against = surfel.against(&other.position);
            let angle = (1.0 - other.normal.dot(&against.normal)) / (fit.angle + 1e-9);
            let depth = against.depth_m * against.depth_m / (fit.depth_m2 + 1e-18);
            *robust = 1.0 / (1.0 + ROBUST_PER_SQUARE * (angle + depth));
        }
    }
    fit
}

impl SurfelFit {
    /// Fits normal and curvature to the weighted neighbours' normals; `false` if nothing fixes
    /// them.
    ///
    /// The tangential parts of the normals are ν = a + S u, u the displacement along the surface.
    fn turn_and_bend(
        &mut self,
        own: &OrientedPlace,
        near: &[(&OrientedPlace, f64)],
        scale_m2: f64,
    ) -> bool {
        let (east, north) = tangents(&self.normal);
        let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&east), v.dot(&north));
        let mut normal_matrix = Matrix3::zeros();
        let mut right = [Vector3::zeros(); 2];
        for (place, weight) in [(own, own.count)].iter().chain(near) {
            let u = flat(&(place.position - self.position));
            let nu = flat(&place.normal);
            let row = Vector3::new(1.0, u.x, u.y);
            normal_matrix += row * row.transpose() * *weight;
            right[0] += row * (nu.x * weight);
            right[1] += row * (nu.y * weight);
        }
        normal_matrix[(1, 1)] += CURVATURE_RIDGE * scale_m2;
        normal_matrix[(2, 2)] += CURVATURE_RIDGE * scale_m2;
        let Some(inverse) = normal_matrix.try_inverse() else {
            return false;
        };
        let (x, y) = (inverse * right[0], inverse * right[1]);
        let shape = Matrix2::new(x.y, 0.5 * (x.z + y.y), 0.5 * (x.z + y.y), y.z);
        let normal = (self.normal + east * x.x + north * y.x).normalize();
        let axes = Matrix3x2::from_columns(&[east, north]);
        self.bend = axes * shape * axes.transpose();
        self.normal = normal;
        self.curve = shape.symmetric_eigenvalues().amax();
        true
    }

    /// Moves the surfel along its normal to the weighted mean height of the places.
    fn lift(&mut self, own: &OrientedPlace, near: &[(&OrientedPlace, f64)]) {
        let surfel = self.surfel();
        let own_height = surfel.against(&own.position).depth_m;
        let (mut sum, mut heights) = (own.count, own.count * own_height);
        for (place, weight) in near {
            sum += weight;
            heights += weight * surfel.against(&place.position).depth_m;
        }
        self.position += self.normal * (heights / sum);
    }

    /// Scatter of the neighbours about the surfel, in depth and angle.
    fn scatter(&mut self, near: &[(&OrientedPlace, f64)]) {
        let surfel = self.surfel();
        let (mut sum, mut depth, mut angle) = (0.0, 0.0, 0.0);
        for (place, weight) in near {
            let against = surfel.against(&place.position);
            sum += weight;
            depth += weight * against.depth_m * against.depth_m;
            angle += weight * (1.0 - place.normal.dot(&against.normal));
        }
        if sum > 0.0 {
            self.weight = sum;
            self.depth_m2 = depth / sum;
            // 2 (1 − cos) is the squared angle, of two axes.
            self.angle = angle / sum;
        }
    }

    fn surfel(&self) -> Surfel {
        Surfel {
            position: self.position,
            normal: self.normal,
            place_normal: self.normal,
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
pub(crate) fn tangents(normal: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    // The cross product with the axis that is farthest from the normal is the best conditioned.
    let axis = normal.iamin();
    let mut least = Vector3::zeros();
    least[axis] = 1.0;
    let east = normal.cross(&least).normalize();
    (east, normal.cross(&east))
}
