//! Live streams: what ticks tell, and how they begin, fall behind and end.

use axum::body::BodyDataStream;
use axum::http::Response;
use cogmap_proto::{LiveTick, ObjectMark, Orientation, StartPose, TouchNoise};
use futures_util::StreamExt;

use super::*;

const LIVE: &str = "/v1/spaces/lab/live";

/// A live stream, as its reader has it.
struct Watch {
    body: BodyDataStream,
    text: String,
}

impl Rig {
    async fn open(&self, query: &str) -> Response<Body> {
        let request = Request::get(format!("{LIVE}?{query}"));
        let request = request.body(Body::empty()).expect("a request");
        let response = self.router.clone().oneshot(request).await;
        response.expect("infallible")
    }

    async fn watch(&self, query: &str) -> Watch {
        let response = self.open(query).await;
        assert_eq!(response.status(), 200);
        let kind = response.headers()["content-type"].to_str().expect("text");
        assert_eq!(kind, "text/event-stream");
        Watch {
            body: response.into_body().into_data_stream(),
            text: String::new(),
        }
    }
}

impl Watch {
    /// The next server-sent event: its name and data; nothing at the end of the stream.
    async fn event(&mut self) -> Option<(String, Value)> {
        loop {
            if let Some((event, rest)) = self.text.split_once("\n\n") {
                let field = |name: &str| {
                    let mut lines = event.lines();
                    lines.find_map(|line| Some(line.strip_prefix(name)?.to_owned()))
                };
                let found = field("event: ").zip(field("data: "));
                self.text = rest.to_owned();
                if let Some((name, data)) = found {
                    return Some((name, serde_json::from_str(&data).expect("JSON")));
                }
                continue; // a comment
            }
            let chunk = tokio::time::timeout(Duration::from_secs(20), self.body.next()).await;
            let chunk = chunk.expect("a live stream is never silent")?;
            let chunk = chunk.expect("readable");
            self.text
                .push_str(std::str::from_utf8(&chunk).expect("a text"));
        }
    }

    async fn tick(&mut self) -> LiveTick {
        loop {
            let (name, data) = self.event().await.expect("the stream goes on");
            if name == "tick" {
                return serde_json::from_value(data).expect("a tick");
            }
            assert_eq!(name, "lagged");
        }
    }

    /// The first tick that fulfils a condition.
    async fn tick_where(&mut self, condition: impl Fn(&LiveTick) -> bool) -> LiveTick {
        for _ in 0..1000 {
            let tick = self.tick().await;
            if condition(&tick) {
                return tick;
            }
        }
        panic!("no such tick came");
    }
}

fn names(tick: &LiveTick) -> Vec<&str> {
    tick.agents
        .iter()
        .map(|agent| agent.name.as_str())
        .collect()
}

#[tokio::test]
async fn the_first_tick_has_all_agents_and_later_ones_those_that_changed() {
    let rig = rig();
    for agent in ["rover", "other"] {
        rig.samples(agent, &steps(1, 0, 60)).await.good();
    }
    let mut watch = rig.watch("rate_hz=60").await;
    let first = watch.tick().await;
    assert_eq!(names(&first), ["other", "rover"]);
    assert!(
        first.events.is_empty() && first.missed.is_none(),
        "{first:?}"
    );
    assert_eq!((first.counts.agents, first.health.samples_per_s), (2, None));
    assert!(first.counts.places > 0 && first.map_revision >= 120);
    assert!(
        first
            .health
            .resident_bytes
            .is_some_and(|bytes| bytes > 1 << 20)
    );
    // It says the same as the agent itself.
    let detail = rig.get("/v1/spaces/lab/agents/rover").await.good();
    let shown = serde_json::to_value(&first.agents[1]).expect("plain data");
    for field in [
        "session",
        "seq",
        "stamp_ns",
        "status",
        "frame",
        "translation_m",
        "rotation_xyzw",
        "place",
        "confidence",
    ] {
        assert_eq!(shown[field], detail["estimate"][field], "{field}");
    }
    let covariance = &detail["estimate"]["covariance"];
    for (at, of_all) in [0, 1, 2, 6, 7, 11].into_iter().enumerate() {
        assert_eq!(shown["position_covariance_m2"][at], covariance[of_all]);
    }
    let sd_rad = first.agents[1].rotation_sd_rad[2];
    assert!((sd_rad * sd_rad - covariance[20].as_f64().expect("a number")).abs() < 1e-15);
    // What does not change is not told again.
    let quiet = watch.tick_where(|tick| tick.agents.is_empty()).await;
    assert!(quiet.events.is_empty() && quiet.removed.is_empty() && quiet.sightings.is_empty());
    rig.samples("rover", &at(1, 60, end_of_trip())).await.good();
    let moved = watch.tick_where(|tick| !tick.events.is_empty()).await;
    assert!(!names(&moved).contains(&"other"), "{moved:?}");
    assert!(
        moved
            .events
            .iter()
            .all(|event| event.event.agent == "rover")
    );
    // Who is gone is told once.
    let path = "/v1/spaces/lab/agents/other";
    rig.send(Method::DELETE, path, "application/json", Body::empty())
        .await;
    let gone = watch.tick_where(|tick| !tick.removed.is_empty()).await;
    assert_eq!(gone.removed, ["other"]);
    let later = watch.tick_where(|tick| tick.counts.agents == 1).await;
    assert!(later.removed.is_empty(), "told once");
}

