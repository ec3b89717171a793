//! What a robot felt and saw: places remember it, it recalls places, and it is expected again.

use std::f32::consts::FRAC_PI_2;

use cogmap_proto::{
    Codec, Descriptor, Event, EventKind, ExpectedPercept, Increment, Level, MotionBody,
    MotionNoise, PerceptCue, PerceptKind, PredictAnswer, PredictQuery, Problem, RecallQuery,
    Sample, SampleBody, StartPose, events_key, query_key,
};
use cogmap_tests::{LONG, RawPublisher, Server, batch};
use zenoh::Wait;

const AGENT: &str = "ada";
/// Length of the wall \[m\], along x.
const WALL_M: f64 = 4.0;
const STEP_M: f64 = 0.05;
const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// A place answers this far at most, and places are at most two field radii apart along a way, so
/// what it remembers was felt no farther from it than this.
const FIELD_M: f64 = 0.5;

fn roughness(value: f64) -> Level {
    Level {
        channel: "roughness".to_owned(),
        value,
        offset_m: [0.0; 3],
        normal: None,
    }
}

/// A view that turns from one axis to the next as the robot goes along the wall.
fn view(x_m: f64) -> Descriptor {
    let axis = x_m.floor().clamp(0.0, 6.0);
    #[expect(clippy::cast_possible_truncation, reason = "a share of a metre")]
    let (sin, cos) = ((x_m - axis) as f32 * FRAC_PI_2).sin_cos();
    let part = |k: f64| match k - axis {
        0.0 => cos,
        1.0 => sin,
        _ => 0.0,
    };
    Descriptor {
        channel: "camera".to_owned(),
        vector: (0..8).map(|k| part(f64::from(k))).collect(),
    }
}

fn increment(x_m: f64) -> Increment {
    Increment {
        translation_m: [x_m, 0.0, 0.0],
        rotation_xyzw: NO_TURN,
        noise: None,
    }
}

/// A hundredth of a second apart.
fn stamped(bodies: Vec<SampleBody>) -> Vec<Sample> {
    let stamps = (1_800_000_000_000_000_000_i64..).step_by(10_000_000);
    stamps
        .zip(bodies)
        .map(|(stamp_ns, body)| Sample { stamp_ns, body })
        .collect()
}

/// Along the wall, whose roughness is the way from its beginning, and back again.
fn along_the_wall() -> Vec<Sample> {
    let mut bodies = vec![SampleBody::StartPose(StartPose {
        translation_m: [0.0; 3],
        rotation_xyzw: NO_TURN,
        noise: None,
    })];
    let mut x_m = 0.0;
    for step_m in [STEP_M, -STEP_M] {
        while (0.0..=WALL_M).contains(&(x_m + step_m / 2.0)) {
            x_m += step_m;
            bodies.push(SampleBody::Increment(increment(step_m)));
            bodies.push(SampleBody::Level(roughness(x_m)));
            bodies.push(SampleBody::Descriptor(view(x_m)));
        }
    }
    stamped(bodies)
}

fn recall(percept: PerceptCue) -> RecallQuery {
    RecallQuery {
        percept: Some(percept),
        limit: Some(1),
        ..RecallQuery::default()
    }
}

#[test]
fn a_percept_recalls_where_it_was_felt() {
    let server = Server::start(&[]);
    let api = server.api();
    let way = batch(1, 0, along_the_wall());
    api.post_samples("default", AGENT, &way).unwrap();
    for x_m in [0.5, 1.7, 3.2] {
        for cue in [
            PerceptCue::Level(roughness(x_m)),
            PerceptCue::Descriptor(view(x_m)),
        ] {
            let answer = api.recall("default", &recall(cue.clone())).unwrap();
            let best = &answer.places[0];
            let off_m = (best.place.translation_m[0] - x_m).abs();
            assert!(off_m < FIELD_M, "{cue:?} at {x_m} m: {best:?}");
            assert!(best.percept_match.unwrap() > 0.5, "{best:?}");
            // Together with a position far away nothing is sure of itself.
            let far = RecallQuery {
                position_m: Some([x_m + 2.0, 0.0, 0.0]),
                ..recall(cue)
            };
            let far = &api.recall("default", &far).unwrap().places[0];
            assert!(far.confidence.unwrap() < 0.1, "{far:?}");
        }
    }
    // Nobody felt anything on this channel.
    let unknown = Level {
        channel: "warmth".to_owned(),
        ..roughness(1.0)
    };
    let answer = api.recall("default", &recall(PerceptCue::Level(unknown)));
    let unknown = answer.unwrap_err().to_string();
    assert!(
        unknown.contains("\"warmth\"") && unknown.contains("404"),
        "{unknown}"
    );
}

