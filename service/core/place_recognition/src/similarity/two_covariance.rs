//! The two-covariance model of a channel.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use crate::tuning::similarity as tuning;

/// The two-covariance model of a channel (Ioffe 2006, "Probabilistic linear discriminant
/// analysis").
///
/// A view is the sum of what its place shows and of noise, both Gaussian. The noise has half the
/// covariance of what neighbours along the way differ by, W; all together have the covariance T.
/// With T v = w W v, r = 1 − 1/w and z = Vᵀ x / √w, brought to the norm of its number of
/// components, two views are of one place as much more probably than any two as the score says, up
/// to a scale:
///
/// ```text
/// S = Σ [ r/(1−r²) z₁ z₂ − r²/(2 (1−r²)) (z₁² + z₂²) − ½ ln(1 − r²) ]
/// ```
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TwoCovariance {
    /// V / √w: a row for each number of a view, a column for each component.
    pub(super) columns: DMatrix<f64>,
    /// r of each component.
    pub(super) correlations: Vec<f64>,
}

impl TwoCovariance {
    /// From half the covariance of what neighbours differ by, and from centred views, one a row;
    /// `None` if neighbours are no more alike than others.
    pub(super) fn of(within: DMatrix<f64>, views: &DMatrix<f64>) -> Option<Self> {
        let total = views.tr_mul(views) / views.nrows() as f64;
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
        Some(Self {
            columns: DMatrix::from_columns(&columns),
            correlations: kept.into_iter().map(|(_, r)| r).collect(),
        })
    }

    /// z of each of the centred views, one a row.
    pub(super) fn components(&self, views: &DMatrix<f64>) -> DMatrix<f64> {
        let mut components = views * &self.columns;
        let norm = (self.correlations.len() as f64).sqrt();
        for mut row in components.row_iter_mut() {
            let length = row.norm().max(f64::MIN_POSITIVE.sqrt());
            row *= norm / length;
        }
        components
    }

    /// S of each of some views, a row, and each of others, a column, by their components.
    pub(super) fn scores_between(
        &self,
        some: &DMatrix<f64>,
        others: &DMatrix<f64>,
    ) -> DMatrix<f32> {
        let (shared, own, constant) = self.terms();
        let [own_of_some, own] = [some, others].map(|views| views.map(|z| z * z) * &own);
        let mut weighted = some.clone();
        for (mut column, weight) in weighted.column_iter_mut().zip(shared.iter()) {
            column *= *weight;
        }
        let [others, weighted] = [others, &weighted].map(|views| views.map(single));
        let mut scores: DMatrix<f32> = weighted * others.transpose();
        for (mut column, own) in scores.column_iter_mut().zip(own.iter()) {
            for (score, own_of_one) in column.iter_mut().zip(own_of_some.iter()) {
                *score += single(constant - own_of_one - own);
            }
        }
        scores
    }

    /// S of two views, by the components of all.
    pub(super) fn score<'a>(
        &self,
        components: &'a DMatrix<f64>,
    ) -> impl Fn(usize, usize) -> f64 + use<'a> {
        let (shared, own, constant) = self.terms();
        move |one, other| {
            let of = |number: usize| {
                let (one, other) = (components[(one, number)], components[(other, number)]);
                shared[number] * one * other - own[number] * (one * one + other * other)
            };
            constant + (0..shared.len()).map(of).sum::<f64>()
        }
    }

    /// What each component of two views has in common, and of itself, and a constant, of the score.
    fn terms(&self) -> (DVector<f64>, DVector<f64>, f64) {
        let of = |term: &dyn Fn(f64) -> f64| {
            let terms = self.correlations.iter().map(|&r| term(r));
            DVector::from_iterator(self.correlations.len(), terms)
        };
        let shared = of(&|r| r / (1.0 - r * r));
        let own = of(&|r| 0.5 * r * r / (1.0 - r * r));
        (shared, own, of(&|r| -0.5 * (1.0 - r * r).ln()).sum())
    }

    /// S of all pairs of views by their components, and the deviation by which they are divided: at
    /// least one.
    pub(super) fn scores(&self, components: &DMatrix<f64>) -> (DMatrix<f32>, f64) {
        let scores = self.scores_between(components, components);
        let (mut sum, mut squares) = (0.0, 0.0);
        for score in &scores {
            sum += f64::from(*score);
            squares += f64::from(*score) * f64::from(*score);
        }
        let count = (scores.len() as f64).max(1.0);
        let variance = squares / count - (sum / count).powi(2);
        let sd = variance.max(0.0).sqrt().max(1.0);
        (scores / single(sd), sd)
    }
}

/// In single precision, of which a score needs no more.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a score is no exact number"
)]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}
