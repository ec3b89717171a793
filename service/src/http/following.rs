//! Routes that agents follow.

use axum::body::Body;
use axum::http::{Response, StatusCode};
use cogmap_proto::{FollowRequest, FollowedRoute, FollowedRoutePage};
use serde::Deserialize;

use super::extract::{AgentOfPath, AgentParams, Json, NoQuery, Query, SpaceOfPath, SpaceParam};
use super::page;
use super::problem::Problem;
use super::reply;
use crate::answer;
use crate::decode::InvalidRoute;
use crate::encode;

/// Which agents.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct FollowedQuery {
    /// Only agents whose names come after this one.
    after: Option<String>,
    /// Most agents in the answer; 100 when absent.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
}

/// The agents that follow routes, and what is left of these.
#[utoipa::path(get, path = "/v1/spaces/{space}/routes", tag = "agents",
    operation_id = "list_followed_routes", params(SpaceParam, FollowedQuery),
    responses(
        (status = 200, description = "What is left of the routes, without the steps, by agent",
            body = FollowedRoutePage),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "A parameter breaks a rule")))]
pub(crate) async fn list(
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<FollowedQuery>,
) -> Result<Response<Body>, Problem> {
    let limit = page::limit(query.limit)?;
    let map = space.snapshot().await?;
    let followed = map.all_followed();
    let mut followed: Vec<_> = followed
        .filter_map(|(agent, following)| Some((map.agent(agent)?, following)))
        .collect();
    followed.sort_by_key(|(agent, _)| agent.name().as_str());
    let after = query.after.as_deref();
    let wanted = { followed.into_iter() }
        .filter(|(agent, _)| after.is_none_or(|after| agent.name().as_str() > after));
    let (routes, next) = page::cut(wanted, limit, |(agent, _)| agent.name().as_str().to_owned());
    Ok(reply::json(&FollowedRoutePage {
        map_revision: map.revision(),
        routes: { routes.into_iter() }
            .map(|(agent, following)| encode::followed_summary(agent, following))
            .collect(),
        next,
    }))
}

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
