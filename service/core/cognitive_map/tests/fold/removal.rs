//! Agents that are removed: what they did in the map stays, their names and what they never tied to
//! it go.

use cognitive_map::{
    AgentId, CognitiveMap, Event, EventKind, PoseNoise, Record, Relation, RelativePose, SampleBody,
    Settings, Sighting, Target, TripEnd,
};
use proptest::prelude::*;

use crate::any_journal::{any_settings, journals};
use crate::journal::{Robot, label, run, sighting};

fn remove(map: &mut CognitiveMap, agent: AgentId) -> Vec<EventKind> {
    let events = run(map, &[Record::Remove { agent }]);
    assert!(events.iter().all(|event: &Event| event.agent == agent));
    events.into_iter().map(|event| event.kind).collect()
}

fn enrol(map: &mut CognitiveMap, agent: AgentId, name: &str) -> Vec<Event> {
    let name = label(name);
    run(map, &[Record::Enrol { agent, name }])
}

/// The same map after a checkpoint: what it goes on from is whole.
fn restored(map: &CognitiveMap) -> CognitiveMap {
    let restored = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
    assert_eq!(restored.digest(), map.digest());
    restored
}

/// A founder that drove 6 m and a newcomer that knows nothing of where it is, both under way.
fn founder_and_stranger() -> (CognitiveMap, Robot, Robot) {
    let mut map = CognitiveMap::new(Settings::default());
    let mut founder = Robot::enrol(&mut map);
    founder.ahead(&mut map, 0.3, 20);
    founder.sample(&mut map, sighting("door", [1.0, 1.0, 0.0], 0.1));
    let mut stranger = Robot::enrol(&mut map);
    stranger.ahead(&mut map, 0.3, 5);
    stranger.sample(&mut map, sighting("lamp", [1.0, 0.0, 0.0], 0.1));
    (map, founder, stranger)
}

#[test]
fn the_past_of_a_removed_agent_stays_and_its_name_is_free() {
    let (mut map, mut founder, _) = founder_and_stranger();
    let (places, trips) = (map.place_count(), map.trip_count());
    assert!(places > 2 && trips == 1);
    let name = map.agent(founder.id).unwrap().name().clone();
    let events = remove(&mut map, founder.id);
    let [ended, removed] = &events[..] else {
        panic!("{events:?}");
    };
    let is_end = |kind: &EventKind| {
        matches!(
            kind,
            EventKind::TripEnded {
                reason: TripEnd::SessionEnd,
                ..
            }
        )
    };
    assert!(is_end(ended), "{events:?}");
    assert_eq!(*removed, EventKind::AgentRemoved { name: name.clone() });
    assert_eq!(map.agent_by_name(&name), None);
    assert_eq!((map.agent_count(), map.agent_numbers()), (1, 2));
    assert_eq!(
        (map.place_count(), map.trip_count(), map.landmark_count()),
        (places, trips, 1)
    );
    assert!(
        map.has_been_in_map(founder.id) && !map.is_vacant(founder.id),
        "its number stays its own: places and trips tell of it"
    );
    assert!(map.places().all(|(_, place)| place.founder() == founder.id));
    let refined = &map.refined().agents[founder.id.0 as usize];
    assert!(refined.is_in_map && !refined.poses.is_empty());
    // Whatever else comes of it has no effect.
    let before = map.digest();
    assert_eq!(founder.ahead(&mut map, 0.3, 3), []);
    assert_eq!(remove(&mut map, founder.id), []);
    assert_eq!(enrol(&mut map, founder.id, "robot-0"), []);
    assert_eq!(map.digest(), before);
    // The next one of that name is another agent, and its runs begin from nothing.
    let next = AgentId(2);
    assert_eq!(enrol(&mut map, next, "robot-0").len(), 1);
    assert_eq!(map.agent_by_name(&name), Some(next));
    let mut again = Robot {
        id: next,
        session: 0,
        seq: 0,
        stamp_ns: 0,
    };
    again.ahead(&mut map, 0.3, 1);
    let agent = map.agent(next).unwrap();
    assert_eq!((agent.session(), agent.next_seq()), (0, 1));
    restored(&map);
}

