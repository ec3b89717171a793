//! Where samples were taken.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use cogmap_proto::{Localization, LocalizeQuery};

use super::extract::{Json, NoQuery, SpaceOfPath, SpaceParam};
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::decode;
use crate::encode;

/// Find out where a sequence of samples was taken, by what the map knows: its motions, what it saw
/// and the landmarks in it.
///
/// The samples need no agent, and change nothing. Of places that look alike none is told as the
/// pose before it can be told from the others. A few such questions are answered at once; further
/// ones are told to come back.
#[utoipa::path(post, path = "/v1/spaces/{space}/localize",
    tag = "memory", operation_id = "localize",
    params(SpaceParam), request_body = LocalizeQuery,
    responses(
        (status = 200, description = "Where the samples were taken, as far as the map knows",
            body = Localization),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "The samples make no sense, or not here")))]
pub(crate) async fn post(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
    Json(query): Json<LocalizeQuery>,
) -> Result<Response<Body>, Problem> {
    let samples = service
        .long
        .make(move || decode::samples_to_localize(&query));
    let samples = samples.await??;
    let (map, found) = space.localize(samples).await?;
    let answered = service.long.make(move || {
        let answer: Localization = encode::localization(space.name(), &map, &found);
        reply::json(&answer)
    });
    answered.await
}
