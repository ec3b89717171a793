//! What the map says of a drive whose every pose is known: a circle in closed form, with a landmark
//! at its centre.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::mpsc::channel;
use std::thread;

use cogmap_proto::{
    Event, EventKind, Marker, Place, RecallQuery, Relation, Sample, SampleBody, Sighting,
    SpaceInfo, Target, TripDetail, TripEnd,
};
use cogmap_tests::{Server, batch, circle, eventually};

const AGENT: &str = "ada";
const RADIUS_M: f64 = 1.0;
const STEPS: u32 = 400;
const SESSION: u64 = 7;
/// Rounding of some hundred steps, and of JSON's fifteen digits.
const EXACT_M: f64 = 1e-9;

/// A service on which the circle has been driven, with what was driven and the events that it sent.
struct Driven {
    server: Server,
    samples: Vec<Sample>,
    positions: Vec<[f64; 3]>,
    events: Vec<Event>,
}

impl Driven {
    fn new() -> Self {
        let (mut samples, positions) = circle(RADIUS_M, STEPS);
        let last = samples.last().unwrap().stamp_ns;
        let sighting = SampleBody::Sighting(Sighting {
            target: Target::Landmark("the centre".to_owned()),
            relation: Relation::Position {
                translation_m: [0.0, RADIUS_M, 0.0],
                sd_m: [0.01; 3],
            },
        });
        // Seen at the very start, when the pose is exactly known.
        let stamp_ns = samples[0].stamp_ns;
        samples.insert(
            1,
            Sample {
                stamp_ns,
                body: sighting,
            },
        );
        let marker = SampleBody::Marker(Marker {
            label: "round".to_owned(),
            ends_trip: true,
        });
        samples.push(Sample {
            stamp_ns: last,
            body: marker,
        });

        let mut server = Server::start(&[]);
        let (http, (opened, open)) = (server.http(), channel());
        let stream = thread::spawn(move || {
            let mut events = Vec::new();
            let opened = || opened.send(()).unwrap();
            http.follow("/v1/spaces/default/events", opened, |event| {
                events.push(serde_json::from_value::<Event>(event).unwrap());
            })
            .unwrap();
            events
        });
        open.recv().unwrap();
        let batch = batch(SESSION, 0, samples.clone());
        server.api().post_samples("default", AGENT, &batch).unwrap();
        // The stream ends with the service, and then it has told everything.
        server.terminate();
        let events = stream.join().unwrap();
        server.run();
        Self {
            server,
            samples,
            positions,
            events,
        }
    }

    fn info(&self) -> SpaceInfo {
        self.server.api().space("default").unwrap()
    }
}

fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square = |axis: usize| (a[axis] - b[axis]).powi(2);
    (square(0) + square(1) + square(2)).sqrt()
}

/// Distance of a position from the circle that was driven.
fn off_circle_m([x, y, z]: [f64; 3]) -> f64 {
    (x.hypot(y - RADIUS_M) - RADIUS_M).hypot(z)
}