#[test]
fn nothing_stays_of_an_agent_that_was_never_in_the_map() {
    let (mut map, mut founder, stranger) = founder_and_stranger();
    assert!(!map.has_been_in_map(stranger.id));
    // What the founder saw of it goes, too.
    let relation = RelativePose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], PoseNoise::none());
    let seen = SampleBody::Sighting(Sighting {
        target: Target::Agent(label("robot-1")),
        relation: Relation::Pose(relation.unwrap()),
    });
    founder.sample(&mut map, seen);
    let alone = map.refined().agents[founder.id.0 as usize].clone();
    remove(&mut map, stranger.id);
    assert!(map.is_vacant(stranger.id));
    assert_eq!(map.refined().agents[founder.id.0 as usize], alone);
    let mut map = restored(&map);
    // The number goes to the next one, which is as new as one of a new number.
    let events = enrol(&mut map, stranger.id, "nora");
    assert_eq!(events.len(), 1);
    assert!(!map.is_vacant(stranger.id));
    let nora = map.agent(stranger.id).unwrap();
    assert_eq!(
        (nora.session(), nora.stamp_ns(), nora.travelled_m()),
        (0, None, 0.0)
    );
    let mut fresh = map.clone();
    assert_eq!(enrol(&mut fresh, AgentId(2), "fresh").len(), 1);
    let mut poses = Vec::new();
    for id in [stranger.id, AgentId(2)] {
        let mut robot = Robot {
            id,
            session: 1,
            seq: 0,
            stamp_ns: 0,
        };
        robot.ahead(&mut fresh, 0.2, 30);
        robot.sample(&mut fresh, sighting("door", [2.0, 0.5, 0.0], 0.1));
        robot.ahead(&mut fresh, 0.2, 5);
        poses.push((robot.pose(&fresh), fresh.status(id), fresh.covariance(id)));
    }
    assert_eq!(poses[0], poses[1]);
    restored(&fresh);
}

#[test]
fn numbers_and_memory_do_not_grow_with_names_that_come_and_go() {
    let (mut map, _, stranger) = founder_and_stranger();
    let bytes = map.memory_bytes();
    for round in 0..200 {
        remove(&mut map, stranger.id);
        enrol(&mut map, stranger.id, &format!("forged-{round}"));
        let mut robot = Robot {
            id: stranger.id,
            session: 1,
            seq: 0,
            stamp_ns: 0,
        };
        robot.ahead(&mut map, 0.3, 5);
        robot.sample(&mut map, sighting("lamp", [1.0, 0.0, 0.0], 0.1));
    }
    assert_eq!((map.agent_numbers(), map.agent_count()), (2, 2));
    assert_eq!(map.memory_bytes(), bytes);
    restored(&map);
}

#[test]
fn removed_agents_leave_room_in_the_joint_estimate() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robots: Vec<_> = (0..33).map(|_| Robot::enrol(&mut map)).collect();
    for robot in &mut robots {
        robot.sample(&mut map, crate::journal::start_pose([0.0; 3], [0.0; 3]));
        robot.sample(&mut map, sighting("door", [1.0, 0.0, 0.0], 0.1));
    }
    let states = |map: &CognitiveMap| {
        let page = map.checkpoint(0).find(|page| page.kind == 9);
        page.unwrap().bytes.len()
    };
    let full = states(&map);
    for robot in &robots[1..] {
        remove(&mut map, robot.id);
    }
    assert!(
        states(&map) < full / 2,
        "the correlations of those who have gone are kept no longer"
    );
    robots[0].sample(&mut map, sighting("door", [1.0, 0.0, 0.0], 0.1));
    restored(&map);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Agents may come and go at any point of any journal: the map is sound, and goes on from a
    /// checkpoint like itself.
    #[test]
    fn a_map_whose_agents_come_and_go_is_restored(
        settings in any_settings(),
        records in journals(),
        changes in prop::collection::vec(
            (any::<prop::sample::Index>(), any::<bool>(), 0u32..4),
            0..24,
        ),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut records = records;
        for (at, goes, agent) in changes {
            let agent = AgentId(agent);
            let record = if goes {
                Record::Remove { agent }
            } else {
                Record::Enrol { agent, name: label(&format!("agent-{}", agent.0)) }
            };
            records.insert(at.index(records.len() + 1), record);
        }
        let (first, second) = records.split_at(cut.index(records.len() + 1));
        let mut map = CognitiveMap::new(settings.clone());
        run(&mut map, first);
        let pages = map.checkpoint(0);
        let mut again = CognitiveMap::restore(settings.clone(), pages).unwrap();
        let since = map.revision();
        prop_assert_eq!(run(&mut map, second), run(&mut again, second));
        prop_assert_eq!(map.digest(), again.digest());
        let pages = again.checkpoint(0).chain(map.checkpoint(since));
        prop_assert!(CognitiveMap::restore(settings, pages).is_ok());
        prop_assert_eq!(map.agents().count(), map.agent_count());
        for (_, agent) in map.agents() {
            prop_assert!(agent.pose().translation.vector.iter().all(|x| x.is_finite()));
        }
        map.refined();
    }
}
