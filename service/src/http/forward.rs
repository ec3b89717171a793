//! Any node answers: what another node owns is passed on to it, one hop far.

mod replica;

use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderMap, Response, StatusCode};
use axum::middleware::{FromFnLayer, Next, from_fn_with_state};
use axum::response::IntoResponse;
use futures_util::StreamExt;
use futures_util::future::{BoxFuture, join_all};

use super::forwarder::FORWARDED;
use super::problem::{Kind, Problem};
use super::state::{Service, Shared};
use super::streams::{OpenStream, stopped};
use crate::cluster::{Cluster, NodeState, Whereabouts};

pub(crate) use replica::Replica;

/// What stands before the name of a space in a path.
const SPACES: &str = "/v1/spaces/";
/// How often is looked whether a node that was asked owns the space still.
const LOOK_INTERVAL: Duration = Duration::from_millis(250);
/// How long its answer is awaited after that: a node that gives a space up answers what it has been
/// asked before.
const LAST_ANSWER: Duration = Duration::from_secs(2);
type Middleware = fn(State<Service>, Request, Next) -> BoxFuture<'static, Response<Body>>;

/// The layer that passes requests on.
pub(crate) fn layer(
    service: &Service,
) -> FromFnLayer<Middleware, Service, (State<Service>, Request)> {
    let pass: Middleware = |State(service), request, next| Box::pin(pass(service, request, next));
    from_fn_with_state(Service::clone(service), pass)
}

async fn pass(service: Service, mut request: Request, next: Next) -> Response<Body> {
    let (Some(cluster), Some(space)) = (&service.cluster, space_of(request.uri().path())) else {
        return next.run(request).await;
    };
    let max_age = match replica::take_max_age(&mut request) {
        Ok(max_age) => max_age,
        Err(problem) => return problem.into_response(),
    };
    let whereabouts = cluster.whereabouts(service.engine.shards().of(&space));
    if whereabouts == Whereabouts::Here {
        return answer_here(&service, &space, request, next).await;
    }
    let replica = max_age.and_then(|max_age| replica::of(&service, &space, &request, max_age));
    if let Some(replica) = replica {
        return replica.answer(request, next).await;
    }
    match whereabouts {
        Whereabouts::At(address) if !is_forwarded(request.headers()) => {
            ask_owner(&service, cluster, &space, &address, request).await
        }
        _ => Problem::moving(&space).into_response(),
    }
}

/// The answer of the node at an address, as long as it owns the space: one that stands still would
/// keep whoever asks waiting.
async fn ask_owner(
    service: &Shared,
    cluster: &Cluster,
    space: &str,
    address: &str,
    request: Request,
) -> Response<Body> {
    let node = cluster.standing().node.clone();
    let shard = service.engine.shards().of(space);
    let (cluster, there) = (cluster.clone(), Whereabouts::At(address.to_owned()));
    let mut moved = Box::pin(has_moved(move || cluster.whereabouts(shard) == there));
    let answered = tokio::select! {
        answered = service.forwarder.forward(request, address, &node) => answered,
        () = &mut moved => return owner_lost(space).into_response(),
    };
    match answered {
        Ok(response) if is_event_stream(&response) => stream(service, response, moved),
        Ok(response) => response,
        Err(error) if error.is_connect() => Problem::moving(space).into_response(),
        Err(_) => owner_lost(space).into_response(),
    }
}

/// Waits until a space has not been there for a while.
async fn has_moved(is_there: impl Fn() -> bool) {
    while is_there() {
        tokio::time::sleep(LOOK_INTERVAL).await;
    }
    tokio::time::sleep(LAST_ANSWER).await;
}

fn is_event_stream(response: &Response<Body>) -> bool {
    let kind = response.headers().get(CONTENT_TYPE);
    kind.is_some_and(|kind| kind.as_bytes().starts_with(b"text/event-stream"))
}

/// Passes a stream on until its space has moved, or this node stops. It is one of the streams that
/// this node may have open.
fn stream(
    service: &Shared,
    response: Response<Body>,
    moved: impl Future<Output = ()> + Send + 'static,
) -> Response<Body> {
    let open = match OpenStream::open(service) {
        Ok(open) => open,
        Err(problem) => return problem.into_response(),
    };
    let stopped = stopped(service);
    let ended = async move {
        tokio::select! {
            () = moved => {}
            () = stopped => {}
        }
    };
    response.map(|body| {
        let chunks = body.into_data_stream().take_until(Box::pin(ended));
        Body::from_stream(chunks.inspect(move |_| {
            let _ = &open; // it counts as long as the stream lives
        }))
    })
}

/// The answer about a space of this node. It may have begun to leave, or is only just coming.
async fn answer_here(
    service: &Shared,
    space: &str,
    request: Request,
    next: Next,
) -> Response<Body> {
    let response = next.run(request).await;
    let found = service.engine.space(space);
    let comes_or_goes = found.is_none_or(|space| space.recovering());
    if response.status() == StatusCode::SERVICE_UNAVAILABLE && comes_or_goes {
        return Problem::moving(space).into_response();
    }
    response
}

/// The space that a path is about.
fn space_of(path: &str) -> Option<String> {
    let rest = path.strip_prefix(SPACES)?;
    let name = rest.split('/').next().filter(|name| !name.is_empty())?;
    let name = percent_encoding::percent_decode_str(name).decode_utf8_lossy();
    Some(name.into_owned())
}

fn owner_lost(space: &str) -> Problem {
    let detail = format!("the node that owns the space {space:?} did not answer");
    Problem::new(Kind::OwnerLost, detail)
}

/// Whether another node has passed a request on.
pub(crate) fn is_forwarded(headers: &HeaderMap) -> bool {
    headers.contains_key(FORWARDED)
}

/// What the other nodes answer under a path, by their addresses, to a request that no node has
/// passed on. Of a node that does not answer there is nothing.
pub(crate) async fn ask_others(
    service: &Shared,
    path: &str,
    headers: &HeaderMap,
) -> Vec<(String, Bytes)> {
    let Some(cluster) = service.cluster.as_ref().filter(|_| !is_forwarded(headers)) else {
        return Vec::new();
    };
    let standing = cluster.standing();
    let others = standing
        .nodes
        .iter()
        .filter(|other| other.name != standing.node && other.state == NodeState::Live);
    let asked = others.map(async |other| {
        let address = other.address.clone();
        let node = &standing.node;
        let answer = service.forwarder.list(&address, path, headers, node).await;
        answer.map(|answer| (address, answer))
    });
    join_all(asked).await.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_concerns_a_space_is_told_by_its_path() {
        for path in ["hall", "hall/agents/ada", "h%61ll", "%68all/places"] {
            let space = space_of(&format!("/v1/spaces/{path}"));
            assert_eq!(space.as_deref(), Some("hall"), "{path}");
        }
        for path in [
            "/v1/spaces",
            "/v1/spaces/",
            "/v1/cluster",
            "/healthz",
            "/v1",
        ] {
            assert_eq!(space_of(path), None, "{path}");
        }
    }
}
