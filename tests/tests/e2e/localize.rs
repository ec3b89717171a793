//! Where samples were taken that belong to no agent: over HTTP and Zenoh, in every codec.

use cogmap_proto::{
    Codec, Descriptor, Increment, Localization, LocalizeQuery, MotionNoise, Problem, Relation,
    Sample, SampleBody, Sighting, StartPose, Status, Target, query_key,
};
use cogmap_tests::{RawPublisher, Server, batch};

/// Where posts stand \[m\].
const POSTS_M: [[f64; 3]; 4] = [
    [0.0, 3.0, 0.5],
    [4.0, -2.0, 1.0],
    [8.0, 2.5, 0.0],
    [2.0, 1.0, 2.0],
];
const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
const STEP_M: f64 = 0.1;

/// So many steps along x from here, with all posts in view after each.
fn walk(from_m: [f64; 3], steps: u32) -> Vec<Sample> {
    let mut bodies = Vec::new();
    for step in 1..=steps {
        bodies.push(SampleBody::Increment(Increment {
            translation_m: [STEP_M, 0.0, 0.0],
            rotation_xyzw: NO_TURN,
            noise: None,
        }));
        let here_m = [from_m[0] + STEP_M * f64::from(step), from_m[1], from_m[2]];
        let posts = (0..).zip(POSTS_M).map(|(number, post_m): (u8, _)| {
            let ahead = [0, 1, 2].map(|axis: usize| post_m[axis] - here_m[axis]);
            SampleBody::Sighting(Sighting {
                target: Target::Landmark(format!("post {number}")),
                relation: Relation::Position {
                    translation_m: ahead,
                    sd_m: [0.02; 3],
                },
            })
        });
        bodies.extend(posts);
    }
    stamped(bodies)
}

/// Ten milliseconds apart.
fn stamped(bodies: Vec<SampleBody>) -> Vec<Sample> {
    let stamps_ns = (1_800_000_000_000_000_000_i64..).step_by(10_000_000);
    stamps_ns
        .zip(bodies)
        .map(|(stamp_ns, body)| Sample { stamp_ns, body })
        .collect()
}

/// What is seen from here: 64 waves across the room, some metres long.
fn view(at_m: [f64; 2]) -> SampleBody {
    let wave = |number: u32| {
        // Directions and phases that look random.
        let random = |salt: f64| (f64::from(number) * 12.9898 + salt).sin() * 43_758.545;
        let (bearing, phase) = (random(1.0), random(2.0));
        let per_m = 1.0 + 0.5 * random(3.0).sin();
        let along_m = at_m[0] * bearing.cos() + at_m[1] * bearing.sin();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a view has single precision"
        )]
        let seen = (per_m * along_m + phase).cos() as f32;
        seen
    };
    SampleBody::Descriptor(Descriptor {
        channel: "eye".to_owned(),
        vector: (0..64).map(wave).collect(),
    })
}

/// Steps from a pose of which each goes ahead and then turns, with a view after each; and where
/// they lead.
fn stroll(mut at_m: [f64; 2], mut heading: f64, turns: &[f64]) -> (Vec<SampleBody>, [f64; 2]) {
    let mut bodies = Vec::new();
    for turn in turns {
        bodies.push(SampleBody::Increment(Increment {
            translation_m: [STEP_M, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, (0.5 * turn).sin(), (0.5 * turn).cos()],
            noise: Some(MotionNoise {
                translation_sd_m: [0.0005; 3],
                rotation_sd_rad: [0.0002; 3],
            }),
        }));
        at_m[0] += STEP_M * heading.cos();
        at_m[1] += STEP_M * heading.sin();
        heading += turn;
        bodies.push(view(at_m));
    }
    (bodies, at_m)
}

fn pose_m(found: &Localization) -> [f64; 3] {
    found.pose.as_ref().unwrap().translation_m
}

