//! Objects: taught, known again, learned on the spot, forgotten.

use cognitive_map::{
    CognitiveMap, EventKind, Motion, ObjectMark, PoseNoise, Record, Sample, SampleBody, Settings,
    SettingsValues, SkipReason, Spacing, TouchNoise,
};
use object_recognition::{Orientation, Verdict};

use crate::journal::{Robot, label, level, run};

/// Levels along three rods whose places are 2 cm apart.
pub(crate) const RODS: [(&str, [f64; 12]); 3] = [
    (
        "fork",
        [
            1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0,
        ],
    ),
    (
        "knife",
        [
            1.0, 3.0, 2.0, 12.0, 4.0, 8.0, 6.0, 5.0, 11.0, 7.0, 10.0, 9.0,
        ],
    ),
    (
        "spoon",
        [
            8.0, 2.0, 6.0, 11.0, 5.0, 3.0, 12.0, 4.0, 7.0, 9.0, 1.0, 10.0,
        ],
    ),
];
pub(crate) const PITCH_M: f64 = 0.02;
/// From one end to the other.
pub(crate) const UP: [usize; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

pub(crate) fn noise() -> TouchNoise {
    TouchNoise::new(0.001, 0.02, 0.2).unwrap()
}

pub(crate) fn learn(name: Option<&str>) -> SampleBody {
    SampleBody::Object(ObjectMark::Learn {
        name: name.map(label),
        spacing: Spacing::new(0.01).unwrap(),
        orientation: Orientation::Known,
        noise: noise(),
    })
}

pub(crate) fn identify() -> SampleBody {
    identify_or_learn(true)
}

/// What is unknown is learned, or not.
fn identify_or_learn(learns: bool) -> SampleBody {
    SampleBody::Object(ObjectMark::Identify {
        orientation: Orientation::Known,
        noise: noise(),
        learns,
    })
}

pub(crate) fn end() -> SampleBody {
    SampleBody::Object(ObjectMark::End)
}

/// Feels the places of a rod one after the other; answers what happened.
pub(crate) fn feel(
    map: &mut CognitiveMap,
    hand: &mut Robot,
    rod: &[f64],
    order: &[usize],
) -> Vec<EventKind> {
    let mut events = Vec::new();
    let mut at = order[0];
    for &place in order {
        let way_m = (place as f64 - at as f64) * PITCH_M;
        // The joints of an arm are more exact than wheels.
        let noise = PoseNoise::new([0.0003; 3], [0.0; 3]).unwrap();
        let upright = [0.0, 0.0, 0.0, 1.0];
        let motion = Motion::from_increment([way_m, 0.0, 0.0], upright, Some(noise));
        hand.sample(map, SampleBody::Motion(motion.unwrap()));
        at = place;
        events.extend(hand.sample(map, level("touch", rod[place], [0.0; 3])));
    }
    events
        .into_iter()
        .filter(|event| !matches!(event, EventKind::PerceptCompared { .. }))
        .collect()
}

/// A map that knows the rods, and a hand.
pub(crate) fn taught(settings: Settings) -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(settings);
    let mut hand = Robot::enrol(&mut map);
    for (name, rod) in &RODS {
        hand.sample(&mut map, learn(Some(name)));
        feel(&mut map, &mut hand, rod, &UP);
        let events = hand.sample(&mut map, end());
        let [
            EventKind::ObjectLearned {
                name: learned,
                contacts: 12,
                ..
            },
        ] = &events[..]
        else {
            panic!("{events:?}")
        };
        assert_eq!(learned.as_str(), *name);
    }
    assert_eq!(map.object_count(), 3);
    (map, hand)
}

