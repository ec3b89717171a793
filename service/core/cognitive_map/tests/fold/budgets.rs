//! Budgets: how many places and legs there may be, and which go when there would be more.

use std::collections::{BTreeMap, BTreeSet};

use cognitive_map::{CognitiveMap, EventKind, PlaceId, SettingsValues, TripId};
use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;

use crate::journal::{Robot, descriptor, level, settings, start_pose};

/// A map with a small budget of places, and a robot at its origin.
fn small(change: impl FnOnce(&mut SettingsValues)) -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(settings(|values| {
        values.places_max = 50;
        change(values);
    }));
    let robot = Robot::enrol(&mut map);
    (map, robot)
}

fn forgotten(events: &[EventKind]) -> Vec<PlaceId> {
    let place = |event: &EventKind| match event {
        EventKind::PlaceForgotten { place, .. } => Some(*place),
        _ => None,
    };
    events.iter().filter_map(place).collect()
}

fn forgotten_trips(events: &[EventKind]) -> Vec<TripId> {
    let trip = |event: &EventKind| match event {
        EventKind::TripForgotten { trip, .. } => Some(*trip),
        _ => None,
    };
    events.iter().filter_map(trip).collect()
}

/// Uses of places, as the events tell them, and the strengths that follow.
#[derive(Default)]
struct Uses(BTreeMap<PlaceId, Vec<u64>>);