#[test]
fn a_motion_predicts_what_was_felt_at_its_end() {
    let server = Server::start(&[]);
    let api = server.api();
    let way = batch(1, 0, along_the_wall());
    api.post_samples("default", AGENT, &way).unwrap();
    let raw = RawPublisher::connect(&server.endpoint());
    for x_m in [0.5, 1.7, 3.2] {
        let query = PredictQuery {
            agent: None,
            motion: MotionBody::Increment(increment(x_m)),
            offset_m: [0.0; 3],
            channel: None,
        };
        let answer = api.predict("default", AGENT, &query).unwrap();
        assert!((answer.translation_m[0] - x_m).abs() < 1e-9, "{answer:?}");
        let [touch, camera] = &answer.percepts[..] else {
            panic!("two channels: {answer:?}");
        };
        let ExpectedPercept::Level { mean, sd } = touch.expected else {
            panic!("a level: {touch:?}");
        };
        assert!((mean - x_m).abs() < FIELD_M && sd < FIELD_M, "{touch:?}");
        let ExpectedPercept::Descriptor { vector } = &camera.expected else {
            panic!("a descriptor: {camera:?}");
        };
        let seen = view(x_m).vector;
        let cosine: f32 = vector.iter().zip(&seen).map(|(a, b)| a * b).sum();
        assert!(cosine > 0.7, "{cosine}");
        assert!(touch.confidence > 0.05, "{touch:?}");
        let memory = api.place_percepts("default", touch.place).unwrap();
        let remembered = |channel: &str| {
            let mut known = memory.percepts.iter();
            known.find(|percept| percept.channel == channel).cloned()
        };
        let place = remembered(&touch.channel).expect("what is predicted is remembered");
        assert_eq!(
            (place.expected, place.percepts),
            (touch.expected.clone(), touch.percepts)
        );

        let asked = PredictQuery {
            agent: Some(AGENT.to_owned()),
            ..query
        };
        for codec in [Codec::Json, Codec::Cbor, Codec::Postcard] {
            let key = query_key("default", "predict");
            let bytes = raw.ask(&key, codec.encoding(), codec.encode(&asked));
            let heard: PredictAnswer = codec.decode(&bytes.unwrap()).unwrap();
            assert_eq!(heard, answer);
        }
    }
    // Off the wall nothing is known, and an unknown agent goes nowhere.
    let mut query = PredictQuery {
        agent: None,
        motion: MotionBody::Increment(increment(50.0)),
        offset_m: [0.0; 3],
        channel: None,
    };
    let nowhere = api.predict("default", AGENT, &query).unwrap();
    assert_eq!((nowhere.place, nowhere.percepts.len()), (None, 0));
    query.agent = Some("nobody".to_owned());
    let key = query_key("default", "predict");
    let problem = raw.ask(&key, Codec::Json.encoding(), Codec::Json.encode(&query));
    let problem: Problem = Codec::Json.decode(&problem.unwrap_err()).unwrap();
    assert_eq!(problem.status, 404);
}

/// A robot that starts at a heading and goes straight on, with a compass in degrees, clockwise from
/// where the map's y axis points.
fn straight_on(heading_rad: f64) -> Vec<Sample> {
    let (sin, cos) = (heading_rad / 2.0).sin_cos();
    let mut bodies = vec![SampleBody::StartPose(StartPose {
        translation_m: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, sin, cos],
        noise: None,
    })];
    for _ in 0..60 {
        bodies.push(SampleBody::Increment(Increment {
            noise: Some(MotionNoise {
                translation_sd_m: [0.01, 0.01, 0.0],
                rotation_sd_rad: [0.0, 0.0, 1e-3],
            }),
            ..increment(0.25)
        }));
        bodies.push(SampleBody::Level(Level {
            channel: "compass".to_owned(),
            value: (90.0 - heading_rad.to_degrees()).rem_euclid(360.0),
            offset_m: [0.0; 3],
            normal: None,
        }));
    }
    stamped(bodies)
}

