//! Coverage test: whether contacts that were drawn from all of a surface lie on all of it.

use nalgebra::{Point3, Vector3};

use crate::numeric::centroid;
use crate::surfels::surfel::Surfel;
use crate::tuning::{COVERAGE_CONTACTS_MIN, HALVINGS_MAX, PART_PLACES_MIN};
use crate::z_score;

/// A surface in parts of equal area (a k-d tree): halved across its longest axis, and each half
/// again.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoverageTest {
    /// Axis and position of each cut \[m\]; the two that follow the cut k are 2k + 1 and 2k + 2.
    cuts: Vec<(usize, f64)>,
    /// Share of the surface in each part.
    shares: Vec<f64>,
    /// Surfels by which the shares were estimated.
    places: f64,
}

impl CoverageTest {
    /// Of a surface's surfels.
    pub(crate) fn new(surfels: &[Surfel]) -> Self {
        let depth = (surfels.len() / PART_PLACES_MIN).max(1).ilog2() as usize;
        let mut parts = vec![(0..surfels.len()).collect::<Vec<_>>()];
        let mut cuts = Vec::new();
        for _ in 0..depth.min(HALVINGS_MAX) {
            let mut coverage_test = Vec::with_capacity(2 * parts.len());
            for part in parts {
                let (cut, [below, above]) = halved(surfels, part);
                cuts.push(cut);
                coverage_test.extend([below, above]);
            }
            parts = coverage_test;
        }
        let area = |part: &Vec<usize>| part.iter().map(|&at| surfels[at].area_m2).sum::<f64>();
        let all: f64 = parts.iter().map(area).sum();
        Self {
            cuts,
            shares: parts.iter().map(|part| area(part) / all).collect(),
            places: surfels.len() as f64,
        }
    }

    /// Pearson's chi-squared test of points that were drawn from the whole surface, as a z-score:
    /// lower where they are less even. `None` if they are too few or the surface is one part.
    pub(crate) fn z_score(&self, points: impl Iterator<Item = Point3<f64>>) -> Option<f64> {
        let mut counts = vec![0.0; self.shares.len()];
        let mut count = 0;
        for point in points {
            counts[self.part(&point)] += 1.0;
            count += 1;
        }
        if count < COVERAGE_CONTACTS_MIN || self.shares.len() < 2 {
            return None;
        }
        let count = f64::from(u32::try_from(count).unwrap_or(u32::MAX));
        let parts = counts.iter().zip(&self.shares);
        let sum: f64 = parts.map(|(own, share)| own * own / share).sum();
        // The shares were estimated from contacts too: with n points and N surfels the variance of
        // the difference is 1 + n/N times that of the points.
        let chi_squared = (sum / count - count) / (1.0 + count / self.places);
        let degrees = self.shares.len() as f64 - 1.0;
        Some(z_score::from_chi_squared(chi_squared, degrees))
    }

    fn part(&self, point: &Point3<f64>) -> usize {
        let mut at = 0;
        while let Some((axis, cut)) = self.cuts.get(at) {
            at = 2 * at + if point[*axis] < *cut { 1 } else { 2 };
        }
        at - self.cuts.len()
    }
}

/// The cut through the median of a part's area across its longest axis, and both halves.
fn halved(surfels: &[Surfel], mut part: Vec<usize>) -> ((usize, f64), [Vec<usize>; 2]) {
    let place = |at: usize| surfels[at].position.coords;
    let mean = centroid(part.iter().map(|&at| place(at)));
    let spread = part.iter().map(|&at| (place(at) - mean).map(|x| x * x));
    let axis = spread.sum::<Vector3<f64>>().imax();
    part.sort_by(|&a, &b| place(a)[axis].total_cmp(&place(b)[axis]).then(a.cmp(&b)));
    let all: f64 = part.iter().map(|&at| surfels[at].area_m2).sum();
    let mut sum = 0.0;
    let middle = part.iter().position(|&at| {
        sum += surfels[at].area_m2;
        sum > 0.5 * all
    });
    // No half is without a place.
    let middle = middle.unwrap_or(0).clamp(1, part.len().max(2) - 1);
    let above = part.split_off(middle.min(part.len()));
    let ends = [part.last(), above.first()].map(|end| end.map_or(0.0, |&at| place(at)[axis]));
    ((axis, 0.5 * (ends[0] + ends[1])), [part, above])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfels::fit::surfels;
    use crate::{Contact, ModelSettings, ObjectModel};

    fn uniform(key: u64) -> f64 {
        random::uniform(5, [0, 0, key])
    }

    /// A plate with four times as many places on its one half.
    fn coverage_test() -> (CoverageTest, Vec<f64>) {
        let mut model = ObjectModel::new(ModelSettings::default());
        for k in 0..40 {
            for j in 0..20 {
                let dense = k % 2 == 0 && j % 2 == 0 || k < 20;
                if dense {
                    let at = Point3::new(f64::from(k) * 0.006, f64::from(j) * 0.006, 0.0);
                    let contact = Contact::at(at, 1e-4).with_normal(Vector3::z_axis(), 0.01);
                    model.learn(&contact);
                }
            }
        }
        let coverage_test = CoverageTest::new(&surfels(model.places()));
        let shares = coverage_test.shares.clone();
        (coverage_test, shares)
    }

    #[test]
    fn contacts_from_everywhere_are_even_and_those_from_a_part_are_not() {
        let (coverage_test, shares) = coverage_test();
        assert_eq!(shares.len(), 16);
        assert!(
            shares.iter().all(|share| (share - 1.0 / 16.0).abs() < 0.02),
            "{shares:?}"
        );
        let drawn = |from: f64, trial: u64, count: u64| {
            let points = (0..count).map(move |k| {
                let key = 1000 * trial + 2 * k;
                Point3::new(
                    (from + (1.0 - from) * uniform(key)) * 0.237,
                    uniform(key + 1) * 0.117,
                    0.0,
                )
            });
            coverage_test.z_score(points)
        };
        let (mut sum, mut squares) = (0.0, 0.0);
        for trial in 0..200 {
            let deviation = drawn(0.0, trial, 40).unwrap();
            sum += deviation;
            squares += deviation * deviation;
        }
        let mean: f64 = sum / 200.0;
        let sd = (squares / 200.0 - mean * mean).sqrt();
        // About a standard normal number, though the areas are only about right.
        assert!(mean.abs() < 0.5 && (0.7..1.3).contains(&sd), "{mean} {sd}");
        assert!(drawn(0.7, 0, 40).unwrap() < -5.0);
        assert!(drawn(0.7, 0, 3).is_none());
    }
}
