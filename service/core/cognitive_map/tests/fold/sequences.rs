//! Sequences of places or percepts, and what comes next on the trips that they look like.

use std::collections::BTreeMap;

use cognitive_map::{
    CognitiveMap, Descriptor, PerceptCue, PlaceId, SequenceCue, SequenceElement, SequenceRecall,
    Settings, TripEnd, TripId,
};
use proptest::prelude::*;

use crate::journal::{Robot, descriptor, label, marker, settings, start_pose};

fn new_map() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(Settings::default());
    let robot = Robot::enrol(&mut map);
    (map, robot)
}

/// Eight places ahead from the origin, then eight to the left or to the right.
fn fork(map: &mut CognitiveMap, robot: &mut Robot, side: f64) {
    robot.sample(map, start_pose([0.0; 3], [0.0; 3]));
    robot.ahead(map, 1.0, 8);
    for _ in 0..8 {
        robot.go(map, [0.0, side, 0.0], [0.0; 3]);
    }
    robot.sample(map, marker("done", true));
}

fn ask(map: &CognitiveMap, places: &[u32]) -> SequenceRecall {
    let elements = places
        .iter()
        .map(|place| SequenceElement::Place(PlaceId(*place)));
    recall(map, elements.collect())
}

fn recall(map: &CognitiveMap, elements: Vec<SequenceElement>) -> SequenceRecall {
    map.recall_sequence(&of(elements, 1000), &mut || false)
        .unwrap()
}

fn of(elements: Vec<SequenceElement>, limit: usize) -> SequenceCue {
    SequenceCue {
        elements,
        error_rate: 0.1,
        none_prior: 0.05,
        limit,
    }
}

fn sum(recalled: &SequenceRecall) -> f64 {
    let next: f64 = recalled.next.iter().map(|next| next.probability).sum();
    next + recalled.others + recalled.none
}

fn places_of(map: &CognitiveMap, trip: u32) -> Vec<u32> {
    map.trip(TripId(trip))
        .unwrap()
        .places()
        .map(|place| place.0)
        .collect()
}

/// Probability that a sequence goes on to the left of the fork, and to the right.
fn sides(map: &CognitiveMap, cue: &[u32]) -> (f64, f64) {
    let recalled = ask(map, cue);
    let of = |is_side: fn(f64) -> bool| {
        let next = recalled.next.iter();
        let side = next.filter(|next| is_side(map.place(next.place).unwrap().position().y));
        side.map(|next| next.probability).sum()
    };
    (of(|y| y > 0.1), of(|y| y < -0.1))
}

#[test]
fn a_fork_goes_on_as_often_as_it_did() {
    let order = [[1.0, 1.0, 1.0, -1.0], [-1.0, 1.0, 1.0, 1.0]];
    let [early, late] = order.map(|order| {
        let (mut map, mut robot) = new_map();
        for side in order {
            fork(&mut map, &mut robot, side);
        }
        let stem: Vec<_> = { places_of(&map, 0) }
            .into_iter()
            .take_while(|place| map.place(PlaceId(*place)).unwrap().position().y.abs() < 0.01)
            .collect();
        sides(&map, &stem[stem.len() - 4..])
    });
    for (left, right) in [early, late] {
        assert!(
            (left - 0.75).abs() < 0.01 && (right - 0.25).abs() < 0.01,
            "{left} {right}"
        );
    }
    // The order of the trips does not matter, but for what has faded in between.
    assert!((early.0 - late.0).abs() < 1e-3, "{early:?} {late:?}");
}

#[test]
fn a_sequence_is_recognised_in_spite_of_a_wrong_place() {
    let (mut map, mut robot) = new_map();
    fork(&mut map, &mut robot, 1.0);
    robot.sample(&mut map, start_pose([50.0, 0.0, 0.0], [0.0; 3]));
    robot.ahead(&mut map, 0.1, 100);
    let (first, other) = (places_of(&map, 0), places_of(&map, 1));
    for wrong in 0..5 {
        let mut cue = first[2..7].to_vec();
        cue[wrong] = other[10];
        let recalled = ask(&map, &cue);
        assert_eq!(recalled.next[0].place, PlaceId(first[7]), "{wrong}");
        assert!(recalled.next[0].probability > 0.8, "{wrong} {recalled:?}");
        let best = recalled.trips[0];
        assert_eq!((best.trip, best.leg), (TripId(0), 6));
    }
    // One was passed by, or is one too many.
    let passed_by = [first[1], first[2], first[4], first[5]];
    assert_eq!(ask(&map, &passed_by).next[0].place, PlaceId(first[6]));
    let one_more = [first[1], first[2], other[10], first[3], first[4]];
    assert_eq!(ask(&map, &one_more).next[0].place, PlaceId(first[5]));
}

