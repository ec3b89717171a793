//! Routes: the cheapest there is, against another program's, whatever bounds the search.

use std::collections::{BTreeMap, BTreeSet};

use cognitive_map::{
    CognitiveMap, NoRoute, NoRouteEnd, PlaceId, Region, Reverse, Route, RouteBounds, RouteCost,
    RouteEnd, RouteOptions, Settings, StepKind, TripId,
};
use nalgebra::{Point3, Vector3};
use petgraph::graphmap::DiGraphMap;
use proptest::prelude::*;

use crate::journal::{Robot, settings, start_pose};

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

fn wandered(yaws: &[f64], half_life: u32) -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(settings(|values| {
        values.strength_half_life_samples = half_life;
        values.trip_stillness_s = 1.0;
    }));
    let mut robot = Robot::enrol(&mut map);
    wander(&mut map, &mut robot, yaws);
    (map, robot)
}

fn routes(
    map: &CognitiveMap,
    from: &RouteEnd,
    to: &RouteEnd,
    options: &RouteOptions,
) -> Result<Vec<Route>, NoRoute> {
    map.routes(from, to, options, None, &mut || false)
}

/// What a way costs, by its public properties.
fn cost(map: &CognitiveMap, from: PlaceId, to: PlaceId, cost: RouteCost) -> u64 {
    let way = map.way(from, to).unwrap();
    let length_m = way.length_m(&map.places_of_way(way).unwrap());
    let length = (length_m * 1e6).ceil();
    let micro = match cost {
        RouteCost::Length => length,
        RouteCost::Time => {
            let there = way.travelled_from(from).mean_s();
            (there.or(way.travelled_from(to).mean_s()).unwrap() * 1e6).ceil()
        }
        RouteCost::Uncertainty => (way.position_variance_m2() * 1e6).ceil(),
        RouteCost::Recency => {
            let age = (map.revision() - way.last_revision()) as f64;
            let half_life = f64::from(map.settings().strength_half_life_samples);
            (length * (age / half_life).min(20.0).exp2()).ceil()
        }
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number that is not negative"
    )]
    (micro as u64).max(1)
}

/// The ways as a graph of another program, as the options have it.
fn graph(map: &CognitiveMap, options: &RouteOptions) -> DiGraphMap<u32, u64> {
    let mut graph = DiGraphMap::new();
    for way in map.ways() {
        let [a, b] = way.ends();
        for (from, to) in [(a, b), (b, a)] {
            let travelled = way.travelled_from(from).times() > 0;
            let allowed = travelled || options.reverse == Reverse::Allowed;
            if allowed && !options.avoid_places.contains(&to) {
                graph.add_edge(from.0, to.0, cost(map, from, to, options.cost));
            }
        }
    }
    graph
}

fn places_of(from: PlaceId, route: &Route) -> Vec<PlaceId> {
    let steps = route.steps.iter().filter_map(|step| step.place);
    std::iter::once(from).chain(steps).collect()
}

