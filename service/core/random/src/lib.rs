#![doc = include_str!("../README.md")]

mod generator;

pub use generator::Seeded;

/// Increment of `SplitMix64`: 2⁶⁴ divided by the golden ratio, made odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// One output of `SplitMix64` whose state was `state` before (Steele, Lea & Flood 2014, Fig. 14,
/// with the constants of Stafford's variant 13).
fn split_mix(state: u64) -> u64 {
    let mut z = state.wrapping_add(GAMMA);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Bits as a number in \[0, 1): the upper 53 fill the mantissa, so each result is exactly
/// representable.
fn fraction(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Random bits for what the keys name.
pub fn bits(seed: u64, keys: [u64; 3]) -> u64 {
    // Each key is mixed in after the keys before it have been scrambled, so that neighbouring keys
    // lead to unrelated states.
    keys.into_iter()
        .fold(split_mix(seed), |state, key| split_mix(state ^ key))
}

/// A uniform number in \[0, 1) for what the keys name.
pub fn uniform(seed: u64, keys: [u64; 3]) -> f64 {
    fraction(bits(seed, keys))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published outputs for the seed 1234567 (Rosetta Code, "Pseudo-random
    /// numbers/Splitmix64").
    #[test]
    fn equals_the_published_outputs() {
        let published = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        for (step, expected) in (0u64..).zip(published) {
            let state = 1_234_567u64.wrapping_add(GAMMA.wrapping_mul(step));
            assert_eq!(split_mix(state), expected);
        }
    }

    #[test]
    fn is_uniform() {
        // 100 bins of 1000 expected draws each: χ² has 99 degrees of freedom, so a mean of 99 and a
        // deviation of 14; 170 lies five deviations above.
        let mut bins = [0u32; 100];
        for seq in 0..100_000 {
            let draw = uniform(7, [3, 11, seq]);
            assert!((0.0..1.0).contains(&draw));
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 to 99"
            )]
            let bin = (draw * 100.0) as usize;
            bins[bin] += 1;
        }
        let chi2: f64 = bins
            .iter()
            .map(|&n| (f64::from(n) - 1000.0).powi(2) / 1000.0)
            .sum();
        assert!((40.0..170.0).contains(&chi2), "χ² = {chi2}");
    }

    #[test]
    fn neighbouring_keys_draw_independently() {
        let n = 50_000u32;
        let draw = |seed, keys| uniform(seed, keys) - 0.5;
        let correlation = |shift: [u64; 4]| -> f64 {
            let sum: f64 = (0..n)
                .map(|i| {
                    let seq = u64::from(i);
                    let keys = [2 + shift[1], 3 + shift[2], seq + shift[3]];
                    draw(1, [2, 3, seq]) * draw(1 + shift[0], keys)
                })
                .sum();
            sum * 12.0 / f64::from(n)
        };
        // The variance of a uniform number is 1/12; a correlation of n pairs deviates by 1/√n.
        let bound = 5.0 / f64::from(n).sqrt();
        for shift in [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] {
            assert!(correlation(shift).abs() < bound, "{shift:?}");
        }
        assert!((correlation([0; 4]) - 1.0).abs() < bound);
    }

    #[test]
    fn every_key_counts() {
        let base = bits(1, [2, 3, 4]);
        assert_ne!(base, bits(2, [2, 3, 4]));
        assert_ne!(base, bits(1, [3, 3, 4]));
        assert_ne!(base, bits(1, [2, 4, 4]));
        assert_ne!(base, bits(1, [2, 3, 5]));
        assert_ne!(bits(1, [2, 3, 4]), bits(1, [2, 4, 3]), "order counts too");
    }
}
