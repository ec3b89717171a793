//! Laws of one way.

use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

use super::{Traversal, Way};
use crate::memory::ids::PlaceId;
use crate::memory::strength::Clock;
use crate::settings::Settings;

fn now(revision: u64) -> Clock {
    Clock::at(revision, &Settings::default())
}

fn pose(translation: [f64; 3], rotation: [f64; 3]) -> Isometry3<f64> {
    Isometry3::new(translation.into(), rotation.into())
}

/// A way that was travelled once, as its places lie.
fn travelled(relative: &Isometry3<f64>, length_m: f64) -> Way {
    let traversal = Traversal::made(PlaceId(3), PlaceId(5), *relative, length_m);
    let mut way = Way::new(&traversal, [0, 1], now(1), 1);
    way.travel(&traversal, relative, now(1), 1);
    way
}

proptest! {
    /// As long as the places lie as was measured the way says so; once they are moved by more than
    /// the noise, in either direction, the places count until it is travelled anew.
    #[test]
    fn places_that_were_moved_count(
        translation in prop::array::uniform3(-3.0..3.0f64),
        rotation in prop::array::uniform3(-1.5..1.5f64),
        axis in 0usize..3,
        sign in prop::sample::select(vec![-1.0, 1.0]),
    ) {
        let relative = pose(translation, rotation);
        let length_m = relative.translation.vector.norm() + 0.5;
        let mut way = travelled(&relative, length_m);
        let shifted = |by: f64| {
            let mut shift = Vector3::zeros();
            shift[axis] = by * sign;
            relative * Isometry3::translation(shift.x, shift.y, shift.z)
        };
        prop_assert!(!way.disagrees_with(&relative) && !way.disagrees_with(&shifted(0.03)));
        let moved = shifted(0.2);
        let turned = relative * pose([0.0; 3], [0.0, 0.0, 0.1 * sign]);
        prop_assert!(way.disagrees_with(&moved) && way.disagrees_with(&turned));
        prop_assert!((way.length_m(&relative) - length_m).abs() < 1e-12);
        let distance_m = moved.translation.vector.norm();
        prop_assert!((way.length_m(&moved) - distance_m).abs() < 1e-12);
        let again = Traversal::made(PlaceId(5), PlaceId(3), moved, distance_m + 0.1);
        way.travel(&again, &moved, now(2), 2);
        prop_assert!(!way.disagrees_with(&moved) && way.disagrees_with(&relative));
        prop_assert!((way.length_m(&moved) - distance_m - 0.1).abs() < 1e-12);
        let times = [3, 5].map(|end| way.travelled_from(PlaceId(end)).times());
        prop_assert_eq!((times, way.last_revision()), ([1, 1], 2));
    }

    /// Against the sums themselves, along a line; many measurements.
    #[test]
    fn mean_and_spread_are_those_of_the_measurements(
        offsets in prop::collection::vec(-0.1..0.1f64, 2..60),
    ) {
        let at = |offset: f64| pose([1.0 + offset, 0.0, 0.0], [0.0; 3]);
        let mut way = travelled(&at(offsets[0]), 1.0);
        for offset in &offsets[1..] {
            let traversal = Traversal::made(PlaceId(3), PlaceId(5), at(*offset), 1.0);
            // The places lie wherever the way is measured to, so that it never begins anew.
            let places = *way.relative();
            way.travel(&traversal, &places, now(2), 2);
        }
        let n = offsets.len() as f64;
        let mean = offsets.iter().sum::<f64>() / n;
        prop_assert!((way.relative().translation.x - 1.0 - mean).abs() < 1e-9);
        let squares = offsets.iter().map(|offset| (offset - mean).powi(2));
        let variance = (squares.sum::<f64>() / (n - 1.0)).max(1e-6);
        prop_assert!((way.measurement_variance()[0] - variance).abs() < 1e-9);
        prop_assert!((way.position_variance_m2() * n - variance - 2e-6).abs() < 1e-9);
    }
}
