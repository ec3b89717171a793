//! Objects: taught at once or by touch, asked for, recognised, forgotten.

use cogmap_proto::{
    Contact, ContactLevel, IdentifyQuery, Level, ObjectLesson, ObjectMark, Orientation, TouchNoise,
};
use serde_json::json;

use super::*;

const JSON: &str = "application/json";
/// Levels along two rods whose places are 2 cm apart.
const FORK: [f64; 8] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
const KNIFE: [f64; 8] = [1.0, 3.0, 2.0, 7.0, 4.0, 8.0, 6.0, 5.0];
const PITCH_M: f64 = 0.02;

fn noise() -> TouchNoise {
    TouchNoise {
        position_sd_m: 0.001,
        normal_sd_rad: 0.02,
        level_sd: 0.2,
    }
}

/// Contacts at some places of a rod, from an origin `offset_m` along it.
fn contacts(rod: &[f64; 8], places: &[u8], offset_m: f64) -> Vec<Contact> {
    let contact = |&place: &u8| Contact {
        position_m: [f64::from(place) * PITCH_M - offset_m, 0.5, -0.5],
        levels: vec![ContactLevel {
            channel: "touch".to_owned(),
            value: rod[usize::from(place)],
        }],
        ..Contact::default()
    };
    places.iter().map(contact).collect()
}

fn lesson(rod: &[f64; 8]) -> Vec<u8> {
    Codec::Json.encode(&ObjectLesson {
        spacing_m: 0.01,
        noise: noise(),
        contacts: contacts(rod, &[0, 1, 2, 3, 4, 5, 6, 7], 0.0),
    })
}

/// A rig that knows both rods.
async fn taught() -> Rig {
    let rig = rig();
    for (name, rod) in [("fork", &FORK), ("knife", &KNIFE)] {
        let path = format!("/v1/spaces/lab/objects/{name}");
        let summary = rig.send(Method::PUT, &path, JSON, lesson(rod)).await.good();
        assert_eq!(
            (&summary["name"], &summary["places"]),
            (&name.into(), &8.into())
        );
    }
    rig
}

#[tokio::test]
async fn objects_are_taught_listed_shown_and_forgotten() {
    let rig = taught().await;
    let page = rig.get("/v1/spaces/lab/objects?limit=1").await.good();
    assert_eq!(
        (&page["objects"][0]["name"], &page["next"]),
        (&"fork".into(), &"fork".into())
    );
    let page = rig.get("/v1/spaces/lab/objects?after=fork").await.good();
    assert_eq!(page["objects"].as_array().map(Vec::len), Some(1));
    let knife = rig.get("/v1/spaces/lab/objects/knife").await.good();
    assert_eq!(knife["summary"]["contacts"], 8);
    let place = &knife["places"][3];
    assert_eq!(
        place["levels"][0],
        json!({"channel": "touch", "mean": 7.0, "sd": 0.2})
    );
    // Taught anew in place of what was known.
    let path = "/v1/spaces/lab/objects/knife";
    let compared = format!("{path}?alike=true");
    let summary = rig
        .send(Method::PUT, &compared, JSON, lesson(&FORK))
        .await
        .good();
    assert_eq!(
        (&summary["visits"], &summary["places"]),
        (&1.into(), &8.into())
    );
    // Nobody could tell it from the other one now.
    assert_eq!(summary["alike"]["name"], "fork");
    assert_eq!(knife["summary"]["alike"], json!(null));
    let gap_m = knife["summary"]["gap_m"].as_f64().expect("a number");
    assert!((gap_m - PITCH_M).abs() < 1e-9, "{gap_m}");
    let gone = Request::delete(path)
        .body(Body::empty())
        .expect("a request");
    assert_eq!(rig.ask(gone).await.status, 204);
    rig.get(path).await.problem(404, "unknown-memory");
    let again = Request::delete(path)
        .body(Body::empty())
        .expect("a request");
    rig.ask(again).await.problem(404, "unknown-memory");
}

