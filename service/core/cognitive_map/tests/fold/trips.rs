//! Legs, and every way a trip ends.

use cognitive_map::{
    CognitiveMap, EventKind, InvalidSample, Leg, PlaceId, Settings, SkipReason, TripEnd, TripId,
};
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

use crate::journal::{Robot, marker, start_pose};

fn new_map() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(Settings::default());
    let robot = Robot::enrol(&mut map);
    (map, robot)
}

/// The ends of trips among events.
fn ends(events: &[EventKind]) -> Vec<TripEnd> {
    let reason = |event: &EventKind| match event {
        EventKind::TripEnded { reason, .. } => Some(*reason),
        _ => None,
    };
    events.iter().filter_map(reason).collect()
}

/// Goes far enough for a trip of some legs.
fn travel(map: &mut CognitiveMap, robot: &mut Robot) {
    robot.ahead(map, 0.05, 40);
    assert!(map.agent(robot.id).unwrap().trip().is_some());
}

#[test]
fn a_straight_trip_has_the_legs_that_it_should() {
    let (mut map, mut robot) = new_map();
    let events = robot.ahead(&mut map, 0.1, 30);
    // The first place is founded after the first step at 0.1 m, the next ones every 0.3 m: the
    // first multiple of the step beyond the field radius.
    assert_eq!(map.place_count(), 10);
    let started: Vec<_> = events
        .iter()
        .filter(|event| matches!(event, EventKind::TripStarted { .. }))
        .collect();
    assert_eq!(started, [&EventKind::TripStarted { trip: TripId(0) }]);
    let trip = map.trip(TripId(0)).unwrap();
    assert_eq!(
        (trip.agent(), trip.session(), trip.ended()),
        (robot.id, 1, None)
    );
    assert_eq!(trip.leg_count(), 9);
    assert_eq!(
        (trip.start_stamp_ns(), trip.end_stamp_ns()),
        (100_000_000, 2_800_000_000)
    );
    for (index, leg) in (0u32..).zip(trip.legs()) {
        assert_eq!((leg.from(), leg.to()), (PlaceId(index), PlaceId(index + 1)));
        let ahead = Isometry3::translation(0.3, 0.0, 0.0);
        assert!((leg.relative().to_homogeneous() - ahead.to_homogeneous()).norm() < 1e-9);
        assert!((leg.displacement() - Vector3::new(0.3, 0.0, 0.0)).norm() < 1e-9);
        assert!((leg.duration_s() - 0.3).abs() < 1e-9 && (leg.length_m() - 0.3).abs() < 1e-9);
        assert_eq!(leg.octant(), 1);
        let variance = leg.covariance().matrix()[(0, 0)];
        let expected = map.settings().translation_sd_per_sqrt_m.powi(2) * 0.3;
        assert!(
            (variance - expected).abs() < 1e-12,
            "its own motion alone: {variance}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn legs_compose_to_the_way_of_the_trip(
        start in (prop::array::uniform3(-9.0..9.0f64), prop::array::uniform3(-3.0..3.0f64)),
        turns in prop::collection::vec(prop::array::uniform3(-0.4..0.4f64), 10..200),
    ) {
        let (mut map, mut robot) = new_map();
        robot.sample(&mut map, start_pose(start.0, start.1));
        let mut poses = Vec::new();
        for turn in turns {
            robot.go(&mut map, [0.1, 0.0, 0.02], turn);
            poses.push((robot.stamp_ns, robot.pose(&map)));
        }
        let at = |stamp_ns| poses.iter().find(|(stamp, _)| *stamp == stamp_ns).unwrap().1;
        for (_, trip) in map.trips() {
            let (start, end) = (at(trip.start_stamp_ns()), at(trip.end_stamp_ns()));
            let way = trip.legs().fold(start, |pose, leg| pose * leg.relative());
            prop_assert!((way.to_homogeneous() - end.to_homogeneous()).norm() < 1e-9);
            let displacement: Vector3<f64> = trip.legs().map(Leg::displacement).sum();
            let expected = end.translation.vector - start.translation.vector;
            prop_assert!((displacement - expected).norm() < 1e-9);
            for (module, lattice) in map.modules().lattices().iter().enumerate() {
                let phases: Vector3<f64> =
                    trip.legs().map(|leg| leg.phase_displacement(map.modules())[module]).sum();
                prop_assert!((phases - lattice.inverse() * expected).norm() < 1e-9);
            }
            let length_m: f64 = trip.legs().map(Leg::length_m).sum();
            prop_assert!((trip.length_m() - length_m).abs() < 1e-9);
            prop_assert!(length_m + 1e-9 >= expected.norm());
            let duration_s: f64 = trip.legs().map(Leg::duration_s).sum();
            let stamps = (trip.end_stamp_ns() - trip.start_stamp_ns()) as f64 * 1e-9;
            prop_assert!((duration_s - stamps).abs() < 1e-9);
            let legs: Vec<_> = trip.legs().collect();
            prop_assert!(legs.windows(2).all(|pair| pair[0].to() == pair[1].from()));
            prop_assert!(legs.iter().all(|leg| leg.from() != leg.to()));
        }
    }
}

#[test]
fn a_trip_without_a_second_place_leaves_no_record() {
    let (mut map, mut robot) = new_map();
    robot.ahead(&mut map, 0.05, 3);
    let events = robot.sample(&mut map, marker("end", true));
    assert_eq!(
        events,
        [EventKind::MarkerPassed {
            label: crate::journal::label("end")
        }]
    );
    assert_eq!(map.trip_count(), 0);
}

#[test]
fn standing_still_ends_a_trip_and_the_next_starts_there() {
    let (mut map, mut robot) = new_map();
    travel(&mut map, &mut robot);
    // Five seconds are 50 samples; turning and trembling on the spot is standing still.
    let mut events = Vec::new();
    for sample in 0..50 {
        assert_eq!(ends(&events), [], "after {sample}");
        let tremble = if sample % 2 == 0 { 0.01 } else { -0.01 };
        events.extend(robot.go(&mut map, [tremble, 0.0, 0.0], [0.0, 0.0, 0.0]));
    }
    events.extend(robot.go(&mut map, [0.0; 3], [0.0; 3]));
    assert_eq!(ends(&events), [TripEnd::Stillness]);
    assert_eq!(
        map.trip(TripId(0)).unwrap().ended(),
        Some(TripEnd::Stillness)
    );
    assert_eq!(map.agent(robot.id).unwrap().trip(), None);

    let here = map.agent(robot.id).unwrap().place().unwrap().0;
    travel(&mut map, &mut robot);
    let next = map.trip(TripId(1)).unwrap();
    assert_eq!(next.leg(0).unwrap().from(), here);
    assert!(
        next.leg(0).unwrap().duration_s() < 1.0,
        "the rest is no part of it"
    );
}

#[test]
fn percepts_alone_do_not_keep_a_trip_going() {
    let (mut map, mut robot) = new_map();
    travel(&mut map, &mut robot);
    let seen: Vec<_> = (0..51)
        .flat_map(|_| robot.sample(&mut map, marker("tick", false)))
        .collect();
    assert_eq!(ends(&seen), [TripEnd::Stillness]);
}

#[test]
fn every_reason_ends_a_trip() {
    type Cause = fn(&mut CognitiveMap, &mut Robot) -> Vec<EventKind>;
    let causes: [(TripEnd, Cause); 5] = [
        (TripEnd::Gap, |map, robot| {
            robot.stamp_ns += 2_000_000_000;
            robot.ahead(map, 0.05, 1)
        }),
        (TripEnd::Gap, |map, robot| {
            robot.skip(map, 1, SkipReason::Lost)
        }),
        (TripEnd::SessionEnd, |map, robot| {
            (robot.session, robot.seq, robot.stamp_ns) = (2, 0, 0);
            robot.ahead(map, 0.05, 1)
        }),
        (TripEnd::Marker, |map, robot| {
            robot.sample(map, marker("dock", true))
        }),
        (TripEnd::StartPose, |map, robot| {
            robot.sample(map, start_pose([9.0; 3], [0.0; 3]))
        }),
    ];
    for (reason, cause) in causes {
        let (mut map, mut robot) = new_map();
        travel(&mut map, &mut robot);
        assert_eq!(ends(&cause(&mut map, &mut robot)), [reason]);
        let trip = map.trip(TripId(0)).unwrap();
        assert_eq!(trip.ended(), Some(reason));
        let legs = trip.leg_count();
        travel(&mut map, &mut robot);
        assert_eq!(
            map.trip_count(),
            2,
            "{reason:?}: the next trip is another one"
        );
        assert_eq!(map.trip(TripId(0)).unwrap().leg_count(), legs);
        assert!(
            map.trip(TripId(1))
                .unwrap()
                .legs()
                .all(|leg| leg.displacement().norm() < 1.0)
        );
    }
}

#[test]
fn what_does_not_end_a_trip() {
    let (mut map, mut robot) = new_map();
    travel(&mut map, &mut robot);
    robot.stamp_ns += 1_800_000_000;
    let mut events = robot.ahead(&mut map, 0.05, 1);
    events.extend(robot.skip(
        &mut map,
        3,
        SkipReason::Invalid(InvalidSample::NumberOutOfRange),
    ));
    events.extend(robot.skip(&mut map, 3, SkipReason::TimeBackwards));
    events.extend(robot.sample(&mut map, marker("door", false)));
    robot.stamp_ns -= 1_000_000_000;
    events.extend(robot.ahead(&mut map, 0.05, 40));
    assert_eq!(ends(&events), []);
    assert_eq!(map.trip_count(), 1);
}

#[test]
fn missing_samples_are_told_and_break_the_trip() {
    let (mut map, mut robot) = new_map();
    travel(&mut map, &mut robot);
    let from = robot.seq;
    robot.seq += 5;
    let events = robot.ahead(&mut map, 0.05, 1);
    let skipped = EventKind::SamplesSkipped {
        from,
        to: from + 5,
        reason: SkipReason::Lost,
    };
    assert_eq!(ends(&events), [TripEnd::Gap]);
    assert!(events.contains(&skipped));
    assert_eq!(map.agent(robot.id).unwrap().next_seq(), robot.seq);
}

#[test]
fn a_full_trip_is_continued_by_the_next() {
    let (mut map, mut robot) = new_map();
    let mut ended = Vec::new();
    for _ in 0..1_100 {
        ended.extend(ends(&robot.ahead(&mut map, 0.3, 1)));
    }
    assert_eq!(ended, [TripEnd::Full]);
    let (first, second) = (map.trip(TripId(0)).unwrap(), map.trip(TripId(1)).unwrap());
    assert_eq!((first.leg_count(), second.leg_count()), (1_024, 75));
    assert_eq!(
        first.leg(1_023).unwrap().to(),
        second.leg(0).unwrap().from()
    );
    assert_eq!(first.end_stamp_ns(), second.start_stamp_ns());
}