#[test]
fn trajectories_in_both_forms_are_what_was_driven() {
    let driven = Driven::new();
    let trajectory = driven.server.api().trajectory("default", AGENT).unwrap();
    assert_eq!(
        (trajectory.session, &*trajectory.frame, &*trajectory.kind),
        (SESSION, "map", "causal")
    );
    assert_eq!(trajectory.poses.len(), driven.positions.len());
    for (index, (pose, position)) in trajectory.poses.iter().zip(&driven.positions).enumerate() {
        let error_m = distance_m(pose.translation_m, *position);
        assert!(error_m < EXACT_M, "pose {index}: {error_m} m off");
        let half = TAU * index as f64 / f64::from(STEPS) / 2.0;
        let [x, y, z, w] = pose.rotation_xyzw;
        // Either sign of a quaternion is the same turn.
        let alike = (z * half.sin() + w * half.cos()).abs();
        assert!(
            (alike - 1.0).abs() < EXACT_M && x.hypot(y) < EXACT_M,
            "pose {index}"
        );
    }
    let http = driven.server.http();
    let path = "/v1/spaces/default/agents/ada/trajectory?format=tum&limit=1000";
    let tum = http.get(path);
    assert!(tum.content_type.starts_with("text/plain"), "{tum:?}");
    assert_eq!(tum.body.lines().count(), trajectory.poses.len());
    for (line, pose) in tum.body.lines().zip(&trajectory.poses) {
        let (stamp, numbers) = line.split_once(' ').unwrap();
        let stamp_ns: i64 = stamp.replace('.', "").parse().unwrap();
        assert_eq!(stamp_ns, pose.stamp_ns);
        let numbers: Vec<f64> = numbers
            .split(' ')
            .map(|number| number.parse().unwrap())
            .collect();
        assert_eq!(
            (&numbers[..3], &numbers[3..]),
            (&pose.translation_m[..], &pose.rotation_xyzw[..])
        );
    }
    let export = http.get("/v1/spaces/default/export?format=tum&agent=ada");
    assert_eq!(export.body, tum.body);
    // A page from the middle, and its end.
    let (from_ns, to_ns) = (
        trajectory.poses[100].stamp_ns,
        trajectory.poses[110].stamp_ns,
    );
    let path = format!("/v1/spaces/default/agents/ada/trajectory?from_ns={from_ns}&to_ns={to_ns}");
    let part = http.get(&path).json(200);
    assert_eq!(
        part["poses"],
        serde_json::to_value(&trajectory.poses[100..110]).unwrap()
    );
}

#[test]
fn places_and_recall_agree_with_the_way() {
    let driven = Driven::new();
    let api = driven.server.api();
    let places = api.places("default").unwrap();
    assert_eq!(places.len() as u64, driven.info().places);
    assert!(places.len() > 10, "{} places", places.len());
    for (number, place) in (0..).zip(&places) {
        assert_eq!((place.id, &*place.founder), (number, AGENT));
        assert!(off_circle_m(place.translation_m) < EXACT_M, "{place:?}");
        let path = format!("/v1/spaces/default/places/{number}");
        let alone: Place =
            serde_json::from_value(driven.server.http().get(&path).json(200)).unwrap();
        assert_eq!(alone, *place);
    }
    // A place is recruited where no place answers with one half, that is, farther than a field's
    // radius from every other: none closer, and no gap wider than two radii.
    let radius_m = driven.info().settings.field_radius_m;
    for (earlier, later) in places.iter().zip(&places[1..]) {
        let apart_m = distance_m(earlier.translation_m, later.translation_m);
        assert!(apart_m > radius_m && apart_m < 2.0 * radius_m, "{apart_m}");
    }
    for place in &places {
        let by_position = RecallQuery {
            position_m: Some(place.translation_m),
            limit: Some(3),
            ..RecallQuery::default()
        };
        let by_code = RecallQuery {
            code: Some(place.code.iter().copied().map(Some).collect()),
            limit: Some(1),
            ..RecallQuery::default()
        };
        let answer = api.recall("default", &by_position).unwrap();
        assert_eq!(
            (answer.frame.as_str(), answer.places[0].place.id),
            ("map", place.id)
        );
        assert!(answer.places[0].confidence.unwrap() > 1.0 - EXACT_M);
        assert!(answer.places[0].distance_m.unwrap() < EXACT_M);
        let confidences: Vec<_> = answer.places.iter().map(|place| place.confidence).collect();
        assert!(confidences.is_sorted_by(|a, b| a >= b), "{confidences:?}");
        let answer = api.recall("default", &by_code).unwrap();
        assert_eq!(answer.places[0].place.id, place.id);
    }
    let elsewhere = RecallQuery {
        agent: Some("nobody".to_owned()),
        ..RecallQuery::default()
    };
    let unknown = api.recall("default", &elsewhere).unwrap_err().to_string();
    assert!(
        unknown.contains("\"nobody\"") && unknown.contains("404"),
        "{unknown}"
    );
    // The agent stands where it began, and says at which place.
    let estimate = api.agent("default", AGENT).unwrap().estimate.unwrap();
    assert_eq!(estimate.seq + 1, driven.samples.len() as u64);
    assert!(distance_m(estimate.translation_m, [0.0; 3]) < EXACT_M);
    assert_eq!(estimate.place, Some(0));
    // Places are asked now and then on the way, so this is the confidence of a moment ago.
    assert!(estimate.confidence > 0.95, "{}", estimate.confidence);
}

