//! Routes.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use cogmap_proto::{RouteAnswer, RouteQuery};

use super::extract::{Json, NoQuery, SpaceOfPath, SpaceParam};
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::answer;

/// Find the way from here to there, by ways that the team has gone: cheapest by length, time,
/// uncertainty or recency.
///
/// The answer is a function of the map. A few such questions are answered at once; further ones are
/// told to come back.
#[utoipa::path(post, path = "/v1/spaces/{space}/route", tag = "memory", operation_id = "route",
    params(SpaceParam), request_body = RouteQuery,
    responses(
        (status = 200, description = "The cheapest route; without steps where start and goal are \
            the same", body = RouteAnswer),
        (status = 404, description = "There is no such space, agent, place, trip, landmark or \
            channel"),
        (status = 409, description = "No way leads there, or the agent is lost"),
        (status = 410, description = "The place or trip has been forgotten"),
        (status = 422, description = "The query breaks a rule, or no place is near an end")))]
pub(crate) async fn post(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
    Json(query): Json<RouteQuery>,
) -> Result<Response<Body>, Problem> {
    let answer: RouteAnswer = answer::route_in(&space, query).await?;
    // Thousands of steps take milliseconds to write.
    service.long.make(move || reply::json(&answer)).await
}
