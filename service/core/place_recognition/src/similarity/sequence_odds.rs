//! Log-odds of the sequences about two views: √n times the mean of the pairs that they meet in,
//! where n is the length of a whole sequence, the better of both directions of travel.

use nalgebra::DMatrix;

use super::log_odds::Learned;
use super::neighbours::{Beside, Neighbours};
use super::runs::Runs;
use super::two_covariance::single;
use crate::tuning::similarity as tuning;

/// Of all pairs of views, by the log-odds of all.
pub(super) fn of_all(runs: &Runs<'_>, log_odds: &DMatrix<f32>) -> DMatrix<f32> {
    let n = runs.len();
    let reach = tuning::SEQUENCE;
    let scale = single((2.0 * reach as f64 + 1.0).sqrt());
    let mut odds = DMatrix::zeros(n, n);
    for column in 0..n {
        for row in 0..=column {
            let along = |direction: isize| {
                let (mut sum, mut count) = (0.0, 0.0);
                for lag in -reach..=reach {
                    let pair = runs
                        .after(row, lag)
                        .zip(runs.after(column, lag * direction));
                    if let Some(pair) = pair {
                        sum += log_odds[pair];
                        count += 1.0;
                    }
                }
                sum / count
            };
            // Both orders of a pair are the same sequences.
            let best = scale * f32::max(along(1), along(-1));
            odds[(row, column)] = best;
            odds[(column, row)] = best;
        }
    }
    odds
}

/// Of all pairs of views that are matched, where there are others between them: the sequences are
/// of neighbours among all, whose `components` a row holds. `score` compares some with others.
pub(super) fn of_thinned(
    neighbours: &Neighbours<'_>,
    components: &DMatrix<f64>,
    score: impl Fn(&DMatrix<f64>, &DMatrix<f64>) -> DMatrix<f32>,
    learned: &Learned,
) -> DMatrix<f32> {
    let reach = tuning::SEQUENCE;
    let along = |direction: isize| {
        let (mut sums, mut counts) = (DMatrix::<f32>::zeros(0, 0), DMatrix::<f32>::zeros(0, 0));
        for lag in -reach..=reach {
            let (rows, columns) = (neighbours.beside(lag), neighbours.beside(lag * direction));
            if sums.is_empty() {
                sums = DMatrix::zeros(rows.len(), columns.len());
                counts = sums.clone();
            }
            let of = |views: &[Option<Beside>]| {
                let places: Vec<usize> = views.iter().flatten().map(|view| view.place).collect();
                components.select_rows(&places)
            };
            let scores = score(&of(&rows), &of(&columns));
            let known = |views: &[Option<Beside>]| -> Vec<(usize, usize)> {
                let views = views.iter().enumerate();
                views
                    .filter_map(|(number, view)| Some((number, view.as_ref()?.about)))
                    .collect()
            };
            let (rows, columns) = (known(&rows), known(&columns));
            for (scores, &(column, about_column)) in scores.column_iter().zip(&columns) {
                for (score, &(row, about_row)) in scores.iter().zip(&rows) {
                    let about = (about_row, about_column);
                    sums[(row, column)] += learned.log_odds_by(*score, about);
                    counts[(row, column)] += 1.0;
                }
            }
        }
        sums.component_div(&counts)
    };
    let best = along(1).zip_map(&along(-1), f32::max);
    let best = best * single((2.0 * reach as f64 + 1.0).sqrt());
    // Both orders of a pair are the same sequences.
    best.zip_map(&best.transpose(), f32::max)
}
