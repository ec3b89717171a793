//! Merging: hypotheses of one cell become one, with the moments of all.

use crate::numeric::to_f32;
use crate::translations::hypothesis::{CELL_BITS, Falls, TranslationHypothesis};
use crate::variant::VariantId;

/// Merges hypotheses of one model, rotation and cell, and sorts by these.
pub(crate) fn merged(all: &[TranslationHypothesis]) -> Vec<TranslationHypothesis> {
    let mut ranks: Vec<(VariantId, u16)> = { all.chunk_by(|a, b| a.map() == b.map()) }
        .map(|own| own[0].map())
        .collect();
    ranks.sort_unstable();
    ranks.dedup();
    // Rank of the map, cell and number side by side: one comparison orders by all three.
    let mut keyed = Vec::with_capacity(all.len());
    let mut numbers = 0u32..;
    for own in all.chunk_by(|a, b| a.map() == b.map()) {
        let rank = ranks.partition_point(|other| *other < own[0].map());
        let high = (rank as u128) << (CELL_BITS + u32::BITS);
        let keys = { own.iter().zip(&mut numbers) }
            .map(|(hypothesis, number)| high | hypothesis.cell() << u32::BITS | u128::from(number));
        keyed.extend(keys);
    }
    keyed.sort_unstable();
    let mut sums = Vec::with_capacity(all.len());
    for cell in keyed.chunk_by(|a, b| a >> u32::BITS == b >> u32::BITS) {
        let own = cell.iter().map(|key| {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "the low bits are the number"
            )]
            let number = *key as u32;
            &all[number as usize]
        });
        sums.extend(sum(own));
    }
    sums
}

/// One hypothesis with the mass, the mean, the variance and the mean falls of several of one map.
fn sum<'a>(
    mut all: impl ExactSizeIterator<Item = &'a TranslationHypothesis> + Clone,
) -> Option<TranslationHypothesis> {
    let others = all.clone();
    let first = *all.next()?;
    if all.len() == 0 {
        return Some(first);
    }
    let most = { others.clone() }
        .map(|own| own.evidence)
        .fold(f64::NEG_INFINITY, f64::max);
    let (mut mass, mut mean, mut square, mut variance) = (0.0, first.translation * 0.0, 0.0, 0.0);
    let (mut gaps, mut places, mut beyond) = (0.0, 0.0, 0.0);
    for own in others {
        let weight = (own.evidence - most).exp();
        // From the first one, so that no digits are lost.
        let apart = own.translation - first.translation;
        mass += weight;
        mean += weight * apart;
        square += weight * apart.norm_squared();
        variance += weight * own.variance_m2;
        gaps += weight * f64::from(own.falls.gaps);
        places += weight * f64::from(own.falls.places);
        beyond += weight * f64::from(own.falls.beyond);
    }
    mean /= mass;
    let spread = (square / mass - mean.norm_squared()).max(0.0);
    Some(TranslationHypothesis {
        translation: first.translation + mean,
        variance_m2: variance / mass + spread / 3.0,
        evidence: most + mass.ln(),
        falls: Falls {
            gaps: to_f32(gaps / mass),
            places: to_f32(places / mass),
            beyond: to_f32(beyond / mass),
        },
        ..first
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::object_id::ObjectId;
    use crate::variant::Variant;

    fn hypothesis(object: u32, x: f64, evidence: f64) -> TranslationHypothesis {
        TranslationHypothesis {
            object: ObjectId(object),
            variant: Variant::Places,
            rotation: 0,
            translation: Vector3::new(x, -1.0, 0.0),
            variance_m2: 1e-6,
            evidence,
            falls: Falls::default(),
        }
    }

    #[test]
    fn one_cell_has_the_moments_of_all_that_lie_in_it() {
        // Cells are a power of two wide; these are the middles of two.
        let middles = [100.0 / 1024.0, 200.0 / 1024.0];
        let apart = [-2e-4, 1e-4, 3e-4];
        let shares: [f64; 3] = [0.2, 0.5, 0.3];
        let mut all = vec![hypothesis(7, 0.5, 0.0)];
        for (apart, share) in apart.iter().zip(shares) {
            all.push(hypothesis(3, apart + middles[0], share.ln() - 900.0));
            all.push(hypothesis(3, apart + middles[1], share.ln() - 900.0));
        }
        all.push(hypothesis(1, 0.1, -5.0));
        let merged = merged(&all);
        let objects: Vec<u32> = merged.iter().map(|own| own.object.0).collect();
        assert_eq!(objects, [1, 3, 3, 7]);
        let mean = apart
            .iter()
            .zip(shares)
            .map(|(x, share)| x * share)
            .sum::<f64>();
        let square = apart
            .iter()
            .zip(shares)
            .map(|(x, share)| x * x * share)
            .sum::<f64>();
        let variance = 1e-6 + (square - mean * mean) / 3.0;
        for (own, middle) in merged[1..3].iter().zip(middles) {
            assert!((own.translation.x - middle - mean).abs() < 1e-12, "{own:?}");
            assert!((own.variance_m2 - variance).abs() < 1e-15, "{own:?}");
            assert!((own.evidence + 900.0).abs() < 1e-12, "{own:?}");
        }
    }
}
