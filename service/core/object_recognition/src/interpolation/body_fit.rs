//! Fit of a superellipsoid to places.

use std::f64::consts::{FRAC_PI_4, TAU};

use nalgebra::{Matrix3, Point3, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::superellipsoid::{Distance, PARAMETERS, Superellipsoid};
use super::tails;
use super::tuning::{
    BODY_FIRST_STEPS, BODY_KEPT, BODY_LAST_STEPS, BODY_SAMPLES, BODY_STEP_MAX, EXPONENT_LOG,
    EXPONENT_LOG_RANGE, EXPONENT_LOG_SD, SIDE_NOISES, SIZE_LOG_SD, TAPER_MAX, TAPER_SD,
};
use crate::numeric::{bounds, centroid};

type Parameters = SVector<f64, PARAMETERS>;
type Information = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Places to which a body is fitted.
///
/// A place is a point that is drawn evenly from the surface of the body, less an error across it:
/// its density is that of the error, by Student's distribution, per area. Without the area a body
/// is as large as it likes where nobody felt it.
#[derive(Debug)]
pub(super) struct BodyFit<'a> {
    pub(super) places: &'a [Point3<f64>],
    /// A quarter of the diagonal of the box about all of them \[m\].
    size_m: f64,
    /// Least variance of an error \[m²\].
    least_m2: f64,
}

/// A body, on the way to the one that fits best.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) form: Superellipsoid,
    /// Variance of a place about it \[m²\].
    pub(super) variance_m2: f64,
    /// Its negative log-likelihood times its prior.
    pub(super) cost: f64,
    /// It about each of the places.
    distances: Vec<Distance>,
}

impl<'a> BodyFit<'a> {
    /// To these places, of which each is known to a variance of `noise_m2` per axis.
    pub(super) fn new(places: &'a [Point3<f64>], noise_m2: f64) -> Self {
        let (low, high) = bounds(places.iter().map(|at| at.coords));
        let size_m = f64::max(0.25 * (high - low).norm(), 1e-9);
        Self {
            places,
            size_m,
            least_m2: f64::max(noise_m2, 1e-8 * size_m * size_m),
        }
    }

