//! The index: where everything is.

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Response};
use serde::Serialize;
use utoipa::ToSchema;

use super::extract::NoQuery;
use super::state::Service;
use super::{reply, spaces};

/// What is here, and where.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ApiIndex {
    /// `cogmap`.
    service: &'static str,
    /// Version of the service.
    version: &'static str,
    /// Where what belongs to no space is.
    links: Links,
    /// The spaces, by name.
    spaces: Vec<SpaceLink>,
}

/// Addresses, from the root of the service.
#[derive(Debug, Serialize, ToSchema)]
struct Links {
    /// The spaces with their settings and sizes.
    spaces: &'static str,
    /// A page that describes this interface, and asks it.
    docs: &'static str,
    /// The same description for programs.
    openapi: &'static str,
    /// Whether the process answers.
    health: &'static str,
    /// Whether it can do its work.
    readiness: &'static str,
    /// What it counts.
    metrics: &'static str,
    /// The nodes of the cluster, and who owns which shard.
    cluster: &'static str,
}

/// A space and its address.
#[derive(Debug, Serialize, ToSchema)]
struct SpaceLink {
    /// Name of the space.
    name: String,
    /// Its address.
    href: String,
}

const LINKS: Links = Links {
    spaces: "/v1/spaces",
    docs: "/docs/",
    openapi: "/openapi.json",
    health: "/healthz",
    readiness: "/readyz",
    metrics: "/metrics",
    cluster: "/v1/cluster",
};

/// What is here, and where: the spaces, the description of the interface, health and metrics.
#[utoipa::path(get, path = "/v1", tag = "service", operation_id = "get_index",
    responses((status = 200, description = "The index", body = ApiIndex)))]
pub(crate) async fn get(
    State(service): State<Service>,
    headers: HeaderMap,
    _: NoQuery,
) -> Response<Body> {
    let elsewhere = spaces::elsewhere(&service, &headers).await;
    let here = service.engine.spaces();
    let here = here.iter().map(|space| space.name().to_owned());
    let mut names: Vec<_> = elsewhere.names().map(str::to_owned).chain(here).collect();
    names.sort();
    reply::json(&ApiIndex {
        service: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        links: LINKS,
        spaces: { names.into_iter() }
            .map(|name| SpaceLink {
                href: format!("/v1/spaces/{name}"),
                name,
            })
            .collect(),
    })
}
