//! Chains of ways as single edges.

use std::collections::BTreeSet;

use cognitive_map::{CognitiveMap, PlaceId, Settings, Way};
use nalgebra::Point3;
use proptest::prelude::*;

use crate::journal::{Robot, start_pose};

fn position(map: &CognitiveMap, place: PlaceId) -> Point3<f64> {
    map.waypoint(place)
        .unwrap()
        .pose()
        .translation
        .vector
        .into()
}

/// Distance of a point from a piece of a line \[m\], by halving it again and again.
fn distance_m(point: &Point3<f64>, [mut a, mut b]: [Point3<f64>; 2]) -> f64 {
    for _ in 0..60 {
        let middle = nalgebra::center(&a, &b);
        if (point - a).norm() < (point - b).norm() {
            b = middle;
        } else {
            a = middle;
        }
    }
    (point - a).norm()
}

#[test]
fn a_corridor_with_a_corner_is_two_edges() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.ahead(&mut map, 1.0, 10);
    for _ in 0..5 {
        robot.go(&mut map, [0.0, 1.0, 0.0], [0.0; 3]);
    }
    let thinned = map.thinned_ways(0.1);
    let numbers: Vec<_> = thinned.iter().map(|edge| edge.places.len()).collect();
    assert_eq!(numbers, [10, 6], "{thinned:?}");
    for edge in &thinned {
        let legs = edge.places.len() as f64 - 1.0;
        assert!((edge.length_m - legs).abs() < 1e-9, "{edge:?}");
        assert!(
            (edge.there.duration_s - 0.1 * legs).abs() < 1e-9,
            "{edge:?}"
        );
        assert!(edge.there.is_travelled && !edge.back.is_travelled);
    }
    // The corner is 3.2 m from the line between the ends.
    assert_eq!(map.thinned_ways(10.0).len(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Each way is part of one edge, which is as straight as asked for, and says how its ways were
    /// travelled.
    #[test]
    fn edges_are_straight_and_have_all_ways(
        turns in prop::collection::vec((-0.9..0.9f64, 0..20_u8), 5..150),
        tolerance_m in prop::sample::select(vec![0.0, 0.1, 0.5, 50.0]),
    ) {
        let mut map = CognitiveMap::new(Settings::default());
        let mut robot = Robot::enrol(&mut map);
        for (turn, jump) in turns {
            if jump == 0 {
                robot.sample(&mut map, start_pose([turn * 5.0, turn, 0.0], [0.0; 3]));
            }
            robot.go(&mut map, [0.4, 0.0, 0.0], [0.0, 0.0, turn]);
        }
        let thinned = map.thinned_ways(tolerance_m);
        let mut seen = BTreeSet::new();
        for edge in &thinned {
            let (first, last) = (edge.places[0], *edge.places.last().unwrap());
            prop_assert!(first < last);
            let line = [position(&map, first), position(&map, last)];
            let mut sums = (0.0, 0.0);
            for pair in edge.places.windows(2) {
                let way = map.way(pair[0], pair[1]).unwrap();
                prop_assert!(seen.insert(way.ends()), "a way is in two edges");
                let went = |from: PlaceId| way.travelled_from(from).times() > 0;
                prop_assert_eq!(went(pair[0]), edge.there.is_travelled);
                prop_assert_eq!(went(pair[1]), edge.back.is_travelled);
                let mean_s = |from: PlaceId| way.travelled_from(from).mean_s();
                sums.0 += mean_s(pair[0]).or(mean_s(pair[1])).unwrap();
                sums.1 += way.length_m(&map.places_of_way(way).unwrap());
                let off_m = distance_m(&position(&map, pair[0]), line);
                prop_assert!(off_m <= tolerance_m + 1e-9, "{off_m}");
            }
            prop_assert!((edge.there.duration_s - sums.0).abs() < 1e-9);
            prop_assert!((edge.length_m - sums.1).abs() < 1e-9);
        }
        let all: BTreeSet<_> = map.ways().map(Way::ends).collect();
        prop_assert_eq!(seen, all);
        prop_assert_eq!(map.clone().thinned_ways(tolerance_m), thinned);
    }
}
