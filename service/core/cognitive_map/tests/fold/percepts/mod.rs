//! What places learn of percepts, and how percepts recall them.

mod many;
mod prediction;

use cognitive_map::{
    AgentId, ChannelKind, CognitiveMap, Descriptor, EventKind, Expected, Label, Motion, PerceptCue,
    PlaceId, PoseNoise, Predicted, RecallCue, Remembered, SampleBody, Settings, StartPose,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use crate::journal::{Robot, descriptor, label, level, settings, start_pose};

/// A robot at the origin, where the first place is.
fn at_first_place() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.go(&mut map, [0.0; 3], [0.0; 3]);
    assert_eq!(map.place_count(), 1);
    (map, robot)
}

fn remembered(map: &CognitiveMap, place: u32) -> Vec<Remembered> {
    map.remembered(PlaceId(place)).collect()
}

fn motion(translation_m: [f64; 3], rotation_vector: [f64; 3], noise: PoseNoise) -> Motion {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(rotation_vector));
    Motion::from_increment(translation_m, rotation.coords.into(), Some(noise)).unwrap()
}

fn predict(
    map: &CognitiveMap,
    robot: &Robot,
    ahead_m: f64,
    channel: Option<&Label>,
) -> Vec<Predicted> {
    let motion = motion([ahead_m, 0.0, 0.0], [0.0; 3], PoseNoise::none());
    let prediction = map.predict(robot.id, &motion, &Vector3::zeros(), channel);
    prediction.unwrap().percepts
}

fn surprises(events: &[EventKind]) -> Vec<f64> {
    let surprise = |event: &EventKind| match event {
        EventKind::PerceptCompared { surprise, .. } => Some(*surprise),
        _ => None,
    };
    events.iter().filter_map(surprise).collect()
}

fn mean_and_sd(remembered: &Remembered) -> (f64, f64) {
    match remembered.expected {
        Expected::Level { mean, sd } => (mean, sd),
        Expected::Descriptor(_) => panic!("a level was expected"),
    }
}

fn direction(remembered: &Remembered) -> &[f32] {
    match &remembered.expected {
        Expected::Descriptor(direction) => direction,
        Expected::Level { .. } => panic!("a descriptor was expected"),
    }
}

fn cue(percept: PerceptCue) -> RecallCue {
    RecallCue {
        position: None,
        code: None,
        percept: Some(percept),
        radius_m: None,
        founder: None,
        since_ns: None,
        until_ns: None,
        limit: 10,
    }
}

fn level_cue(channel: &str, value: f64) -> RecallCue {
    let channel = label(channel);
    cue(PerceptCue::Level { channel, value })
}

fn view_cue(vector: &[f32]) -> RecallCue {
    let view = Descriptor::new(label("camera"), vector).unwrap();
    cue(PerceptCue::Descriptor(view))
}

/// A unit vector along an axis, of eight numbers.
fn axis(k: usize) -> [f32; 8] {
    let mut axis = [0.0; 8];
    axis[k] = 1.0;
    axis
}

#[test]
fn what_is_felt_in_no_field_teaches_nothing() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut first = Robot::enrol(&mut map);
    let mut lost = Robot::enrol(&mut map);
    first.sample(&mut map, level("touch", 1.0, [0.0; 3])); // before there is a place
    first.go(&mut map, [0.0; 3], [0.0; 3]);
    lost.go(&mut map, [0.0; 3], [0.0; 3]);
    lost.sample(&mut map, level("touch", 1.0, [0.0; 3])); // an agent that stands nowhere
    lost.sample(&mut map, descriptor("camera", &axis(0)));
    first.sample(&mut map, level("touch", 1.0, [0.3, 0.0, 0.0])); // confidence below one half
    first.sample(&mut map, level("touch", 1e101, [0.0; 3])); // beyond what can be squared
    assert_eq!(map.channels().count(), 0);
    assert!(remembered(&map, 0).is_empty());
    assert_eq!(map.agent(first.id).unwrap().percepts(), 3);
    assert_eq!(map.agent(lost.id).unwrap().percepts(), 2);

    first.sample(&mut map, level("touch", 1.0, [0.2, 0.0, 0.0]));
    assert_eq!(remembered(&map, 0).len(), 1);
}

#[test]
fn a_level_teaches_the_place_where_its_sensor_is() {
    let (mut map, mut robot) = at_first_place();
    robot.ahead(&mut map, 0.5, 1); // a second place, half a metre ahead
    robot.go(&mut map, [0.0; 3], [0.0, 0.0, std::f64::consts::PI]);
    assert_eq!(map.place_count(), 2);
    // The robot looks back, so half a metre before it lies the first place.
    robot.sample(&mut map, level("touch", 4.0, [0.5, 0.0, 0.0]));
    robot.sample(&mut map, level("touch", 7.0, [0.0; 3]));
    assert_eq!(mean_and_sd(&remembered(&map, 0)[0]), (4.0, 0.0));
    assert_eq!(mean_and_sd(&remembered(&map, 1)[0]), (7.0, 0.0));
}