impl Uses {
    fn strength(&self, place: PlaceId, now: u64, half_life: f64) -> f64 {
        let uses = self.0[&place].iter();
        uses.map(|at| (-((now - at) as f64) / half_life).exp2())
            .sum()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Two robots wander about a corner of the world that has room for more places than the budget.
    /// The strengths are summed up beside the map, from what it tells of uses.
    #[test]
    fn the_weakest_goes_and_never_comes_back(
        steps in prop::collection::vec((any::<bool>(), -1.5..1.5f64), 1..400),
        places_max in 5u32..30,
        half_life in prop::sample::select(vec![5u32, 100, 100_000]),
    ) {
        let (mut map, first) = small(|values| {
            values.places_max = places_max;
            values.strength_half_life_samples = half_life;
        });
        let mut robots = [first, Robot::enrol(&mut map)];
        robots[1].sample(&mut map, start_pose([1.0, 0.0, 0.0], [0.0; 3]));
        let mut uses = Uses::default();
        let mut ever = BTreeSet::new();
        for (which, yaw) in steps {
            let position = robots[usize::from(which)].position(&map);
            // Back to the middle from far out.
            let yaw = if position.coords.norm() > 2.0 { 2.5 } else { yaw };
            let before: BTreeSet<_> = map.places().map(|(id, _)| id).collect();
            let events = robots[usize::from(which)].go(&mut map, [0.15, 0.0, 0.0], [0.0, 0.0, yaw]);
            let now = map.revision();
            let recruiting = events.iter().any(|e| matches!(e, EventKind::PlaceRecruited { .. }));
            let gone = forgotten(&events);
            prop_assert!(gone.len() <= usize::from(recruiting), "one for one");
            for place in &gone {
                prop_assert_eq!(before.len(), places_max as usize, "only under pressure");
                let strength = uses.strength(*place, now, half_life.into());
                let weaker = before.iter().filter(|other| {
                    uses.strength(**other, now, half_life.into()) < strength * (1.0 - 1e-9)
                });
                // Where either robot is, and where its leg began.
                prop_assert!(weaker.count() <= 4);
            }
            for event in &events {
                match event {
                    EventKind::PlaceRecruited { place, .. } => {
                        prop_assert!(ever.insert(*place), "a number twice");
                        uses.0.insert(*place, vec![now]);
                    }
                    EventKind::PlaceEntered { place, .. } => {
                        uses.0.get_mut(place).unwrap().push(now);
                    }
                    EventKind::PlaceForgotten { place, .. } => {
                        uses.0.remove(place);
                    }
                    _ => {}
                }
            }
            prop_assert!(map.place_count() <= places_max as usize);
            let live: BTreeSet<_> = map.places().map(|(id, _)| id).collect();
            prop_assert_eq!(&live, &uses.0.keys().copied().collect());
            for robot in &robots {
                if let Some((place, _)) = map.agent(robot.id).unwrap().place() {
                    prop_assert!(live.contains(&place), "an agent's place is there");
                }
            }
        }
        for (place, _) in map.places() {
            let expected = uses.strength(place, map.revision(), half_life.into());
            prop_assert!((map.place_strength(place) / expected - 1.0).abs() < 1e-9);
        }
        for place in ever {
            prop_assert_eq!(map.is_forgotten_place(place), map.place(place).is_none());
        }
    }
}

#[test]
fn what_is_visited_often_outlives_a_long_walk_elsewhere() {
    let (mut map, mut robot) = small(|_| {});
    // Ten rounds of a circle of 4 m, then 100 m straight ahead: many times the budget.
    let turn = [0.0, 0.0, std::f64::consts::TAU / 40.0];
    for _ in 0..400 {
        robot.go(&mut map, [0.1, 0.0, 0.0], turn);
    }
    let circle: Vec<_> = map.places().map(|(id, _)| id).collect();
    assert!((8..=16).contains(&circle.len()), "{circle:?}");
    let events = robot.ahead(&mut map, 0.1, 1000);
    assert!(forgotten(&events).len() > 200);
    assert_eq!(map.place_count(), 50);
    // The turn from the circle to the straight may have touched one place once.
    let left = circle.iter().filter(|id| map.place(**id).is_some()).count();
    assert!(left + 1 >= circle.len(), "{left} of {}", circle.len());
    assert!(
        map.place_strength(PlaceId(100)) < f64::MIN_POSITIVE,
        "forgotten"
    );
    assert!(map.is_forgotten_place(PlaceId(100)));
    assert!(!map.is_forgotten_place(PlaceId(1_000_000)));
}

/// The way there is kept by the legs, whatever becomes of the places on it.
#[test]
fn the_way_stays_whole_when_its_places_go() {
    let (mut map, mut robot) = small(|values| values.places_max = 4);
    for step in 0..300 {
        let turn = [0.0, 0.0, if step % 3 == 0 { 0.05 } else { 0.0 }];
        robot.go(&mut map, [0.1, 0.0, 0.0], turn);
    }
    let trip = map.trip(TripId(0)).unwrap();
    let gone = trip.legs().filter(|leg| map.is_forgotten_place(leg.from()));
    assert!(gone.count() > 50);
    let way = trip
        .legs()
        .fold(Isometry3::identity(), |way, leg| way * leg.relative());
    let (last, start) = (trip.legs().last().unwrap(), Point3::new(0.1, 0.0, 0.0));
    let end = map.place(last.to()).unwrap().position();
    let from = Isometry3::from_parts(
        start.into(),
        nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, 0.05),
    );
    let reached: Point3<f64> = (from * way).translation.vector.into();
    assert!((reached - end).norm() < 1e-9, "{reached} {end}");
}

#[test]
fn a_snapshot_keeps_what_it_had() {
    let (mut map, mut robot) = small(|_| {});
    robot.ahead(&mut map, 0.1, 200);
    let snapshot = map.clone();
    let digest = snapshot.digest();
    let places: Vec<_> = snapshot.places().map(|(id, p)| (id, p.clone())).collect();
    let mut twin = map.clone();
    robot.ahead(&mut map, 0.1, 500);
    assert!(places.iter().all(|(id, _)| map.is_forgotten_place(*id)));
    for (id, place) in &places {
        assert_eq!(snapshot.place(*id), Some(place));
        let nearest = snapshot.nearest_place(place.position()).unwrap();
        assert_eq!(nearest.0, *id);
    }
    assert_eq!(snapshot.digest(), digest);
    // A snapshot that goes on forgets what the original forgot.
    let mut again = Robot {
        seq: 200,
        stamp_ns: 20_000_000_000,
        ..robot
    };
    again.ahead(&mut twin, 0.1, 500);
    assert_eq!(twin.digest(), map.digest());
}

