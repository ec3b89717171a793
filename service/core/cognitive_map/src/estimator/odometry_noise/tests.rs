//! What a beacon that was found says of the noise of turns.

use nalgebra::Vector6;

use super::super::noise_part::NoiseEvidence;
use super::*;

const SECOND_NS: i64 = 1_000_000_000;

/// What a beacon says by which this much weight is left of each part of the noise.
fn evidence(weights: [f64; 3]) -> NoiseEvidence {
    NoiseEvidence::of_weights(weights).unwrap()
}

#[test]
fn a_beacon_that_fits_little_noise_ends_the_trial_and_takes_noise_back() {
    let mut noise = OdometryNoise::new(false);
    noise.learn_turns(evidence([0.0, 0.1, 0.9]));
    let not_there = noise.end_trial(SECOND_NS, Told::ByBeacon).unwrap();
    assert!(
        not_there[0].abs() < 1e-12,
        "a beacon says nothing of lengths"
    );
    assert!((0.9..1.0).contains(&not_there[1]), "{not_there:?}");
    let assumed = Vector6::repeat(1.0);
    let variance = noise.variance(&assumed, None);
    assert!((variance[0] - 1.0).abs() < 1e-12, "{variance}");
    assert!((0.2..0.5).contains(&variance[5]), "{variance}");
    assert_eq!(noise.end_trial(2 * SECOND_NS, Told::ByBeacon), None);
}

#[test]
fn a_beacon_that_fits_the_assumed_noise_changes_nothing() {
    let mut noise = OdometryNoise::new(false);
    noise.learn_turns(evidence([1.0, 0.0, 0.0]));
    assert_eq!(noise.end_trial(SECOND_NS, Told::ByBeacon), None);
    assert_eq!(
        noise.variance(&Vector6::repeat(1.0), None),
        Vector6::repeat(1.0)
    );
}

#[test]
fn more_beacons_tell_more_and_lead_no_further_than_what_was_tried() {
    let mut noise = OdometryNoise::new(false);
    let mut factors = vec![noise.factors[1]];
    for _ in 0..10 {
        noise.learn_turns(evidence([0.05, 0.45, 0.5]));
        factors.push(noise.factors[1]);
    }
    assert!(
        factors[0] > factors[1] && factors[1] > factors[2],
        "{factors:?}"
    );
    assert!(noise.log_scales[1] >= NoisePart::Least.log_factor());
}

#[test]
fn who_sees_landmarks_with_directions_waits_for_pairs_of_them() {
    let mut noise = OdometryNoise::new(false);
    assert_eq!(noise.end_trial(0, Told::ByPairs), None);
    noise.learn_turns(evidence([0.0, 0.0, 1.0]));
    assert_eq!(noise.end_trial(SECOND_NS, Told::ByBeacon), None);
    let late = noise.end_trial(NOISE_TRIAL_NS_MAX, Told::ByPairs);
    assert!(late.is_some_and(|not_there| not_there[1] > 0.5), "{late:?}");
}

#[test]
fn stated_noise_stays_as_it_is() {
    let mut noise = OdometryNoise::new(true);
    noise.learn_turns(evidence([0.0, 0.0, 1.0]));
    let stated = Vector6::repeat(0.01);
    assert_eq!(noise.variance(&Vector6::repeat(1.0), Some(&stated)), stated);
}
