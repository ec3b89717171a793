//! Sequences and the past: what comes next by the trips, and where an agent was, over HTTP and
//! Zenoh alike, and the same after a restart.

use cogmap_proto::{
    Codec, FeltAnswer, FeltQuery, Increment, Level, Looked, Marker, PerceptCue, Problem, Sample,
    SampleBody, SequenceAnswer, SequenceElement, SequenceQuery, StartPose, query_key,
};
use cogmap_tests::{RawPublisher, Server, batch};

const AGENT: &str = "ada";
const START_NS: i64 = 1_800_000_000_000_000_000;
const STEP_NS: i64 = 100_000_000;
const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Four trips ahead by eight places: three of them then go to the left, one to the right. At each
/// place a level of its own is felt.
fn forks() -> Vec<Sample> {
    let mut bodies = Vec::new();
    let go = |x_m: f64, y_m: f64| {
        SampleBody::Increment(Increment {
            translation_m: [x_m, y_m, 0.0],
            rotation_xyzw: UPRIGHT,
            noise: None,
        })
    };
    for side in [1.0, 1.0, -1.0, 1.0] {
        bodies.push(SampleBody::StartPose(StartPose {
            translation_m: [0.0; 3],
            rotation_xyzw: UPRIGHT,
            noise: None,
        }));
        for place in 0..8 {
            bodies.push(go(1.0, 0.0));
            bodies.push(SampleBody::Level(level(f64::from(place))));
        }
        bodies.extend((0..8).map(|_| go(0.0, side)));
        bodies.push(SampleBody::Marker(Marker {
            label: "done".to_owned(),
            ends_trip: true,
        }));
    }
    let stamps = (START_NS..).step_by(usize::try_from(STEP_NS).unwrap());
    let stamped = stamps.zip(bodies);
    stamped
        .map(|(stamp_ns, body)| Sample { stamp_ns, body })
        .collect()
}

fn level(value: f64) -> Level {
    Level {
        channel: "touch".to_owned(),
        value,
        offset_m: [0.0; 3],
        normal: None,
    }
}

fn query(cue: Vec<SequenceElement>) -> SequenceQuery {
    SequenceQuery {
        cue,
        error_rate: None,
        none_prior: None,
        limit: None,
    }
}

fn sum(answer: &SequenceAnswer) -> f64 {
    let next = answer.next.iter().map(|next| next.probability);
    next.sum::<f64>() + answer.others + answer.none
}

#[test]
fn what_comes_next_is_told_on_every_door_and_after_a_restart() {
    let mut server = Server::start(&[]);
    let api = server.api();
    api.post_samples("default", AGENT, &batch(1, 0, forks()))
        .unwrap();
    let trips = api.trips("default").unwrap();
    assert_eq!(trips.len(), 4);
    let legs = |trip: u64| api.trip("default", trip).unwrap().legs;
    let (left, right) = (legs(trips[0].id), legs(trips[2].id));
    let fork = (0..).zip(&left).zip(&right);
    let mut fork = fork.filter(|((_, a), b)| a.to != b.to);
    let ((at, to_left), to_right) = fork.next().unwrap();

    let stem = left[at - 3..at].iter().map(|leg| leg.to);
    let places = query(stem.map(SequenceElement::Place).collect());
    let answer = api.sequence("default", &places).unwrap();
    assert!((sum(&answer) - 1.0).abs() < 1e-9, "{answer:?}");
    let next: Vec<_> = answer.next.iter().take(2).collect();
    assert_eq!((next[0].place, next[1].place), (to_left.to, to_right.to));
    assert!((next[0].probability - 0.75).abs() < 0.05, "{answer:?}");
    assert!((next[1].probability - 0.25).abs() < 0.05, "{answer:?}");
    assert_eq!(answer.trips.len(), 4);
    assert!(answer.trips.iter().all(|found| found.agent == AGENT));
    assert_eq!(answer.trips[0].leg, at as u64);

    let felt = [2.0, 3.0, 4.0].map(|value| PerceptCue::Level(level(value)));
    let percepts = query(felt.into_iter().map(SequenceElement::Percept).collect());
    let recalled = api.sequence("default", &percepts).unwrap();
    assert!((sum(&recalled) - 1.0).abs() < 1e-9);
    assert_eq!(recalled.next[0].place, left[4].to, "{recalled:?}");

    let raw = RawPublisher::connect(&server.endpoint());
    let key = query_key("default", "sequence");
    for codec in [Codec::Json, Codec::Cbor, Codec::Postcard] {
        let bytes = raw.ask(&key, codec.encoding(), codec.encode(&places));
        let heard: SequenceAnswer = codec.decode(&bytes.unwrap()).unwrap();
        assert_eq!(heard, answer);
    }
    let unknown = query(vec![SequenceElement::Place(9_999)]);
    let problem = raw.ask(&key, Codec::Json.encoding(), Codec::Json.encode(&unknown));
    let problem: Problem = Codec::Json.decode(&problem.unwrap_err()).unwrap();
    assert_eq!(
        (problem.status, &*problem.kind),
        (404, "/problems/unknown-memory")
    );

    server.kill();
    server.run();
    assert_eq!(server.api().sequence("default", &places).unwrap(), answer);
}