#[tokio::test]
async fn contacts_tell_the_object_and_its_pose() {
    let rig = taught().await;
    let query = |contacts| {
        Codec::Json.encode(&IdentifyQuery {
            orientation: Orientation::Known {},
            noise: noise(),
            contacts,
        })
    };
    let path = "/v1/spaces/lab/objects/identify";
    let told = contacts(&KNIFE, &[2, 3, 1, 4, 5, 6, 7, 0], 7.0);
    let answer = rig.send(Method::POST, path, JSON, query(told)).await.good();
    assert_eq!(answer["verdict"], json!({"object": {"name": "knife"}}));
    let x = answer["pose"]["translation_m"][0]
        .as_f64()
        .expect("a number");
    assert!((x - 7.0).abs() < 0.005, "{x}");
    assert_eq!(answer["explored"], 1.0);
    assert_eq!(answer["rival"]["name"], "fork");
    let said = answer["rival"]["contacts_nats"].as_array().expect("a list");
    assert_eq!(said.len(), 8);
    // Nothing is known after one contact whose level both have.
    let told = contacts(&KNIFE, &[0], 0.0);
    let answer = rig.send(Method::POST, path, JSON, query(told)).await.good();
    assert_eq!(answer["verdict"], json!({"undecided": {}}));
    rig.send(Method::POST, path, JSON, query(Vec::new()))
        .await
        .problem(422, "invalid-query");
    let mut wrong = contacts(&KNIFE, &[0, 1], 0.0);
    wrong[1].normal = Some([2.0, 0.0, 0.0]);
    let refused = rig.send(Method::POST, path, JSON, query(wrong)).await;
    let problem = refused.problem(422, "invalid-query");
    assert!(
        problem["detail"]
            .as_str()
            .is_some_and(|text| text.starts_with("contacts[1].normal [2.0"))
    );
    // What may be turned anyhow is told by the normals.
    let free = Codec::Json.encode(&IdentifyQuery {
        orientation: Orientation::Free {},
        noise: noise(),
        contacts: contacts(&KNIFE, &[0, 1], 0.0),
    });
    let refused = rig.send(Method::POST, path, JSON, free).await;
    assert_eq!(
        refused.problem(422, "invalid-query")["detail"],
        "contacts[0].normal: a free orientation needs the normal of every contact"
    );
}

#[tokio::test]
async fn fields_of_contacts_are_refused_with_their_limits() {
    let rig = taught().await;
    let path = "/v1/spaces/lab/objects/identify";
    let with = |key: &str, value: Value| {
        let contacts = json!([{ "position_m": [0, 0, 0] }]);
        let mut query = json!({ "orientation": { "known": {} }, "contacts": contacts });
        query[key] = value;
        serde_json::to_vec(&query).expect("JSON")
    };
    let label = |key: &str, own: Value| json!([{ "position_m": [0, 0, 0], key: [own] }]);
    let level = label("levels", json!({ "channel": "a b", "value": 1.0 }));
    let view = label("descriptors", json!({ "channel": "a", "vector": [0.0] }));
    let levels = [1.0, 2.0].map(|value| json!({ "channel": "a", "value": value }));
    let twice = json!([{ "position_m": [0, 0, 0], "levels": levels }]);
    for (body, told) in [
        (
            with("orientation", json!({ "finite": { "rotations_xyzw": [] } })),
            "orientation: must have 1 to 1000 rotations",
        ),
        (with("contacts", level), "a channel must be a name: 1 to"),
        (
            with("contacts", json!([{ "position_m": [0, 2e6, 0] }])),
            "contacts[0].position_m [0.0, 2000000.0, 0.0]: must be finite, and at most 1e6",
        ),
        (with("contacts", view), "contacts[0].descriptors ["),
        (
            with("contacts", twice),
            "contacts[0].levels: \"a\" is there more than once",
        ),
    ] {
        let refused = rig.send(Method::POST, path, JSON, body).await;
        let problem = refused.problem(422, "invalid-query");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(detail.contains(told), "{detail}");
    }
}

