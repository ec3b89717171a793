//! What would be felt after a motion.

use cogmap_proto::ExpectedPercept;

use super::*;

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
