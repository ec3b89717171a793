//! The interface, request by request, over a real engine on a store of its own.

mod cloud;
mod compression;
mod cors;
mod dashboard;
mod events;
mod forgetting;
mod guarding;
mod live;
mod localize;
mod objects;
mod problems;
mod removal;
mod resources;
mod routes;
mod running;
mod samples;
mod told;
mod trajectories;
mod uniform;
mod wayfinding;

use std::sync::{Arc, OnceLock};
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::http::{HeaderMap, Method, Request, StatusCode};
use cogmap_proto::{
    Codec, Increment, Marker, Relation, Sample, SampleBatch, SampleBody, Sighting, SpaceSettings,
    Target,
};
use metrics_exporter_prometheus::PrometheusBuilder;
use serde_json::Value;
use tokio::sync::watch;
use tower::ServiceExt;

use super::*;
use crate::engine::{Engine, EngineSettings, Silent};
use crate::store::LocalStore;

/// A service with the space `lab`, and the store that it lives on.
struct Rig {
    router: Router,
    engine: Engine,
    stop: watch::Sender<bool>,
    _directory: tempfile::TempDir,
}

/// An answer, read to its end.
#[derive(Debug)]
struct Answer {
    status: StatusCode,
    headers: HeaderMap,
    body: Bytes,
}

fn settings() -> HttpSettings {
    crate::config::HttpConfig::default().settings()
}

fn rig() -> Rig {
    rig_with(&settings(), EngineSettings::default())
}

fn rig_with(settings: &HttpSettings, engine: EngineSettings) -> Rig {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let store = LocalStore::open(directory.path()).expect("the store opens");
    let engine = Engine::open(Arc::new(store), engine, Arc::new(Silent)).expect("opens");
    let name = "lab".parse().expect("a name");
    let (space, _) = engine
        .create_space(&name, &SpaceSettings::default())
        .expect("created");
    while space.recovering() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let prometheus = PrometheusBuilder::new().build_recorder().handle();
    let (stop, stopping) = watch::channel(false);
    let router = router(engine.clone(), settings, prometheus, stopping);
    Rig {
        router,
        engine,
        stop,
        _directory: directory,
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.engine.shutdown();
    }
}

impl Rig {
    async fn ask(&self, request: Request<Body>) -> Answer {
        let (method, path) = (request.method().clone(), request.uri().path().to_owned());
        let response = self
            .router
            .clone()
            .oneshot(request)
            .await
            .expect("infallible");
        let (parts, body) = response.into_parts();
        let body = to_bytes(body, usize::MAX)
            .await
            .expect("the body ends well");
        let answer = Answer {
            status: parts.status,
            headers: parts.headers,
            body,
        };
        assert_documented(&method, &path, &answer);
        answer
    }

    async fn get(&self, path: &str) -> Answer {
        self.ask(Request::get(path).body(Body::empty()).expect("a request"))
            .await
    }

    async fn send(
        &self,
        method: Method,
        path: &str,
        media_type: &str,
        body: impl Into<Body>,
    ) -> Answer {
        let request = Request::builder()
            .method(method)
            .uri(path)
            .header("content-type", media_type);
        self.ask(request.body(body.into()).expect("a request"))
            .await
    }

    /// Sends samples as JSON.
    async fn samples(&self, agent: &str, batch: &SampleBatch) -> Answer {
        let path = format!("/v1/spaces/lab/agents/{agent}/samples");
        self.send(
            Method::POST,
            &path,
            "application/json",
            Codec::Json.encode(batch),
        )
        .await
    }
}

impl Answer {
    fn header(&self, name: &str) -> &str {
        self.headers
            .get(name)
            .and_then(|value| value.to_str().ok())
            .unwrap_or_default()
    }

    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("a JSON body")
    }

    fn text(&self) -> &str {
        std::str::from_utf8(&self.body).expect("a text")
    }

    /// The JSON body of an answer that must be a success.
    fn good(&self) -> Value {
        assert!(self.status.is_success(), "{self:?}");
        assert_eq!(self.header("content-type"), "application/json", "{self:?}");
        self.json()
    }

    /// Asserts that this is a problem of a status and a kind, and gives it.
    fn problem(&self, status: u16, kind: &str) -> Value {
        assert_eq!(self.status.as_u16(), status, "{self:?}");
        assert_eq!(
            self.header("content-type"),
            "application/problem+json",
            "{self:?}"
        );
        let problem = self.json();
        assert_eq!(problem["type"], format!("/problems/{kind}"), "{problem}");
        assert_eq!(problem["status"], status);
        assert!(
            problem["title"]
                .as_str()
                .is_some_and(|title| !title.is_empty())
        );
        assert!(
            problem["detail"]
                .as_str()
                .is_some_and(|detail| !detail.is_empty())
        );
        problem
    }
}

/// Asserts that the description knows the status and media type of an answer, if it knows the path.
fn assert_documented(method: &Method, path: &str, answer: &Answer) {
    static OPENAPI: OnceLock<Value> = OnceLock::new();
    let openapi = OPENAPI.get_or_init(|| openapi(true));
    let paths = openapi["paths"].as_object().expect("paths");
    let Some((_, item)) = paths.iter().find(|(template, _)| fits(template, path)) else {
        return;
    };
    let Some(operation) = item.get(method.as_str().to_ascii_lowercase()) else {
        let expected = if method == Method::OPTIONS { 204 } else { 405 };
        assert_eq!(answer.status, expected, "{method} {path}");
        return;
    };
    let response = &operation["responses"][answer.status.as_str()];
    assert!(
        response.is_object(),
        "{method} {path}: {} is not documented",
        answer.status
    );
    let media_type = answer
        .header("content-type")
        .split(';')
        .next()
        .unwrap_or_default();
    let known = if media_type.is_empty() {
        response.get("content").is_none()
    } else {
        response["content"][media_type].is_object()
    };
    assert!(
        known,
        "{method} {path}: {media_type:?} is not documented for {}",
        answer.status
    );
}

fn fits(template: &str, path: &str) -> bool {
    let (template, path) = (template.split('/'), path.split('/'));
    template.clone().count() == path.clone().count()
        && template
            .zip(path)
            .all(|(chunk, given)| (chunk.starts_with('{') && !given.is_empty()) || chunk == given)
}

/// `count` steps of 0.1 m along x, ten a second.
fn steps(session: u64, first_seq: u64, count: u64) -> SampleBatch {
    let step = |seq: u64| Sample {
        stamp_ns: i64::try_from(seq).expect("small") * 100_000_000,
        body: SampleBody::Increment(Increment {
            translation_m: [0.1, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        }),
    };
    SampleBatch {
        session,
        first_seq,
        samples: (first_seq..first_seq + count).map(step).collect(),
    }
}

/// One sample at a time in tenths of a second.
fn at(session: u64, seq: u64, body: SampleBody) -> SampleBatch {
    let stamp_ns = i64::try_from(seq).expect("small") * 100_000_000;
    SampleBatch {
        session,
        first_seq: seq,
        samples: vec![Sample { stamp_ns, body }],
    }
}

fn post_ahead(label: &str) -> SampleBody {
    SampleBody::Sighting(Sighting {
        target: Target::Landmark(label.to_owned()),
        relation: Relation::Position {
            translation_m: [2.0, 0.0, 0.0],
            sd_m: [0.1; 3],
        },
    })
}

fn end_of_trip() -> SampleBody {
    SampleBody::Marker(Marker {
        label: "dock".to_owned(),
        ends_trip: true,
    })
}