#[test]
fn what_nobody_travelled_is_not_recognised() {
    let (mut map, mut robot) = new_map();
    robot.ahead(&mut map, 0.1, 300);
    let places = places_of(&map, 0);
    let known = ask(&map, &places[3..8]);
    assert!(known.none < 1e-3, "{known:?}");
    // Back and forth by many places at once.
    let recalled = ask(
        &map,
        &[places[70], places[10], places[50], places[30], places[90]],
    );
    assert!(recalled.none > 0.9, "{recalled:?}");
    // A place that no trip leads through says little.
    let (empty, _) = new_map();
    for nothing in [ask(&empty, &[0]), recall(&empty, Vec::new())] {
        assert!((nothing.none - 1.0).abs() < 1e-12, "{nothing:?}");
    }
}

#[test]
fn after_the_end_of_a_trip_comes_nothing() {
    let (mut map, mut robot) = new_map();
    fork(&mut map, &mut robot, 1.0);
    assert_eq!(map.trip(TripId(0)).unwrap().ended(), Some(TripEnd::Marker));
    let places = places_of(&map, 0);
    let end = ask(&map, &places[places.len() - 4..]);
    assert!(end.none > 0.95, "{end:?}");
    // Another one is under way: where it goes is not known, and says nothing.
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    robot.ahead(&mut map, 1.0, 6);
    let under_way = places_of(&map, 1);
    assert!(map.trip(TripId(1)).unwrap().ended().is_none());
    let recalled = ask(&map, &under_way[under_way.len() - 4..]);
    assert_eq!(recalled.next[0].place, PlaceId(places[under_way.len()]));
    assert!(recalled.next[0].probability > 0.95, "{recalled:?}");
    assert!(
        recalled
            .trips
            .iter()
            .all(|found| found.trip != TripId(1) || found.probability < 0.05)
    );
}

#[test]
fn what_was_seen_recalls_as_well_as_where() {
    let (mut map, mut robot) = new_map();
    let looks = |step: u16| -> Vec<f32> {
        let waves = (1..=16).map(|wave| (f32::from(step * wave) * 0.07).sin() + 0.1);
        waves.collect()
    };
    for step in 0..40 {
        robot.ahead(&mut map, 0.3, 1);
        robot.sample(&mut map, descriptor("camera", &looks(step)));
    }
    robot.sample(&mut map, marker("done", true));
    let places = places_of(&map, 0);
    let seen = (20..25).map(|step| {
        let seen = Descriptor::new(label("camera"), &looks(step)).unwrap();
        SequenceElement::Percept(PerceptCue::Descriptor(seen))
    });
    let recalled = recall(&map, seen.collect());
    assert_eq!(recalled.next[0].place, PlaceId(places[25]), "{recalled:?}");
    assert!(recalled.next[0].probability > 0.5);
    assert!((sum(&recalled) - 1.0).abs() < 1e-9);
}

/// A walk in steps of a place on a lattice of five by five, as trips of its own.
fn wander(map: &mut CognitiveMap, robot: &mut Robot, turns: &[u8]) {
    let mut at = [2_i32, 2];
    robot.sample(map, start_pose([0.0; 3], [0.0; 3]));
    for turn in turns {
        let (axis, step) = (usize::from(turn % 2), i32::from(turn / 2 % 2) * 2 - 1);
        let step = if (0..5).contains(&(at[axis] + step)) {
            step
        } else {
            -step
        };
        at[axis] += step;
        let mut way = [0.0; 3];
        way[axis] = f64::from(step);
        robot.go(map, way, [0.0; 3]);
        if turn / 4 == 0 {
            robot.sample(map, marker("done", true));
        }
    }
}

/// Whether a position of a trip is looked at: one of the sequence's places is so near that the
/// sequence may end here.
fn is_near(places: &[PlaceId], end: usize, cue: &[u32]) -> bool {
    (0..).zip(cue).any(|(rank, element)| {
        let mut at = (0..places.len()).filter(|at| places[*at].0 == *element);
        at.any(|at| at <= end + rank + 2 && end + rank < at + cue.len() + 2)
    })
}