fn options() -> impl Strategy<Value = RouteOptions> {
    let costs = vec![
        RouteCost::Length,
        RouteCost::Time,
        RouteCost::Uncertainty,
        RouteCost::Recency,
    ];
    let avoid = prop::collection::btree_set(0u32..20, 0..3);
    let reverse = prop::sample::select(vec![Reverse::Allowed, Reverse::Never]);
    let options = (prop::sample::select(costs), reverse, avoid, 0usize..4);
    options.prop_map(|(cost, reverse, avoid, alternatives)| RouteOptions {
        cost,
        reverse,
        avoid_places: avoid.into_iter().map(PlaceId).collect(),
        avoid_regions: Vec::new(),
        shortcuts_within_m: None,
        alternatives,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The cost is Dijkstra's on the same ways; the steps join up; bounds change nothing, nor does
    /// it matter how old the bounds are that were brought up to date.
    #[test]
    fn a_route_is_the_cheapest_there_is(
        yaws in prop::collection::vec(-1.5..1.5f64, 20..250),
        later in prop::collection::vec(-1.5..1.5f64, 0..60),
        ends in (any::<prop::sample::Index>(), any::<prop::sample::Index>()),
        half_life in prop::sample::select(vec![20u32, 1_000_000]),
        options in options(),
    ) {
        let (mut map, mut robot) = wandered(&yaws, half_life);
        let (mut bounds, mut straight) = (RouteBounds::of(&map), RouteBounds::straight(&map));
        wander(&mut map, &mut robot, &later);
        prop_assert!(bounds.follow(&map, usize::MAX) && straight.follow(&map, usize::MAX));
        let places: Vec<_> = map.places().map(|(id, _)| id).collect();
        let (from, to) = (places[ends.0.index(places.len())], places[ends.1.index(places.len())]);
        let (start, goal) = (map.route_end_at(from).unwrap(), map.route_end_at(to).unwrap());
        let found = routes(&map, &start, &goal, &options);
        for bounds in [bounds, straight, RouteBounds::of(&map), RouteBounds::straight(&map)] {
            let again = map.routes(&start, &goal, &options, Some(&bounds), &mut || false);
            prop_assert_eq!(&again, &found, "with bounds");
        }
        let graph = graph(&map, &options);
        let costs = if graph.contains_node(from.0) {
            petgraph::algo::dijkstra(&graph, from.0, None, |edge| *edge.2)
        } else {
            std::iter::once((from.0, 0)).collect()
        };
        let Ok(found) = found else {
            prop_assert!(!costs.contains_key(&to.0));
            let Err(NoRoute::NoWay { nearest: (place, distance_m), .. }) = found else {
                panic!("nobody gave up");
            };
            let at = |place| map.place(place).unwrap().position();
            prop_assert!(costs.contains_key(&place.0));
            let far = |place| (at(place) - at(to)).norm();
            prop_assert!((far(place) - distance_m).abs() < 1e-12);
            prop_assert!(costs.keys().all(|other| far(PlaceId(*other)) >= distance_m));
            return Ok(());
        };
        let best = &found[0];
        prop_assert_eq!(Some(&best.cost_micro), costs.get(&to.0));
        prop_assert_eq!(best.steps.is_empty(), from == to);
        let mut seen: Vec<BTreeSet<_>> = Vec::new();
        for route in &found {
            let places = places_of(from, route);
            prop_assert_eq!(places.last(), Some(&to));
            let (mut micro, mut shared, mut length_m) = (0, BTreeMap::new(), 0.0);
            for (pair, step) in places.windows(2).zip(&route.steps) {
                let (a, b) = (pair[0], pair[1]);
                micro += cost(&map, a, b, options.cost);
                prop_assert!(graph.contains_edge(a.0, b.0));
                let travelled = map.way(a, b).unwrap().travelled_from(a).times();
                prop_assert_eq!(step.traversals, travelled);
                prop_assert_eq!(step.kind == StepKind::Travelled, travelled > 0);
                let (trip, leg) = step.leg.unwrap();
                let leg = map.trip(trip).unwrap().leg(leg as usize).unwrap();
                let ends = [leg.from().min(leg.to()), leg.from().max(leg.to())];
                prop_assert_eq!(ends, [a.min(b), a.max(b)]);
                let at = map.place(b).unwrap().position();
                prop_assert_eq!(&step.position, at);
                let distance_m = (at - map.place(a).unwrap().position()).norm();
                prop_assert!(step.length_m + 1e-5 >= distance_m);
                prop_assert!(step.tolerance_m >= 0.125 && step.tolerance_m >= 2.0 * step.sd_m);
                for (number, known) in seen.iter().enumerate() {
                    if known.contains(&ends) {
                        *shared.entry(number).or_insert(0.0) += step.length_m;
                    }
                }
                length_m += step.length_m;
            }
            prop_assert_eq!(micro, route.cost_micro);
            prop_assert!((length_m - route.length_m).abs() < 1e-9);
            prop_assert!(shared.values().all(|shared| *shared <= 0.5 * length_m + 1e-9));
            let ends = places.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])]);
            seen.push(ends.collect());
        }
        prop_assert!(found.len() <= 1 + options.alternatives);
        prop_assert!(found.windows(2).all(|pair| pair[0].cost_micro <= pair[1].cost_micro));
        let restored = CognitiveMap::restore(map.settings().clone(), map.checkpoint(0)).unwrap();
        prop_assert_eq!(routes(&restored, &start, &goal, &options), Ok(found));
    }
}

