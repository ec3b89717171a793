//! Ways: what the legs add up to, and which of them go.

use std::collections::{BTreeMap, BTreeSet};

use cognitive_map::{CognitiveMap, PlaceId, Settings, Way};
use nalgebra::Isometry3;
use petgraph::graphmap::UnGraphMap;
use proptest::prelude::*;

use crate::journal::{Robot, settings, start_pose};

/// A robot that goes to and fro along a corridor.
fn corridor(turns: usize) -> CognitiveMap {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    for _ in 0..turns {
        robot.ahead(&mut map, 0.1, 60);
        robot.go(&mut map, [0.0; 3], [0.0, 0.0, std::f64::consts::PI]);
    }
    map
}

/// The ways as a graph of another program.
fn graph(map: &CognitiveMap) -> UnGraphMap<u32, u32> {
    let mut graph = UnGraphMap::new();
    for way in map.ways() {
        let [a, b] = way.ends();
        graph.add_edge(a.0, b.0, 0);
    }
    graph
}

#[test]
fn ten_trips_along_a_corridor_are_one_chain() {
    let map = corridor(10);
    let places = map.place_count();
    assert!(places > 15, "{places}");
    assert_eq!(map.way_count(), places - 1);
    let ends: BTreeSet<_> = map.ways().map(Way::ends).collect();
    let first = u32::try_from(places).unwrap();
    let chain = (1..first).map(|k| [PlaceId(k - 1), PlaceId(k)]);
    assert_eq!(ends, chain.collect());
    for way in map.ways() {
        let [a, b] = way.ends();
        let (there, back) = (way.travelled_from(a), way.travelled_from(b));
        // The last way at an end may be missed by a robot that turns a little earlier.
        assert!(
            (4..=5).contains(&there.times()) && (4..=5).contains(&back.times()),
            "{way:?}"
        );
        assert!(!way.disagrees_with(&map.places_of_way(way).unwrap()));
    }
}

/// What the legs of all trips add up to.
#[derive(Debug, Default, PartialEq)]
struct Sum {
    times: u64,
    fastest_s: f64,
    mean_s: f64,
}

fn of_legs(map: &CognitiveMap) -> BTreeMap<(PlaceId, PlaceId), Sum> {
    let mut sums: BTreeMap<_, Vec<f64>> = BTreeMap::new();
    for leg in map.trips().flat_map(|(_, trip)| trip.legs()) {
        let durations: &mut Vec<f64> = sums.entry((leg.from(), leg.to())).or_default();
        durations.push(leg.duration_s());
    }
    let sum = |(ends, durations): (_, Vec<f64>)| {
        let sum = Sum {
            times: durations.len() as u64,
            fastest_s: durations.iter().copied().fold(f64::INFINITY, f64::min),
            mean_s: durations.iter().sum::<f64>() / durations.len() as f64,
        };
        (ends, sum)
    };
    sums.into_iter().map(sum).collect()
}

/// Wanders in the plane, back to the middle from far out.
fn wander(map: &mut CognitiveMap, robot: &mut Robot, yaws: &[f64]) {
    for yaw in yaws {
        let position = robot.position(map);
        let yaw = if position.coords.norm() > 2.0 {
            2.5
        } else {
            *yaw
        };
        robot.go(map, [0.15, 0.0, 0.0], [0.0, 0.0, yaw]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Two robots wander; nothing is forgotten.
    #[test]
    fn ways_are_what_the_legs_add_up_to(
        yaws in prop::collection::vec(-1.5..1.5f64, 1..300),
        others in prop::collection::vec(-1.5..1.5f64, 1..300),
    ) {
        let mut map = CognitiveMap::new(Settings::default());
        let mut robot = Robot::enrol(&mut map);
        robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
        wander(&mut map, &mut robot, &yaws);
        let mut other = Robot::enrol(&mut map);
        other.sample(&mut map, start_pose([0.4, 0.0, 0.0], [0.0, 0.0, 1.0]));
        wander(&mut map, &mut other, &others);
        let legs = of_legs(&map);
        let mut directions = 0;
        for way in map.ways() {
            let [a, b] = way.ends();
            prop_assert!(a < b);
            prop_assert_eq!(map.way(b, a), Some(way));
            for (from, to) in [(a, b), (b, a)] {
                let travelled = way.travelled_from(from);
                let sum = legs.get(&(from, to));
                prop_assert_eq!(travelled.times(), sum.map_or(0, |sum| sum.times));
                prop_assert_eq!(travelled.fastest_s(), sum.map(|sum| sum.fastest_s));
                if let Some(sum) = sum {
                    directions += 1;
                    prop_assert!((travelled.mean_s().unwrap() - sum.mean_s).abs() < 1e-9);
                    let (trip, leg) = travelled.leg().unwrap();
                    let leg = map.trip(trip).unwrap().leg(leg as usize).unwrap();
                    prop_assert_eq!((leg.from(), leg.to()), (from, to));
                }
            }
            // Nothing was relaxed, so what was measured between the places is how they lie.
            let places = map.places_of_way(way).unwrap();
            let (a, b) = (map.place(a).unwrap(), map.place(b).unwrap());
            let pose = |p: &cognitive_map::Place| {
                Isometry3::from_parts((*p.position()).into(), *p.rotation())
            };
            let expected = pose(a).inv_mul(&pose(b));
            for relative in [&places, way.relative()] {
                let off = relative.to_homogeneous() - expected.to_homogeneous();
                prop_assert!(off.norm() < 1e-6, "{off}");
            }
            let distance_m = places.translation.vector.norm();
            prop_assert!(way.length_m(&places) >= distance_m);
        }
        prop_assert_eq!(directions, legs.len());
    }

    /// No two places are separated as long as there is a way that is no bridge, and what is
    /// forgotten leaves waypoints where ways lead.
    #[test]
    fn forgetting_separates_nothing_while_it_need_not(
        yaws in prop::collection::vec(-1.5..1.5f64, 100..300),
        ways_max in 4u32..40,
        places_max in 8u32..60,
    ) {
        let mut map = CognitiveMap::new(settings(|values| {
            (values.ways_max, values.places_max) = (ways_max, places_max);
        }));
        let mut robot = Robot::enrol(&mut map);
        let mut before = graph(&map);
        for yaw in yaws {
            wander(&mut map, &mut robot, &[yaw]);
            let after = graph(&map);
            prop_assert!(map.way_count() <= ways_max as usize);
            let mut gone: Vec<_> = before.all_edges().collect();
            gone.retain(|(a, b, _)| !after.contains_edge(*a, *b));
            prop_assert!(gone.len() <= 1, "one for one");
            if let [(a, b, _)] = gone[..] {
                let bridges: BTreeSet<_> = petgraph::algo::bridges::bridges(&before)
                    .map(|bridge| {
                        let (a, b) = (bridge.0, bridge.1);
                        (a.min(b), a.max(b))
                    })
                    .collect();
                let separates = bridges.contains(&(a.min(b), a.max(b)));
                prop_assert!(!separates || bridges.len() == before.edge_count(), "{a} {b}");
            }
            let waypoints: BTreeSet<_> = map.waypoints().map(|w| w.place().0).collect();
            prop_assert_eq!(&waypoints, &after.nodes().collect());
            before = after;
        }
        let digest = map.digest();
        let restored = CognitiveMap::restore(map.settings().clone(), map.checkpoint(0)).unwrap();
        prop_assert_eq!(restored.digest(), digest);
    }
}
