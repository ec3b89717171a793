//! The body that explains where an object was felt.

use std::f64::consts::PI;

use nalgebra::{Point3, SMatrix, SVector, Vector3};

use super::body_fit::{BodyFit, Candidate};
use super::graph::LinkGraph;
use super::superellipsoid::{PARAMETERS, PARAMETERS_OF_FORM, Superellipsoid};
use super::tails;
use super::taken::Taken;
use super::tuning::{
    BODY_FOLD_STEPS, BODY_FOLDS, BODY_MISSED_SDS, BODY_PLACES, BODY_PROBABILITY_MIN,
    CHOSEN_RATIO_SD, CORE_MAX, EXPONENT_LOG_SD, REGULARITY_MAX, REGULARITY_SD, SIDE_NORMAL_COS,
    SIDE_PROBABILITY_MIN, SIDE_SAMPLES, SIDE_SAMPLES_APART, SIZE_APART_SD, TAPER_SD,
    UNEXPECTED_SHARE,
};
use crate::model::ModelPlace;
use crate::numeric::median;

/// A superellipsoid through the places of a model, and how well it is known.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    form: Superellipsoid,
    /// Others that explain the places nearly as well, with their probabilities.
    others: Vec<(f64, Superellipsoid)>,
    /// Covariance of its parameters.
    covariance: SMatrix<f64, PARAMETERS, PARAMETERS>,
    /// Variance of the surface about it, without the noise of contacts \[m²\].
    surface_m2: f64,
    /// Median distance of the places from it, each left out \[m\].
    pub(super) typical_error_m: f64,
    /// Share of contacts that are not as it predicts: as many as places, and more where it is off
    /// by more than contacts are, since it is the form of the object then in parts only.
    pub(crate) unexpected: f64,
    /// By how much the places are likelier if they were chosen than if they are random
    /// ([`chosen_log`]); none where they are too dense to tell.
    pub(crate) chosen_log: Option<f64>,
}

/// How well places are predicted by bodies of the others.
#[derive(Debug)]
struct LeftOutErrors {
    /// Profile log-likelihood of a place, on average.
    log: f64,
    /// Variance of a place about the body \[m²\].
    variance_m2: f64,
    /// The same of most places: the square of the scale of Student's distribution \[m²\].
    scale_m2: f64,
    /// Median distance \[m\].
    typical_m: f64,
    /// Places that are off by more than a few deviations.
    missed: usize,
}

impl LeftOutErrors {
    /// Share of the variance of most places that is beyond the noise of contacts.
    fn beyond(&self, noise_m2: f64) -> f64 {
        (1.0 - noise_m2 / self.scale_m2).max(0.0)
    }
}

/// A point as a body predicts it.
#[derive(Clone, Debug)]
pub(crate) struct BodyPoint {
    /// Distance from the surface; inside it is negative \[m\].
    pub(crate) off_m: f64,
    /// Direction across the surface, outwards.
    pub(crate) across: Vector3<f64>,
    /// Variance of the surface about the body there \[m²\].
    pub(crate) surface_m2: f64,
    /// How much the distance grows with each parameter.
    slopes: SVector<f64, PARAMETERS>,
    /// The same by the covariance of the parameters.
    by_covariance: SVector<f64, PARAMETERS>,
}

impl BodyPoint {
    /// Covariance of the distances of two points, by that of the parameters \[m²\].
    pub(crate) fn covariance_m2(&self, other: &Self) -> f64 {
        self.slopes.dot(&other.by_covariance)
    }

    /// The same by how much the bodies of objects differ in size, exponents and taper \[m²\].
    pub(crate) fn apart_m2(&self, other: &Self) -> f64 {
        let sds = [SIZE_APART_SD; 3].into_iter();
        let sds = sds.chain([EXPONENT_LOG_SD, EXPONENT_LOG_SD, TAPER_SD]);
        let form = sds.zip(PARAMETERS_OF_FORM);
        form.map(|(sd, number)| sd * sd * self.slopes[number] * other.slopes[number])
            .sum()
    }
}

impl Body {
    /// A point as it predicts it.
    pub(crate) fn about(&self, point: &Point3<f64>) -> BodyPoint {
        let distance = self.form.distance(point);
        BodyPoint {
            off_m: distance.off_m,
            across: distance.normal,
            surface_m2: self.surface_m2 + self.others_m2(point, distance.off_m),
            by_covariance: self.covariance * distance.slopes,
            slopes: distance.slopes,
        }
    }

    /// Variance of a point's distance over the bodies that are nearly as likely \[m²\].
    fn others_m2(&self, point: &Point3<f64>, off_m: f64) -> f64 {
        let others = self.others.iter();
        let apart = others.map(|(p, form)| p * (form.distance(point).off_m - off_m).powi(2));
        apart.sum()
    }

