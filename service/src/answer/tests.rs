//! Answers about a small map: one agent that drove ten metres along x, saw a post, and felt and saw
//! something where it stopped.

use cogmap_proto::{ExpectedPercept, Increment, MotionBody, PerceptCue, PredictQuery, RecallQuery};
use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, Label, Level, Motion, PlaceId, Record, Relation,
    RelativePosition, Sample, SampleBody, Settings, Sighting, Target, TripId,
};

use super::*;
use crate::decode::InvalidChannel;
use crate::encode::{grid_state, landmark, place, trip_detail};

fn label(text: &str) -> Label {
    Label::new(text).expect("a label")
}

fn map() -> CognitiveMap {
    let mut map = CognitiveMap::new(Settings::default());
    let mut events = Vec::new();
    let agent = AgentId(0);
    map.apply(
        &Record::Enrol {
            agent,
            name: label("rover"),
        },
        &mut events,
    );
    let felt = [
        SampleBody::Level(Level::new(label("touch"), 3.0, [0.0; 3], None).expect("a level")),
        SampleBody::Level(Level::new(label("touch"), 5.0, [0.0; 3], None).expect("a level")),
        SampleBody::Descriptor(Descriptor::new(label("camera"), &[1.0; 16]).expect("a direction")),
    ];
    for seq in 0..105 {
        let percept = usize::try_from(seq).expect("small").checked_sub(102);
        let body = if let Some(percept) = percept {
            felt[percept].clone()
        } else if seq == 101 {
            SampleBody::Sighting(Sighting {
                target: Target::Landmark(label("post")),
                relation: Relation::Position(
                    RelativePosition::new([2.0, 1.0, 0.0], [0.1; 3]).expect("a position"),
                ),
            })
        } else {
            let step = if seq == 0 { 0.0 } else { 0.1 };
            let motion = Motion::from_increment([step, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], None);
            SampleBody::Motion(motion.expect("a motion"))
        };
        let stamp_ns = 100_000_000 * i64::try_from(seq).expect("small");
        let sample = Sample { stamp_ns, body };
        map.apply(
            &Record::Sample {
                agent,
                session: 1,
                seq,
                sample,
            },
            &mut events,
        );
    }
    map
}

#[test]
fn a_place_is_told_with_its_position_code_and_founder() {
    let map = map();
    let id = PlaceId(1);
    let told = place(
        &map,
        id,
        map.place(id).expect("ten metres hold many places"),
    );
    assert_eq!((told.id, told.founder.as_str()), (1, "rover"));
    assert!(
        told.translation_m[0] > 0.2 && told.translation_m[1].abs() < 1e-9,
        "{told:?}"
    );
    let [x, y, z, w] = told.rotation_xyzw;
    assert!(
        x.abs() + y.abs() + z.abs() < 1e-12 && (w - 1.0).abs() < 1e-12,
        "{told:?}"
    );
    assert_eq!(told.code.len(), 6);
    assert!(
        told.code
            .iter()
            .flatten()
            .all(|turn| (0.0..1.0).contains(turn))
    );
    assert!(told.visits >= 1);
}

#[test]
fn a_trip_leads_from_place_to_place() {
    let map = map();
    let detail = trip_detail(
        &map,
        TripId(0),
        map.trip(TripId(0)).expect("the agent moved"),
    );
    assert_eq!(detail.trip.agent, "rover");
    assert_eq!(detail.trip.leg_count, detail.legs.len() as u64);
    assert!(detail.trip.ended.is_none());
    for pair in detail.legs.windows(2) {
        assert_eq!(pair[0].to, pair[1].from);
    }
    let first = detail.legs.first().expect("a leg");
    assert!(first.translation_m[0] > 0.0 && first.length_m >= first.translation_m[0] - 1e-9);
    assert_eq!(first.phase_displacement.len(), 6);
    assert!((1..=8).contains(&first.octant));
}

