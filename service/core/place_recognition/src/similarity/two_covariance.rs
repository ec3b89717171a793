//! The two-covariance model of a channel.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::runs::Runs;
use crate::tuning::similarity as tuning;

/// Scores of all pairs of views: logarithms of how much more probable two views are of one place
/// than of any two, up to a scale.
///
/// A view is the sum of what its place shows and of noise, both Gaussian (Ioffe 2006,
/// "Probabilistic linear discriminant analysis"). The noise has half the covariance of what
/// neighbours along the way differ by, W; all together have the covariance T. With T v = w W v,
/// r = 1 − 1/w and z = Vᵀ x / √w, brought to the norm of its number of components, it is
///
/// ```text
/// S = Σ [ r/(1−r²) z₁ z₂ − r²/(2 (1−r²)) (z₁² + z₂²) − ½ ln(1 − r²) ]
/// ```
///
/// W and T are those of the views of a range. `None` if neighbours are no more alike than others.
pub(super) fn scores(runs: &Runs<'_>, learned_from: Range<usize>) -> Option<DMatrix<f32>> {
    let views = centred(runs);
    let within = within(runs, &views, &learned_from)?;
    let known = views.rows(learned_from.start, learned_from.len());
    let total = known.tr_mul(&known) / known.nrows() as f64;
    let shrunk = tuning::SHRINKAGE * within.trace() / within.nrows() as f64;
    let shrink = |matrix: DMatrix<f64>| {
        let ridge = DMatrix::from_diagonal_element(matrix.nrows(), matrix.nrows(), shrunk);
        matrix + ridge
    };
    let factor = Cholesky::new(shrink(within))?.unpack();
    // L⁻¹ T L⁻ᵀ has the eigenvalues w, and V = L⁻ᵀ Q.
    let half = factor.solve_lower_triangular(&shrink(total))?;
    let whitened = factor.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new((&whitened + whitened.transpose()) * 0.5);
    let vectors = factor.tr_solve_lower_triangular(&eigen.eigenvectors)?;
    let kept: Vec<(usize, f64)> = { eigen.eigenvalues.iter().enumerate() }
        .map(|(column, w)| (column, (1.0 - 1.0 / w).clamp(0.0, tuning::CORRELATION_MAX)))
        .filter(|(_, r)| *r > tuning::CORRELATION_MIN)
        .collect();
    if kept.is_empty() {
        return None;
    }
    let columns: Vec<_> = { kept.iter() }
        .map(|&(column, _)| vectors.column(column) / eigen.eigenvalues[column].sqrt())
        .collect();
    let mut components = &views * DMatrix::from_columns(&columns);
    let norm = (kept.len() as f64).sqrt();
    for mut row in components.row_iter_mut() {
        let length = row.norm().max(f64::MIN_POSITIVE.sqrt());
        row *= norm / length;
    }
    Some(pair_scores(&components, &kept))
}

/// S, at a standard deviation of at most one.
fn pair_scores(components: &DMatrix<f64>, kept: &[(usize, f64)]) -> DMatrix<f32> {
    let n = components.nrows();
    let correlations = || kept.iter().map(|(_, r)| r);
    let own = DVector::from_iterator(
        kept.len(),
        correlations().map(|r| 0.5 * r * r / (1.0 - r * r)),
    );
    let shared = DVector::from_iterator(kept.len(), correlations().map(|r| r / (1.0 - r * r)));
    let constant = -0.5 * correlations().map(|r| (1.0 - r * r).ln()).sum::<f64>();
    let own = components.map(|z| z * z) * own;
    let mut weighted = components.clone();
    for (mut column, weight) in weighted.column_iter_mut().zip(shared.iter()) {
        column *= *weight;
    }
    let [components, weighted] = [components, &weighted].map(|m| m.map(single));
    let mut scores: DMatrix<f32> = weighted * components.transpose();
    let (mut sum, mut squares) = (0.0, 0.0);
    for column in 0..n {
        for row in 0..n {
            let score = &mut scores[(row, column)];
            *score += single(constant - own[row] - own[column]);
            sum += f64::from(*score);
            squares += f64::from(*score) * f64::from(*score);
        }
    }
    let count = (n * n) as f64;
    let variance = squares / count - (sum / count).powi(2);
    scores / single(variance.max(0.0).sqrt().max(1.0))
}

/// The views, one a row, about their mean. A long session is centred about its own mean: seasons
/// and hours change all views alike.
fn centred(runs: &Runs<'_>) -> DMatrix<f64> {
    let width = runs.views.first().map_or(0, |view| view.vector.len());
    let mut rows = DMatrix::from_fn(runs.len(), width, |row, column| {
        f64::from(runs.views[row].vector[column])
    });
    let session = |row: usize| {
        let sample = runs.views[row].sample;
        (sample.agent, sample.session)
    };
    let whole = rows.row_mean();
    let mut begin = 0;
    while begin < rows.nrows() {
        let mut end = begin;
        while end < rows.nrows() && session(end) == session(begin) {
            end += 1;
        }
        let mut some = rows.rows_mut(begin, end - begin);
        let mean = if end - begin >= tuning::SESSION_VIEWS_MIN {
            some.row_mean()
        } else {
            whole.clone()
        };
        for mut row in some.row_iter_mut() {
            row -= &mean;
        }
        begin = end;
    }
    rows
}

/// Half the covariance of what neighbours in a range differ by; `None` if there are too few.
fn within(
    runs: &Runs<'_>,
    views: &DMatrix<f64>,
    learned_from: &Range<usize>,
) -> Option<DMatrix<f64>> {
    let mut differences = Vec::new();
    for index in learned_from.clone() {
        for lag in tuning::NEIGHBOUR_LAGS {
            let other = runs.after(index, lag);
            if let Some(other) = other.filter(|other| learned_from.contains(other)) {
                differences.push(views.row(other) - views.row(index));
            }
        }
    }
    if differences.len() < tuning::NEIGHBOURS_MIN {
        return None;
    }
    let all = DMatrix::from_rows(&differences);
    Some(all.tr_mul(&all) / (2.0 * differences.len() as f64))
}

/// In single precision, of which a score needs no more.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a score is no exact number"
)]
pub(super) fn single(value: f64) -> f32 {
    value as f32
}