#[test]
fn levels_that_tell_a_heading_are_listed_as_a_compass() {
    let server = Server::start(&[]);
    let api = server.api();
    let way = batch(1, 0, along_the_wall());
    api.post_samples("default", AGENT, &way).unwrap();
    for number in 0_u32..20 {
        let way = batch(1, 0, straight_on(2.4 * f64::from(number)));
        let name = format!("robot-{number}");
        api.post_samples("default", &name, &way).unwrap();
    }
    let channels = api.channels("default").unwrap();
    let compass = |name: &str| {
        let mut named = channels.iter().filter(|channel| channel.name == name);
        named.next().expect("a channel").compass.clone()
    };
    assert_eq!((compass("roughness"), compass("camera")), (None, None));
    let compass = compass("compass").expect("levels that tell a heading");
    let is_clockwise = (compass.rad_per_unit + 1.0_f64.to_radians()).abs() < 1e-12;
    assert!(is_clockwise, "{compass:?}");
    assert_eq!(compass.agent, None);
    // A level of 90° is a heading of zero, and six degrees are the least that lasts of an error.
    let heading_rad = compass.rad_per_unit * 90.0 - compass.offset_rad;
    assert!(heading_rad.sin().abs() < 0.01 && heading_rad.cos() > 0.0);
    assert!((0.1..0.2).contains(&compass.lasting_sd_rad), "{compass:?}");
}

#[test]
fn a_surprise_is_an_event_and_counted() {
    let server = Server::start(&[]);
    let api = server.api();
    let raw = RawPublisher::connect(&server.endpoint());
    let events = raw
        .session()
        .declare_subscriber(events_key("default"))
        .wait()
        .unwrap();
    // What is asked behind it is answered when the service knows of the subscription.
    let nothing = Codec::Json.encode(&serde_json::json!({}));
    let key = query_key("default", "predict");
    raw.ask(&key, Codec::Json.encoding(), nothing).unwrap_err();
    let mut way = along_the_wall();
    let mut last = way.last().unwrap().stamp_ns;
    let taught = last;
    for body in [
        SampleBody::Level(roughness(-70.0)),
        SampleBody::Descriptor(view(5.0)),
    ] {
        last += 10_000_000;
        way.push(Sample {
            stamp_ns: last,
            body,
        });
    }
    api.post_samples("default", AGENT, &batch(1, 0, way))
        .unwrap();
    let mut surprises = Vec::new();
    while surprises.len() < 2 {
        let heard = events.recv_timeout(LONG).unwrap().expect("two surprises");
        let codec = Codec::of_encoding(&heard.encoding().to_string()).unwrap();
        let event: Event = codec.decode(&heard.payload().to_bytes()).unwrap();
        if let EventKind::PerceptSurprising {
            percept, surprise, ..
        } = event.kind
        {
            surprises.push((event.stamp_ns, percept, surprise));
        }
    }
    assert_eq!(surprises[0].0, taught + 10_000_000);
    assert_eq!(surprises[0].1, PerceptKind::Level);
    assert!(surprises[0].2 > 100.0, "{surprises:?}");
    assert_eq!(surprises[1].0, last);
    assert_eq!(surprises[1].1, PerceptKind::Descriptor);
    // The two views have no axis in common.
    assert!((surprises[1].2 - 1.0).abs() < 1e-6, "{surprises:?}");
    // Every percept that something was known of is in the histograms, expected or not.
    let metrics = server.metrics();
    for name in [
        "cogmap_level_surprise_deviations",
        "cogmap_descriptor_surprise",
    ] {
        let compared = metrics.sum(&format!("{name}_count"), &[]);
        assert!(compared > 80, "{name}: {compared}");
    }
}
