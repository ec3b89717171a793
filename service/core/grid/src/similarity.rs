//! Similarity of two grid codes, or of two populations.

use nalgebra::{Point3, Vector3};

use super::inner_product::dot;
use super::lattice::{shortest_turns, turns_norm_squared};
use super::tuning::TUNING_WIDTH;
use super::{GridCode, GridModules, Lattice, PartialCode};

/// Newton steps at most; from 0 to anywhere that matters takes fewer than ten.
const NEWTON_STEPS: u32 = 50;

/// Cosine similarity of two activation vectors of equal length (seed Eqs. 5, 6 and 10), in \[−1,
/// 1\]; 0 when either is zero.
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
/// numbers, so that it keeps its digits where the patterns are nearly equal, and needs no N×N
/// matrix.
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

/// Recall confidence of a distance with scale σ > 0 of the same unit (seed Eq. 9): exp(−d / σ), in
/// \[0, 1\].
pub fn exponential_confidence(distance: f64, sigma: f64) -> f64 {
    (-distance / sigma).exp()
}

/// Similarity of a partly known code to a code, in \[0, 1\]: the cosine of their population
/// activations as if each module had infinitely many cells, averaged over the known modules.
///
/// ```text
/// kernel = mean over known m of exp(−d_m² / (4 σ_m²))
/// d_m torus distance, σ_m = TUNING_WIDTH · spacing
/// ```
///
/// It costs one exponential per module instead of 27, and does not depend on how the cells tile the
/// phase. It is not quite the cosine of the materialised
/// [`population_vector`](super::population::population_vector)s, for 27 cells are few, and a far
/// phase is near several images; they differ by less than a tenth
/// (`the_kernel_is_the_cosine_of_activations_to_a_tenth` in `tests/population.rs`).
pub fn kernel(modules: &GridModules, cue: &PartialCode, code: &GridCode) -> f64 {
    let mut sum = 0.0;
    let mut known = 0.0;
    let modules = modules.lattices().len();
    for (cue, phase) in cue.phases().iter().zip(code.phases()).take(modules) {
        let Some(cue) = cue else { continue };
        sum += module_kernel(cue.turns(), phase.turns());
        known += 1.0;
    }
    if known > 0.0 { sum / known } else { 0.0 }
}

/// What one module adds to [`kernel`].
fn module_kernel(cue: &Vector3<f64>, phase: &Vector3<f64>) -> f64 {
    // In units of the spacing, so that the spacing itself falls out of d/σ.
    let distance_squared = turns_norm_squared(&shortest_turns(&(cue - phase)));
    (-distance_squared / (4.0 * TUNING_WIDTH * TUNING_WIDTH)).exp()
}

/// A partly known code, ready to be compared with the codes of many positions.
#[derive(Debug)]
pub struct CodeCue<'a> {
    known: Vec<(&'a Lattice, Vector3<f64>)>,
}

impl<'a> CodeCue<'a> {
    /// The known modules of a code.
    pub fn new(modules: &'a GridModules, code: &PartialCode) -> Self {
        let modules = modules.lattices().iter().zip(code.phases());
        let known =
            modules.filter_map(|(lattice, phase)| Some((lattice, *phase.as_ref()?.turns())));
        Self {
            known: known.collect(),
        }
    }

    /// Number of known modules.
    pub fn known(&self) -> usize {
        self.known.len()
    }

    /// [`kernel`] of the code and the code of a position, to the last bit; `None` when it is below
    /// `least`, which is found out early.
    pub fn kernel_at(&self, position: &Point3<f64>, least: f64) -> Option<f64> {
        let known = self.known.len() as f64;
        let mut sum = 0.0;
        let mut left = known;
        for (lattice, cue) in &self.known {
            sum += module_kernel(cue, lattice.locate(position).1.turns());
            left -= 1.0;
            // No module adds more than one; the slack is far above what rounding changes.
            if sum + left < least * known - 1e-9 {
                return None;
            }
        }
        let kernel = if known > 0.0 { sum / known } else { 0.0 };
        (kernel >= least).then_some(kernel)
    }

    /// The largest Σ dₘ² over the known modules, dₘ torus distance in spacings, at which [`kernel`]
    /// can still be `least`; `None` when codes can be arbitrarily far apart in one module then.
    ///
    /// With modules adding qₘ = exp(−dₘ²/4σ²) and a deficit ε = Σ (1 − qₘ) = known · (1 − least), Σ
    /// dₘ² = −4σ² Σ ln qₘ. As −ln is convex, that is largest when one module has the whole deficit:
    ///
    /// ```text
    /// Σ dₘ² ≤ −4σ² ln(1 − ε)        ε < 1
    /// ```
    pub fn tolerance(&self, least: f64) -> Option<f64> {
        let deficit = self.known.len() as f64 * (1.0 - least) + 1e-9;
        (deficit < 1.0).then(|| -4.0 * TUNING_WIDTH * TUNING_WIDTH * (1.0 - deficit.max(0.0)).ln())
    }

    /// The distance \[m\] at which two codes are on average as similar as `kernel` says, i.e. the d
    /// with
    ///
    /// ```text
    /// mean over known m of exp(−d² / (4 σₘ²)) = kernel
    /// ```
    ///
    /// at most `far_m`. The logarithm of the left side is a convex and falling function of d², so
    /// Newton's method started at 0 comes to the root from the left and never passes it.
    pub fn mean_distance_m(&self, kernel: f64, far_m: f64) -> f64 {
        let far = far_m * far_m;
        let goal = kernel.ln();
        let mut squared = 0.0_f64;
        for _ in 0..NEWTON_STEPS {
            let mut sum = 0.0;
            let mut slope = 0.0;
            for (lattice, _) in &self.known {
                let rate = (2.0 * TUNING_WIDTH * lattice.spacing_m()).powi(-2);
                let answer = (-squared * rate).exp();
                sum += answer;
                slope += rate * answer;
            }
            let step = ((sum / self.known.len() as f64).ln() - goal) * sum / slope;
            squared += step.max(0.0);
            // Written so that a step that is not a number ends it, too.
            let goes_on = step > 1e-12 * squared && squared < far;
            if !goes_on {
                break;
            }
        }
        squared.min(far).sqrt()
    }
}
