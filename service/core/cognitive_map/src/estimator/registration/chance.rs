//! Number of false alarms: how many motions would be as good by chance.

use super::point_index::{Correspondence, PointIndex};

/// What was tried to find a motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tried {
    /// Motions.
    pub(super) n_hypotheses: usize,
    /// Landmarks that were sought.
    pub(super) n_sought: usize,
    pub(super) is_planar: bool,
}

/// Log₁₀ of the expected number of motions that lay as many landmarks as near to others where
/// nothing is the same, for the number of the nearest correspondences that makes it least. Nobody
/// is nearer than both are known.
pub(super) fn log10_by_chance(
    correspondences: &[Correspondence],
    index: &PointIndex<'_>,
    tried: &Tried,
) -> f64 {
    let Tried {
        n_hypotheses,
        n_sought,
        is_planar,
    } = *tried;
    let free = if is_planar { 2 } else { 3 };
    // The motion was fitted to the correspondences, which takes half of its degrees of freedom off
    // their distances.
    let n = correspondences.len() as f64;
    let (freedom, dimensions) = if is_planar { (3.0, 2.0) } else { (6.0, 3.0) };
    let fitted = dimensions * n / (dimensions * n - freedom).max(1.0);
    let chance = |correspondence: &Correspondence| {
        let squared = (correspondence.distance_m.powi(2) * fitted).max(correspondence.variance);
        index.chance_within(squared.sqrt())
    };
    let mut chances: Vec<f64> = correspondences.iter().map(chance).collect();
    chances.sort_by(f64::total_cmp);
    let tried = (n_hypotheses.max(1) * n_sought.max(1)) as f64;
    let trials = n_sought.saturating_sub(free);
    let expected = chances
        .iter()
        .enumerate()
        .skip(free)
        .map(|(at, &chance)| tried.log10() + log10_at_least(at + 1 - free, trials, chance));
    expected.fold(f64::INFINITY, f64::min)
}

/// Log₁₀ of the probability of at least `k` successes in `n` trials.
pub(in super::super) fn log10_at_least(k: usize, n: usize, chance: f64) -> f64 {
    if k == 0 || chance >= 1.0 {
        return 0.0;
    }
    let ln_choose = |k: usize| {
        (0..k)
            .map(|i| ((n - i) as f64 / (i + 1) as f64).ln())
            .sum::<f64>()
    };
    let ln_term =
        |k: usize| ln_choose(k) + k as f64 * chance.ln() + (n - k) as f64 * (-chance).ln_1p();
    let terms: Vec<f64> = (k..=n).map(ln_term).collect();
    let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = terms.iter().map(|term| (term - largest).exp()).sum();
    ((largest + sum.ln()) / std::f64::consts::LN_10).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_least_so_many_has_the_probability_of_a_sum_over_all_outcomes() {
        for n in 1..=9_usize {
            for chance in [0.03, 0.4, 0.9] {
                for k in 0..=n {
                    let outcomes = 0..1_u32 << n;
                    let wanted: f64 = outcomes
                        .map(u32::count_ones)
                        .filter(|&ones| ones as usize >= k)
                        .map(|ones| chance_of(ones, n, chance))
                        .sum();
                    let found = 10.0_f64.powf(log10_at_least(k, n, chance));
                    assert!(
                        (found - wanted).abs() < 1e-12,
                        "{k} of {n}: {found} {wanted}"
                    );
                }
            }
        }
        assert!(log10_at_least(5, 10, 1.0).abs() < 1e-12);
    }

    fn chance_of(ones: u32, n: usize, chance: f64) -> f64 {
        let zeros = u32::try_from(n).unwrap() - ones;
        chance.powi(ones.cast_signed()) * (1.0 - chance).powi(zeros.cast_signed())
    }
}
