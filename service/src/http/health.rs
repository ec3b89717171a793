//! Health and metrics.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use serde::Serialize;
use utoipa::ToSchema;

use super::extract::NoQuery;
use super::problem::{Kind, Problem};
use super::reply;
use super::spaces::StoppedSpace;
use super::state::Service;
use crate::cluster::Cluster;
use crate::engine::Readiness;

/// Whether the service does its work.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Health {
    /// `ok`.
    status: &'static str,
}

const OK: Health = Health { status: "ok" };

/// The process runs and answers.
#[utoipa::path(get, path = "/healthz", tag = "service", operation_id = "get_health",
    responses((status = 200, description = "It does", body = Health)))]
pub(crate) async fn healthz(_: NoQuery) -> Response<Body> {
    reply::json(&OK)
}

/// Whether the service can do its work, and what it does it without.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ReadyHealth {
    /// `ok`.
    status: &'static str,
    /// Spaces that are stopped because their journal is damaged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    stopped: Vec<StoppedSpace>,
}

/// The service can do its work: the store takes writes, and every space is loaded, but for those
/// that are stopped because their journal is damaged.
#[utoipa::path(get, path = "/readyz", tag = "service", operation_id = "get_readiness",
    responses(
        (status = 200, description = "It can", body = ReadyHealth),
        (status = 503, description = "Spaces are still loading, all are stopped, or the store has failed")))]
pub(crate) async fn readyz(
    State(service): State<Service>,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let standing = service.cluster.as_ref().map(Cluster::standing);
    if standing.is_some_and(|standing| standing.resigned) {
        let detail = "this node of the cluster has no contact to the storage";
        return Err(Problem::new(Kind::NotReady, detail));
    }
    match service.engine.readiness() {
        Readiness::Ready => Ok(ready(Vec::new())),
        Readiness::ReadyBut { stopped } => Ok(ready(stopped)),
        Readiness::Recovering { spaces } => {
            let detail = format!("spaces still loading: {}", spaces.join(", "));
            Err(Problem::new(Kind::Recovering, detail))
        }
        Readiness::Failed { detail } => Err(Problem::new(Kind::NotReady, detail)),
    }
}

fn ready(stopped: Vec<(String, String)>) -> Response<Body> {
    let stopped = stopped.into_iter();
    reply::json(&ReadyHealth {
        status: "ok",
        stopped: stopped
            .map(|(name, reason)| StoppedSpace { name, reason })
            .collect(),
    })
}

/// Metrics in Prometheus's text format.
#[utoipa::path(get, path = "/metrics", tag = "service", operation_id = "get_metrics",
    responses((status = 200, description = "The metrics",
        body = String, content_type = "text/plain")))]
pub(crate) async fn metrics(
    State(service): State<Service>,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    // Of many spaces it is a long text; whoever watches does not wait for a turn.
    let prometheus = service.prometheus.clone();
    let text = tokio::task::spawn_blocking(move || crate::metrics::render(&prometheus)).await;
    let body = Body::from(text.map_err(|_| Problem::interrupted())?);
    Ok(reply::with_type(
        "text/plain; version=0.0.4; charset=utf-8",
        body,
    ))
}