#[test]
fn a_second_round_knows_the_places_of_the_first() {
    let driven = Driven::new();
    let (api, before) = (driven.server.api(), driven.info());
    let (mut samples, _) = circle(RADIUS_M, STEPS);
    let later_ns = 20_000_000_000;
    for sample in &mut samples {
        sample.stamp_ns += later_ns;
    }
    // Another robot, on the same way.
    let batch = batch(SESSION, 0, samples);
    api.post_samples("default", "bea", &batch).unwrap();
    let after = driven.info();
    assert_eq!((after.agents, after.places), (2, before.places));
    let places = api.places("default").unwrap();
    assert!(
        places
            .iter()
            .all(|place| place.founder == AGENT && place.visits >= 2),
        "{places:?}"
    );
}

#[test]
fn trips_landmarks_and_the_grid_agree_with_the_way() {
    let driven = Driven::new();
    let api = driven.server.api();
    let trips = api.trips("default").unwrap();
    assert_eq!(trips.len(), 1);
    let TripDetail { trip, legs } = api.trip("default", 0).unwrap();
    assert_eq!(trip, trips[0]);
    assert_eq!(
        (&*trip.agent, trip.session, trip.ended),
        (AGENT, SESSION, Some(TripEnd::Marker))
    );
    assert_eq!(trip.leg_count, legs.len() as u64);
    assert!(
        legs.iter()
            .zip(&legs[1..])
            .all(|(leg, next)| leg.to == next.from)
    );
    assert_eq!(legs[0].from, 0);
    // Once around, but for the part of a leg that the marker cut off.
    // The path is that of the samples, a polygon.
    let around_m = 2.0 * RADIUS_M * f64::from(STEPS) * (TAU / 2.0 / f64::from(STEPS)).sin();
    assert!(trip.length_m <= around_m + EXACT_M && trip.length_m > 0.85 * around_m);
    let lengths_m: f64 = legs.iter().map(|leg| leg.length_m).sum();
    assert!((lengths_m - trip.length_m).abs() < EXACT_M);

    let landmarks = api.landmarks("default").unwrap();
    assert_eq!(
        (landmarks.len(), &*landmarks[0].id, landmarks[0].sightings),
        (1, "the centre", 1)
    );
    assert!(distance_m(landmarks[0].translation_m, [0.0, RADIUS_M, 0.0]) < 1e-6);

    let grid = api.grid("default", AGENT).unwrap();
    let settings = driven.info().settings;
    assert_eq!(grid.modules.len(), settings.grid_modules as usize);
    assert!(
        distance_m(grid.decoded_m, [0.0; 3]) < 1e-6,
        "{:?}",
        grid.decoded_m
    );
    let wrapped = (grid.heading_rad / TAU).fract();
    assert!(
        wrapped.abs() < EXACT_M || wrapped.abs() > 1.0 - EXACT_M,
        "{}",
        grid.heading_rad
    );
    for (module, step) in grid.modules.iter().zip(0..) {
        // At the origin each of the eight centres is half a cell's diagonal away: √3/2 spacings, or
        // 3√3 times a sixth.
        assert!((module.octant_activation - (-13.5_f64).exp()).abs() < 1e-9);
        let spacing_m = settings.grid_spacing_m * settings.grid_ratio.powi(step);
        assert!((module.spacing_m - spacing_m).abs() < EXACT_M);
        assert!(module.phase.iter().all(|turn| (0.0..1.0).contains(turn)));
        assert!(
            module
                .activation
                .iter()
                .all(|rate| (0.0..=1.0).contains(rate))
        );
    }
    let detail = api.agent("default", AGENT).unwrap();
    assert!((detail.travelled_m - around_m).abs() < EXACT_M);
}

