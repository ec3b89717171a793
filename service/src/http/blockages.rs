//! Blockages: where nobody gets through for now.

use axum::body::Body;
use axum::http::{Response, StatusCode};
use cogmap_proto::{Blockage, BlockageList, BlockageRequest};

use super::extract::{IdParams, Json, NoQuery, SpaceOfPath, SpaceParam};
use super::places::{MemoryOfPath, unknown};
use super::problem::Problem;
use super::reply;
use crate::decode;
use crate::encode;

/// The blockages of a space.
#[utoipa::path(get, path = "/v1/spaces/{space}/blockages", tag = "memory",
    operation_id = "list_blockages", params(SpaceParam),
    responses(
        (status = 200, description = "The blockages, by number", body = BlockageList),
        (status = 404, description = "There is no such space")))]
pub(crate) async fn list(
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    Ok(reply::json(&encode::blockages(&map)))
}

/// Say where nobody gets through: no route leads there until that is taken back, its time has come,
/// or somebody travels there. Answers when that is on disk.
#[utoipa::path(post, path = "/v1/spaces/{space}/blockages", tag = "memory",
    operation_id = "block", params(SpaceParam), request_body = BlockageRequest,
    responses(
        (status = 201, description = "The blockage", body = Blockage),
        (status = 404, description = "There is no such space, place or way"),
        (status = 409, description = "There are as many blockages as there may be"),
        (status = 422, description = "The request breaks a rule"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn post(
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
    Json(request): Json<BlockageRequest>,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    let blockage = space.block(decode::blockage(&map, &request)?).await?;
    let mut response = reply::json(&encode::blockage(&blockage));
    *response.status_mut() = StatusCode::CREATED;
    Ok(response)
}

/// End a blockage.
#[utoipa::path(delete, path = "/v1/spaces/{space}/blockages/{id}", tag = "memory",
    operation_id = "unblock", params(IdParams),
    responses(
        (status = 204, description = "The blockage has ended, and that is on disk"),
        (status = 404, description = "There is no such space, or no such blockage any more"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn delete(
    MemoryOfPath(space, id): MemoryOfPath,
    _: NoQuery,
) -> Result<StatusCode, Problem> {
    let map = space.snapshot().await?;
    let known = map.blockages().iter().find(|known| known.id.0 == id);
    let known = known.ok_or_else(|| unknown("blockage", &id))?;
    space.unblock(known.id).await?;
    Ok(StatusCode::NO_CONTENT)
}