/// A robot that always goes on, feels, looks and records takes no more memory after ten thousand
/// recruitments than after a thousand, and neither does what a store keeps of it.
#[test]
fn memory_and_checkpoints_stay_flat() {
    let (mut map, mut robot) = small(|values| {
        values.legs_max = 300;
        values.ways_max = 300;
        values.keyframes_max = 300;
    });
    let mut stored: BTreeMap<(u8, u32), usize> = BTreeMap::new();
    let mut saved = 0;
    let mut sizes = Vec::new();
    for _ in 0..10 {
        for step in 0..1000 {
            robot.go(&mut map, [0.3, 0.0, 0.0], [0.0; 3]);
            robot.sample(&mut map, level("touch", f64::from(step), [0.0; 3]));
            robot.sample(&mut map, descriptor("camera", &[1.0; 64]));
            if step % 100 == 99 {
                for page in map.checkpoint(saved) {
                    stored.insert((page.kind, page.index), page.bytes.len());
                }
                stored.retain(|_, bytes| *bytes > 0);
                saved = map.revision();
            }
        }
        assert_eq!(map.place_count(), 50);
        assert!(map.leg_count() <= 300);
        let remembering = map
            .places()
            .filter(|(id, _)| map.remembered(*id).count() == 2)
            .count();
        assert_eq!(remembering, 50);
        assert_eq!(
            map.remembered(PlaceId(0)).count(),
            0,
            "forgotten with its place"
        );
        sizes.push((map.memory_bytes(), stored.values().sum::<usize>()));
    }
    assert_eq!(map.places_recruited(), 10_000);
    // A trip grows until it fills the budget and goes, so it is the peaks that are flat.
    let peak = |sizes: &[(usize, usize)]| {
        let memory = sizes.iter().map(|size| size.0).max().unwrap();
        (memory, sizes.iter().map(|size| size.1).max().unwrap())
    };
    let (early, late) = (peak(&sizes[..4]), peak(&sizes[4..]));
    assert!(late.0 < early.0 + early.0 / 10, "{sizes:?}");
    assert!(late.1 < early.1 + early.1 / 10, "{sizes:?}");
}

#[test]
fn a_trip_that_is_travelled_again_outlives_others() {
    let (mut map, mut robot) = small(|values| {
        values.places_max = 2048;
        values.legs_max = 60;
    });
    // A first way of some fifteen legs; then again and again a way of its own, and the first one.
    let go = |map: &mut CognitiveMap, robot: &mut Robot, y: f64| {
        let mut events = robot.sample(map, start_pose([0.0, y, 0.0], [0.0; 3]));
        events.extend(robot.ahead(map, 0.1, 50));
        events
    };
    let mut events = go(&mut map, &mut robot, 0.0);
    for row in 1..20 {
        events.extend(go(&mut map, &mut robot, f64::from(row)));
        assert!(map.leg_count() <= 60);
        events.extend(go(&mut map, &mut robot, 0.0));
        assert!(map.leg_count() <= 60);
    }
    let gone = forgotten_trips(&events);
    assert!(gone.len() > 30);
    assert_eq!(gone.iter().collect::<BTreeSet<_>>().len(), gone.len());
    assert!(map.trip(TripId(0)).is_some(), "{gone:?}");
    assert!(map.trip_strength(TripId(0)) > 5.0);
    assert!(map.is_forgotten_trip(TripId(1)));
    assert!(map.trip_strength(TripId(1)) < f64::MIN_POSITIVE);
    let legs = map.trips().map(|(_, trip)| trip.leg_count()).sum::<usize>();
    assert_eq!(map.leg_count(), legs);
}

