//! Robots that drive round a circle against their route.

use cognitive_map::{
    CognitiveMap, Errand, EventKind, Goal, Instruction, PlaceId, Record, Reverse, RouteCost,
};

use crate::journal::{Robot, run, settings};

/// A robot that has gone once round a circle of 5 m, in steps of 0.25 m, and has turned round.
fn round_a_circle() -> (CognitiveMap, Robot, f64) {
    let mut map = CognitiveMap::new(settings(|values| values.trip_stillness_s = 3600.0));
    let mut robot = Robot::enrol(&mut map);
    let turn_rad = std::f64::consts::TAU / 20.0;
    robot.go(&mut map, [0.0; 3], [0.0; 3]);
    for _ in 0..21 {
        robot.go(&mut map, [0.25, 0.0, 0.0], [0.0, 0.0, turn_rad]);
    }
    robot.go(&mut map, [0.0; 3], [0.0, 0.0, std::f64::consts::PI]);
    (map, robot, turn_rad)
}

fn send(map: &mut CognitiveMap, robot: &Robot, place: PlaceId, reverse: Reverse) {
    let errand = Errand {
        goal: Goal::Place(place),
        cost: RouteCost::Length,
        reverse,
        avoid_places: Vec::new(),
        avoid_regions: Vec::new(),
    };
    let instruction = Instruction::Follow(robot.id, errand);
    let record = Record::Instruct {
        number: map.instructions(),
        instruction,
    };
    run(map, &[record]);
}

fn distance_m(map: &CognitiveMap, robot: &Robot, place: PlaceId) -> f64 {
    (map.place(place).unwrap().position() - robot.position(map)).norm()
}

/// It goes on the wrong way. As it gets new routes, it follows one until it is told that it has
/// arrived, and that is where the goal is.
#[test]
fn one_who_goes_the_wrong_way_round_is_led_on_until_it_is_there() {
    for reverse in [Reverse::Allowed, Reverse::Never] {
        let (map, robot, turn_rad) = round_a_circle();
        let mut led_anew = 0;
        for goal in map.places().map(|(id, _)| id) {
            let mut map = map.clone();
            let (session, seq, stamp_ns) = (robot.session, robot.seq, robot.stamp_ns);
            let id = robot.id;
            let mut robot = Robot {
                id,
                session,
                seq,
                stamp_ns,
            };
            if distance_m(&map, &robot, goal) < 0.5 {
                continue;
            }
            send(&mut map, &robot, goal, reverse);
            for _ in 0..20 {
                assert!(map.followed(robot.id).is_some(), "{reverse:?} {goal:?}");
                let told = robot.go(&mut map, [0.25, 0.0, 0.0], [0.0, 0.0, -turn_rad]);
                if told
                    .iter()
                    .any(|kind| matches!(kind, EventKind::RouteFailed { .. }))
                {
                    // A new place beside the circle, from which nobody has come yet.
                    assert_eq!(reverse, Reverse::Never, "{told:?}");
                    break;
                }
                let left = |kind: &&EventKind| matches!(kind, EventKind::RouteLeft(_));
                led_anew += told.iter().filter(left).count();
                let off_m = distance_m(&map, &robot, goal);
                if told.contains(&EventKind::RouteDone) {
                    assert!(off_m <= 0.126, "{reverse:?} {goal:?}: {off_m} m");
                    break;
                }
            }
        }
        assert!(led_anew > 10, "{led_anew}");
    }
}