#[test]
fn what_looks_like_another_object_is_found() {
    let (mut map, mut hand) = taught(Settings::default());
    let known = |map: &CognitiveMap, name| map.object_by_name(&label(name)).unwrap();
    for (name, _) in &RODS {
        assert_eq!(map.object_alike(known(&map, name)), None, "{name}");
    }
    // The fork once more, the other way round.
    let mut turned = RODS[0].1;
    turned.reverse();
    hand.sample(&mut map, learn(Some("twin")));
    feel(&mut map, &mut hand, &turned, &UP);
    hand.sample(&mut map, end());
    let (alike, probability) = map.object_alike(known(&map, "twin")).unwrap();
    assert_eq!(alike, known(&map, "fork"));
    assert!(probability >= 0.995, "{probability}");
    let density = map.object_density(alike).unwrap();
    assert!((density.gap_m - PITCH_M).abs() < 0.002, "{density:?}");
}

pub(crate) fn recognised(events: &[EventKind]) -> Vec<&str> {
    let names = events.iter().filter_map(|event| match event {
        EventKind::ObjectRecognised { name, .. } => Some(name.as_str()),
        _ => None,
    });
    names.collect()
}

#[test]
fn what_was_learned_by_touch_is_known_again_from_an_unknown_start() {
    let (mut map, mut hand) = taught(Settings::default());
    for (name, rod) in &RODS {
        hand.sample(&mut map, identify());
        let events = feel(&mut map, &mut hand, rod, &[10, 9, 8, 7, 6, 5, 4, 3, 2, 1]);
        assert_eq!(recognised(&events), [*name], "{events:?}");
        let (teaches, identified) = map.episode(hand.id).unwrap();
        assert!(!teaches);
        // The episode began at the rod's eleventh place.
        let pose = identified.posterior.pose.unwrap();
        let off = pose.map_from_episode.translation.vector.x - 10.0 * PITCH_M;
        assert!(off.abs() < 0.003, "{off}");
        // Ten of twelve places were felt, and the levels tell it from another rod.
        let explanation = identified.explanation;
        let explored = explanation.explored.unwrap();
        assert!((0.8..0.95).contains(&explored), "{explored}");
        let (rival, said) = explanation.rival.unwrap();
        assert_ne!(map.object(rival).unwrap().name().as_str(), *name);
        assert_eq!(said.len(), 10);
        assert!(said.iter().sum::<f64>() > 5.0, "{said:?}");
        hand.sample(&mut map, end());
        assert!(map.episode(hand.id).is_none());
    }
    assert_eq!(map.object_count(), 3, "what is known is not learned anew");
}

#[test]
fn what_was_learned_on_the_spot_is_named_later() {
    let (mut map, mut hand) = taught(Settings::default());
    let strange = RODS[2].1.map(|level| level + 20.0);
    hand.sample(&mut map, identify());
    feel(&mut map, &mut hand, &strange, &UP);
    hand.sample(&mut map, end());
    let before = map.object_by_name(&label("object-3")).unwrap();
    assert!(!map.object(before).unwrap().is_named());
    hand.sample(&mut map, learn(Some("ladle")));
    feel(
        &mut map,
        &mut hand,
        &strange,
        &[11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0],
    );
    let events = hand.sample(&mut map, end());
    assert!(
        matches!(&events[..], [EventKind::ObjectLearned { name, .. }] if name.as_str() == "ladle"),
        "{events:?}"
    );
    assert_eq!(map.object_count(), 4, "it is no other object");
    assert_eq!(map.object_by_name(&label("ladle")), Some(before));
    assert_eq!(map.object_by_name(&label("object-3")), None);
    let known = map.object(before).unwrap();
    assert_eq!((known.is_named(), known.visits()), (true, 2));
    assert_eq!(
        map.object_places(before).len(),
        12,
        "laid into the same places"
    );
    // What has a name keeps it: another one is that of another object.
    hand.sample(&mut map, learn(Some("scoop")));
    feel(&mut map, &mut hand, &strange, &UP);
    hand.sample(&mut map, end());
    assert_eq!(map.object_count(), 5);
}