#[tokio::test]
async fn sightings_are_shown_as_lines_in_the_map() {
    let rig = rig();
    let facing_left = SampleBody::StartPose(StartPose {
        translation_m: [1.0, 2.0, 0.0],
        rotation_xyzw: [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()],
        noise: None,
    });
    rig.samples("rover", &at(1, 0, facing_left)).await.good();
    let mut watch = rig.watch("rate_hz=60").await;
    watch.tick().await;
    rig.samples("rover", &at(1, 1, post_ahead("post")))
        .await
        .good();
    let bearing = SampleBody::Sighting(Sighting {
        target: Target::Agent("other".into()),
        relation: Relation::RangeBearing {
            range_m: 3.0,
            azimuth_rad: std::f64::consts::FRAC_PI_2,
            elevation_rad: 0.0,
            range_sd_m: 0.1,
            bearing_sd_rad: 0.1,
        },
    });
    rig.samples("rover", &at(1, 2, bearing)).await.good();
    let mut seen = Vec::new();
    while seen.len() < 2 {
        seen.extend(watch.tick().await.sightings);
    }
    let near = |at: [f64; 3], x: f64, y: f64| {
        assert!(
            (at[0] - x).abs() + (at[1] - y).abs() + at[2].abs() < 1e-6,
            "{at:?}"
        );
    };
    assert_eq!((&*seen[0].agent, seen[0].stamp_ns), ("rover", 100_000_000));
    assert_eq!(seen[0].target, Target::Landmark("post".into()));
    near(seen[0].from_m, 1.0, 2.0);
    near(seen[0].to_m, 1.0, 4.0);
    assert_eq!(seen[1].target, Target::Agent("other".into()));
    near(seen[1].to_m, -2.0, 2.0);
    let counts = watch.tick_where(|tick| tick.counts.landmarks == 1).await;
    assert!(counts.sightings.is_empty(), "each is shown once");
}

#[tokio::test]
async fn an_episode_with_an_object_shows_its_contacts() {
    let rig = rig();
    let level = |value: f64| {
        SampleBody::Level(cogmap_proto::Level {
            channel: "texture".into(),
            value,
            offset_m: [0.0; 3],
            normal: None,
        })
    };
    rig.samples("arm", &steps(1, 0, 1)).await.good();
    let mut watch = rig.watch("rate_hz=60").await;
    assert_eq!(watch.tick().await.agents[0].contacts, None);
    let learn = SampleBody::Object(ObjectMark::Learn {
        name: Some("cup".into()),
        spacing_m: 0.01,
        orientation: Orientation::Known {},
        noise: TouchNoise::default(),
    });
    rig.samples("arm", &at(1, 1, learn)).await.good();
    rig.samples("arm", &at(1, 2, level(0.3))).await.good();
    rig.samples("arm", &at(1, 3, level(0.7))).await.good();
    let contacts = |tick: &LiveTick| tick.agents.first().and_then(|arm| arm.contacts);
    watch.tick_where(|tick| contacts(tick) == Some(2)).await;
    let end = SampleBody::Object(ObjectMark::End {});
    rig.samples("arm", &at(1, 4, end)).await.good();
    let learned = watch
        .tick_where(|tick| !tick.agents.is_empty() && contacts(tick).is_none())
        .await;
    assert_eq!(learned.counts.objects, 1);
}