#[test]
fn a_sequence_that_makes_no_sense_is_refused() {
    let server = Server::start(&[]);
    let api = server.api();
    api.post_samples("default", AGENT, &batch(1, 0, forks()))
        .unwrap();
    let place = || vec![SequenceElement::Place(0)];
    let wrong = [
        query(Vec::new()),
        query(vec![SequenceElement::Place(0); 65]),
        SequenceQuery {
            error_rate: Some(0.9),
            ..query(place())
        },
        SequenceQuery {
            none_prior: Some(1.0),
            ..query(place())
        },
        SequenceQuery {
            limit: Some(0),
            ..query(place())
        },
    ];
    for query in wrong {
        let refused = api.sequence("default", &query).unwrap_err().to_string();
        assert!(refused.contains("422"), "{refused}");
    }
    let path = "/v1/spaces/default/sequence";
    for body in [
        r#"{"cue":[{"place":0}],"more":1}"#,
        r#"{"cue":[{"plaice":0}]}"#,
        "{}",
    ] {
        let answer = server
            .http()
            .post(path, "application/json", body.as_bytes());
        answer.problem(400, "malformed-body");
    }
    let unknown = PerceptCue::Level(Level {
        channel: "smell".to_owned(),
        ..level(1.0)
    });
    let refused = api.sequence("default", &query(vec![SequenceElement::Percept(unknown)]));
    assert!(refused.unwrap_err().to_string().contains("404"));
}

#[test]
fn where_an_agent_was_is_told_between_its_samples() {
    let mut server = Server::start(&[]);
    let api = server.api();
    let ahead = |i: i64| Sample {
        stamp_ns: START_NS + i * STEP_NS,
        body: SampleBody::Increment(Increment {
            translation_m: [0.1, 0.0, 0.0],
            rotation_xyzw: UPRIGHT,
            noise: None,
        }),
    };
    // More than a chunk of a trajectory.
    let samples: Vec<_> = (0..700).map(ahead).collect();
    for (part, samples) in (0..).zip(samples.chunks(350)) {
        let batch = batch(1, part * 350, samples.to_vec());
        api.post_samples("default", AGENT, &batch).unwrap();
    }
    let check = |server: &Server| {
        let api = server.api();
        // At the first stamp the refined trajectory is where the agent set out.
        for i in [1, 2, 255, 256, 511, 690, 698] {
            let half = START_NS + i * STEP_NS + STEP_NS / 2;
            let at = api.agent_at("default", AGENT, half).unwrap();
            let expected = 0.1 * (i as f64 + 1.5);
            assert!((at.translation_m[0] - expected).abs() < 1e-6, "{i}: {at:?}");
            assert_eq!(at.after_ns - at.before_ns, STEP_NS);
            assert_eq!((&*at.trajectory, at.map_revision), ("causal", None));
            let exact = api.agent_at("default", AGENT, half - STEP_NS / 2).unwrap();
            assert_eq!(
                (exact.before_ns, exact.after_ns),
                (exact.stamp_ns, exact.stamp_ns)
            );
            let refined = api.refined_agent_at("default", AGENT, half).unwrap();
            assert_eq!((&*refined.trajectory, refined.stamp_ns), ("refined", half));
            assert!(
                (refined.translation_m[0] - expected).abs() < 1e-3,
                "{refined:?}"
            );
        }
    };
    check(&server);
    let path = |rest: &str| format!("/v1/spaces/default/agents/{AGENT}/at?{rest}");
    let last_ns = START_NS + 699 * STEP_NS;
    for stamp_ns in [START_NS - 1, last_ns + 1] {
        for trajectory in ["causal", "refined"] {
            let asked = path(&format!("stamp_ns={stamp_ns}&trajectory={trajectory}"));
            let problem = server.http().get(&asked);
            let problem = problem.problem(422, "stamp-out-of-range");
            let detail = problem["detail"].as_str().unwrap();
            let range = format!("{START_NS} to {last_ns}");
            assert!(detail.contains(&range), "{detail}");
        }
    }
    let (first, session) = (START_NS, "session=7");
    let other = path(&format!("stamp_ns={first}&{session}"));
    let problem = server.http().get(&other);
    problem.problem(422, "stamp-out-of-range");
    let both = path(&format!("stamp_ns={first}&{session}&trajectory=refined"));
    let problem = server.http().get(&both);
    problem.problem(422, "invalid-query");
    for unreadable in ["stamp_ns=soon", "", "stamp_ns=1&trajectory=real"] {
        let problem = server.http().get(&path(unreadable));
        problem.problem(400, "invalid-parameter");
    }
    let nobody = format!("/v1/spaces/default/agents/nobody/at?stamp_ns={first}");
    server.http().get(&nobody).problem(404, "unknown-agent");

    server.kill();
    server.run();
    check(&server);
}