/// What comes next by the model with all positions of all trips.
fn exhaustive(map: &CognitiveMap, cue: &[u32]) -> (BTreeMap<u32, f64>, f64) {
    let n_places = map.place_count().max(2) as f64;
    let trips: Vec<_> = map.trips().collect();
    let n_positions: usize = trips.iter().map(|(_, trip)| trip.leg_count() + 1).sum();
    let starts: Vec<Vec<f64>> = { trips.iter() }
        .map(|(id, trip)| {
            let weight = map.trip_strength(*id).min(1.0);
            vec![0.95 / n_positions as f64 * weight; trip.leg_count() + 1]
        })
        .collect();
    let left_out = 0.95 - starts.iter().flatten().sum::<f64>();
    let (mut all, mut elsewhere, mut nobody) = (starts.clone(), left_out, 0.05);
    for (rank, element) in cue.iter().enumerate() {
        if rank > 0 {
            let mut jumps = 0.005 * (nobody + elsewhere);
            let mut moved: Vec<Vec<f64>> = starts.iter().map(|of| vec![0.0; of.len()]).collect();
            for (from, to) in all.iter().zip(&mut moved) {
                for (at, mass) in from.iter().enumerate() {
                    jumps += 0.005 * mass;
                    for (on, share) in [(0, 0.002), (1, 0.991), (2, 0.002)] {
                        match to.get_mut(at + on) {
                            Some(to) => *to += share * mass,
                            None => jumps += share * mass,
                        }
                    }
                }
            }
            for (to, start) in moved.iter_mut().flatten().zip(starts.iter().flatten()) {
                *to += jumps * start;
            }
            all = moved;
            elsewhere = 0.995 * elsewhere + jumps * left_out;
            nobody = 0.995 * nobody + jumps * 0.05;
        }
        for (of, (_, trip)) in all.iter_mut().zip(&trips) {
            for (mass, place) in of.iter_mut().zip(trip.places()) {
                *mass *= if place.0 == *element {
                    0.9 * n_places + 0.1
                } else {
                    0.1
                };
            }
        }
        elsewhere *= 0.1;
    }
    let (mut next, mut none) = (BTreeMap::new(), nobody + elsewhere);
    for (of, (_, trip)) in all.iter().zip(&trips) {
        let places: Vec<_> = trip.places().collect();
        for (at, mass) in of.iter().enumerate() {
            match places.get(at + 1) {
                // Elsewhere it cannot be told where.
                _ if !is_near(&places, at, cue) => none += mass,
                Some(place) => *next.entry(place.0).or_insert(0.0) += mass,
                None if trip.ended() == Some(TripEnd::Marker) => none += mass,
                None => {}
            }
        }
    }
    let sum = next.values().sum::<f64>() + none;
    for mass in next.values_mut() {
        *mass /= sum;
    }
    (next, none / sum)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Against all positions of all trips; with places that are forgotten, a small budget of legs,
    /// and from a checkpoint.
    #[test]
    fn the_answer_is_that_of_all_positions(
        turns in prop::collection::vec(0..64_u8, 5..300),
        cue in prop::collection::vec(0..25_u32, 1..8),
        start in any::<prop::sample::Index>(),
        is_travelled in any::<bool>(),
        legs_max in prop::sample::select(vec![40, 65_536]),
    ) {
        let mut map = CognitiveMap::new(settings(|values| values.legs_max = legs_max));
        let mut robot = Robot::enrol(&mut map);
        wander(&mut map, &mut robot, &turns);
        let mut cue = cue;
        if is_travelled && let Some((_, trip)) = map.trips().next() {
            let places: Vec<_> = trip.places().map(|place| place.0).collect();
            let first = start.index(places.len());
            cue.splice(.., places[first..].iter().take(5).copied());
        }
        let recalled = ask(&map, &cue);
        prop_assert!((sum(&recalled) - 1.0).abs() < 1e-9, "{recalled:?}");
        let (expected, none) = exhaustive(&map, &cue);
        // Off the parts that are looked at, all positions are taken for one. On a map of some
        // twenty places that matters for a sequence that nobody travelled.
        let off_max = if is_travelled { 0.05 } else { 0.15 };
        prop_assert!((recalled.none - none).abs() < off_max, "{} {none}", recalled.none);
        for next in &recalled.next {
            let expected = expected.get(&next.place.0).copied().unwrap_or(0.0);
            prop_assert!((0.0..=1.0).contains(&next.probability));
            prop_assert!((next.probability - expected).abs() < off_max, "{next:?} {expected}");
        }
        prop_assert!(recalled.next.is_sorted_by(|a, b| a.probability >= b.probability));
        let on_trips: f64 = recalled.trips.iter().map(|found| found.probability).sum();
        prop_assert!(on_trips < 1.0 + 1e-9);
        let pages: Vec<_> = map.checkpoint(0).collect();
        let restored = CognitiveMap::restore(map.settings().clone(), pages).unwrap();
        prop_assert_eq!(&ask(&restored, &cue), &recalled);
        // A shorter answer is the beginning of the long one.
        let elements = cue.iter().map(|place| SequenceElement::Place(PlaceId(*place)));
        let short = of(elements.collect(), 1);
        let given_up = map.recall_sequence(&short, &mut || true);
        prop_assert!(given_up.is_none());
        let short = map.recall_sequence(&short, &mut || false).unwrap();
        prop_assert!((sum(&short) - 1.0).abs() < 1e-9);
        prop_assert_eq!(short.next.first(), recalled.next.first());
    }
}
