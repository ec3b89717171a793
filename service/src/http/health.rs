//! Health and metrics.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use serde::Serialize;
use utoipa::ToSchema;

use super::extract::NoQuery;
use super::problem::{Kind, Problem};
use super::reply;
use super::state::Service;
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

/// The service can do its work: every space is loaded, and the store takes writes.
#[utoipa::path(get, path = "/readyz", tag = "service", operation_id = "get_readiness",
    responses(
        (status = 200, description = "It can", body = Health),
        (status = 503, description = "Spaces are still loading, or the store has failed")))]
pub(crate) async fn readyz(
    State(service): State<Service>,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    match service.engine.readiness() {
        Readiness::Ready => Ok(reply::json(&OK)),
        Readiness::Recovering { spaces } => {
            let detail = format!("spaces still loading: {}", spaces.join(", "));
            Err(Problem::new(Kind::Recovering, detail))
        }
        Readiness::Failed { detail } => Err(Problem::new(Kind::NotReady, detail)),
    }
}

/// Metrics in Prometheus's text format.
#[utoipa::path(get, path = "/metrics", tag = "service", operation_id = "get_metrics",
    responses((status = 200, description = "The metrics", body = String, content_type = "text/plain")))]
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