#[test]
fn that_nobody_looked_is_told_from_that_nothing_was_felt() {
    let mut server = Server::start(&[]);
    let api = server.api();
    let samples = forks();
    let last_ns = samples.last().unwrap().stamp_ns;
    api.post_samples("default", AGENT, &batch(1, 0, samples))
        .unwrap();
    let near = |position_m: [f64; 3], since_ns: i64| FeltQuery {
        position_m,
        radius_m: None,
        since_ns: Some(since_ns),
        channels: Some(vec!["touch".to_owned()]),
        limit: None,
    };
    // At 3 m it felt 2 each of four times; to the left, and to the right, nothing.
    let questions = [
        (near([3.0, 0.0, 0.0], START_NS), Looked::Felt),
        (near([8.0, 4.0, 0.0], START_NS), Looked::NothingFelt),
        (near([3.0, 0.0, 0.0], last_ns), Looked::Never),
        (near([50.0, 0.0, 0.0], START_NS), Looked::Never),
    ];
    let answers = questions.each_ref().map(|(query, looked)| {
        let answer = api.felt("default", query).unwrap();
        assert_eq!(answer.looked, *looked, "{query:?}");
        answer
    });
    let percept = &answers[0].places[0].percepts[0];
    assert_eq!((percept.percepts, percept.mean), (4, Some(2.0)));
    assert_eq!(answers[0].last_felt_ns, Some(percept.last_stamp_ns));
    assert!(answers[2].last_seen_ns.unwrap() < last_ns && answers[3].near == 0);

    let raw = RawPublisher::connect(&server.endpoint());
    let key = query_key("default", "felt");
    for codec in [Codec::Json, Codec::Cbor, Codec::Postcard] {
        let bytes = raw.ask(&key, codec.encoding(), codec.encode(&questions[0].0));
        let heard: FeltAnswer = codec.decode(&bytes.unwrap()).unwrap();
        assert_eq!(heard, answers[0]);
    }
    let path = "/v1/spaces/default/felt";
    for (body, status, kind) in [
        (r#"{"position_m":[0,0]}"#, 400, "malformed-body"),
        (r#"{"position_m":[0,0,1e300]}"#, 422, "invalid-query"),
        (
            r#"{"position_m":[0,0,0],"radius_m":-1}"#,
            422,
            "invalid-query",
        ),
        (
            r#"{"position_m":[0,0,0],"channels":[]}"#,
            422,
            "invalid-query",
        ),
        (
            r#"{"position_m":[0,0,0],"channels":["smell"]}"#,
            404,
            "unknown-channel",
        ),
    ] {
        let answer = server
            .http()
            .post(path, "application/json", body.as_bytes());
        answer.problem(status, kind);
    }
    server.kill();
    server.run();
    let again = server.api().felt("default", &questions[0].0).unwrap();
    assert_eq!(again, answers[0]);
}