#[test]
fn something_unknown_is_said_to_be_and_learned() {
    let (mut map, mut hand) = taught(Settings::default());
    let strange = RODS[2].1.map(|level| level + 20.0);
    hand.sample(&mut map, identify());
    let events = feel(&mut map, &mut hand, &strange, &UP);
    assert!(events.contains(&EventKind::ObjectUnknown), "{events:?}");
    let events = hand.sample(&mut map, end());
    let [EventKind::ObjectLearned { name, .. }] = &events[..] else {
        panic!("{events:?}");
    };
    assert_eq!(name.as_str(), "object-3");
    hand.sample(&mut map, identify());
    let events = feel(
        &mut map,
        &mut hand,
        &strange,
        &[10, 9, 8, 7, 6, 5, 4, 3, 2, 1],
    );
    assert_eq!(recognised(&events), ["object-3"]);
}

#[test]
fn another_visit_extends_an_object_in_its_own_frame() {
    let (mut map, mut hand) = taught(Settings::default());
    let fork = map.object_by_name(&label("fork")).unwrap();
    let mut longer = RODS[0].1.to_vec();
    longer.extend([13.0, 14.0]);
    // It begins elsewhere, and goes beyond what was known.
    hand.sample(&mut map, learn(Some("fork")));
    feel(
        &mut map,
        &mut hand,
        &longer,
        &[3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13],
    );
    let events = hand.sample(&mut map, end());
    assert!(matches!(&events[..], [EventKind::ObjectLearned { object, .. }] if *object == fork));
    assert_eq!(map.object_places(fork).len(), 14);
    let farthest = map
        .object_places(fork)
        .iter()
        .map(|place| place.position_m.x);
    let off_m = farthest.fold(0.0, f64::max) - 13.0 * PITCH_M;
    assert!(off_m.abs() < 0.5 * PITCH_M, "{off_m} m");
    // Something else under that name changes nothing.
    hand.sample(&mut map, learn(Some("fork")));
    feel(
        &mut map,
        &mut hand,
        &[70.0, 50.0, 90.0, 60.0],
        &[0, 1, 2, 3],
    );
    let events = hand.sample(&mut map, end());
    assert_eq!(events, [EventKind::ObjectNotLearned { contacts: 4 }]);
    assert_eq!(map.object_places(fork).len(), 14);
}

/// Feels places of a rod in an episode; answers what happened, to its end.
fn visit(
    map: &mut CognitiveMap,
    hand: &mut Robot,
    mark: SampleBody,
    rod: &[f64],
    order: &[usize],
) -> Vec<EventKind> {
    hand.sample(map, mark);
    let mut events = feel(map, hand, rod, order);
    events.extend(hand.sample(map, end()));
    events
}

fn names(map: &CognitiveMap) -> Vec<String> {
    let names = map
        .objects()
        .map(|(_, known, _)| known.name().as_str().to_owned());
    names.collect()
}

#[test]
fn what_two_hands_find_at_the_same_time_is_one_object() {
    let (mut map, mut left) = taught(Settings::default());
    let mut right = Robot::enrol(&mut map);
    let strange = RODS[2].1.map(|level| level + 20.0);
    for hand in [&mut left, &mut right] {
        hand.sample(&mut map, identify());
        let events = feel(&mut map, hand, &strange, &UP);
        assert!(events.contains(&EventKind::ObjectUnknown), "{events:?}");
    }
    left.sample(&mut map, end());
    let events = right.sample(&mut map, end());
    assert_eq!(recognised(&events), ["object-3"]);
    assert_eq!(map.object_count(), 4);
}

