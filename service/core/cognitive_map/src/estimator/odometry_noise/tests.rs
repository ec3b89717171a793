//! What a beacon that was found, and what pairs of sightings say of the noise.

use nalgebra::{Point3, Vector3, Vector6};
use random::Seeded;

use super::super::noise_part::NoiseEvidence;
use super::*;
use crate::estimator::Parameters;
use crate::input::RangeBearing;

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

/// Distance of a field's posts \[m\].
const SPACING_M: f64 = 3.0;

/// The factors that a robot learns of the variances of lengths and of angles, over the true ones,
/// as it drives through a field of posts. Its odometry has so many times the deviations that are
/// assumed, and a share of its sightings is of something else.
fn learned(deviations: f64, false_share: f64, seed: u64) -> [f64; 2] {
    let (mut random, parameters) = (Seeded(seed), Parameters::default());
    let (mut noise, mut pose) = (OdometryNoise::new(false), Isometry3::identity());
    for step in 1..2000 {
        let read = Isometry3::new(Vector3::x() * 0.2, Vector3::z() * 0.05);
        let sd = parameters.assumed_noise_sd(&read);
        let error = sd.map(|sd| deviations * sd * random.normal());
        let [along, about] = [0, 3].map(|k| error.fixed_rows::<3>(k).into_owned());
        pose *= read * Isometry3::new(along, about);
        noise.append(&read, &sd.component_mul(&sd), None);
        let stamp_ns = step * SECOND_NS / 2;
        for ahead_m in [1.0, 4.0] {
            let near = pose * Point3::new(ahead_m, 0.0, 0.0);
            let [column, row] = [near.x, near.y].map(|along| (along / SPACING_M).round());
            let label = Label::new(&format!("post {column} {row}")).unwrap();
            let post = Point3::new(column * SPACING_M, row * SPACING_M, 0.0);
            let relation = seen(
                &pose.inverse_transform_point(&post),
                false_share,
                &mut random,
            );
            noise.note(&label, stamp_ns, &relation, &LastingErrors::zeros(), false);
        }
    }
    [0, 1].map(|k| noise.log_scales[k].exp() / deviations.powi(2))
}

/// A post in the body frame as it is seen, or something else.
fn seen(post: &Point3<f64>, false_share: f64, random: &mut Seeded) -> Relation {
    let (range_m, azimuth) = if random.uniform() < false_share {
        (8.0 * random.uniform(), 6.0 * random.uniform() - 3.0)
    } else {
        let azimuth = post.y.atan2(post.x) + 0.02 * random.normal();
        (post.coords.norm() + 0.05 * random.normal(), azimuth)
    };
    let relation = RangeBearing::new(range_m.max(0.1), azimuth, 0.0, 0.05, 0.02);
    Relation::RangeBearing(relation.unwrap())
}

#[test]
fn false_sightings_do_not_make_odometry_worse() {
    for deviations in [0.3, 1.0, 3.0] {
        for false_share in [0.0, 0.1, 0.2, 0.3] {
            for seed in 1..5 {
                let [lengths, angles] = learned(deviations, false_share, seed).map(f64::sqrt);
                assert!(
                    (0.5..1.5).contains(&angles),
                    "{deviations} {false_share} {seed}: angles {angles}"
                );
                // What is seen tells little of small noise of lengths.
                assert!(
                    lengths < 3.0,
                    "{deviations} {false_share} {seed}: lengths {lengths}"
                );
            }
        }
    }
}
