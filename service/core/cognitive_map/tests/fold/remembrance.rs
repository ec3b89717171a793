//! Places and ways of another map: a map that takes them in answers as the other one does.

use cognitive_map::{
    AgentId, CognitiveMap, NoRoute, PlaceId, RecallCue, Recalled, Record, RememberedPlace,
    RememberedTraversals, RememberedWay, Remembrance, Route, RouteCost, RouteOptions,
    SettingsValues, Traversals,
};
use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;

use crate::journal::{Robot, label, motion, run, settings, start_pose};

fn budgets(values: &mut SettingsValues) {
    (values.places_max, values.ways_max) = (40, 50);
}

/// A robot that wanders in the plane, back to the middle from far out.
fn wandered(yaws: &[f64]) -> CognitiveMap {
    let mut map = CognitiveMap::new(settings(budgets));
    let mut robot = Robot::enrol(&mut map);
    for yaw in yaws {
        let far = robot.position(&map).coords.norm() > 2.0;
        let yaw = if far { 2.5 } else { *yaw };
        robot.sample(&mut map, motion([0.15, 0.0, 0.0], [0.0, 0.0, yaw]));
    }
    map
}

fn traversals(of: &Traversals) -> RememberedTraversals {
    RememberedTraversals {
        times: of.times(),
        fastest_s: of.fastest_s().unwrap_or(0.0),
        mean_s: of.mean_s().unwrap_or(0.0),
        last_stamp_ns: of.last_stamp_ns().unwrap_or(0),
    }
}

/// What is to be journaled of a map.
fn remembrances(map: &CognitiveMap) -> Vec<Record> {
    let enrolled = map.agents().map(|(agent, of)| Record::Enrol {
        agent,
        name: of.name().clone(),
    });
    let places = map.places().map(|(place, of)| {
        Record::Remember(Remembrance::Place(RememberedPlace {
            place,
            pose: Isometry3::from_parts((*of.position()).into(), *of.rotation()),
            position_sd_m: *of.position_sd_m(),
            founder: of.founder(),
            visits: of.visits(),
            first_stamp_ns: of.first_stamp_ns(),
            last_stamp_ns: of.last_stamp_ns(),
            strength: map.place_strength(place),
        }))
    });
    let ways = map.ways().map(|way| {
        let ends = way.ends();
        let places = map.places_of_way(way).unwrap();
        Record::Remember(Remembrance::Way(Box::new(RememberedWay {
            ends,
            poses: ends.map(|end| *map.waypoint(end).unwrap().pose()),
            travelled: ends.map(|end| traversals(way.travelled_from(end))),
            relative: *way.relative(),
            variance: way.measurement_variance(),
            measurements: way.measurements(),
            shortest_m: way.length_m(&places),
            strength: map.way_strength(way),
        })))
    });
    enrolled.chain(places).chain(ways).collect()
}

fn recalled(map: &CognitiveMap, at: Point3<f64>, by_code: bool) -> Vec<Recalled> {
    let code = map.modules().code_at(&at);
    map.recall(&RecallCue {
        position: (!by_code).then_some(at),
        code: by_code.then(|| (&code).into()),
        percept: None,
        radius_m: None,
        founder: Some(AgentId(0)),
        since_ns: None,
        until_ns: None,
        limit: 5,
    })
}

fn route(
    map: &CognitiveMap,
    ends: [PlaceId; 2],
    cost: RouteCost,
) -> Result<(f64, Vec<Option<PlaceId>>), NoRoute> {
    let [from, to] = ends.map(|end| map.route_end_at(end).unwrap());
    let options = RouteOptions {
        cost,
        ..RouteOptions::default()
    };
    let found = map.routes(&from, &to, &options, None, &mut || false)?;
    let places = |route: &Route| route.steps.iter().map(|step| step.place).collect();
    Ok((found[0].length_m, places(&found[0])))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Also of places that have been forgotten and ways that outlived them.
    #[test]
    fn a_map_that_takes_another_one_in_answers_as_that_one(
        yaws in prop::collection::vec(-1.5..1.5f64, 50..400),
        asked in prop::collection::vec(prop::array::uniform2(-2.0..2.0f64), 4),
    ) {
        let map = wandered(&yaws);
        let records = remembrances(&map);
        let mut taken = CognitiveMap::new(settings(budgets));
        run(&mut taken, &records);
        prop_assert_eq!(taken.place_count(), map.place_count());
        prop_assert_eq!(taken.way_count(), map.way_count());
        for [x, y] in asked {
            let at = Point3::new(x, y, 0.0);
            for by_code in [false, true] {
                prop_assert_eq!(recalled(&taken, at, by_code), recalled(&map, at, by_code));
            }
        }
        let places: Vec<_> = map.places().map(|(id, _)| id).collect();
        for pair in places.windows(4) {
            let ends = [pair[0], pair[3]];
            for cost in [RouteCost::Length, RouteCost::Time, RouteCost::Uncertainty] {
                match (route(&taken, ends, cost), route(&map, ends, cost)) {
                    (Ok(taken), Ok(of)) => {
                        prop_assert_eq!(taken.1, of.1);
                        prop_assert!((taken.0 - of.0).abs() < 1e-9);
                    }
                    (taken, of) => prop_assert_eq!(taken.is_err(), of.is_err()),
                }
            }
        }

        // Once more changes nothing; a checkpoint has it all, and so has a replay.
        let (digest, revision) = (taken.digest(), taken.revision());
        run(&mut taken, &records);
        prop_assert_eq!((taken.digest(), taken.revision()), (digest, revision));
        let restored = CognitiveMap::restore(settings(budgets), taken.checkpoint(0)).unwrap();
        prop_assert_eq!(restored.digest(), digest);
        let mut replayed = CognitiveMap::new(settings(budgets));
        run(&mut replayed, &records);
        prop_assert_eq!(replayed.digest(), digest);
    }
}

#[test]
fn robots_go_on_in_a_map_that_was_taken_in() {
    let map = wandered(&[0.0; 12]);
    let mut taken = CognitiveMap::new(settings(budgets));
    run(&mut taken, &remembrances(&map));
    let id = AgentId(1);
    let name = label("newcomer");
    run(&mut taken, &[Record::Enrol { agent: id, name }]);
    let mut robot = Robot {
        id,
        session: 1,
        seq: 0,
        stamp_ns: 0,
    };
    robot.go(&mut taken, [0.0; 3], [0.0; 3]);
    assert!(
        !taken.agent(id).unwrap().placed(),
        "it does not define the frame anew"
    );
    robot.sample(&mut taken, start_pose([0.0; 3], [0.0; 3]));
    robot.ahead(&mut taken, 0.15, 12);
    assert_eq!(
        taken.place_count(),
        map.place_count(),
        "it comes by known places"
    );
    let way = taken.way(PlaceId(1), PlaceId(2)).unwrap();
    let before = map.way(PlaceId(1), PlaceId(2)).unwrap();
    assert_eq!(way.traversals(), before.traversals() + 1);
    robot.ahead(&mut taken, 0.15, 6);
    let newest = taken.places().last().unwrap().0;
    assert!(newest.0 as usize >= map.places_recruited());
}
