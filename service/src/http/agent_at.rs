//! Where an agent was at a time.

use axum::body::Body;
use axum::http::Response;
use cogmap_proto::AgentAt;
use serde::Deserialize;

use super::extract::{AgentName, AgentParams, Query};
use super::problem::{Kind, Problem};
use super::reply;
use super::trajectory::TrajectoryKind;
use crate::answer::agent_once_named;
use crate::encode;

/// Which time, and by what.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct AtQuery {
    /// The stamp, on the sensor's clock \[ns\].
    stamp_ns: i64,
    /// `causal` (when absent): as it was known then. `refined`: by all that has been seen since, of
    /// all sessions.
    #[param(inline)]
    trajectory: Option<TrajectoryKind>,
    /// The session; the current one when absent. For the causal trajectory only.
    session: Option<u64>,
}

/// Where an agent was at a time: between two poses that are known it is taken to have moved evenly.
///
/// For a refined pose the whole map is relaxed, which may take seconds.
#[utoipa::path(get, path = "/v1/spaces/{space}/agents/{agent}/at", tag = "agents",
    operation_id = "get_agent_at", params(AgentParams, AtQuery),
    responses(
        (status = 200, description = "Its pose then", body = AgentAt),
        (status = 404, description = "There is no such space or agent"),
        (status = 410, description = "The agent has been removed: name one of its sessions"),
        (status = 422, description = "The stamp is not between the first and the last known \
            pose, or a session was named for a refined one")))]
pub(crate) async fn get(
    AgentName(space, agent): AgentName,
    Query(query): Query<AtQuery>,
) -> Result<Response<Body>, Problem> {
    let (name, stamp_ns) = (agent.as_str(), query.stamp_ns);
    agent_once_named(&space, name)?;
    let around = match query.trajectory.unwrap_or_default() {
        TrajectoryKind::Causal => space.poses_around(name, query.session, stamp_ns).await?,
        TrajectoryKind::Refined if query.session.is_some() => {
            let detail = "`session` is for causal trajectories only";
            return Err(Problem::new(Kind::InvalidQuery, detail));
        }
        TrajectoryKind::Refined => space.refined_poses_around(name, stamp_ns).await?,
    };
    let poses = [&around.before, &around.after];
    let (session, revision) = (around.session, around.revision);
    let answer: AgentAt = encode::agent_at(name, session, revision, poses, stamp_ns);
    Ok(reply::json(&answer))
}