#[test]
fn confidence_weighs_what_is_learned() {
    let (mut map, mut robot) = at_first_place();
    robot.sample(&mut map, level("touch", 0.0, [0.0; 3]));
    robot.sample(&mut map, level("touch", 3.0, [0.0, 0.25 - 1e-12, 0.0])); // confidence one half
    let learned = &remembered(&map, 0)[0];
    let (mean, sd) = mean_and_sd(learned);
    assert_eq!(learned.percepts, 2);
    assert!((learned.strength - 1.5).abs() < 1e-9);
    assert!((mean - 1.0).abs() < 1e-9);
    assert!((sd - 2.0f64.sqrt()).abs() < 1e-9, "√((1·1 + ½·4) / 1.5)");
}

#[test]
fn descriptors_add_up_to_their_mean_direction() {
    let (mut map, mut robot) = at_first_place();
    for k in [0, 1, 1, 0] {
        robot.sample(&mut map, descriptor("camera", &axis(k)));
    }
    let learned = &remembered(&map, 0)[0];
    assert_eq!((learned.percepts, learned.strength), (4, 4.0));
    let half = 0.5f32.sqrt();
    let expected = [half, half, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for (x, y) in direction(learned).iter().zip(expected) {
        assert!((x - y).abs() < 1e-6);
    }
}

#[test]
fn channels_are_told_apart_by_kind_and_dimension() {
    let (mut map, mut robot) = at_first_place();
    robot.sample(&mut map, level("eye", 1.0, [0.0; 3]));
    robot.sample(&mut map, descriptor("eye", &[1.0; 8]));
    robot.sample(&mut map, descriptor("eye", &[1.0; 9]));
    let kinds: Vec<_> = map.channels().map(|(_, channel)| channel.kind()).collect();
    let descriptors = |dimension| ChannelKind::Descriptor { dimension };
    assert_eq!(kinds, [ChannelKind::Level, descriptors(8), descriptors(9)]);
    assert_eq!(remembered(&map, 0).len(), 3);
}

#[test]
fn channels_are_bounded() {
    let (mut map, mut robot) = at_first_place();
    for k in 0..100 {
        robot.sample(&mut map, level(&format!("channel-{k}"), 1.0, [0.0; 3]));
    }
    assert_eq!(map.channels().count(), 64);
    assert_eq!(remembered(&map, 0).len(), 64);
    // Those that are there go on learning.
    robot.sample(&mut map, level("channel-63", 3.0, [0.0; 3]));
    assert_eq!(mean_and_sd(&remembered(&map, 0)[63]), (2.0, 1.0));
}

#[test]
fn surprise_is_the_distance_from_what_was_learned() {
    let (mut map, mut robot) = at_first_place();
    let feel = |map: &mut CognitiveMap, robot: &mut Robot, value| {
        surprises(&robot.sample(map, level("touch", value, [0.0; 3])))
    };
    assert!(
        feel(&mut map, &mut robot, 9.0).is_empty(),
        "nothing to compare with"
    );
    assert_eq!(feel(&mut map, &mut robot, 11.0).len(), 1);
    assert_eq!(feel(&mut map, &mut robot, 10.0), [0.0]);
    let sd = (2.0f64 / 3.0).sqrt();
    let [surprise] = feel(&mut map, &mut robot, 14.0)[..] else {
        panic!("one")
    };
    assert!((surprise - 4.0 / sd).abs() < 1e-9);

    // A place that has felt one value only is compared by the channel's floor.
    robot.ahead(&mut map, 0.5, 1);
    feel(&mut map, &mut robot, 11.0);
    let floor = map.channels().next().unwrap().1.level_sd_floor();
    let [surprise] = feel(&mut map, &mut robot, 12.0)[..] else {
        panic!("one")
    };
    assert!((surprise - 1.0 / floor).abs() < 1e-9);

    let look = |map: &mut CognitiveMap, robot: &mut Robot, vector: [f32; 8]| {
        surprises(&robot.sample(map, descriptor("camera", &vector)))
    };
    assert!(look(&mut map, &mut robot, axis(0)).is_empty());
    assert_eq!(look(&mut map, &mut robot, axis(0)), [0.0]);
    assert_eq!(look(&mut map, &mut robot, axis(1)), [1.0]);
    let [surprise] = look(&mut map, &mut robot, axis(0).map(|x| -x))[..] else {
        panic!("one")
    };
    assert!((surprise - (1.0 + 2.0 / 5.0f64.sqrt())).abs() < 1e-6);
}

/// A sensor that once says nonsense must not blunt its channel.
#[test]
fn one_bad_reading_does_not_spoil_a_channel() {
    for nonsense in [3.4e38, -9999.0, 1e29] {
        let (mut map, mut robot) = at_first_place();
        for place in 0..1000 {
            let value = if place == 100 {
                nonsense
            } else {
                f64::from(place % 40)
            };
            robot.sample(&mut map, level("touch", value, [0.0; 3]));
            robot.ahead(&mut map, 0.5, 1);
        }
        let best = &map.recall(&level_cue("touch", 7.0))[0];
        assert!((mean_and_sd(&remembered(&map, best.place.0)[0]).0 - 7.0).abs() < 1e-9);
        // The place of a 39 is surprised by a 0.
        robot.ahead(&mut map, -0.5, 1);
        let mut events = Vec::new();
        for _ in 0..5 {
            robot.sample(&mut map, level("touch", 39.0, [0.0; 3]));
        }
        events.extend(robot.sample(&mut map, level("touch", 0.0, [0.0; 3])));
        assert!(surprises(&events)[0] > 10.0, "{nonsense}: {events:?}");
    }
}

#[test]
fn recall_by_a_level_prefers_where_it_is_likely() {
    let (mut map, mut robot) = at_first_place();
    for place in 0..4 {
        for offset in [-1.0, 1.0] {
            let value = 10.0 * f64::from(place) + offset;
            robot.sample(&mut map, level("touch", value, [0.0; 3]));
        }
        robot.ahead(&mut map, 0.5, 1);
    }
    let floor = map.channels().next().unwrap().1.level_sd_floor();
    assert!(
        floor > 1.0,
        "the places' own deviation of 1 is below a tenth of the channel's"
    );
    let recalled = map.recall(&level_cue("touch", 12.0));
    let order: Vec<_> = recalled.iter().map(|recalled| recalled.place.0).collect();
    assert_eq!(
        order,
        [1, 2, 0, 3],
        "and not the place that has felt nothing"
    );
    for recalled in &recalled {
        let mean = 10.0 * f64::from(recalled.place.0);
        let expected = (-0.5 * ((12.0 - mean) / floor).powi(2)).exp();
        assert!((recalled.percept_match.unwrap() - expected).abs() < 1e-12);
        assert_eq!(recalled.confidence, recalled.percept_match);
        assert_eq!((recalled.cosine, recalled.distance_m), (None, None));
    }
    assert!(map.recall(&level_cue("smell", 12.0)).is_empty());
    assert!(map.recall(&view_cue(&axis(0))).is_empty());
}

#[test]
fn a_percept_and_a_position_multiply() {
    let (mut map, mut robot) = at_first_place();
    // Two places look alike, and one in between does not.
    for k in [0, 1, 0] {
        robot.sample(&mut map, descriptor("camera", &axis(k)));
        robot.ahead(&mut map, 0.5, 1);
    }
    let by_view = map.recall(&view_cue(&axis(0)));
    let places: Vec<_> = by_view.iter().map(|recalled| recalled.place.0).collect();
    assert_eq!(places, [0, 2, 1], "equal views by identifier");

    let mut cue = view_cue(&axis(0));
    cue.position = Some([0.9, 0.0, 0.0].into());
    let both = map.recall(&cue);
    assert_eq!(both[0].place, PlaceId(2));
    let by_distance = (-(0.1f64 / 0.25).powi(2)).exp2();
    assert!((both[0].confidence.unwrap() - by_distance).abs() < 1e-9);
    assert!((both[0].distance_m.unwrap() - 0.1).abs() < 1e-9);
    assert_eq!(both[0].percept_match, Some(1.0));
    assert!(both[0].cosine.unwrap() > 0.9);

    cue.code = Some((&map.modules().code_at(&[1.0, 0.0, 0.0].into())).into());
    let three = map.recall(&cue);
    assert_eq!(three[0].place, PlaceId(2));
    assert!((three[0].confidence.unwrap() - by_distance).abs() < 1e-6);
    assert!((three[0].cosine.unwrap() - 1.0).abs() < 1e-9);

    cue.radius_m = Some(0.45);
    let near: Vec<_> = map
        .recall(&cue)
        .iter()
        .map(|recalled| recalled.place.0)
        .collect();
    assert_eq!(near, [2, 1]);
    cue.until_ns = Some(0);
    assert!(map.recall(&cue).is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any number of places, of percepts for each and of numbers in a descriptor, also such that
    /// are no multiple of anything.
    #[test]
    fn search_equals_a_plain_scan(
        views in prop::collection::vec(prop::collection::vec(-1.0..1.0f32, 700), 1..12),
        walk in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 1..120),
        dimension in prop::sample::select(vec![8usize, 9, 31, 256, 700]),
        cue in any::<prop::sample::Index>(),
        limit in 1usize..40,
    ) {
        let (mut map, mut robot) = at_first_place();
        let view = |index: &prop::sample::Index| {
            let mut view = views[index.index(views.len())][..dimension].to_vec();
            view[0] += 1.5; // never the zero vector
            view
        };
        for (index, moves) in &walk {
            robot.sample(&mut map, descriptor("camera", &view(index)));
            robot.ahead(&mut map, if *moves { 0.5 } else { 0.0 }, 1);
        }
        let asked = Descriptor::new(label("camera"), &view(&cue)).unwrap();
        let mut scan = Vec::new();
        for (place, _) in map.places() {
            if let Some(learned) = map.remembered(place).next() {
                let pairs = direction(&learned).iter().zip(asked.vector());
                let cosine: f64 = pairs.map(|(x, y)| f64::from(*x) * f64::from(*y)).sum();
                scan.push((place, cosine));
            }
        }
        let mut cue = self::cue(PerceptCue::Descriptor(asked));
        cue.limit = limit;
        let recalled = map.recall(&cue);
        prop_assert_eq!(recalled.len(), scan.len().min(limit));
        let of = |place: PlaceId| scan.iter().find(|scanned| scanned.0 == place).unwrap().1;
        let mut cosines: Vec<_> = scan.iter().map(|scanned| scanned.1).collect();
        cosines.sort_by(|a, b| b.partial_cmp(a).unwrap());
        for (recalled, best) in recalled.iter().zip(cosines) {
            let cosine = recalled.percept_match.unwrap();
            prop_assert!((cosine - of(recalled.place)).abs() < 1e-5);
            prop_assert!((cosine - best).abs() < 1e-5);
        }
        for pair in recalled.windows(2) {
            let key = |recalled: &cognitive_map::Recalled| {
                (-recalled.confidence.unwrap(), -recalled.percept_match.unwrap(), recalled.place)
            };
            prop_assert!(key(&pair[0]) < key(&pair[1]), "best first, equal ones by identifier");
        }
    }

    /// The order in which percepts come to a place matters only by rounding.
    #[test]
    fn memory_does_not_depend_on_the_order(
        felt in prop::collection::vec((-50.0..50.0f64, 0.0..0.24f64, 0usize..8), 1..40),
    ) {
        let learn = |felt: &[(f64, f64, usize)]| {
            let (mut map, mut robot) = at_first_place();
            for (value, off_m, k) in felt {
                robot.sample(&mut map, level("touch", *value, [*off_m, 0.0, 0.0]));
                robot.sample(&mut map, descriptor("camera", &axis(*k)));
            }
            remembered(&map, 0)
        };
        let reversed: Vec<_> = felt.iter().rev().copied().collect();
        let (there, back) = (learn(&felt), learn(&reversed));
        let (there_level, back_level) = (mean_and_sd(&there[0]), mean_and_sd(&back[0]));
        prop_assert!((there_level.0 - back_level.0).abs() < 1e-9);
        prop_assert!((there_level.1 - back_level.1).abs() < 1e-9);
        prop_assert!((there[0].strength - back[0].strength).abs() < 1e-9);
        for (x, y) in direction(&there[1]).iter().zip(direction(&back[1])) {
            prop_assert!((x - y).abs() < 1e-5);
        }
    }
}

#[test]
fn a_moved_start_pose_is_where_percepts_are_learned() {
    let (mut map, mut robot) = at_first_place();
    let pose = Isometry3::translation(3.0, 0.0, 0.0);
    let start = StartPose::new(
        pose.translation.vector.into(),
        [0.0, 0.0, 0.0, 1.0],
        PoseNoise::none(),
    );
    robot.sample(&mut map, SampleBody::StartPose(start.unwrap()));
    robot.sample(&mut map, level("touch", 1.0, [0.0; 3]));
    assert_eq!(map.channels().count(), 0, "no place is there yet");
    robot.go(&mut map, [0.0; 3], [0.0; 3]);
    robot.sample(&mut map, level("touch", 2.0, [0.0; 3]));
    assert!(remembered(&map, 0).is_empty());
    assert_eq!(mean_and_sd(&remembered(&map, 1)[0]), (2.0, 0.0));
}

#[test]
fn what_places_remember_is_part_of_the_digest() {
    let digest = |percept: SampleBody| {
        let (mut map, mut robot) = at_first_place();
        robot.sample(&mut map, percept);
        map.digest()
    };
    let levels = |value| digest(level("touch", value, [0.0; 3]));
    assert_eq!(levels(1.0), levels(1.0));
    assert_ne!(levels(1.0), levels(1.0 + f64::EPSILON));
    assert_ne!(levels(1.0), digest(level("light", 1.0, [0.0; 3])));
    let views = |k| digest(descriptor("camera", &axis(k)));
    assert_ne!(views(0), views(1));
}