    /// The body of the largest likelihood, and the log-likelihood per place, each predicted by the
    /// body of others, as [`Field::learned`](super::field::Field::learned) has it of the places
    /// around. None of a curve and of what lies in a plane.
    pub(super) fn fitted(
        places: &[ModelPlace],
        graph: &LinkGraph,
        spacing_m: f64,
    ) -> Option<(f64, Self)> {
        if graph.is_curve() {
            return None;
        }
        let positions: Vec<Point3<f64>> = places.iter().map(|place| place.position_m).collect();
        let noise = places
            .iter()
            .map(|place| place.variance_m2 / (place.count * place.count));
        let noise_m2 = noise.sum::<f64>() / places.len().max(1) as f64;
        let all = BodyFit::new(&positions, noise_m2);
        if all.is_flat() {
            return None;
        }
        let some = evenly_chosen(&positions, BODY_PLACES);
        let fit = all.of(&some);
        let found = fit.found();
        let best = found.first()?;
        let errors = left_out(&fit, &found)?;
        // As the others predict a place, so they predict what was not felt.
        let covariance = fit.information(best).0.cholesky()?.inverse();
        let surface_m2 = f64::max(errors.variance_m2 - noise_m2, 0.0);
        // The rule of succession (Laplace 1774).
        let missed = (errors.missed as f64 + 1.0) / (some.len() as f64 + 2.0);
        let masses: Vec<f64> = found
            .iter()
            .map(|own| (best.cost - own.cost).exp())
            .collect();
        let all = masses.iter().sum::<f64>();
        let others = { found.iter().zip(&masses).skip(1) }
            .map(|(own, mass)| (mass / all, own.form.clone()))
            .filter(|(probability, _)| *probability > BODY_PROBABILITY_MIN);
        let off = regularity(&best.form, &positions, spacing_m);
        let body = Self {
            chosen_log: off.map(|off| chosen_log(off, positions.len())),
            form: best.form.clone(),
            others: others.collect(),
            covariance: covariance * (errors.variance_m2 / best.variance_m2),
            surface_m2,
            typical_error_m: errors.typical_m,
            unexpected: f64::max(missed, UNEXPECTED_SHARE * errors.beyond(noise_m2)),
        };
        Some((errors.log, body))
    }

    /// Variance of the surface about a point of it, and the direction across.
    pub(super) fn surface(&self, point: &Point3<f64>) -> (f64, Vector3<f64>) {
        let distance = self.form.distance(point);
        let slopes = distance.slopes;
        let others = self.others.iter();
        let apart_m2 =
            others.map(|(probability, form)| probability * form.distance(point).off_m.powi(2));
        let known_m2 = self.surface_m2 + slopes.dot(&(self.covariance * slopes));
        (known_m2 + apart_m2.sum::<f64>(), distance.normal)
    }

    /// Whether it was felt on all sides: on none are so few places that hardly one in a hundred
    /// bodies would have so few of as many places at random (Poisson 1837). On the far side of what
    /// was felt from above are those about its edge alone.
    pub(super) fn is_felt_all_over(&self, places: &[ModelPlace]) -> bool {
        let mut taken = Taken::new(
            SIDE_SAMPLES_APART * self.form.half_m.mean(),
            SIDE_SAMPLES as usize / 8,
        );
        let points = self.points(SIDE_SAMPLES).filter(|at| {
            let is_free = !taken.holds(at);
            if is_free {
                taken.add(*at);
            }
            is_free
        });
        let normal = |at: Point3<f64>| self.form.distance(&at).normal;
        let all: Vec<Vector3<f64>> = points.map(normal).collect();
        let felt = places.iter().map(|place| normal(place.position_m));
        let felt: Vec<Vector3<f64>> = felt.collect();
        let axes = self.form.rotation.to_rotation_matrix();
        let mut sides = axes
            .matrix()
            .column_iter()
            .flat_map(|axis| [axis.into(), -axis]);
        sides.all(|side: Vector3<f64>| {
            let is_on = |own: &&Vector3<f64>| own.dot(&side) > SIDE_NORMAL_COS;
            let share = all.iter().filter(is_on).count() as f64 / all.len().max(1) as f64;
            let expected = share * places.len() as f64;
            at_most(felt.iter().filter(is_on).count(), expected) > SIDE_PROBABILITY_MIN
        })
    }

    /// So many points all over the surface.
    pub(super) fn points(&self, count: u32) -> impl Iterator<Item = Point3<f64>> {
        // A spiral over a ball.
        let golden = std::f64::consts::TAU * 0.618_033_988_749_895;
        (0..count).map(move |k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
            let (sin, cos) = (golden * f64::from(k)).sin_cos();
            let across = (1.0 - z * z).sqrt();
            self.form
                .point(&Vector3::new(across * cos, across * sin, z))
        })
    }
}