#[test]
fn the_grid_state_decodes_to_where_the_agent_is() {
    let map = map();
    let state = grid_state(&map, map.agent(AgentId(0)).expect("enrolled")).expect("has moved");
    assert!(
        (state.decoded_m[0] - 10.0).abs() < 1e-6,
        "{:?}",
        state.decoded_m
    );
    assert!(
        (state.interference_m[0] - 10.0).abs() < 0.5,
        "{:?}",
        state.interference_m
    );
    assert_eq!(state.modules.len(), 6);
    assert!((state.displacement_m - 0.1).abs() < 1e-9);
    assert!(state.heading_rad.abs() < 1e-9);
    let finest = &state.modules[0];
    assert_eq!(finest.activation.len(), 27);
    assert!(finest.activation.iter().all(|a| (0.0..=1.0).contains(a)));
}

#[test]
fn a_landmark_stands_where_it_was_seen() {
    let map = map();
    let (_, post) = map.landmark_by_label("post").expect("it was seen");
    let told = landmark(post);
    assert_eq!((told.id.as_str(), told.sightings), ("post", 1));
    assert!(
        (told.translation_m[0] - 12.0).abs() < 0.2,
        "{:?}",
        told.translation_m
    );
    assert!(
        (told.translation_m[1] - 1.0).abs() < 0.2,
        "{:?}",
        told.translation_m
    );
    let [xx, _, _, yy, _, zz] = told.covariance;
    assert!(xx > 0.0 && yy > 0.0 && zz > 0.0);
}

#[test]
fn recall_by_position_ranks_by_distance_and_keeps_within_the_radius() {
    let map = map();
    let query = RecallQuery {
        position_m: Some([5.0, 0.0, 0.0]),
        radius_m: Some(1.0),
        agent: Some("rover".to_owned()),
        limit: Some(3),
        ..RecallQuery::default()
    };
    let answer = recall("lab", &map, &query).expect("a legal query");
    assert_eq!(
        (answer.space.as_str(), answer.frame.as_str()),
        ("lab", "map")
    );
    assert_eq!(answer.map_revision, map.revision());
    assert!(!answer.places.is_empty() && answer.places.len() <= 3);
    let distances: Vec<_> = answer
        .places
        .iter()
        .filter_map(|found| found.distance_m)
        .collect();
    assert_eq!(distances.len(), answer.places.len());
    assert!(distances.is_sorted() && distances.iter().all(|distance| *distance <= 1.0));
}

#[test]
fn recall_by_a_place_s_own_code_finds_the_place() {
    let map = map();
    let told = place(&map, PlaceId(3), map.place(PlaceId(3)).expect("there"));
    let mut code: Vec<_> = told.code.iter().copied().map(Some).collect();
    code[4] = None;
    let query = RecallQuery {
        code: Some(code),
        limit: Some(1),
        ..RecallQuery::default()
    };
    let answer = recall("lab", &map, &query).expect("a legal query");
    assert_eq!(answer.places[0].place.id, 3);
    assert!(answer.places[0].cosine.expect("there is a cue") > 0.99);
}

#[test]
fn a_stranger_is_unknown() {
    let query = RecallQuery {
        agent: Some("nobody".to_owned()),
        ..RecallQuery::default()
    };
    let refused = recall("lab", &map(), &query).expect_err("nobody is called so");
    assert_eq!(refused, InvalidQuery::UnknownAgent("nobody".to_owned()));
}