#[tokio::test]
async fn a_slow_reader_is_told_so_and_gets_all_that_changed_in_one_tick() {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 10)).await.good();
    let mut watch = rig.watch("rate_hz=50").await;
    watch.tick().await;
    for first in [10, 20, 30] {
        rig.samples("rover", &steps(1, first, 10)).await.good();
    }
    rig.samples("other", &steps(1, 0, 10)).await.good();
    // Nobody reads for at least five periods of 20 ms.
    tokio::time::sleep(Duration::from_millis(130)).await;
    // What was made before may still come.
    let (name, data) = loop {
        let event = watch.event().await.expect("the stream goes on");
        if event.0 == "lagged" {
            break event;
        }
    };
    assert_eq!(name, "lagged");
    assert!(data["ticks"].as_u64().is_some_and(|ticks| ticks >= 4));
    let tick = watch.tick().await;
    assert_eq!(names(&tick), ["other", "rover"]);
    assert_eq!(tick.agents[1].seq, 39);
    let rate = tick.health.samples_per_s.expect("not the first");
    assert!(rate > 0.0, "{tick:?}");
}

#[tokio::test]
async fn totals_are_those_of_the_space() {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 10)).await.good();
    rig.samples("rover", &steps(1, 5, 5)).await.good();
    let mut nonsense = steps(1, 10, 3);
    nonsense.samples[1].stamp_ns = 0;
    rig.samples("rover", &nonsense).await.good();
    let stale = rig.samples("rover", &steps(0, 0, 1)).await;
    assert_eq!(stale.status, 409, "{stale:?}");
    let mut watch = rig.watch("").await;
    let health = watch.tick().await.health;
    assert_eq!(
        (
            health.dropped_messages,
            health.skipped_samples,
            health.duplicate_samples
        ),
        (1, 1, 5),
        "{health:?}"
    );
}

#[tokio::test]
async fn rates_out_of_range_are_refused_and_streams_are_bounded() {
    let mut settings = settings();
    settings.streams_max = 2;
    let rig = rig_with(&settings, EngineSettings::default());
    for wrong in ["0", "0.09", "61", "-1", "NaN", "inf"] {
        let path = format!("{LIVE}?rate_hz={wrong}");
        rig.get(&path).await.problem(422, "invalid-query");
    }
    let path = format!("{LIVE}?rate_hz=fast");
    assert_eq!(rig.get(&path).await.status, 400);
    let unknown = rig.get("/v1/spaces/none/live").await;
    unknown.problem(404, "unknown-space");
    let (first, _second) = (rig.watch("rate_hz=0.1").await, rig.watch("").await);
    rig.get(LIVE).await.problem(503, "busy");
    drop(first);
    rig.watch("").await.tick().await;
}

#[tokio::test]
async fn a_stream_ends_with_its_space_and_with_the_service() {
    let rig = rig();
    // The next tick is ten seconds away; the end does not wait for it.
    let mut watch = rig.watch("rate_hz=0.1").await;
    watch.tick().await;
    let deleted = rig
        .send(
            Method::DELETE,
            "/v1/spaces/lab",
            "application/json",
            Body::empty(),
        )
        .await;
    assert!(deleted.status.is_success(), "{deleted:?}");
    let end = tokio::time::timeout(Duration::from_secs(5), watch.event()).await;
    assert_eq!(end.expect("it ends at once"), None);
    let name = "hall".parse().expect("a name");
    rig.engine
        .create_space(&name, &SpaceSettings::default())
        .expect("created");
    let request = Request::get("/v1/spaces/hall/live?rate_hz=0.1");
    let request = request.body(Body::empty()).expect("a request");
    let response = rig.router.clone().oneshot(request).await;
    let mut watch = Watch {
        body: response.expect("infallible").into_body().into_data_stream(),
        text: String::new(),
    };
    watch.tick().await;
    rig.stop.send_replace(true);
    let end = tokio::time::timeout(Duration::from_secs(5), watch.event()).await;
    assert_eq!(end.expect("it ends at once"), None);
}
