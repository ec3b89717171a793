//! What was felt near a point.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use cogmap_proto::{FeltAnswer, FeltQuery};

use super::extract::{Json, NoQuery, SpaceOfPath, SpaceParam};
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::answer;

/// What was felt near a point since a stamp, by what the places near remember: that nobody looked
/// is told from that somebody did and felt nothing.
#[utoipa::path(post, path = "/v1/spaces/{space}/felt", tag = "memory", operation_id = "felt",
    params(SpaceParam), request_body = FeltQuery,
    responses(
        (status = 200, description = "What was felt, and who was there", body = FeltAnswer),
        (status = 404, description = "There is no such space or channel"),
        (status = 422, description = "The query breaks a rule")))]
pub(crate) async fn post(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
    Json(query): Json<FeltQuery>,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    // A large radius holds many places: work for a thread that may be busy.
    let answered = service
        .long
        .make(move || answer::felt(space.name(), &map, &query).map(|answer| reply::json(&answer)));
    Ok(answered.await??)
}