#[test]
fn a_channel_that_nobody_has_felt_is_unknown() {
    let map = map();
    let asked = |percept| {
        let query = RecallQuery {
            percept: Some(percept),
            ..RecallQuery::default()
        };
        recall("lab", &map, &query).expect_err("no such channel")
    };
    let refused = asked(level_cue("smell", 1.0));
    assert!(matches!(
        refused,
        InvalidQuery::Channel(InvalidChannel::Unknown { .. })
    ));
    let detail = refused.to_string();
    assert!(
        detail.contains("\"smell\"") && detail.contains("touch, camera"),
        "{detail}"
    );
    // A level is asked for where descriptors are felt.
    let refused = asked(level_cue("camera", 1.0));
    assert!(matches!(
        refused,
        InvalidQuery::Channel(InvalidChannel::OtherKind { .. })
    ));
    assert!(
        refused.to_string().contains("descriptors of 16 numbers"),
        "{refused}"
    );
    // A name that no channel can have.
    let refused = asked(level_cue("my nose", 1.0));
    assert!(matches!(
        refused,
        InvalidQuery::Channel(InvalidChannel::Name(..))
    ));
    let query = PredictQuery {
        channel: Some("smell".to_owned()),
        ..question(0.0)
    };
    let refused = predict("lab", &map, AgentId(0), &query).expect_err("no such channel");
    assert!(matches!(
        refused,
        InvalidPrediction::Channel(InvalidChannel::Unknown { .. })
    ));
}

#[test]
fn without_a_cue_at_most_ten_places_come() {
    let answer = recall("lab", &map(), &RecallQuery::default()).expect("a legal query");
    assert_eq!(answer.places.len(), 10);
    assert!(answer.places.iter().all(|found| found.cosine.is_none()));
}

#[test]
fn senseless_queries_are_refused_by_the_rule_that_they_break() {
    let map = map();
    let legal = RecallQuery {
        position_m: Some([0.0; 3]),
        ..RecallQuery::default()
    };
    let code = |phases: &[Option<[f64; 3]>]| RecallQuery {
        code: Some(phases.to_vec()),
        ..RecallQuery::default()
    };
    let cases = [
        (
            RecallQuery {
                position_m: Some([f64::NAN, 0.0, 0.0]),
                ..legal.clone()
            },
            "position_m",
        ),
        (
            RecallQuery {
                position_m: Some([0.0, -1e9, 0.0]),
                ..legal.clone()
            },
            "position_m",
        ),
        (
            RecallQuery {
                radius_m: Some(-0.1),
                ..legal.clone()
            },
            "radius_m",
        ),
        (
            RecallQuery {
                radius_m: Some(f64::NAN),
                ..legal.clone()
            },
            "radius_m",
        ),
        (
            RecallQuery {
                radius_m: Some(1.0),
                ..RecallQuery::default()
            },
            "centre",
        ),
        (
            RecallQuery {
                limit: Some(0),
                ..legal.clone()
            },
            "limit",
        ),
        (
            RecallQuery {
                limit: Some(1001),
                ..legal.clone()
            },
            "limit",
        ),
        (
            RecallQuery {
                agent: Some("a b".to_owned()),
                ..legal.clone()
            },
            "agent",
        ),
        (code(&[Some([1.0, 0.0, 0.0]); 6]), "phases"),
        (code(&[Some([0.0, -0.1, 0.0]); 6]), "phases"),
        (code(&[Some([0.5; 3]); 4]), "4 modules"),
        (code(&[None; 6]), "no module"),
    ];
    for (query, part) in cases {
        let error = recall("lab", &map, &query)
            .expect_err("must be refused")
            .to_string();
        assert!(error.contains(part), "{query:?}: {error}");
    }
}

fn level_cue(channel: &str, value: f64) -> PerceptCue {
    PerceptCue::Level(cogmap_proto::Level {
        channel: channel.to_owned(),
        value,
        offset_m: [0.0; 3],
        normal: None,
    })
}

#[test]
fn a_percept_recalls_the_place_where_it_was_felt() {
    let map = map();
    let descriptor = PerceptCue::Descriptor(cogmap_proto::Descriptor {
        channel: "camera".to_owned(),
        vector: vec![2.0; 16],
    });
    for percept in [level_cue("touch", 4.0), descriptor] {
        let query = RecallQuery {
            percept: Some(percept),
            ..RecallQuery::default()
        };
        let answer = recall("lab", &map, &query).expect("a legal query");
        let [found] = &answer.places[..] else {
            panic!("one place has felt something: {answer:?}");
        };
        assert!((found.place.translation_m[0] - 10.0).abs() < 0.25);
        assert!(found.percept_match.expect("there is a percept") > 0.0);
        assert_eq!((found.cosine, found.distance_m), (None, None));
    }
}