    /// To others of the same object.
    pub(super) fn of<'b>(&self, places: &'b [Point3<f64>]) -> BodyFit<'b> {
        BodyFit { places, ..*self }
    }

    /// The bodies that fit best, from different starts, the best first.
    pub(super) fn found(&self) -> Vec<Candidate> {
        let step = self.places.len().div_ceil(BODY_SAMPLES).max(1);
        let some: Vec<Point3<f64>> = self.places.iter().step_by(step).copied().collect();
        let few = self.of(&some);
        let by_cost = |a: &Candidate, b: &Candidate| a.cost.total_cmp(&b.cost);
        let first = few.starts().into_iter();
        let mut found: Vec<Candidate> = first
            .map(|form| few.refined(form, BODY_FIRST_STEPS))
            .collect();
        found.sort_by(by_cost);
        found.truncate(BODY_KEPT);
        let last = found.into_iter();
        let refined = last.map(|own| self.refined(own.form, BODY_LAST_STEPS));
        let mut found: Vec<Candidate> = refined.filter(|own| own.cost.is_finite()).collect();
        found.sort_by(by_cost);
        found
    }

    /// Whether all places lie in a plane, as far as their noise tells: those of an outline tell no
    /// body.
    pub(super) fn is_flat(&self) -> bool {
        let across_m2 = self.spread().symmetric_eigenvalues().min() / self.places.len() as f64;
        across_m2 < SIDE_NOISES * SIDE_NOISES * self.least_m2
    }

    /// Sum of the squares of the offsets from the middle \[m²\].
    fn spread(&self) -> Matrix3<f64> {
        let middle = centroid(self.places.iter().map(|at| at.coords));
        let squares = self.places.iter().map(|at| {
            let apart = at.coords - middle;
            apart * apart.transpose()
        });
        squares.sum()
    }

    /// Balls, boxes and cylinders along the principal axes of the places, and turned by an eighth.
    fn starts(&self) -> Vec<Superellipsoid> {
        let mut axes = self.spread().symmetric_eigen().eigenvectors;
        if axes.determinant() < 0.0 {
            axes = -axes;
        }
        let principal = Rotation3::from_matrix_unchecked(axes);
        let principal = UnitQuaternion::from_rotation_matrix(&principal);
        let turns = [
            Vector3::zeros(),
            FRAC_PI_4 * Vector3::x(),
            FRAC_PI_4 * Vector3::y(),
            FRAC_PI_4 * Vector3::z(),
        ];
        // About the diagonal, so that each axis is the last one once.
        let thirds = [0.0, 1.0, 2.0].map(|k| Vector3::repeat(k * TAU / 27.0_f64.sqrt()));
        let mut starts = Vec::new();
        for (turn, third) in turns
            .iter()
            .flat_map(|turn| thirds.map(|third| (turn, third)))
        {
            let turned = [*turn, third].map(UnitQuaternion::from_scaled_axis);
            let rotation = principal * turned[0] * turned[1];
            let own = self.places.iter().map(|at| rotation.inverse() * at.coords);
            let (low, high) = bounds(own);
            for exponents in [[2.0, 2.0], [8.0, 8.0], [2.0, 8.0]] {
                starts.push(Superellipsoid {
                    middle: Point3::from(rotation * ((low + high) / 2.0)),
                    rotation,
                    half_m: ((high - low) / 2.0).map(|own| own.max(0.05 * self.size_m)),
                    exponent_logs: exponents.map(f64::ln),
                    taper: 0.0,
                });
            }
        }
        starts
    }

    /// The body that so many steps of Levenberg and Marquardt lead to, at most.
    pub(super) fn refined(&self, form: Superellipsoid, steps: usize) -> Candidate {
        let mut best = self.candidate(form);
        let mut damping = 1e-2;
        for _ in 0..steps {
            let (mut information, gradient) = self.information(&best);
            for own in 0..PARAMETERS {
                information[(own, own)] *= 1.0 + damping;
            }
            let Some(factor) = information.cholesky() else {
                break;
            };
            let mut step = -factor.solve(&gradient);
            let largest = step.fixed_rows::<9>(3).amax();
            if largest > BODY_STEP_MAX {
                step *= BODY_STEP_MAX / largest;
            }
            let mut form = best.form.moved(&step);
            let [least, most] = EXPONENT_LOG_RANGE;
            form.exponent_logs = form.exponent_logs.map(|own| own.clamp(least, most));
            form.taper = form.taper.clamp(-TAPER_MAX, TAPER_MAX);
            let next = self.candidate(form);
            if next.cost < best.cost {
                let gained = best.cost - next.cost;
                best = next;
                damping = f64::max(0.2 * damping, 1e-6);
                if gained < 1e-3 {
                    break;
                }
            } else {
                damping *= 8.0;
                if damping > 1e4 {
                    break;
                }
            }
        }
        best
    }

    fn candidate(&self, form: Superellipsoid) -> Candidate {
        let distances: Vec<Distance> = self.places.iter().map(|at| form.distance(at)).collect();
        let squares = distances.iter().map(|own| own.off_m * own.off_m);
        let errors: Vec<(f64, f64, f64)> = squares.map(|square| (square, 1.0, 1.0)).collect();
        let (log, variance_m2) = tails::profile(&errors, self.least_m2);
        let count = self.places.len() as f64;
        let squares = self
            .prior_errors(&form)
            .map(|(apart, sd)| (apart / sd).powi(2));
        let cost = count * (form.area_log().log - log) + 0.5 * squares.iter().sum::<f64>();
        Candidate {
            form,
            variance_m2,
            cost,
            distances,
        }
    }

    /// How far sizes, exponents and taper are from what is expected, and the deviations of that.
    fn prior_errors(&self, form: &Superellipsoid) -> [(f64, f64); 6] {
        let [x, y, z] = form.half_m.map(|own| (own / self.size_m).ln()).into();
        let [p, q] = form.exponent_logs.map(|own| own - EXPONENT_LOG);
        [
            (x, SIZE_LOG_SD),
            (y, SIZE_LOG_SD),
            (z, SIZE_LOG_SD),
            (p, EXPONENT_LOG_SD),
            (q, EXPONENT_LOG_SD),
            (form.taper, TAPER_SD),
        ]
    }

    /// Information on the parameters, and the gradient of the cost.
    pub(super) fn information(&self, own: &Candidate) -> (Information, Parameters) {
        let mut information = Information::zeros();
        let mut gradient = Parameters::zeros();
        for distance in &own.distances {
            let square = distance.off_m * distance.off_m;
            let weight = tails::weight(square / own.variance_m2) / own.variance_m2;
            information.syger(weight, &distance.slopes, &distance.slopes, 1.0);
            gradient += distance.slopes * (weight * distance.off_m);
        }
        let count = self.places.len() as f64;
        let area = own.form.area_log();
        let mut sizes = information.fixed_view_mut::<3, 3>(6, 6);
        sizes += area.curvature * count;
        let prior = self.prior_errors(&own.form);
        let slopes = area.slopes.iter().chain(&[0.0]);
        for (number, ((apart, sd), slope)) in (6..).zip(prior.iter().zip(slopes)) {
            gradient[number] += count * slope + apart / (sd * sd);
            information[(number, number)] += 1.0 / (sd * sd);
        }
        // What nothing tells of, as a cylinder's turn about itself, stays as it is.
        for axis in 0..3 {
            information[(axis, axis)] += self.size_m.powi(-2);
            information[(3 + axis, 3 + axis)] += 1.0;
        }
        information.fill_upper_triangle_with_lower_triangle();
        (information, gradient)
    }
}
