//! Spaces.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{FromRequest, Request, State};
use axum::http::header::LOCATION;
use axum::http::{HeaderMap, HeaderValue, Response, StatusCode};
use cogmap_proto::{Name, SpaceInfo, SpaceSettings};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::extract::{
    AnySpaceOfPath, NoQuery, SpaceOfPath, SpaceParam, must_be_json, name, whole_body,
};
use super::forward::{ask_others, is_forwarded};
use super::json;
use super::problem::{Kind, Problem};
use super::reply;
use super::state::Service;
use crate::cluster::Whereabouts;
use crate::encode;
use crate::engine::{Space, Unavailable};
use crate::store::ShardNumber;

/// How often to look whether a new space has been set up.
const SET_UP_POLL: Duration = Duration::from_millis(1);

/// The spaces of the service.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct ListedSpaces {
    /// The spaces, by name.
    spaces: Vec<SpaceInfo>,
    /// Spaces that are stopped because their journal is damaged, by name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    stopped: Vec<StoppedSpace>,
    /// Shards of which this node knows no spaces for the moment: they change hands, or their owners
    /// did not answer. Their spaces are missing here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    missing_shards: Vec<u32>,
}

impl ListedSpaces {
    /// The names of all of them.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        let spaces = self.spaces.iter().map(|space| space.name.as_str());
        spaces.chain(self.stopped.iter().map(|space| space.name.as_str()))
    }
}

/// A space that is stopped because its journal is damaged.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct StoppedSpace {
    /// Name.
    pub(crate) name: String,
    /// What is damaged, what is lost, and which command helps.
    pub(crate) reason: String,
}

/// The spaces.
///
/// Those that are still loading are not among them; `/readyz` names them. Those that are stopped
/// because their journal is damaged are listed apart, each with the reason.
#[utoipa::path(get, path = "/v1/spaces", tag = "spaces", operation_id = "list_spaces",
    responses((status = 200, description = "All spaces, by name", body = ListedSpaces)))]
pub(crate) async fn list(
    State(service): State<Service>,
    headers: HeaderMap,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let ListedSpaces {
        mut spaces,
        mut stopped,
        missing_shards,
    } = elsewhere(&service, &headers).await;
    for space in service.engine.spaces() {
        if let Some(reason) = space.stop_reason() {
            let (name, reason) = (space.name().to_owned(), reason.to_owned());
            stopped.push(StoppedSpace { name, reason });
        } else if let Ok(info) = info(&service, &space).await {
            spaces.push(info);
        }
    }
    spaces.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(reply::json(&ListedSpaces {
        spaces,
        stopped,
        missing_shards,
    }))
}

/// The spaces of the other nodes of the cluster.
pub(crate) async fn elsewhere(service: &Service, headers: &HeaderMap) -> ListedSpaces {
    let mut all = ListedSpaces {
        spaces: Vec::new(),
        stopped: Vec::new(),
        missing_shards: Vec::new(),
    };
    let Some(cluster) = { service.cluster.as_ref() }.filter(|_| !is_forwarded(headers)) else {
        return all;
    };
    let mut answered = Vec::new();
    for (address, answer) in ask_others(service, "/v1/spaces", headers).await {
        match serde_json::from_slice::<ListedSpaces>(&answer) {
            Ok(listed) => {
                all.spaces.extend(listed.spaces);
                all.stopped.extend(listed.stopped);
                answered.push(address);
            }
            Err(error) => tracing::debug!(%error, "the spaces of another node"),
        }
    }
    let is_missing = |shard: &ShardNumber| match cluster.whereabouts(*shard) {
        Whereabouts::Here => false,
        Whereabouts::At(address) => !answered.contains(&address),
        Whereabouts::Nowhere => true,
    };
    let missing = service.engine.shards().all().filter(is_missing);
    all.missing_shards = missing.map(|shard| shard.0).collect();
    all
}