#[test]
fn percepts_that_make_no_sense_are_refused() {
    let short = PerceptCue::Descriptor(cogmap_proto::Descriptor {
        channel: "camera".to_owned(),
        vector: vec![1.0; 7],
    });
    for percept in [level_cue("", 1.0), level_cue("touch", f64::NAN), short] {
        let query = RecallQuery {
            percept: Some(percept),
            ..RecallQuery::default()
        };
        let refused = recall("lab", &map(), &query).expect_err("no percept");
        assert!(matches!(refused, InvalidQuery::Percept(..)), "{refused}");
    }
}

fn question(ahead_m: f64) -> PredictQuery {
    PredictQuery {
        agent: None,
        motion: MotionBody::Increment(Increment {
            translation_m: [ahead_m, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        }),
        offset_m: [0.0; 3],
        channel: None,
    }
}

#[test]
fn what_was_felt_here_is_expected_here() {
    let map = map();
    let answer = predict("lab", &map, AgentId(0), &question(0.0)).expect("a legal query");
    assert_eq!(
        (
            answer.space.as_str(),
            answer.agent.as_str(),
            answer.frame.as_str()
        ),
        ("lab", "rover", "map")
    );
    assert!((answer.translation_m[0] - 10.0).abs() < 1e-9);
    let [touch, camera] = &answer.percepts[..] else {
        panic!("two channels: {answer:?}");
    };
    assert_eq!(
        (touch.channel.as_str(), camera.channel.as_str()),
        ("touch", "camera")
    );
    let ExpectedPercept::Level { mean, sd } = touch.expected else {
        panic!("a level: {touch:?}");
    };
    assert!((mean - 4.0).abs() < 1e-12 && (sd - 1.0).abs() < 1e-12);
    assert_eq!((touch.percepts, camera.percepts), (2, 1));
    assert_eq!(
        (Some(touch.place), touch.confidence),
        (answer.place, answer.confidence)
    );
    let ExpectedPercept::Descriptor { vector } = &camera.expected else {
        panic!("a descriptor: {camera:?}");
    };
    assert!(vector.iter().all(|x| (x - 0.25).abs() < 1e-6), "{vector:?}");

    let query = PredictQuery {
        channel: Some("camera".to_owned()),
        ..question(0.0)
    };
    let answer = predict("lab", &map, AgentId(0), &query).expect("a legal query");
    assert_eq!(&answer.percepts, std::slice::from_ref(camera));
    let nowhere = predict("lab", &map, AgentId(0), &question(5.0)).expect("a legal query");
    assert_eq!(
        (nowhere.place, nowhere.confidence, nowhere.percepts.len()),
        (None, 0.0, 0)
    );
}

#[test]
fn predictions_that_make_no_sense_are_refused() {
    let mut map = map();
    let refused = |map: &CognitiveMap, agent, query: &PredictQuery| {
        predict("lab", map, AgentId(agent), query).expect_err("no sense")
    };
    let infinite = refused(&map, 0, &question(f64::INFINITY));
    assert!(
        matches!(infinite, InvalidPrediction::Motion(..)),
        "{infinite}"
    );
    let mut query = question(0.0);
    query.offset_m[1] = f64::NAN;
    let offset = refused(&map, 0, &query);
    assert!(matches!(offset, InvalidPrediction::Offset(_)), "{offset}");
    query = question(0.0);
    query.channel = Some(String::new());
    let unnamed = refused(&map, 0, &query);
    assert!(
        matches!(unnamed, InvalidPrediction::Channel(_)),
        "{unnamed}"
    );

    let (agent, name) = (AgentId(1), label("late"));
    map.apply(&Record::Enrol { agent, name }, &mut Vec::new());
    assert_eq!(
        refused(&map, 1, &question(0.0)),
        InvalidPrediction::NotPlaced
    );
}
