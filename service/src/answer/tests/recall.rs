//! Places by position, code and percept.

use cogmap_proto::{PerceptCue, RecallQuery};
use cognitive_map::PlaceId;

use super::*;
use crate::decode::InvalidChannel;

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
#[expect(clippy::too_many_lines, reason = "a table: a row for each rule")]
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
