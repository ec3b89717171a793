//! What follows from a code's spacings alone.

use std::f64::consts::PI;

use cognitive_map::Settings;
use grid::{GridModules, Lattice, unique_range_m};
use serde::Serialize;

/// Precision and range of a code with independent Gaussian noise of s turns on each phase
/// component.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CodeTheory {
    /// Spacings of the modules, finest first \[m\].
    pub spacings_m: Vec<f64>,
    /// Fisher information of the position along each axis, averaged over directions \[1/m²\]:
    /// J = (1/s²) Σ 1/dₘ².
    pub fisher_information_per_m2: f64,
    /// The least standard deviation along each axis that an unbiased estimate can have \[m\]: 1/√J.
    pub position_sd_m: f64,
    /// How far codes are unique, by [`unique_range_m`] \[m\].
    pub unique_range_m: f64,
    /// Up to this distance the score of a place falls with its distance alone \[m\]: half of the
    /// finest spacing.
    pub monotone_m: f64,
    /// Of as many places far away as were measured, how many are expected to explain a noisy code
    /// better than the right one: by a whole code, and without one and two modules.
    pub expected_better: [f64; 3],
}

impl CodeTheory {
    /// Of a space's code, with `s` turns of noise and so many places.
    pub fn of(settings: &Settings, s: f64, places: u64) -> Self {
        let modules = GridModules::new(&settings.grid());
        let spacings = modules.lattices().iter().map(Lattice::spacing_m);
        let spacings_m: Vec<f64> = spacings.collect();
        let stiffness: f64 = spacings_m.iter().map(|d| d.powi(-2)).sum();
        let fisher_information_per_m2 = stiffness / (s * s);
        let known = |erased: usize| spacings_m.len().saturating_sub(erased);
        Self {
            fisher_information_per_m2,
            position_sd_m: fisher_information_per_m2.powf(-0.5),
            unique_range_m: unique_range_m(&modules, s),
            monotone_m: 0.5 * settings.grid_spacing_m,
            expected_better: [0, 1, 2].map(|erased| places as f64 * share_better(known(erased), s)),
            spacings_m,
        }
    }
}

/// The share of far places whose random phases lie closer to a noisy code than the right place's.
///
/// With K known modules a right place has Q = Σ δₘ² ≈ s² χ²₃ₖ; a wrong one has less with a
/// probability of 2^(K/2) V₃ₖ Q^(3K/2), since the torus of a module has a volume of 1/√2. Averaged
/// over Q:
///
/// ```text
/// 2^(K/2) V₃ₖ s^3K 2^(3K/2) Γ(3K)/Γ(3K/2)          V₃ₖ = π^(3K/2) / Γ(3K/2 + 1)
/// ```
///
/// To first order: it counts overlaps of the balls around lattice points twice, and is 1 at most.
fn share_better(known: usize, s: f64) -> f64 {
    let k = known as f64;
    let n = 3.0 * k;
    let whole = 3 * known;
    // Γ(3K) of a whole number, Γ(3K/2) and Γ(3K/2 + 1) of a whole number or a half.
    let log = 0.5 * k * 2.0_f64.ln() + 0.5 * n * PI.ln() - log_gamma_of_half(whole + 2)
        + n * s.ln()
        + 0.5 * n * 2.0_f64.ln()
        + log_gamma_of_half(2 * whole)
        - log_gamma_of_half(whole);
    log.exp().min(1.0)
}

/// ln Γ(n/2) of a whole number n, at least 1, by Γ(x + 1) = x Γ(x).
fn log_gamma_of_half(n: usize) -> f64 {
    let mut log = if n.is_multiple_of(2) {
        0.0
    } else {
        0.5 * PI.ln()
    };
    let mut twice = if n.is_multiple_of(2) { 2 } else { 1 };
    while twice < n {
        log += (twice as f64 / 2.0).ln();
        twice += 2;
    }
    log
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gamma_of_halves_is_that_of_the_tables() {
        for (n, gamma) in [
            (1, PI.sqrt()),
            (2, 1.0),
            (3, 0.5 * PI.sqrt()),
            (4, 1.0),
            (7, 15.0 / 8.0 * PI.sqrt()),
            (10, 24.0),
        ] {
            assert!((log_gamma_of_half(n).exp() / gamma - 1.0).abs() < 1e-12);
        }
    }

    /// One module: Q = s² χ²₃ and a ball of volume 4π/3 Q^1.5 in a torus of 1/√2; E χ³ = 8 √(2/π).
    #[test]
    fn the_share_for_one_module_is_that_by_hand() {
        let s = 0.01_f64;
        let by_hand = 2.0_f64.sqrt() * 4.0 / 3.0 * PI * s.powi(3) * 8.0 * (2.0 / PI).sqrt();
        assert!((share_better(1, s) / by_hand - 1.0).abs() < 1e-12);
    }
}
