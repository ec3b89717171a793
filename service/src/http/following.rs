//! Routes that agents follow.

use axum::body::Body;
use axum::http::{Response, StatusCode};
use cogmap_proto::{FollowRequest, FollowedRoute};

use super::extract::{AgentOfPath, AgentParams, Json, NoQuery};
use super::problem::Problem;
use super::reply;
use crate::answer;
use crate::decode::InvalidRoute;
use crate::encode;

/// What is left of the route that an agent follows.
#[utoipa::path(get, path = "/v1/spaces/{space}/agents/{agent}/route", tag = "agents",
    operation_id = "get_agent_route", params(AgentParams),
    responses(
        (status = 200, description = "The steps that are left", body = FollowedRoute),
        (status = 404, description = "There is no such space or agent, or it follows no route")))]
pub(crate) async fn get(
    AgentOfPath(space, view): AgentOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    if map.followed(view.id()).is_none() {
        return Err(InvalidRoute::FollowsNone(view.name().to_owned()).into());
    }
    let route: FollowedRoute = encode::followed_route(space.name(), &map, view.id());
    Ok(reply::json(&route))
}

/// Let an agent follow a route from where it is, in place of any that it follows. Events tell its
/// progress; when it leaves the route, or a blockage comes onto it, it gets another one.
#[utoipa::path(put, path = "/v1/spaces/{space}/agents/{agent}/route", tag = "agents",
    operation_id = "follow_route", params(AgentParams), request_body = FollowRequest,
    responses(
        (status = 200, description = "The route; without steps where the agent is there already",
            body = FollowedRoute),
        (status = 404, description = "There is no such space, agent, place, trip, landmark or \
            channel"),
        (status = 409, description = "No way leads there, or the agent is lost"),
        (status = 410, description = "The place or trip has been forgotten"),
        (status = 422, description = "The request breaks a rule, or no place is near an end"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn put(
    AgentOfPath(space, view): AgentOfPath,
    _: NoQuery,
    Json(request): Json<FollowRequest>,
) -> Result<Response<Body>, Problem> {
    let agent = view.id();
    let errand = answer::errand_in(&space, agent, request).await?;
    space.lead(agent, errand).await?;
    let map = space.snapshot().await?;
    Ok(reply::json(&encode::followed_route(
        space.name(),
        &map,
        agent,
    )))
}

/// Let an agent follow its route no more.
#[utoipa::path(delete, path = "/v1/spaces/{space}/agents/{agent}/route", tag = "agents",
    operation_id = "stop_following", params(AgentParams),
    responses(
        (status = 204, description = "The agent follows no route, and that is on disk"),
        (status = 404, description = "There is no such space or agent, or it follows no route"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn delete(
    AgentOfPath(space, view): AgentOfPath,
    _: NoQuery,
) -> Result<StatusCode, Problem> {
    let map = space.snapshot().await?;
    if map.followed(view.id()).is_none() {
        return Err(InvalidRoute::FollowsNone(view.name().to_owned()).into());
    }
    space.stop_leading(view.id()).await?;
    Ok(StatusCode::NO_CONTENT)
}