/// A robot that goes round a square of 3 m once, by the left.
fn square() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    for _ in 0..4 {
        robot.ahead(&mut map, 0.1, 30);
        robot.go(&mut map, [0.0; 3], [0.0, 0.0, std::f64::consts::FRAC_PI_2]);
    }
    robot.ahead(&mut map, 0.1, 4);
    (map, robot)
}

fn near(map: &CognitiveMap, at: [f64; 3]) -> RouteEnd {
    map.route_end_near(&Point3::from(at)).unwrap()
}

fn only(map: &CognitiveMap, from: &RouteEnd, to: &RouteEnd, options: &RouteOptions) -> Route {
    let mut found = routes(map, from, to, options).unwrap();
    assert_eq!(found.len(), 1);
    found.remove(0)
}

#[test]
fn a_route_leads_from_beside_the_places_to_beside_them() {
    let (map, _) = square();
    let (from, to) = (near(&map, [0.1, 0.2, 0.0]), near(&map, [1.5, -0.2, 0.0]));
    let route = only(&map, &from, &to, &RouteOptions::default());
    let kinds: Vec<_> = route.steps.iter().map(|step| step.kind).collect();
    assert_eq!(kinds.first(), Some(&StepKind::Approach));
    assert_eq!(kinds.last(), Some(&StepKind::Approach));
    assert!(
        kinds[1..kinds.len() - 1]
            .iter()
            .all(|kind| *kind == StepKind::Travelled)
    );
    let last = route.steps.last().unwrap();
    assert_eq!(
        (last.place, last.position),
        (None, Point3::new(1.5, -0.2, 0.0))
    );
    assert!((1.5..2.2).contains(&route.length_m), "{}", route.length_m);
    // A metre a second; the approaches take as long as the same length of ways.
    assert!(
        (route.duration_s / route.length_m - 1.0).abs() < 0.1,
        "{}",
        route.duration_s
    );
}

#[test]
fn a_route_from_beside_a_place_to_the_place_is_an_approach() {
    let (map, _) = square();
    let place = map.nearest_place(&Point3::new(1.5, 0.0, 0.0)).unwrap().0;
    let position = *map.place(place).unwrap().position();
    let there = map.route_end_at(place).unwrap();
    let beside = near(&map, (position.coords + Vector3::new(0.0, 0.3, 0.0)).into());
    let route = only(&map, &beside, &there, &RouteOptions::default());
    let [step] = &route.steps[..] else {
        panic!("{route:?}");
    };
    assert_eq!((step.kind, step.place), (StepKind::Approach, Some(place)));
    assert!((step.position - position).norm() < 1e-9 && (route.length_m - 0.3).abs() < 1e-9);
    let nowhere = only(&map, &there, &there, &RouteOptions::default());
    assert_eq!((nowhere.steps.len(), nowhere.length_m), (0, 0.0));
}

#[test]
fn a_way_back_is_only_taken_where_it_may_be() {
    let (map, _) = square();
    let (from, to) = (near(&map, [1.5, 0.0, 0.0]), near(&map, [0.0, 0.9, 0.0]));
    let back = only(&map, &from, &to, &RouteOptions::default());
    assert!(back.length_m < 3.0, "{}", back.length_m);
    assert!(
        back.steps
            .iter()
            .any(|step| step.kind == StepKind::Reversed)
    );
    let options = RouteOptions {
        reverse: Reverse::Never,
        ..RouteOptions::default()
    };
    let round = only(&map, &from, &to, &options);
    assert!(round.length_m > 9.0, "{}", round.length_m);
    assert!(
        round
            .steps
            .iter()
            .all(|step| step.kind != StepKind::Reversed)
    );
}