/// A step along the rod.
fn step(way_m: f64) -> SampleBody {
    SampleBody::Increment(Increment {
        translation_m: [way_m, 0.0, 0.0],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        noise: None,
    })
}

/// What is felt.
fn feel(value: f64) -> SampleBody {
    SampleBody::Level(Level {
        channel: "touch".to_owned(),
        value,
        offset_m: [0.0; 3],
        normal: None,
    })
}

/// The mark that begins a lesson.
fn learn(name: &str) -> SampleBody {
    SampleBody::Object(ObjectMark::Learn {
        name: Some(name.to_owned()),
        spacing_m: 0.01,
        orientation: Orientation::Known {},
        noise: noise(),
    })
}

/// Where an episode's contacts are along the rod, and their levels.
fn contacts_told(status: &Value) -> Vec<(f64, f64)> {
    let number = |of: &Value| of.as_f64().expect("a number");
    let contact = |contact: &Value| {
        let at = number(&contact["position_m"][0]);
        (at, number(&contact["levels"][0]["value"]))
    };
    let told = status["contacts"].as_array().expect("a list");
    told.iter().map(contact).collect()
}

#[tokio::test]
async fn an_agent_learns_and_recognises_by_touch() {
    let rig = rig();
    let mut seq = 0;
    let mut next = |body| {
        seq += 1;
        at(1, seq - 1, body)
    };
    for (name, rod) in [("fork", FORK), ("knife", KNIFE)] {
        rig.samples("arm", &next(learn(name))).await.good();
        for value in rod {
            rig.samples("arm", &next(feel(value))).await.good();
            rig.samples("arm", &next(step(PITCH_M))).await.good();
        }
        let status = rig.get("/v1/spaces/lab/agents/arm/object").await.good();
        assert_eq!(status["episode"], "learn");
        let end = SampleBody::Object(ObjectMark::End {});
        rig.samples("arm", &next(end)).await.good();
    }
    let identify = ObjectMark::Identify {
        orientation: Orientation::Known {},
        noise: noise(),
    };
    rig.samples("arm", &next(SampleBody::Object(identify)))
        .await
        .good();
    for value in KNIFE.into_iter().rev() {
        rig.samples("arm", &next(feel(value))).await.good();
        rig.samples("arm", &next(step(-PITCH_M))).await.good();
    }
    let status = rig.get("/v1/spaces/lab/agents/arm/object").await.good();
    assert_eq!(status["episode"], "identify");
    let told = &status["identification"];
    let knife = json!({"object": {"name": "knife"}});
    assert_eq!(told["verdict"], knife, "{told}");
    assert_eq!(told["contacts"], 8);
    // Where the body was, counted from where the episode began.
    let felt = contacts_told(&status);
    for (i, (at, level)) in felt.iter().enumerate() {
        assert!((at + i as f64 * PITCH_M).abs() < 1e-9, "{felt:?}");
        assert!((level - KNIFE[7 - i]).abs() < 1e-9, "{felt:?}");
    }
    assert_eq!(felt.len(), 8);
    let end = SampleBody::Object(ObjectMark::End {});
    rig.samples("arm", &next(end)).await.good();
    let status = rig.get("/v1/spaces/lab/agents/arm/object").await.good();
    assert_eq!(
        (&status["episode"], &status["identification"]),
        (&Value::Null, &Value::Null)
    );
    assert_eq!(status["contacts"], json!([]));
    let last = &status["last"];
    assert_eq!(
        (&last["episode"], &last["session"]),
        (&"identify".into(), &1.into())
    );
    let said = &last["identification"];
    assert_eq!(said["verdict"], told["verdict"], "{said}");
    assert_eq!(said["contacts"], 8);
    let objects = rig.get("/v1/spaces/lab/objects").await.good();
    assert_eq!(objects["objects"].as_array().map(Vec::len), Some(2));
}