#[test]
fn samples_are_found_in_the_map_over_http_and_zenoh_alike() {
    let server = Server::start(&[]);
    let (api, raw) = (server.api(), RawPublisher::connect(&server.endpoint()));
    let mut samples = walk([0.0; 3], 60);
    let start = SampleBody::StartPose(StartPose {
        translation_m: [0.0; 3],
        rotation_xyzw: NO_TURN,
        noise: None,
    });
    let stamp_ns = samples[0].stamp_ns;
    samples.insert(
        0,
        Sample {
            stamp_ns,
            body: start.clone(),
        },
    );
    api.post_samples("default", "ada", &batch(1, 0, samples))
        .unwrap();
    let before = api.space("default").unwrap();

    let query = LocalizeQuery {
        samples: walk([3.0, -1.0, 0.0], 5),
    };
    let found = api.localize("default", &query).unwrap();
    assert_eq!(found.status, Status::Localized, "{found:?}");
    let [x, y, z] = pose_m(&found);
    let off_m = ((x - 3.5).powi(2) + (y + 1.0).powi(2) + z.powi(2)).sqrt();
    assert!(off_m < 0.1, "{found:?}");

    let key = query_key("default", "localize");
    for codec in [Codec::Postcard, Codec::Cbor, Codec::Json] {
        let ask = |query: &LocalizeQuery| raw.ask(&key, codec.encoding(), codec.encode(query));
        let answer: Localization = codec.decode(&ask(&query).unwrap()).unwrap();
        // The last digit of a JSON number may change as it is read.
        for (told, over_http) in pose_m(&answer).into_iter().zip(pose_m(&found)) {
            assert!((told - over_http).abs() < 1e-9, "{answer:?} in {codec:?}");
        }
        assert_eq!(
            (answer.status, answer.found_after, answer.map_revision),
            (found.status, found.found_after, found.map_revision)
        );
        let senseless = LocalizeQuery {
            samples: vec![Sample {
                stamp_ns,
                body: start.clone(),
            }],
        };
        let problem: Problem = codec.decode(&ask(&senseless).unwrap_err()).unwrap();
        assert_eq!(
            (problem.kind.as_str(), problem.status),
            ("/problems/invalid-query", 422)
        );
    }
    // Nothing was learned from the questions.
    assert_eq!(api.space("default").unwrap(), before);
}

#[test]
fn views_alone_tell_over_http_where_samples_were_taken() {
    let server = Server::start(&[]);
    let api = server.api();
    // Up and down through the room, in rows that are 0.4 m apart.
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut turns = Vec::new();
    for row in 0..14 {
        let way = if row % 2 == 0 { quarter } else { -quarter };
        turns.extend([0.0; 50]);
        turns.extend([way, 0.0, 0.0, 0.0, way]);
    }
    let start = SampleBody::StartPose(StartPose {
        translation_m: [0.0; 3],
        rotation_xyzw: NO_TURN,
        noise: None,
    });
    let mut bodies = vec![start];
    bodies.extend(stroll([0.0; 2], 0.0, &turns).0);
    api.post_samples("default", "ada", &batch(1, 0, stamped(bodies)))
        .unwrap();

    let (bodies, end_m) = stroll([1.7, 1.1], 0.6, &[0.03; 30]);
    let samples = stamped(bodies);
    let found = api.localize("default", &LocalizeQuery { samples }).unwrap();
    assert_eq!(found.status, Status::Localized, "{found:?}");
    let [x, y, _] = pose_m(&found);
    let off_m = (x - end_m[0]).hypot(y - end_m[1]);
    assert!(off_m < 0.2, "{off_m} m: {found:?}");

    // From elsewhere, where nobody has been.
    let (bodies, _) = stroll([40.0, -30.0], 0.6, &[0.03; 30]);
    let samples = stamped(bodies);
    let lost = api.localize("default", &LocalizeQuery { samples }).unwrap();
    assert!(
        lost.status != Status::Localized && lost.pose.is_none(),
        "{lost:?}"
    );
}
