//! Blockages, routes that agents follow, and trips that are pinned.

use cognitive_map::{
    Back, Ball, Blockage, BlockageId, Blocked, CognitiveMap, Errand, EventKind, Goal, Instruction,
    NoRoute, PlaceId, Record, Retrace, Reverse, Route, RouteCost, RouteFailure, RouteOptions,
    TripId,
};
use nalgebra::Point3;

use crate::journal::{Robot, run, settings};

/// Someone who says what routes are to heed.
#[derive(Default)]
struct Operator {
    number: u64,
}

impl Operator {
    fn says(&mut self, map: &mut CognitiveMap, instruction: Instruction) -> Vec<EventKind> {
        let number = self.number;
        self.number += 1;
        let record = Record::Instruct {
            number,
            instruction,
        };
        let events = run(map, &[record]);
        events.into_iter().map(|event| event.kind).collect()
    }

    fn blocks(&mut self, map: &mut CognitiveMap, blocked: Blocked) -> Vec<EventKind> {
        let id = BlockageId(self.number);
        let blockage = Blockage {
            id,
            blocked,
            until_ns: None,
        };
        self.says(map, Instruction::Block(blockage))
    }

    fn sends(&mut self, map: &mut CognitiveMap, robot: &Robot, goal: Goal) -> Vec<EventKind> {
        let errand = Errand {
            goal,
            cost: RouteCost::Length,
            reverse: Reverse::Allowed,
            avoid_places: Vec::new(),
            avoid_regions: Vec::new(),
        };
        self.says(map, Instruction::Follow(robot.id, errand))
    }
}

/// Goes straight to a position, 0.1 m at a time; answers what it brought about.
fn drive(map: &mut CognitiveMap, robot: &mut Robot, to: [f64; 2]) -> Vec<EventKind> {
    let mut events = Vec::new();
    loop {
        let left = Point3::new(to[0], to[1], 0.0) - robot.position(map);
        if left.norm() < 1e-9 {
            return events;
        }
        let step = left * (0.1 / left.norm()).min(1.0);
        // Robots here never turn, so the axes of the body are those of the map.
        events.extend(robot.go(map, step.into(), [0.0; 3]));
    }
}

/// Once round a block of 4 m by 2 m.
fn round_the_block() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(settings(|values| values.trip_stillness_s = 3600.0));
    let mut robot = Robot::enrol(&mut map);
    robot.go(&mut map, [0.0; 3], [0.0; 3]);
    for corner in [[4.0, 0.0], [4.0, 2.0], [0.0, 2.0], [0.0, 0.0]] {
        drive(&mut map, &mut robot, corner);
    }
    (map, robot)
}

fn place_at(map: &CognitiveMap, x: f64, y: f64) -> PlaceId {
    map.nearest_place(&Point3::new(x, y, 0.0)).unwrap().0
}

fn route(map: &CognitiveMap, from: PlaceId, to: PlaceId) -> Result<Route, NoRoute> {
    let [from, to] = [from, to].map(|end| map.route_end_at(end).unwrap());
    let options = RouteOptions::default();
    let found = map.routes(&from, &to, &options, None, &mut || false);
    found.map(|mut routes| routes.remove(0))
}

/// What is told of routes.
fn told(events: Vec<EventKind>) -> Vec<EventKind> {
    let of_routes = |kind: &EventKind| {
        matches!(
            kind,
            EventKind::RouteProgress { .. }
                | EventKind::RouteLeft(_)
                | EventKind::RouteDone
                | EventKind::RouteFailed { .. }
        )
    };
    events.into_iter().filter(of_routes).collect()
}

#[test]
fn no_route_leads_across_a_blockage_until_it_ends() {
    for way_of_ending in ["taken back", "time", "travelled"] {
        let (mut map, mut robot) = round_the_block();
        let mut operator = Operator::default();
        let (from, to) = (place_at(&map, 1.0, 0.0), place_at(&map, 3.0, 0.0));
        let direct_m = route(&map, from, to).unwrap().length_m;
        assert!(direct_m < 2.5, "{direct_m}");
        let ball = Ball {
            at: Point3::new(2.0, 0.0, 0.0),
            radius_m: 0.2,
        };
        let blockage = Blockage {
            id: BlockageId(7),
            blocked: Blocked::Ball(ball),
            until_ns: Some(robot.stamp_ns + 1_000_000_000),
        };
        operator.says(&mut map, Instruction::Block(blockage));
        assert_eq!(map.blockages(), [blockage]);
        let round_m = route(&map, from, to).unwrap().length_m;
        assert!(round_m > 6.0, "{round_m}");
        match way_of_ending {
            "taken back" => {
                operator.says(&mut map, Instruction::Unblock(BlockageId(7)));
            }
            "time" => {
                robot.go(&mut map, [0.0; 3], [0.0; 3]);
                assert_eq!(map.blockages().len(), 1, "its time has not come");
                robot.stamp_ns += 1_000_000_000;
                robot.go(&mut map, [0.0; 3], [0.0; 3]);
            }
            _ => {
                robot.stamp_ns -= 10_000_000_000;
                drive(&mut map, &mut robot, [1.5, 0.0]);
                assert_eq!(map.blockages().len(), 1, "nobody has got through");
                drive(&mut map, &mut robot, [3.0, 0.0]);
            }
        }
        assert_eq!(map.blockages(), [], "{way_of_ending}");
        assert!((route(&map, from, to).unwrap().length_m - direct_m).abs() < 0.2);
    }
}

