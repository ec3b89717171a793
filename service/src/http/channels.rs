//! Channels of percepts.

use axum::body::Body;
use axum::http::Response;
use cogmap_proto::ChannelList;

use super::extract::{NoQuery, SpaceOfPath, SpaceParam};
use super::problem::Problem;
use super::reply;
use crate::encode;

/// The channels of a space, and what was learned of their views.
#[utoipa::path(get, path = "/v1/spaces/{space}/channels", tag = "memory",
    operation_id = "list_channels", params(SpaceParam),
    responses(
        (status = 200, description = "The channels", body = ChannelList),
        (status = 404, description = "There is no such space")))]
pub(crate) async fn list(
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    Ok(reply::json(&encode::channels(&map)))
}