#[test]
fn a_route_leads_round_what_is_avoided() {
    let (map, _) = square();
    let (from, to) = (near(&map, [0.5, 0.0, 0.0]), near(&map, [2.5, 0.0, 0.0]));
    let region = Region::new([1.5, -1.0, -1.0], [1.51, 1.0, 1.0]).unwrap();
    let options = RouteOptions {
        avoid_regions: vec![region],
        ..RouteOptions::default()
    };
    let round = only(&map, &from, &to, &options);
    assert!(round.length_m > 8.0, "{}", round.length_m);
    assert!(
        round
            .steps
            .iter()
            .all(|step| !region.contains(&step.position))
    );
    let wall = Region::new([-1.0, 1.5, -1.0], [4.0, 1.51, 1.0]).unwrap();
    let options = RouteOptions {
        avoid_regions: vec![region, wall],
        ..RouteOptions::default()
    };
    let Err(NoRoute::NoWay { nearest, .. }) = routes(&map, &from, &to, &options) else {
        panic!("there is no way");
    };
    let nearest = map.place(nearest.0).unwrap().position();
    assert!(
        (1.0..1.5).contains(&nearest.x) && nearest.y.abs() < 0.1,
        "{nearest}"
    );
}

#[test]
fn the_other_way_round_is_an_alternative() {
    let (map, _) = square();
    let (from, to) = (near(&map, [0.5, 0.0, 0.0]), near(&map, [2.5, 0.0, 0.0]));
    let options = RouteOptions {
        alternatives: 4,
        ..RouteOptions::default()
    };
    let found = routes(&map, &from, &to, &options).unwrap();
    assert_eq!(found.len(), 2, "there is no third one");
    assert!(found[0].length_m < 2.5 && found[1].length_m > 9.0);
}

#[test]
fn ends_are_known_forgotten_or_far_from_everything() {
    let (map, robot) = square();
    let unknown = Err(NoRouteEnd::Unknown);
    assert_eq!(map.route_end_at(PlaceId(999)), unknown);
    assert_eq!(map.route_end_of_trip(TripId(99)), unknown);
    let start = map.trip(TripId(0)).unwrap().leg(0).unwrap().from();
    assert_eq!(map.route_end_of_trip(TripId(0)).unwrap().place(), start);
    assert_eq!(map.route_end_home(robot.id).unwrap().place(), start);
    let at = map.agent(robot.id).unwrap().place().unwrap().0;
    assert_eq!(map.route_end_of_agent(robot.id).unwrap().place(), at);
    let far = Point3::new(1.5, 1.5, 0.0);
    let nearest = map.nearest_place(&far);
    assert_eq!(
        map.route_end_near(&far),
        Err(NoRouteEnd::NothingNear { nearest })
    );
    assert_eq!(
        map.route_end_before(&far).unwrap().place(),
        nearest.unwrap().0
    );
    let here = map.route_end_at(start).unwrap();
    assert!(
        only(&map, &here, &here, &RouteOptions::default())
            .steps
            .is_empty()
    );

    let empty = CognitiveMap::new(Settings::default());
    let nothing = Err(NoRouteEnd::NothingNear { nearest: None });
    assert_eq!(empty.route_end_near(&far), nothing);
}

#[test]
fn a_new_session_has_a_new_home() {
    let (mut map, mut robot) = square();
    let before = map.route_end_home(robot.id).unwrap().place();
    robot.ahead(&mut map, 0.1, 9);
    assert_eq!(map.route_end_home(robot.id).unwrap().place(), before);
    (robot.session, robot.seq) = (2, 0);
    robot.ahead(&mut map, 0.1, 9);
    let after = map.route_end_home(robot.id).unwrap().place();
    assert_ne!(after, before);
    assert_eq!(
        map.route_end_home(cognitive_map::AgentId(9)),
        Err(NoRouteEnd::Unknown)
    );
}