#[test]
fn where_no_way_is_left_the_blockages_are_named() {
    let (mut map, _) = round_the_block();
    let mut operator = Operator::default();
    let (from, to) = (place_at(&map, 1.0, 0.0), place_at(&map, 3.0, 0.0));
    let (near, far) = (place_at(&map, 2.0, 0.0), place_at(&map, 2.0, 2.0));
    operator.blocks(&mut map, Blocked::Place(near));
    let way = map.ways_at(far).next().unwrap().ends();
    operator.blocks(&mut map, Blocked::Way(way));
    let Err(NoRoute::NoWay { blockages, .. }) = route(&map, from, to) else {
        panic!("both ways are blocked");
    };
    assert_eq!(blockages, [BlockageId(0)], "that on the shorter way");
    let there = route(&map, from, near);
    assert!(
        matches!(there, Err(NoRoute::NoWay { .. })),
        "to the blocked place itself"
    );
    assert!(route(&map, near, from).is_ok(), "one may leave it");
}

#[test]
fn an_agent_is_told_how_far_it_has_come() {
    let (mut map, mut robot) = round_the_block();
    let mut operator = Operator::default();
    let goal = place_at(&map, 3.0, 0.0);
    assert_eq!(operator.sends(&mut map, &robot, Goal::Place(goal)), []);
    let steps = map.followed(robot.id).unwrap().rest().len();
    assert!(steps > 3, "{steps}");
    let events = told(drive(&mut map, &mut robot, [3.0, 0.0]));
    let (last, before) = events.split_last().unwrap();
    assert_eq!(*last, EventKind::RouteDone);
    let mut left = steps;
    for event in before {
        let EventKind::RouteProgress {
            steps_left, rest_m, ..
        } = event
        else {
            panic!("{event:?}");
        };
        assert!(*steps_left < left && *rest_m < 3.2, "{event:?}");
        left = *steps_left;
    }
    assert_eq!(left, 0);
    assert!(map.followed(robot.id).is_none());
    assert_eq!(told(drive(&mut map, &mut robot, [4.0, 0.0])), []);
}

#[test]
fn one_who_leaves_the_route_gets_another_and_one_without_a_way_is_told() {
    let (mut map, mut robot) = round_the_block();
    let mut operator = Operator::default();
    let goal = place_at(&map, 3.0, 0.0);
    operator.sends(&mut map, &robot, Goal::Place(goal));
    let first = map.followed(robot.id).unwrap().rest().to_vec();
    // It goes up instead of ahead.
    let events = told(drive(&mut map, &mut robot, [0.0, 2.0]));
    let left = events.iter().find_map(|event| match event {
        EventKind::RouteLeft(left) => Some(left),
        _ => None,
    });
    let left = left.expect("it has left the route");
    assert!(left.off_m.unwrap() > 0.2 && left.blockage.is_none());
    assert_ne!(left.route.steps, first);
    assert_eq!(left.route.steps.last().unwrap().place, Some(goal));
    let events = operator.blocks(&mut map, Blocked::Place(goal));
    let [
        EventKind::RouteFailed {
            failure: RouteFailure::NoWay(blockages),
        },
    ] = &events[..]
    else {
        panic!("{events:?}");
    };
    assert_eq!(blockages, &[BlockageId(1)]);
    assert!(map.followed(robot.id).is_none());
}

#[test]
fn a_blockage_on_a_route_leads_another_way() {
    let (mut map, mut robot) = round_the_block();
    let mut operator = Operator::default();
    let goal = place_at(&map, 3.0, 0.0);
    operator.sends(&mut map, &robot, Goal::Place(goal));
    drive(&mut map, &mut robot, [1.0, 0.0]);
    let beside = place_at(&map, 2.0, 2.0);
    assert_eq!(
        operator.blocks(&mut map, Blocked::Place(beside)),
        [],
        "not on it"
    );
    operator.says(&mut map, Instruction::Unblock(BlockageId(1)));
    let ahead = place_at(&map, 2.0, 0.0);
    let events = operator.blocks(&mut map, Blocked::Place(ahead));
    let [EventKind::RouteLeft(left)] = &events[..] else {
        panic!("{events:?}");
    };
    assert_eq!((left.off_m, left.blockage), (None, Some(BlockageId(3))));
    assert!(left.route.length_m > 6.0 && left.route.steps.iter().all(|s| s.place != Some(ahead)));
    for corner in [[0.0, 0.0], [0.0, 2.0], [4.0, 2.0], [4.0, 0.0]] {
        assert!(!told(drive(&mut map, &mut robot, corner)).contains(&EventKind::RouteDone));
    }
    let events = told(drive(&mut map, &mut robot, [3.0, 0.0]));
    assert_eq!(events.last(), Some(&EventKind::RouteDone));
}