#[test]
fn events_and_export_tell_what_the_lists_tell() {
    let driven = Driven::new();
    let api = driven.server.api();
    let places = api.places("default").unwrap();
    let recruited: Vec<_> = driven
        .events
        .iter()
        .filter_map(|event| match &event.kind {
            EventKind::PlaceRecruited {
                place,
                translation_m,
            } => Some((*place, *translation_m)),
            _ => None,
        })
        .collect();
    let listed: Vec<_> = places
        .iter()
        .map(|place| (place.id, place.translation_m))
        .collect();
    assert_eq!(recruited, listed);
    let names: BTreeSet<_> = driven
        .events
        .iter()
        .map(|event| {
            assert_eq!((&*event.space, &*event.agent), ("default", AGENT));
            let kind = serde_json::to_value(&event.kind).unwrap();
            kind.as_object().unwrap().keys().next().unwrap().clone()
        })
        .collect();
    for kind in [
        "agent_enrolled",
        "landmark_learned",
        "marker_passed",
        "session_started",
        "trip_ended",
        "trip_started",
    ] {
        assert!(names.contains(kind), "{kind} is not among {names:?}");
    }
    let export = driven
        .server
        .http()
        .get("/v1/spaces/default/export")
        .json(200);
    assert_eq!(
        export["space"],
        serde_json::to_value(driven.info()).unwrap()
    );
    assert_eq!(export["places"], serde_json::to_value(&places).unwrap());
    let landmarks = api.landmarks("default").unwrap();
    assert_eq!(
        export["landmarks"],
        serde_json::to_value(landmarks).unwrap()
    );
    let trip = api.trip("default", 0).unwrap();
    assert_eq!(export["trips"], serde_json::to_value([trip]).unwrap());
    let mut agents = api.agents("default").unwrap();
    for agent in &mut agents {
        agent.heard_ago_s = None; // that is of the moment
    }
    assert_eq!(export["agents"], serde_json::to_value(agents).unwrap());
    let cloud = driven
        .server
        .http()
        .get("/v1/spaces/default/export?format=ply");
    assert!(cloud.body.starts_with("ply\n"), "{}", cloud.body);
    assert!(
        cloud
            .body
            .contains(&format!("element vertex {}\n", places.len()))
    );
}

#[test]
fn only_the_events_of_the_agent_that_was_asked_for_come() {
    let driven = Driven::new();
    let mut server = driven.server;
    // An agent that is not there yet is unknown, to whoever wants to follow it, too.
    let first = batch(1, 0, driven.samples[..1].to_vec());
    server
        .api()
        .post_samples("default", "cleo", &first)
        .unwrap();
    let (http, (opened, open)) = (server.http(), channel());
    let stream = thread::spawn(move || {
        let mut agents = BTreeSet::new();
        let path = "/v1/spaces/default/events?agent=cleo";
        let opened = || opened.send(()).unwrap();
        http.follow(path, opened, |event| {
            agents.insert(event["agent"].as_str().unwrap().to_owned());
        })
        .unwrap();
        agents
    });
    open.recv().unwrap();
    for agent in ["bea", "cleo"] {
        let batch = batch(1, 0, circle(2.0, 100).0);
        server.api().post_samples("default", agent, &batch).unwrap();
    }
    eventually("both robots", || {
        let agents = server.api().space("default").unwrap().agents;
        (agents == 3).then_some(()).ok_or(agents.to_string())
    });
    server.terminate();
    let agents: Vec<_> = stream.join().unwrap().into_iter().collect();
    assert_eq!(agents, ["cleo"]);
}