/// A trip under way that fills the budget ends, and only then may go.
#[test]
fn a_trip_under_way_is_never_forgotten() {
    let (mut map, mut robot) = small(|values| values.legs_max = 10);
    for _ in 0..200 {
        let under_way = map.agent(robot.id).unwrap().trip();
        let events = robot.go(&mut map, [0.3, 0.0, 0.0], [0.0; 3]);
        for trip in forgotten_trips(&events) {
            let ended = events.iter().any(
                |event| matches!(event, EventKind::TripEnded { trip: ended, .. } if *ended == trip),
            );
            assert!(ended || under_way != Some(trip));
        }
        if let Some(trip) = map.agent(robot.id).unwrap().trip() {
            assert!(map.trip(trip).is_some());
        }
        assert!(map.leg_count() <= 10);
    }
    assert!(map.trips_recorded() >= 18, "{}", map.trips_recorded());
}

/// As many robots at rest as there may be places: nobody loses the place where it stands to a robot
/// that finds another one free, and the next robot takes the weakest.
#[test]
fn a_held_place_goes_only_where_all_are_held() {
    let (mut map, first) = small(|values| values.places_max = 4);
    let mut robots = vec![first];
    robots.extend((1..5).map(|_| Robot::enrol(&mut map)));
    for (x, robot) in (0i32..).zip(&mut robots[..4]) {
        robot.sample(&mut map, start_pose([f64::from(x), 0.0, 0.0], [0.0; 3]));
        robot.go(&mut map, [0.0; 3], [0.0; 3]);
    }
    let place = |map: &CognitiveMap, robot: &Robot| map.agent(robot.id).unwrap().place();
    for robot in &robots[..4] {
        assert!(map.place(place(&map, robot).unwrap().0).is_some());
    }
    robots[4].sample(&mut map, start_pose([9.0, 0.0, 0.0], [0.0; 3]));
    let events = robots[4].go(&mut map, [0.0; 3], [0.0; 3]);
    assert_eq!(forgotten(&events), [PlaceId(0)]);
    // Whoever stood there finds out with its next sample, and takes the weakest in turn.
    let events = robots[0].go(&mut map, [0.0; 3], [0.0; 3]);
    assert_eq!(forgotten(&events), [PlaceId(1)]);
    assert!(map.place(place(&map, &robots[0]).unwrap().0).is_some());
    assert_eq!(map.place_count(), 4);
}

/// Robots that fall silent for good, each in a place and on a trip of its own, leave room for the
/// others.
#[test]
fn silent_robots_do_not_take_the_memory_with_them() {
    let (mut map, mut alive) = small(|values| {
        values.places_max = 16;
        values.legs_max = 40;
    });
    for gone in 0..20 {
        let mut robot = Robot::enrol(&mut map);
        let start = [f64::from(gone) * 10.0, 50.0, 0.0];
        robot.sample(&mut map, start_pose(start, [0.0; 3]));
        for _ in 0..12 {
            robot.go(&mut map, [0.3, 0.0, 0.0], [0.0; 3]);
        }
    }
    alive.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    let mut ended = 0;
    for step in 0..400 {
        let events = alive.go(&mut map, [0.3, 0.0, 0.0], [0.0; 3]);
        let is_end = |event: &&EventKind| matches!(event, EventKind::TripEnded { .. });
        ended += events.iter().filter(is_end).count();
        assert!(map.place_count() <= 16 && map.leg_count() <= 40);
        if step > 100 {
            let agent = map.agent(alive.id).unwrap();
            assert!(agent.place().is_some(), "step {step}");
            assert!(agent.trip().is_none_or(|trip| map.trip(trip).is_some()));
        }
    }
    // All legs are now of the one who still travels.
    assert!(map.trips().all(|(_, trip)| trip.agent() == alive.id));
    assert!(
        map.leg_count() > 30 && ended > 5,
        "{} legs, {ended} ended",
        map.leg_count()
    );
    // And what the map has become can be written down and read again.
    let pages: Vec<_> = map.checkpoint(0).collect();
    let again = CognitiveMap::restore(map.settings().clone(), pages).unwrap();
    assert_eq!(again.digest(), map.digest());
}
