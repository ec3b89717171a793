//! What the gaps tell of an object whose contacts fell on places alone.

use std::f64::consts::TAU;

use crate::numeric::log_sum;
use crate::translations::Falls;
use crate::tuning::{ELSEWHERE_PRIOR, EVEN_SHARE_MIN};

/// By how much an unknown object leads over a known one for the share of an episode's contacts that
/// lie in gaps between the places \[nats\].
///
/// Masses count each contact in a gap by the share `EVEN_SHARE_MIN`, whatever came before, so that
/// the odds between known objects do not depend on it. That is the likelihood ratio of this to what
/// [`likelihood_log`] has learned: above 0 where few contacts lie in gaps, but more than places
/// were missed, and below 0 where most do.
pub(super) fn told_by_gaps(falls: Falls, missed_share: f64) -> f64 {
    let [gaps, places] = [falls.gaps, falls.places].map(f64::from);
    gaps * EVEN_SHARE_MIN.ln() - likelihood_log(gaps, places, missed_share)
}

/// Log-likelihood of so many contacts in gaps and on places, in the order in which they came.
///
/// Either the object is felt at the points at which it was taught: then a contact is in a gap where
/// a place was missed. Or it is felt elsewhere too, and any share s of the contacts may lie in gaps
/// (Bayes 1763): ∫ sᵏ (1 − s)ᵐ ds = B(k + 1, m + 1).
fn likelihood_log(gaps: f64, places: f64, missed_share: f64) -> f64 {
    let taught = gaps * missed_share.ln() + places * (-missed_share).ln_1p();
    let elsewhere = ln_gamma(gaps + 1.0) + ln_gamma(places + 1.0) - ln_gamma(gaps + places + 2.0);
    let each = [
        (1.0 - ELSEWHERE_PRIOR).ln() + taught,
        ELSEWHERE_PRIOR.ln() + elsewhere,
    ];
    log_sum(each.into_iter())
}

/// Log of the gamma function of a number from 1 on, to eight digits: Stirling's series for the
/// number and seven more (Abramowitz and Stegun 6.1.15 and 6.1.41).
fn ln_gamma(x: f64) -> f64 {
    let shift: f64 = (0..7).map(|k| x + f64::from(k)).product();
    let x = x + 7.0;
    let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3));
    (x - 0.5) * x.ln() - x + 0.5 * TAU.ln() + series - shift.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSED_SHARE: f64 = 0.02;

    /// What an episode tells of which so many contacts lay in gaps and on places.
    fn told(gaps: u8, places: u8) -> f64 {
        let [gaps, places] = [gaps, places].map(f32::from);
        let beyond = 0.0;
        let falls = Falls {
            gaps,
            places,
            beyond,
        };
        told_by_gaps(falls, MISSED_SHARE)
    }

    #[test]
    fn all_orders_of_contacts_together_are_certain() {
        for count in [1_u32, 2, 7, 40] {
            let mut ways = 1.0;
            let mut sum = 0.0;
            for gaps in 0..=count {
                let [gaps, places] = [gaps, count - gaps].map(f64::from);
                sum += ways * likelihood_log(gaps, places, MISSED_SHARE).exp();
                ways *= places / (gaps + 1.0);
            }
            assert!((sum - 1.0).abs() < 1e-6, "{count}: {sum}");
        }
    }

    #[test]
    fn the_gamma_function_is_the_factorial() {
        let mut log = 0.0;
        for k in 1..=140 {
            let k = f64::from(k);
            assert!((ln_gamma(k) - log).abs() < 1e-7, "{k}");
            log += k.ln();
        }
        // Γ(3/2) = √π/2, and 128 contacts are the most that can come.
        assert!((ln_gamma(1.5) - (0.125 * TAU).sqrt().ln()).abs() < 1e-7);
    }

    #[test]
    fn a_gap_speaks_against_an_object_the_more_the_longer_none_was_met() {
        assert!(told(0, 0).abs() < 1e-6);
        assert!(told(0, 20) < 0.7);
        let mut before = told(1, 0);
        for places in 1..40 {
            let now = told(1, places);
            assert!(now > before, "{places}: {now} after {before}");
            before = now;
        }
        // Two gaps among ten contacts weigh several times as much as one that was missed.
        assert!(
            told(2, 8) > 1.5 * told(1, 9),
            "{} {}",
            told(2, 8),
            told(1, 9)
        );
    }

    #[test]
    fn who_feels_an_object_anywhere_is_told_so_by_its_gaps() {
        for contacts in [20, 40, 80] {
            let told = told(3 * contacts / 4, contacts / 4);
            assert!(told < 0.0, "{contacts}: {told}");
        }
    }
}