#[test]
fn a_search_can_be_given_up() {
    let (map, _) = square();
    let (from, to) = (near(&map, [0.5, 0.0, 0.0]), near(&map, [2.5, 0.0, 0.0]));
    // So short a search is over before anybody is asked.
    let options = RouteOptions::default();
    assert!(map.routes(&from, &to, &options, None, &mut || true).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Each point of a shortcut is near a way, and no route becomes longer.
    #[test]
    fn shortcuts_stay_where_bodies_have_been(
        yaws in prop::collection::vec(-1.5..1.5f64, 100..250),
        ends in (any::<prop::sample::Index>(), any::<prop::sample::Index>()),
        radius_m in 0.05..0.3f64,
    ) {
        let (map, _) = wandered(&yaws, 1_000_000);
        let places: Vec<_> = map.places().map(|(id, _)| id).collect();
        let (from, to) = (places[ends.0.index(places.len())], places[ends.1.index(places.len())]);
        let (start, goal) = (map.route_end_at(from).unwrap(), map.route_end_at(to).unwrap());
        let plain = only(&map, &start, &goal, &RouteOptions::default());
        let options = RouteOptions {
            shortcuts_within_m: Some(radius_m),
            ..RouteOptions::default()
        };
        let short = only(&map, &start, &goal, &options);
        prop_assert!(short.length_m <= plain.length_m + 1e-6);
        prop_assert!((short.cost_micro as f64 * 1e-6 - short.length_m).abs() < 1e-4);
        let ways: Vec<_> = map.ways().map(cognitive_map::Way::ends).collect();
        let mut at = short.start;
        for step in &short.steps {
            if step.kind == StepKind::Shortcut {
                prop_assert!((step.position - at).norm() - step.length_m < 1e-9);
                for k in 0..=50 {
                    let point = at + (step.position - at) * (f64::from(k) / 50.0);
                    let near = ways.iter().any(|[a, b]| {
                        let [a, b] = [a, b].map(|id| map.place(*id).unwrap().position());
                        let axis = b - a;
                        let along = (point - a).dot(&axis) / axis.norm_squared();
                        (point - (a + axis * along.clamp(0.0, 1.0))).norm() <= radius_m + 1e-9
                    });
                    prop_assert!(near, "{point}");
                }
            }
            at = step.position;
        }
    }
}

#[test]
fn bends_are_cut_where_bodies_have_been_and_not_through_what_is_avoided() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    for step in 0..12 {
        let aside = if step % 2 == 0 { 0.15 } else { -0.15 };
        robot.go(&mut map, [0.3, aside, 0.0], [0.0; 3]);
    }
    let (from, to) = (near(&map, [0.3, 0.15, 0.0]), near(&map, [3.3, 0.15, 0.0]));
    let plain = only(&map, &from, &to, &RouteOptions::default());
    assert!((plain.length_m - 3.354).abs() < 0.001, "{}", plain.length_m);
    let within = |radius_m| RouteOptions {
        shortcuts_within_m: Some(radius_m),
        ..RouteOptions::default()
    };
    let cut = only(&map, &from, &to, &within(0.16));
    assert!((cut.length_m - 3.0).abs() < 0.001, "{}", cut.length_m);
    assert_eq!(cut.steps.len(), 1);
    let step = &cut.steps[0];
    assert_eq!(
        (step.kind, step.traversals, step.leg),
        (StepKind::Shortcut, 0, None)
    );
    assert!((step.sd_m - plain.sd_m).abs() < 1e-12 && step.duration_s < plain.duration_s);
    // Of a thinner body nobody knows whether it would pass.
    let thin = only(&map, &from, &to, &within(0.05));
    assert!(thin.length_m > 3.2, "{}", thin.length_m);
    let avoiding = RouteOptions {
        avoid_regions: vec![Region::new([1.75, 0.14, -1.0], [1.79, 0.2, 1.0]).unwrap()],
        ..within(0.16)
    };
    let beside = only(&map, &from, &to, &avoiding);
    assert!(beside.length_m > 3.0001 && beside.length_m < plain.length_m);
}
