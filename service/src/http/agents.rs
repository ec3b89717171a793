//! Agents: where they are, and how sure that is.

use axum::body::Body;
use axum::extract::State;
use axum::http::{Response, StatusCode};
use cogmap_proto::{AgentDetail, AgentPage, GridState};
use serde::Deserialize;

use super::extract::{
    AgentName, AgentOfPath, AgentParams, NoQuery, Query, SpaceOfPath, SpaceParam,
};
use super::page;
use super::problem::{Kind, Problem};
use super::reply;
use super::state::Service;
use crate::answer;
use crate::encode;
use crate::engine::IngestError;

/// Which page of the agents.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct AgentsQuery {
    /// Only agents whose names come after this one.
    after: Option<String>,
    /// Most agents in the answer; 100 when absent.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
}

/// The agents of a space.
#[utoipa::path(get, path = "/v1/spaces/{space}/agents",
    tag = "agents", operation_id = "list_agents",
    params(SpaceParam, AgentsQuery),
    responses(
        (status = 200, description = "The agents, by name", body = AgentPage),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "A parameter breaks a rule")))]
pub(crate) async fn list(
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<AgentsQuery>,
) -> Result<Response<Body>, Problem> {
    let limit = page::limit(query.limit)?;
    space.available()?;
    let views = space.agents_after(query.after.as_deref(), limit + 1);
    let (views, next) = page::cut(views.into_iter(), limit, |view| view.name().to_owned());
    let agents = views.iter().map(|view| view.summary()).collect();
    Ok(reply::json(&AgentPage { agents, next }))
}

/// An agent: where it is, how sure that is, and how far its samples have come.
#[utoipa::path(get, path = "/v1/spaces/{space}/agents/{agent}", tag = "agents",
    operation_id = "get_agent", params(AgentParams),
    responses(
        (status = 200, description = "The agent", body = AgentDetail),
        (status = 404, description = "There is no such space or agent")))]
pub(crate) async fn get(AgentOfPath(_, view): AgentOfPath, _: NoQuery) -> Response<Body> {
    reply::with_type("application/json", Body::from(view.detail_json()))
}

/// Remove an agent.
///
/// Its name is free: the next samples under it enrol another agent, whose sessions begin from
/// nothing. What the agent did in the map stays: places, trips, landmarks, and the causal
/// trajectories of its sessions, which can still be read by their number. Of one that was never in
/// the map nothing stays.
///
/// A robot that goes on sending comes back as a new agent, whose earlier samples are missing: they
/// count as lost after the usual wait, or a new run begins from 0.
#[utoipa::path(delete, path = "/v1/spaces/{space}/agents/{agent}", tag = "agents",
    operation_id = "remove_agent", params(AgentParams),
    responses(
        (status = 204, description = "The agent is removed, and that is on disk"),
        (status = 404, description = "There is no such space or agent"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn delete(
    AgentName(space, agent): AgentName,
    _: NoQuery,
) -> Result<StatusCode, Problem> {
    match space.remove_agent(&agent).await {
        Ok(()) => Ok(StatusCode::NO_CONTENT),
        Err(IngestError::UnknownAgent(name)) => Err(answer::nobody_named(&space, &name)),
        Err(error) => Err(error.into()),
    }
}

/// The grid-cell state of an agent.
#[utoipa::path(get, path = "/v1/spaces/{space}/agents/{agent}/grid", tag = "agents",
    operation_id = "get_agent_grid", params(AgentParams),
    responses(
        (status = 200, description = "The state of its grid modules", body = GridState),
        (status = 404, description = "There is no such space or agent, or it has no sample yet")))]
pub(crate) async fn grid(
    State(_): State<Service>,
    AgentOfPath(space, view): AgentOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    let state = map
        .agent(view.id())
        .and_then(|agent| encode::grid_state(&map, agent));
    let detail = || format!("the agent {:?} has no sample yet", view.name());
    state.map_or_else(
        || Err(Problem::new(Kind::UnknownAgent, detail())),
        |state| Ok(reply::json(&state)),
    )
}
