//! Sequences.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use cogmap_proto::{SequenceAnswer, SequenceQuery};

use super::extract::{Json, NoQuery, SpaceOfPath, SpaceParam};
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::answer;

/// Recognise the last places, or what was sensed there, on the trips of the team: which trips they
/// look like, and what comes next.
///
/// The answer is a function of the map. A few such questions are answered at once; further ones are
/// told to come back.
#[utoipa::path(post, path = "/v1/spaces/{space}/sequence", tag = "memory",
    operation_id = "sequence", params(SpaceParam), request_body = SequenceQuery,
    responses(
        (status = 200, description = "What comes next, with probabilities that add up to 1",
            body = SequenceAnswer),
        (status = 404, description = "There is no such space, place or channel"),
        (status = 422, description = "The query breaks a rule")))]
pub(crate) async fn post(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
    Json(query): Json<SequenceQuery>,
) -> Result<Response<Body>, Problem> {
    let answer: SequenceAnswer = answer::sequence_in(&space, query).await?;
    service.long.make(move || reply::json(&answer)).await
}
