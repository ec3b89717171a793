//! How much better a pose explains levels than no pose does.

use nalgebra::{DMatrix, DVector, Point3};

use crate::kernel::Kernel;
use crate::tuning::search as tuning;

/// A level that is expected at a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub(super) channel: u8,
    pub(super) kernel: Kernel,
    /// Where it was sensed, by motion alone.
    pub(super) at: Point3<f64>,
    /// The level less the channel's mean.
    pub(super) value: f64,
    /// The level less what is expected.
    pub(super) residual: f64,
    /// Variance that the map leaves open there.
    pub(super) left: f64,
}

/// Log odds of a pose against a way outside the map, by all levels at once \[nats\]:
///
/// ```text
/// s = Σ ln((1 − ε) N(r; 0, E) / N(v; 0, K) + ε)      E = n I + eᵢ eⱼ exp(−d²/2(aℓ)²)
/// ```
///
/// summed over channels, with residuals r, levels v, and K of the channel's kernel. What the map
/// leaves open, e², goes together over a part a of the correlation length. A sensor that lies says
/// ln ε at worst.
pub(super) fn evidence(levels: &[Judged]) -> f64 {
    let mut channels: Vec<u8> = levels.iter().map(|level| level.channel).collect();
    channels.sort_unstable();
    channels.dedup();
    let of_channel = |channel: u8| {
        let own: Vec<&Judged> = levels
            .iter()
            .filter(|each| each.channel == channel)
            .collect();
        let here = log_density(
            &own,
            |a, b, squared| {
                let alike = (tuning::ALIKE * a.kernel.length_m).powi(2);
                (a.left * b.left).sqrt() * (-0.5 * squared / alike).exp()
            },
            |level| {
                let far = tuning::FAR_SD * (level.left + level.kernel.nugget).sqrt();
                level.residual.clamp(-far, far)
            },
        );
        let there = log_density(
            &own,
            |a, _, squared| a.kernel.covariance(squared),
            |level| level.value,
        );
        let odds = here? - there?;
        Some(((1.0 - tuning::LIES) * odds.exp() + tuning::LIES).ln())
    };
    channels.into_iter().filter_map(of_channel).sum()
}

/// Log density of values with noise and a covariance, but for a constant of their number.
fn log_density(
    levels: &[&Judged],
    covariance: impl Fn(&Judged, &Judged, f64) -> f64,
    value: impl Fn(&Judged) -> f64,
) -> Option<f64> {
    let matrix = DMatrix::from_fn(levels.len(), levels.len(), |row, column| {
        let (a, b) = (levels[row], levels[column]);
        let noise = if row == column { a.kernel.nugget } else { 0.0 };
        covariance(a, b, (a.at - b.at).norm_squared()) + noise
    });
    let values = DVector::from_fn(levels.len(), |row, _| value(levels[row]));
    let factor = matrix.cholesky()?;
    let diagonal = factor.l_dirty().diagonal();
    let log_root: f64 = diagonal.iter().map(|entry| entry.ln()).sum();
    Some(-0.5 * values.dot(&factor.solve(&values)) - log_root)
}
