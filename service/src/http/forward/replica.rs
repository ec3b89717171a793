//! Answers about spaces of other nodes, by what this node follows of them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderName, HeaderValue, Method, Response, Uri};
use axum::middleware::Next;

use super::super::problem::{Kind, Problem};
use super::super::state::Shared;
use crate::engine::Space;

/// The parameter that lets a replica answer: how old what it knows may be \[ms\].
const MAX_AGE: &str = "max_age_ms";
/// The header of an answer by a replica: how old it may be \[ms\].
const AGE: HeaderName = HeaderName::from_static("cogmap-age-ms");
/// The header of an answer by a replica: the revision of its map.
const REVISION: HeaderName = HeaderName::from_static("cogmap-map-revision");
/// What ends the paths of questions that have a body.
const QUESTIONS: [&str; 7] = [
    "recall", "localize", "route", "sequence", "felt", "predict", "identify",
];
/// How far what is followed lags behind the storage: some looks at it, and reading.
const LAG: Duration = Duration::from_millis(250);

/// A space of another node as it was a moment ago.
#[derive(Clone, Debug)]
pub(crate) struct Replica {
    pub(crate) space: Arc<Space>,
    age: Duration,
}

/// Takes the parameter off a request: handlers do not know it.
pub(super) fn take_max_age(request: &mut Request) -> Result<Option<Duration>, Problem> {
    let Some(query) = request.uri().query() else {
        return Ok(None);
    };
    let of_parameter = |pair: &&str| {
        pair.split_once('=')
            .is_some_and(|(name, _)| name == MAX_AGE)
    };
    let Some((_, value)) = query
        .split('&')
        .find(of_parameter)
        .and_then(|pair| pair.split_once('='))
    else {
        return Ok(None);
    };
    let age = value.parse().map_err(|_| {
        let detail = format!("{MAX_AGE} is a number of milliseconds, not {value:?}");
        Problem::new(Kind::InvalidParameter, detail)
    })?;
    let rest: Vec<_> = query
        .split('&')
        .filter(|pair| !of_parameter(pair))
        .collect();
    let (path, rest) = (request.uri().path(), rest.join("&"));
    let uri = if rest.is_empty() {
        path.to_owned()
    } else {
        format!("{path}?{rest}")
    };
    let uri = Uri::try_from(uri)
        .map_err(|error| Problem::new(Kind::InvalidParameter, error.to_string()))?;
    *request.uri_mut() = uri;
    Ok(Some(Duration::from_millis(age)))
}

/// The replica of a space, if a request is a question and what it knows is young enough.
pub(super) fn of(
    service: &Shared,
    space: &str,
    request: &Request,
    max_age: Duration,
) -> Option<Replica> {
    if !is_question(request.method(), request.uri().path()) {
        return None;
    }
    let space = service.replicas.as_ref()?.space(space)?;
    space.available().ok()?;
    // Since the last contact to the storage nothing that came there can have been seen, and what
    // was seen may not be folded yet.
    let contact = service.cluster.as_ref()?.standing().contact?;
    let known = contact.min(space.caught_up()?);
    let age = Instant::now().saturating_duration_since(known) + LAG;
    (age <= max_age).then_some(Replica { space, age })
}

/// Whether a request changes nothing.
fn is_question(method: &Method, path: &str) -> bool {
    let last = path.rsplit('/').next().unwrap_or_default();
    method.is_safe() || (method == Method::POST && QUESTIONS.contains(&last))
}

impl Replica {
    /// Answers in place of the owner, and says how old that may be.
    pub(super) async fn answer(self, mut request: Request, next: Next) -> Response<Body> {
        let (age, revision) = (self.age.as_millis(), self.space.revision());
        request.extensions_mut().insert(self);
        let mut response = next.run(request).await;
        let headers = response.headers_mut();
        for (name, value) in [(AGE, age.to_string()), (REVISION, revision.to_string())] {
            if let Ok(value) = HeaderValue::try_from(value) {
                headers.insert(name, value);
            }
        }
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(uri: &str) -> (Result<Option<Duration>, Problem>, String) {
        let mut request = Request::new(Body::empty());
        *request.uri_mut() = uri.parse().expect("a path");
        let taken = take_max_age(&mut request);
        (taken, request.uri().to_string())
    }

    #[test]
    fn the_parameter_is_taken_off_and_the_others_stay() {
        let age = |uri| {
            let (taken, rest) = taken(uri);
            (
                taken.expect("it can be read").map(|age| age.as_millis()),
                rest,
            )
        };
        assert_eq!(
            age("/v1/spaces/hall?max_age_ms=500"),
            (Some(500), "/v1/spaces/hall".into())
        );
        let (found, rest) = age("/v1/spaces/hall/places?limit=3&max_age_ms=0&after=2");
        assert_eq!(
            (found, &*rest),
            (Some(0), "/v1/spaces/hall/places?limit=3&after=2")
        );
        assert_eq!(
            age("/v1/spaces/hall?limit=3"),
            (None, "/v1/spaces/hall?limit=3".into())
        );
        for wrong in ["", "-1", "1.5", "soon"] {
            let (taken, _) = taken(&format!("/v1/spaces/hall?max_age_ms={wrong}"));
            assert_eq!(taken.expect_err("no number").kind(), Kind::InvalidParameter);
        }
    }

    #[test]
    fn only_questions_are_answered_by_replicas() {
        let at = |path: &str| format!("/v1/spaces/hall/{path}");
        assert!(is_question(&Method::GET, &at("agents/ada")));
        assert!(is_question(&Method::POST, &at("objects/identify")));
        for (method, path) in [
            (Method::POST, "agents/ada/samples"),
            (Method::PUT, "agents/ada/route"),
            (Method::POST, "blockages"),
            (Method::DELETE, ""),
        ] {
            assert!(!is_question(&method, &at(path)), "{method} {path}");
        }
    }
}
