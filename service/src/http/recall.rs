//! Recall of places.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use cogmap_proto::{RecallAnswer, RecallQuery};

use super::extract::{Json, NoQuery, SpaceOfPath, SpaceParam};
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::answer;

/// Recall places by position, grid code and percept, alone or together; filtered by agent and time.
#[utoipa::path(post, path = "/v1/spaces/{space}/recall", tag = "memory", operation_id = "recall",
    params(SpaceParam), request_body = RecallQuery,
    responses(
        (status = 200, description = "The places, best first", body = RecallAnswer),
        (status = 404, description = "There is no such space, agent or channel"),
        (status = 422, description = "The query makes no sense in this space")))]
pub(crate) async fn post(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
    Json(query): Json<RecallQuery>,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    // A cue by code or percept is compared with every place: work for a thread that may be busy.
    let answered = service.long.make(move || {
        answer::recall(space.name(), &map, &query).map(|answer| reply::json(&answer))
    });
    Ok(answered.await??)
}