/// About so many of some points, or all of them, chosen evenly but with no period: two fingers may
/// have felt them in turns.
fn evenly_chosen(points: &[Point3<f64>], count: usize) -> Vec<Point3<f64>> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let share = count as f64 / points.len().max(1) as f64;
    let numbered = points.iter().enumerate();
    // Fractions of the multiples of the golden ratio are spread evenly (Weyl 1916).
    let chosen = numbered.filter(|(number, _)| (*number as f64 * GOLDEN).fract() < share);
    chosen.map(|(_, point)| *point).collect()
}

/// By how many deviations points of a body lie farther from their nearest ones than points that are
/// drawn at random from it, of which those within `spacing_m` of one another are one. `None` where
/// those are so many that the rest tells little.
///
/// Of n points on an area A the nearest is m = √(A/n)/2 away on average, with a deviation of 0.26
/// √A/n of the mean over all (Clark and Evans 1954, Distance to nearest neighbor as a measure of
/// spatial relationships in populations). The distance r has the density 2πr n/A exp(−πr² n/A), and
/// beyond a spacing h the mean h + m exp(x) erfc(√x) with x = πh²n/A, of which the first terms are
/// m (1 + x − 4/(3√π) x^1.5 + x²/2).
fn regularity(form: &Superellipsoid, points: &[Point3<f64>], spacing_m: f64) -> Option<f64> {
    let count = points.len().max(1) as f64;
    let nearest_m = points.iter().enumerate().map(|(own, point)| {
        let others = { points.iter().enumerate() }.filter(|(other, _)| *other != own);
        let apart_m = others.map(|(_, other)| (other - point).norm());
        apart_m.fold(f64::INFINITY, f64::min)
    });
    let side_m = (form.area_log().log / 2.0).exp();
    let within = PI * spacing_m * spacing_m * count / (side_m * side_m);
    if within > CORE_MAX {
        return None;
    }
    let half = 4.0 / (3.0 * PI.sqrt()) * within.powf(1.5);
    let beyond = 1.0 + within - half + 0.5 * within * within;
    let off_m = nearest_m.sum::<f64>() / count - 0.5 * side_m / count.sqrt() * beyond;
    // One object that is beyond all measure must not tell of the others.
    Some(off_m * count / (REGULARITY_SD * side_m)).filter(|off| off.abs() < REGULARITY_MAX)
}

/// Log-likelihood ratio of places that were chosen, and lie so many deviations farther apart than
/// random ones, to random ones.
///
/// By chance that is a standard normal number. Of chosen places the mean distance is a part or a
/// multiple of that of random ones: it is as normal, with the variance of that ratio added.
fn chosen_log(regularity: f64, places: usize) -> f64 {
    let of_ratio = 0.5 * CHOSEN_RATIO_SD / REGULARITY_SD;
    let variance = 1.0 + of_ratio * of_ratio * places as f64;
    0.5 * (regularity * regularity * (1.0 - 1.0 / variance) - variance.ln())
}

/// Probability of so many events at most, of which so many are expected.
fn at_most(count: usize, expected: f64) -> f64 {
    let mut term = (-expected).exp();
    let mut sum = term;
    for number in 1..=count {
        term *= expected / number as f64;
        sum += term;
    }
    sum
}

/// How well places are predicted by the bodies that the others make of the ones found.
fn left_out(fit: &BodyFit<'_>, found: &[Candidate]) -> Option<LeftOutErrors> {
    let folds = BODY_FOLDS.min(fit.places.len());
    let mut errors = Vec::with_capacity(fit.places.len());
    for fold in 0..folds {
        let of_fold = |own: bool| {
            let numbered = fit.places.iter().enumerate();
            numbered.filter(move |(number, _)| (number % folds == fold) == own)
        };
        let kept: Vec<Point3<f64>> = of_fold(false).map(|(_, at)| *at).collect();
        let fit = fit.of(&kept);
        let refined = { found.iter() }.map(|own| fit.refined(own.form.clone(), BODY_FOLD_STEPS));
        let body = refined.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        let covariance = fit.information(&body).0.cholesky()?.inverse() / body.variance_m2;
        for (_, at) in of_fold(true) {
            let distance = body.form.distance(at);
            let slopes = distance.slopes;
            let open = 1.0 + slopes.dot(&(covariance * slopes));
            errors.push((distance.off_m.powi(2) / open, open, 1.0));
        }
    }
    let (log, scale_m2) = tails::profile(&errors, f64::MIN_POSITIVE.sqrt());
    let usual = BODY_MISSED_SDS.powi(2) * scale_m2;
    let offs = errors.iter().map(|(square, open, _)| square * open);
    Some(LeftOutErrors {
        log,
        variance_m2: errors.iter().map(|own| own.0).sum::<f64>() / errors.len() as f64,
        scale_m2,
        typical_m: median(offs.collect()).sqrt(),
        missed: errors.iter().filter(|own| own.0 > usual).count(),
    })
}