#[test]
fn pieces_of_one_thing_become_one_object_once_the_whole_is_known() {
    let (mut map, mut hand) = taught(Settings::default());
    let mut strange = RODS[2].1.map(|level| level + 20.0).to_vec();
    strange.extend(RODS[1].1.map(|level| level + 40.0));
    let all: Vec<usize> = (0..strange.len()).collect();
    visit(&mut map, &mut hand, learn(None), &strange, &all[..12]);
    visit(&mut map, &mut hand, learn(None), &strange, &all[12..]);
    assert_eq!(
        map.object_count(),
        5,
        "nobody can know that they hang together"
    );
    visit(&mut map, &mut hand, learn(Some("ladle")), &strange, &all);
    // What fits a piece as well as the whole.
    let mut events = visit(&mut map, &mut hand, identify(), &strange, &all[..12]);
    events.extend(visit(&mut map, &mut hand, identify(), &strange, &all[12..]));
    let merged = events.iter().filter_map(|event| match event {
        EventKind::ObjectsMerged { name, absorbed, .. } => Some((name.as_str(), absorbed.as_str())),
        _ => None,
    });
    let merged: Vec<_> = merged.collect();
    assert!(!merged.is_empty() && merged.iter().all(|(name, _)| *name == "ladle"));
    assert_eq!(recognised(&events), ["ladle"; 2], "{events:?}");
    assert_eq!(names(&map), ["fork", "knife", "spoon", "ladle"]);
    let ladle = map.object_by_name(&label("ladle")).unwrap();
    assert_eq!(map.object_places(ladle).len(), strange.len());
}

#[test]
fn two_objects_that_were_named_apart_stay_two() {
    let (mut map, mut hand) = taught(Settings::default());
    visit(&mut map, &mut hand, learn(Some("gabel")), &RODS[0].1, &UP);
    let events = visit(&mut map, &mut hand, identify(), &RODS[0].1, &UP);
    assert_eq!(recognised(&events), [""; 0], "it may be either");
    assert_eq!(names(&map), ["fork", "knife", "spoon", "gabel"]);
}

#[test]
fn what_was_joined_in_error_comes_apart_again() {
    let (mut map, mut hand) = taught(Settings::default());
    let fork = map.object_by_name(&label("fork")).unwrap();
    let levels = |map: &CognitiveMap| {
        let places = map.object_places(fork).iter();
        places.map(|place| place.levels[0].mean).collect::<Vec<_>>()
    };
    let before = levels(&map);
    // Like the fork, but for its end.
    let mut other = RODS[0].1;
    other[9..].copy_from_slice(&[30.0, 40.0, 50.0]);
    let events = visit(&mut map, &mut hand, learn(None), &other, &UP);
    assert!(
        matches!(&events[..], [EventKind::ObjectLearned { object, .. }] if *object == fork),
        "{events:?}"
    );
    assert_ne!(levels(&map), before);
    let mut restored = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
    assert_eq!(restored.digest(), map.digest());
    let mut twin = Robot { ..hand };
    let events = visit(&mut map, &mut hand, identify(), &RODS[0].1, &UP);
    let split = { events.iter() }
        .find_map(|event| match event {
            EventKind::ObjectSplit {
                object, part_name, ..
            } => Some((*object, part_name.as_str().to_owned())),
            _ => None,
        })
        .unwrap_or_else(|| panic!("{events:?}"));
    assert_eq!(split, (fork, "object-3".to_owned()));
    assert_eq!(levels(&map), before);
    assert_eq!(map.object(fork).unwrap().visits(), 1);
    let again = visit(&mut restored, &mut twin, identify(), &RODS[0].1, &UP);
    assert_eq!(again, events);
    assert_eq!(restored.digest(), map.digest());
    let events = visit(&mut map, &mut hand, identify(), &other, &UP);
    assert_eq!(recognised(&events), ["object-3"]);
}

#[test]
fn a_visit_to_what_was_known_before_does_not_undo_what_was_added() {
    let (mut map, mut hand) = taught(Settings::default());
    let fork = map.object_by_name(&label("fork")).unwrap();
    let mut longer = RODS[0].1.to_vec();
    longer.extend([13.0, 14.0, 15.0, 16.0]);
    let order: Vec<usize> = (3..16).collect();
    visit(&mut map, &mut hand, learn(Some("fork")), &longer, &order);
    for _ in 0..3 {
        let events = visit(&mut map, &mut hand, identify(), &longer, &UP[..8]);
        assert_eq!(recognised(&events), ["fork"], "{events:?}");
    }
    // A visit to all of it settles what was added.
    let whole: Vec<usize> = (0..16).collect();
    let events = visit(&mut map, &mut hand, identify(), &longer, &whole);
    assert_eq!(recognised(&events), ["fork"], "{events:?}");
    let restored = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
    assert_eq!(restored.digest(), map.digest());
    assert_eq!(map.object_places(fork).len(), longer.len());
    assert_eq!(map.object_count(), 3);
}

