//! How alike two grid codes or two populations are.

use super::lattice::{shortest_turns, turns_norm_squared};
use super::population::TUNING_WIDTH;
use super::{GridCode, GridModules, PartialCode};

/// Cosine similarity of two activation vectors of equal length (seed Eqs. 5, 6 and 10), in \[−1, 1\];
/// 0 when either is zero.
///
/// ```text
/// cos = a·b / (|a| |b|)
/// ```
pub fn cosine(a: &[f64], b: &[f64]) -> f64 {
    let norms = dot(a, a).sqrt() * dot(b, b).sqrt();
    if norms > 0.0 {
        (dot(a, b) / norms).clamp(-1.0, 1.0)
    } else {
        0.0
    }
}

/// Frobenius distance of the second-order patterns of two vectors of equal length (seed Eq. 7).
///
/// ```text
/// ‖a aᵀ − b bᵀ‖_F = √(|a|⁴ + |b|⁴ − 2 (a·b)²) = √(((a−b)·(a+b))² + 2 |a|² |b⊥|²)
/// ```
///
/// where b⊥ is the part of b across a. The second form is computed: it has no difference of large
/// numbers, so that it keeps its digits where the patterns are nearly equal, and needs no N×N matrix.
pub fn frobenius(a: &[f64], b: &[f64]) -> f64 {
    let a_squared = dot(a, a);
    let along = if a_squared > 0.0 {
        dot(a, b) / a_squared
    } else {
        0.0
    };
    let mut lengths = 0.0;
    let mut across_squared = 0.0;
    for (a, b) in a.iter().zip(b) {
        lengths += (a - b) * (a + b);
        let across = b - along * a;
        across_squared += across * across;
    }
    (lengths * lengths + 2.0 * a_squared * across_squared).sqrt()
}

/// Recall confidence of a distance with generalisation radius σ > 0 of the same unit (seed Eq. 8):
/// exp(−d² / (2 σ²)), in \[0, 1\].
pub fn gaussian_confidence(distance: f64, sigma: f64) -> f64 {
    let ratio = distance / sigma;
    (-0.5 * ratio * ratio).exp()
}

/// Recall confidence of a distance with scale σ > 0 of the same unit (seed Eq. 9): exp(−d / σ), in \[0, 1\].
pub fn exponential_confidence(distance: f64, sigma: f64) -> f64 {
    (-distance / sigma).exp()
}

/// Similarity of a partly known code to a code, in \[0, 1\]: the cosine of their population activations as
/// if each module had infinitely many cells, averaged over the known modules.
///
/// ```text
/// kernel = mean over known m of exp(−d_m² / (4 σ_m²))     d_m torus distance, σ_m = TUNING_WIDTH · spacing
/// ```
///
/// It costs one exponential per module instead of 27, and does not depend on how the cells tile the phase.
/// Measured on 20000 pairs of positions with the default settings, it is within 0.09 of the cosine of the
/// materialised [`population_vector`](super::population::population_vector)s: 27 cells are few, and a far
/// phase is near several images.
pub fn kernel(modules: &GridModules, cue: &PartialCode, code: &GridCode) -> f64 {
    let mut sum = 0.0;
    let mut known = 0.0;
    let modules = modules.lattices().len();
    for (cue, phase) in cue.phases().iter().zip(code.phases()).take(modules) {
        let Some(cue) = cue else { continue };
        // In units of the spacing, so that the spacing itself falls out of d/σ.
        let distance_squared = turns_norm_squared(&shortest_turns(&(cue.turns() - phase.turns())));
        sum += (-distance_squared / (4.0 * TUNING_WIDTH * TUNING_WIDTH)).exp();
        known += 1.0;
    }
    if known > 0.0 { sum / known } else { 0.0 }
}

/// Σ aᵢ bᵢ, in order.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    debug_assert_eq!(
        a.len(),
        b.len(),
        "activation vectors of one space have one length"
    );
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
