//! Prediction of percepts.

use axum::body::Body;
use axum::http::Response;
use cogmap_proto::{PredictAnswer, PredictQuery};

use super::extract::{AgentOfPath, AgentParams, Json, NoQuery};
use super::problem::Problem;
use super::reply;
use crate::answer;
use crate::decode::InvalidPrediction;

/// What an agent would feel after a motion from where it is now, and how sure that is.
#[utoipa::path(post, path = "/v1/spaces/{space}/agents/{agent}/predict", tag = "memory",
    operation_id = "predict", params(AgentParams), request_body = PredictQuery,
    responses(
        (status = 200, description = "Where the motion leads and what is expected there; no percepts \
            where no place answers", body = PredictAnswer),
        (status = 404, description = "There is no such space, agent or channel"),
        (status = 409, description = "It is not known where the agent stands in the map"),
        (status = 422, description = "The query makes no sense")))]
pub(crate) async fn post(
    AgentOfPath(space, view): AgentOfPath,
    _: NoQuery,
    Json(query): Json<PredictQuery>,
) -> Result<Response<Body>, Problem> {
    if let Some(other) = query.agent.as_ref().filter(|name| *name != view.name()) {
        return Err(InvalidPrediction::OtherAgent(other.clone()).into());
    }
    let map = space.snapshot().await?;
    let answer = answer::predict(space.name(), &map, view.id(), &query)?;
    Ok(reply::json(&answer))
}