#[test]
fn nothing_unknown_is_learned_where_the_settings_or_the_episode_say_so() {
    let learned = |(learns, episode_learns)| {
        let values = SettingsValues {
            learns_unknown_objects: learns,
            ..SettingsValues::default()
        };
        let (mut map, mut hand) = taught(Settings::new(values).unwrap());
        let before = map.object_count();
        let strange = RODS[2].1.map(|level| level + 20.0);
        hand.sample(&mut map, identify_or_learn(episode_learns));
        let events = feel(&mut map, &mut hand, &strange, &UP);
        assert!(events.contains(&EventKind::ObjectUnknown), "{events:?}");
        hand.sample(&mut map, end());
        map.object_count() - before
    };
    let cases = [(true, true), (true, false), (false, true), (false, false)];
    assert_eq!(cases.map(learned), [1, 0, 0, 0]);
}

#[test]
fn an_episode_goes_on_where_a_checkpoint_was_taken() {
    let (mut map, mut hand) = taught(Settings::default());
    hand.sample(&mut map, identify());
    let rod = &RODS[2].1;
    feel(&mut map, &mut hand, rod, &[10]);
    let mut restored = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
    assert_eq!(restored.digest(), map.digest());
    let mut twin = Robot { ..hand };
    let rest = [10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0];
    let on = feel(&mut map, &mut hand, rod, &rest);
    let again = feel(&mut restored, &mut twin, rod, &rest);
    assert_eq!(on, again);
    assert_eq!(recognised(&on).last(), Some(&"spoon"));
    assert_eq!(restored.digest(), map.digest());
}

#[test]
fn the_end_of_an_episode_tells_what_was_recognised() {
    let (mut map, mut hand) = taught(Settings::default());
    hand.sample(&mut map, identify());
    feel(&mut map, &mut hand, &RODS[1].1, &UP);
    let (_, said) = map.episode(hand.id).unwrap();
    let knife = map.object_by_name(&label("knife")).unwrap();
    assert_eq!(said.posterior.verdict(), Verdict::Object(knife));
    let mut restored = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
    let end = Record::Sample {
        agent: hand.id,
        session: hand.session,
        seq: hand.seq,
        sample: Sample {
            stamp_ns: hand.stamp_ns,
            body: SampleBody::SessionEnd,
        },
    };
    for map in [&mut map, &mut restored] {
        let events = run(map, std::slice::from_ref(&end));
        let ended: Vec<_> = { events.iter() }
            .filter(|event| matches!(event.kind, EventKind::EpisodeEnded { .. }))
            .collect();
        let [event] = &ended[..] else {
            panic!("{events:?}");
        };
        assert_eq!(event.stamp_ns, hand.stamp_ns);
        let told = EventKind::EpisodeEnded {
            session: hand.session,
            teaches: false,
            posterior: Some(Box::new(said.posterior.clone())),
        };
        assert_eq!(event.kind, told);
        assert!(map.episode(hand.id).is_none());
    }
    assert_eq!(map.digest(), restored.digest());
    // Nothing more is to be told. An episode in which nothing was felt says that nothing is known:
    // its answer is not the one before.
    hand.seq += 1;
    let again = hand.sample(&mut map, identify());
    assert_eq!(again, []);
    let end = Record::Skip {
        agent: hand.id,
        session: hand.session,
        from: hand.seq,
        to: hand.seq + 1,
        reason: SkipReason::Lost,
    };
    let events = run(&mut map, &[end]);
    let said = events.iter().find_map(|event| match &event.kind {
        EventKind::EpisodeEnded { posterior, .. } => posterior.as_deref(),
        _ => None,
    });
    let said = said.unwrap_or_else(|| panic!("{events:?}"));
    assert_eq!((said.contacts, said.verdict()), (0, Verdict::Undecided));
}