/// A space.
#[utoipa::path(get, path = "/v1/spaces/{space}", tag = "spaces", operation_id = "get_space",
    params(SpaceParam),
    responses(
        (status = 200, description = "The space", body = SpaceInfo),
        (status = 404, description = "There is no such space")))]
pub(crate) async fn get(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    Ok(reply::json(&info(&service, &space).await?))
}

/// Create a space.
///
/// Its settings are fixed then, because its map depends on them. Without a body, or without a
/// field, the defaults hold. Creating it again with the same settings changes nothing.
#[utoipa::path(put, path = "/v1/spaces/{space}", tag = "spaces", operation_id = "create_space",
    params(SpaceParam), request_body = SpaceSettings,
    responses(
        (status = 201, description = "The space has been created", body = SpaceInfo),
        (status = 200, description = "The space was there, with these settings", body = SpaceInfo),
        (status = 409, description = "The space exists with other settings, or there are too many spaces"),
        (status = 422, description = "The settings make no sense"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn put(
    State(service): State<Service>,
    _: NoQuery,
    NewSpace(name, settings): NewSpace,
) -> Result<Response<Body>, Problem> {
    let engine = service.engine.clone();
    // The store syncs before it answers.
    let created = tokio::task::spawn_blocking(move || engine.create_space(&name, &settings));
    let (space, created) = created.await.map_err(|_| Problem::interrupted())??;
    if !created {
        return Ok(reply::json(&info(&service, &space).await?));
    }
    while space.recovering() {
        tokio::time::sleep(SET_UP_POLL).await;
    }
    let mut response = reply::json(&info(&service, &space).await?);
    *response.status_mut() = StatusCode::CREATED;
    if let Ok(location) = HeaderValue::try_from(format!("/v1/spaces/{}", space.name())) {
        response.headers_mut().insert(LOCATION, location);
    }
    Ok(response)
}

/// Delete a space with all that it remembers.
#[utoipa::path(delete, path = "/v1/spaces/{space}", tag = "spaces", operation_id = "delete_space",
    params(SpaceParam),
    responses(
        (status = 204, description = "The space is gone"),
        (status = 404, description = "There is no such space")))]
pub(crate) async fn delete(
    State(service): State<Service>,
    AnySpaceOfPath(space): AnySpaceOfPath,
    _: NoQuery,
) -> Result<StatusCode, Problem> {
    // The space's writer finishes what it has before the store forgets it.
    let deleted = tokio::task::spawn_blocking(move || service.engine.delete_space(space.name()));
    deleted.await.map_err(|_| Problem::interrupted())??;
    Ok(StatusCode::NO_CONTENT)
}

/// What is known of a space.
async fn info(service: &Service, space: &Arc<Space>) -> Result<SpaceInfo, Problem> {
    let map = space.snapshot().await.map_err(|error| match error {
        Unavailable::Recovering => Problem::new(
            Kind::Recovering,
            format!("the space {:?} is loading", space.name()),
        ),
        error => error.into(),
    })?;
    // The digest looks at everything that changed.
    let space = Arc::clone(space);
    let info = move || encode::space_info(space.name(), space.settings(), &map);
    service.long.make(info).await
}

/// The name in the path and the settings in the body.
pub(crate) struct NewSpace(Name, SpaceSettings);

impl FromRequest<Service> for NewSpace {
    type Rejection = Problem;

    async fn from_request(request: Request, service: &Service) -> Result<Self, Problem> {
        let (mut parts, body) = request.into_parts();
        let params: SpaceParam = super::extract::path(&mut parts, service).await?;
        let name = name(&params.space)?;
        let headers = parts.headers.clone();
        let bytes = whole_body(Request::from_parts(parts, body), service).await?;
        if bytes.is_empty() {
            return Ok(Self(name, SpaceSettings::default()));
        }
        must_be_json(&headers)?;
        let settings = json::message(&bytes)?;
        Ok(Self(name, settings))
    }
}
