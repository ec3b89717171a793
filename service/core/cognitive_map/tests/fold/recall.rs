//! Recall against an exhaustive scan.

use std::cmp::Ordering;

use cognitive_map::{AgentId, CognitiveMap, PlaceId, RecallCue, Recalled, Settings};
use grid::{GridCode, PartialCode, Phase, similarity};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::journal::{Robot, start_pose};

/// Two agents' places along two crooked ways that cross.
fn map_of(turns: &[f64]) -> CognitiveMap {
    let mut map = CognitiveMap::new(Settings::default());
    for start in [[0.0, 0.0, 0.0], [1.0, -1.0, 0.1]] {
        let mut robot = Robot::enrol(&mut map);
        robot.sample(&mut map, start_pose(start, [0.0; 3]));
        for turn in turns {
            robot.go(&mut map, [0.15, 0.0, 0.0], [0.0, 0.0, *turn]);
        }
    }
    map
}

fn cue() -> RecallCue {
    RecallCue {
        position: None,
        code: None,
        percept: None,
        radius_m: None,
        founder: None,
        since_ns: None,
        until_ns: None,
        limit: 10,
    }
}

fn cues() -> impl Strategy<Value = RecallCue> {
    let position = prop::array::uniform3(-3.0..3.0f64).prop_map(Point3::from);
    // As many modules as the default settings have; at least the first one is known.
    let phase = || prop::array::uniform3(0.0..1.0f64).prop_map(|turns| Phase::wrap(turns.into()));
    let code = (phase(), prop::collection::vec(prop::option::of(phase()), 5));
    let stamp = || prop::option::of((0i64..60).prop_map(|tenths| tenths * 100_000_000));
    (
        prop::option::of(position),
        prop::option::of(code),
        prop::option::of(prop_oneof![0.0..1.0f64, 0.0..10.0f64]),
        prop::option::of((0u32..3).prop_map(AgentId)),
        stamp(),
        stamp(),
        0usize..20,
    )
        .prop_map(
            |(position, code, radius_m, founder, since_ns, until_ns, limit)| {
                let code = code.map(|(first, mut others)| {
                    others.insert(0, Some(first));
                    let map = CognitiveMap::new(Settings::default());
                    PartialCode::new(map.modules(), others).unwrap()
                });
                RecallCue {
                    position,
                    code,
                    percept: None,
                    radius_m,
                    founder,
                    since_ns,
                    until_ns,
                    limit,
                }
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// Filters, scores and order, from nothing but the list of places.
    #[test]
    fn equals_the_exhaustive_scan(
        turns in prop::collection::vec(-0.8..0.8f64, 1..60),
        cue in cues(),
    ) {
        let map = map_of(&turns);
        let mut expected = Vec::new();
        for (id, place) in map.places() {
            let distance_m = cue.position.map(|position| (place.position() - position).norm());
            let out_of_reach = distance_m.zip(cue.radius_m).is_some_and(|(d, radius)| d > radius);
            if out_of_reach
                || cue.founder.is_some_and(|founder| founder != place.founder())
                || cue.since_ns.is_some_and(|since| place.last_stamp_ns() < since)
                || cue.until_ns.is_some_and(|until| place.first_stamp_ns() >= until)
            {
                continue;
            }
            let code = cue.code.clone().or_else(|| {
                let position = cue.position?;
                Some(PartialCode::from(&map.modules().code_at(&position)))
            });
            let cosine =
                code.map(|code| {
                    similarity::kernel(map.modules(), &code, &place.code(map.modules()))
                });
            expected.push((id, distance_m, cosine, place.last_stamp_ns()));
        }
        let recalled = map.recall(&cue);
        let of = |id: PlaceId| recalled.iter().find(|recalled| recalled.place == id);
        prop_assert_eq!(recalled.len(), expected.len().min(cue.limit));

        // With both cues the score is the product that the answer itself states; of the places that
        // are not in the answer it is asked for one by one.
        let mut everything = cue.clone();
        everything.limit = usize::MAX;
        let all = map.recall(&everything);
        let confidence = |id: PlaceId| {
            let found = all.iter().find(|recalled| recalled.place == id);
            found.and_then(|recalled| recalled.confidence)
        };
        expected.sort_by(|a, b| {
            let by_distance = || a.1.partial_cmp(&b.1).unwrap();
            let order = match (cue.position.is_some(), cue.code.is_some()) {
                (true, false) => by_distance(),
                (false, true) => b.2.partial_cmp(&a.2).unwrap(),
                (true, true) => {
                    let product = confidence(b.0).partial_cmp(&confidence(a.0)).unwrap();
                    product.then_with(by_distance)
                }
                (false, false) => b.3.cmp(&a.3),
            };
            if order == Ordering::Equal { a.0.cmp(&b.0) } else { order }
        });
        let best: Vec<_> = expected.iter().take(cue.limit).map(|best| best.0).collect();
        prop_assert_eq!(recalled.iter().map(|recalled| recalled.place).collect::<Vec<_>>(), best);
        for (id, distance_m, cosine, _) in expected {
            if let Some(recalled) = of(id) {
                prop_assert_eq!(recalled.distance_m, distance_m);
                prop_assert_eq!(recalled.cosine, cosine);
                let cued = cue.position.is_some() || cue.code.is_some();
                prop_assert_eq!(recalled.confidence.is_some(), cued);
                prop_assert!(recalled.confidence.is_none_or(|c| (0.0..=1.0).contains(&c)));
            }
        }
    }
}

fn code_at(map: &CognitiveMap, position: &Point3<f64>) -> PartialCode {
    PartialCode::from(&map.modules().code_at(position))
}

#[test]
fn a_position_recalls_the_places_around_it() {
    let map = map_of(&[0.0; 40]);
    let position = *map.place(PlaceId(5)).unwrap().position() + Vector3::new(0.0, 0.25, 0.0);
    let recalled = map.recall(&RecallCue {
        position: Some(position),
        limit: 1,
        ..cue()
    });
    let [
        Recalled {
            place: PlaceId(5),
            confidence: Some(confidence),
            ..
        },
    ] = recalled[..]
    else {
        panic!("{recalled:?}")
    };
    assert!(
        (confidence - 0.5).abs() < 1e-9,
        "one half at the field radius"
    );
}

#[test]
fn a_code_recalls_its_place_even_partly_erased() {
    let map = map_of(&[0.05; 40]);
    for (id, place) in map.places() {
        let whole = code_at(&map, place.position());
        let recalled = map.recall(&RecallCue {
            code: Some(whole),
            limit: 1,
            ..cue()
        });
        assert_eq!(recalled[0].place, id);
        assert!((recalled[0].confidence.unwrap() - 1.0).abs() < 1e-9);
        let GridCodeParts(mut phases) = parts(&place.code(map.modules()));
        phases[1] = None;
        phases[3] = None;
        let erased = PartialCode::new(map.modules(), phases).unwrap();
        let recalled = map.recall(&RecallCue {
            code: Some(erased),
            limit: 1,
            ..cue()
        });
        assert_eq!(recalled[0].place, id);
    }
}

struct GridCodeParts(Vec<Option<Phase>>);

fn parts(code: &GridCode) -> GridCodeParts {
    GridCodeParts(code.phases().iter().copied().map(Some).collect())
}

/// By its code alone a place a small way off answers about as confidently as by its distance.
#[test]
fn confidence_by_code_resembles_confidence_by_distance() {
    let map = map_of(&[0.0; 40]);
    let place = map.place(PlaceId(7)).unwrap();
    for offset_m in [0.0, 0.05, 0.1] {
        let position = place.position() + Vector3::new(0.0, 0.0, offset_m);
        let by_code = map.recall(&RecallCue {
            code: Some(code_at(&map, &position)),
            ..cue()
        });
        let by_distance = map.recall(&RecallCue {
            position: Some(position),
            ..cue()
        });
        let (code, distance) = (by_code[0], by_distance[0]);
        assert_eq!((code.place, distance.place), (PlaceId(7), PlaceId(7)));
        let difference = code.confidence.unwrap() - distance.confidence.unwrap();
        assert!(difference.abs() < 1e-6, "{difference} at {offset_m} m");
    }
}

#[test]
fn without_a_cue_the_latest_come_first() {
    let map = map_of(&[0.0; 40]);
    let recalled = map.recall(&RecallCue { limit: 3, ..cue() });
    let stamps: Vec<_> = recalled
        .iter()
        .map(|r| map.place(r.place).unwrap().last_stamp_ns())
        .collect();
    assert!(stamps.is_sorted_by(|a, b| a >= b));
    assert_eq!(recalled[0].cosine, None);
    assert!(map.recall(&RecallCue { limit: 0, ..cue() }).is_empty());
}

#[test]
fn the_nearest_place_is_found_however_far() {
    let map = map_of(&[0.0; 40]);
    let (place, distance_m) = map.nearest_place(&Point3::new(-1e6, 0.0, 0.0)).unwrap();
    assert_eq!(place, PlaceId(0));
    assert!((distance_m - 1e6).abs() < 1.0);
    assert_eq!(
        CognitiveMap::new(Settings::default()).nearest_place(&Point3::origin()),
        None
    );
}