#[test]
fn another_session_ends_the_route_and_so_does_whoever_gave_it() {
    let (mut map, mut robot) = round_the_block();
    let mut operator = Operator::default();
    let goal = place_at(&map, 3.0, 0.0);
    operator.sends(&mut map, &robot, Goal::Place(goal));
    operator.says(&mut map, Instruction::StopFollowing(robot.id));
    assert_eq!(told(drive(&mut map, &mut robot, [0.5, 0.0])), []);
    operator.sends(&mut map, &robot, Goal::Place(goal));
    (robot.session, robot.seq) = (2, 0);
    let events = told(robot.go(&mut map, [0.0; 3], [0.0; 3]));
    let ended = EventKind::RouteFailed {
        failure: RouteFailure::SessionEnded,
    };
    assert_eq!(events, [ended]);
    let unknown = Goal::Place(PlaceId(9999));
    let events = operator.sends(&mut map, &robot, unknown);
    assert!(
        matches!(events[..], [EventKind::RouteFailed { .. }]),
        "{events:?}"
    );
}

#[test]
fn a_trip_is_retraced_from_the_nearest_point_on_it() {
    let (map, robot) = round_the_block();
    let trip = TripId(0);
    let from = map.route_end_near(&Point3::new(4.0, 1.0, 0.0)).unwrap();
    let options = RouteOptions::default();
    let lengths = [false, true].map(|backward| {
        let retrace = Retrace { trip, backward };
        let route = map.retraced(&from, &retrace, &options, None, &mut || false);
        let route = route.unwrap();
        let trip = map.trip(trip).unwrap();
        let end = if backward {
            trip.leg(0).unwrap().from()
        } else {
            trip.legs().last().unwrap().to()
        };
        assert_eq!(route.steps.last().unwrap().place, Some(end));
        route.length_m
    });
    // The shortest way to where it began is back, and to where it ended likewise.
    assert!(
        (lengths[0] - 7.0).abs() < 0.8 && (lengths[1] - 5.0).abs() < 0.8,
        "{lengths:?}"
    );
    // At 1 m/s it was where it is now 12 s ago, and at the corner before for 2 s.
    for back in [Back::Seconds(2.0), Back::Metres(2.0)] {
        let end = map.route_end_back(robot.id, back).unwrap();
        let at = map.place(end.place()).unwrap().position();
        assert!(
            (at - Point3::new(0.0, 2.0, 0.0)).norm() < 0.5,
            "{back:?}: {at}"
        );
    }
    let long_ago = map.route_end_back(robot.id, Back::Metres(1e9)).unwrap();
    assert_eq!(Some(long_ago), map.route_end_home(robot.id).ok());
}

#[test]
fn pinned_trips_stay_and_have_at_most_half_the_budget() {
    let [free, pinned] = [false, true].map(|is_pinned| {
        let mut map = CognitiveMap::new(settings(|values| {
            values.trip_stillness_s = 3600.0;
            values.legs_max = 40;
        }));
        let mut robot = Robot::enrol(&mut map);
        let mut operator = Operator::default();
        robot.go(&mut map, [0.0; 3], [0.0; 3]);
        for round in 0..20 {
            drive(&mut map, &mut robot, [1.0, 0.0]);
            drive(&mut map, &mut robot, [0.0, 0.0]);
            robot.sample(&mut map, crate::journal::marker("end", true));
            if round == 1 && is_pinned {
                assert!(map.can_pin(TripId(1)));
                operator.says(&mut map, Instruction::Pin(TripId(1)));
            }
        }
        assert!(map.leg_count() <= 40 && map.trips_recorded() == 20);
        for (trip, _) in map.clone().trips() {
            let room = map.can_pin(trip);
            operator.says(&mut map, Instruction::Pin(trip));
            assert_eq!(map.is_pinned(trip), room, "{trip:?}");
        }
        let legs = map.trips().filter(|(trip, _)| map.is_pinned(*trip));
        let legs: usize = legs.map(|(_, trip)| trip.leg_count()).sum();
        assert!((10..=20).contains(&legs), "{legs}");
        assert!(map.trips().any(|(trip, _)| !map.is_pinned(trip)));
        map
    });
    assert!(free.is_forgotten_trip(TripId(1)));
    assert!(pinned.trip(TripId(1)).is_some());
}

#[test]
fn thinned_ways_leave_out_what_is_blocked() {
    let mut map = CognitiveMap::new(settings(|_| ()));
    let mut robot = Robot::enrol(&mut map);
    robot.ahead(&mut map, 1.0, 10);
    let mut operator = Operator::default();
    let counts = |map: &CognitiveMap| -> Vec<usize> {
        let thinned = map.thinned_ways(0.1);
        thinned.iter().map(|edge| edge.places.len()).collect()
    };
    let places = counts(&map)[0];
    assert_eq!(counts(&map), [places]);
    operator.blocks(&mut map, Blocked::Way([PlaceId(3), PlaceId(4)]));
    assert_eq!(counts(&map), [4, places - 4]);
    operator.says(&mut map, Instruction::Unblock(BlockageId(0)));
    assert_eq!(counts(&map), [places]);
}
