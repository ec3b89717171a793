//! What is learned of turns.

use super::*;

/// Pairs of views near to one another, at turns up to an angle \[rad\], that are as alike as a law
/// has it.
fn pairs(most_rad: f64, alike: impl Fn(f64) -> f64) -> Vec<NeighbourPair> {
    let pair = |number: usize| {
        let part = number as f64 / 2000.0;
        let (turn_rad, distance_m) = (most_rad * part, 2.0 * (part * 1234.5).fract());
        let by_distance = (-0.5 * distance_m * distance_m / 4.0).exp();
        NeighbourPair {
            about: (0, 0),
            lag: 1,
            distance_m,
            turn_rad,
            score: 0.5 + 3.0 * by_distance * alike(turn_rad),
        }
    };
    (0..2000).map(pair).collect()
}

fn learned(most_rad: f64, alike: impl Fn(f64) -> f64) -> Turned {
    Turned::of(&pairs(most_rad, alike), 2.0, 0.5)
}

#[test]
fn whatever_a_turn_changes_is_learned() {
    let camera = |angle: f64| (1.0 - angle).max(0.0);
    let corridor = |angle: f64| 0.6 + 0.4 * (2.0 * angle).cos();
    let radio = |_: f64| 1.0;
    let laws: [&dyn Fn(f64) -> f64; 3] = [&camera, &corridor, &radio];
    for law in laws {
        let turned = learned(PI, law);
        for (turn, part) in turned.parts().iter().enumerate() {
            let expected = law(PI * turn as f64 / 4.0);
            assert!((part - expected).abs() < 0.15, "{turned:?} at {turn}");
        }
    }
    // Either way round, and no farther than half a turn.
    let turned = learned(PI, camera);
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
    assert!(same(turned.part(0.3), turned.part(-0.3)));
    assert!(same(turned.part(PI), turned.part(9.0)));
}

#[test]
fn of_turns_that_nobody_made_the_next_smaller_one_tells() {
    for part in learned(0.0, |_| 1.0).parts() {
        assert!((part - 1.0).abs() < 1e-9, "{part}");
    }
    let [_, _, quarter, more, half] = *learned(PI / 2.0, |angle| 1.0 - 0.4 * angle).parts();
    assert!((quarter - 0.37).abs() < 0.1, "{quarter}");
    assert!((more - quarter).abs() < 1e-9 && (half - quarter).abs() < 1e-9);
}

#[test]
fn views_that_are_never_alike_teach_nothing() {
    assert_eq!(Turned::of(&[], 2.0, 0.0), Turned::NOTHING);
    assert_eq!(learned(PI, |_| -1.0), Turned::NOTHING);
    assert_eq!(learned(PI, |_| 0.0), Turned::NOTHING);
    assert_eq!(learned(PI, |_| f64::NAN), Turned::NOTHING);
}
