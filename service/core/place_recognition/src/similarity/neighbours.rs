//! Neighbours along the way: what is known to be of one place.

use nalgebra::DMatrix;

use super::runs::Runs;
use super::two_covariance::TwoCovariance;
use crate::tuning::similarity as tuning;

/// Two views of a run, near to one another along the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct NeighbourPair {
    /// Number of the first among the views that are matched, and of one of these about the second.
    pub(super) about: (usize, usize),
    /// Views from the first to the second.
    pub(super) lag: usize,
    /// Distance between them by motion alone \[m\].
    pub(super) distance_m: f64,
    /// Angle that the body has turned by between them, by motion alone \[rad\].
    pub(super) turn_rad: f64,
    /// Their score.
    pub(super) score: f64,
}

/// A view beside one of those that are matched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// Its number among all.
    pub(super) place: usize,
    /// The number of one about it among those that are matched.
    pub(super) about: usize,
}

/// The neighbours of views that are matched, among all views: of those that are matched two in a
/// row may be so far apart that they show different places.
#[derive(Debug)]
pub(super) struct Neighbours<'a> {
    all: &'a Runs<'a>,
    matched: &'a Runs<'a>,
    /// Where each view that is matched is among all.
    places: Vec<usize>,
}

impl<'a> Neighbours<'a> {
    /// Of views that are matched among all.
    pub(super) fn of(all: &'a Runs<'a>, matched: &'a Runs<'a>) -> Self {
        Self {
            all,
            matched,
            places: all.places_of(matched),
        }
    }

    /// Of all views, one a row, those that are matched.
    pub(super) fn of_matched(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        rows.select_rows(&self.places)
    }

    /// Half the covariance of what neighbours of the first views differ by; `None` if there are too
    /// few.
    pub(super) fn within(&self, views: &DMatrix<f64>, first: usize) -> Option<DMatrix<f64>> {
        let mut differences = Vec::new();
        let end = self.places.get(first).copied().unwrap_or(self.all.len());
        for &place in &self.places[..first] {
            for lag in tuning::NEIGHBOUR_LAGS {
                let other = self.all.after(place, lag);
                if let Some(other) = other.filter(|&other| other < end) {
                    differences.push(views.row(other) - views.row(place));
                }
            }
        }
        if differences.len() < tuning::NEIGHBOURS_MIN {
            return None;
        }
        let all = DMatrix::from_rows(&differences);
        Some(all.tr_mul(&all) / (2.0 * differences.len() as f64))
    }

    /// The pairs of each view that is matched with those after it, near and farther, by the
    /// components of all.
    pub(super) fn pairs(
        &self,
        model: &TwoCovariance,
        components: &DMatrix<f64>,
        score_sd: f64,
    ) -> Vec<NeighbourPair> {
        let stride = self.stride();
        let near = 1..=tuning::RANGE_LAGS.cast_signed();
        let mut lags: Vec<isize> = near.clone().chain(near.map(|lag| lag * stride)).collect();
        lags.sort_unstable();
        lags.dedup();
        let score = model.score(components);
        let mut pairs = Vec::new();
        for &lag in &lags {
            for (first, second) in self.beside(lag).into_iter().enumerate() {
                let (Some(second), place) = (second, self.places[first]) else {
                    continue;
                };
                let score = score(place, second.place);
                pairs.push(NeighbourPair {
                    about: (first, second.about),
                    lag: lag.unsigned_abs(),
                    distance_m: self.all.distance_m(place, second.place),
                    turn_rad: self.all.turn_rad(place, second.place),
                    score: score / score_sd,
                });
            }
        }
        pairs
    }

    /// The view so many after each view that is matched, if it is of the same run.
    pub(super) fn beside(&self, lag: isize) -> Vec<Option<Beside>> {
        let places = self.places.iter().enumerate();
        let beside = |(number, &place): (usize, &usize)| {
            let about = self.matched.after(number, lag / self.stride());
            Some(Beside {
                place: self.all.after(place, lag)?,
                about: about.unwrap_or(number),
            })
        };
        places.map(beside).collect()
    }

    /// Views from one that is matched to the next.
    fn stride(&self) -> isize {
        let stride = self.matched.stride / self.all.stride.max(1);
        isize::try_from(stride).unwrap_or(isize::MAX).max(1)
    }
}
