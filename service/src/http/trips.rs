//! Trips.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use cogmap_proto::{TripDetail, TripPage};
use cognitive_map::{CognitiveMap, TripId};
use serde::Deserialize;

use super::extract::{IdParams, NoQuery, Query, SpaceOfPath, SpaceParam};
use super::page;
use super::places::{MemoryOfPath, forgotten, unknown};
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::answer::agent_once_named;
use crate::encode;

/// Which trips.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TripsQuery {
    /// Only trips with a larger number.
    after: Option<u64>,
    /// Most trips in the answer; 100 when absent.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
    /// Only trips of the agent with this name.
    agent: Option<String>,
    /// Only trips under way at or after this stamp \[ns\].
    since_ns: Option<i64>,
}

/// The trips of a space.
#[utoipa::path(get, path = "/v1/spaces/{space}/trips", tag = "memory", operation_id = "list_trips",
    params(SpaceParam, TripsQuery),
    responses(
        (status = 200, description = "The trips, by number", body = TripPage),
        (status = 404, description = "There is no such space or agent"),
        (status = 422, description = "A parameter breaks a rule")))]
pub(crate) async fn list(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<TripsQuery>,
) -> Result<Response<Body>, Problem> {
    let limit = page::limit(query.limit)?;
    let map = space.snapshot().await?;
    if let Some(name) = query.agent.as_deref() {
        agent_once_named(&space, name)?;
    }
    // A filter may look at every trip.
    let listed = service.long.make(move || trips(&map, &query, limit));
    listed.await
}

fn trips(map: &CognitiveMap, query: &TripsQuery, limit: usize) -> Response<Body> {
    // By name, so that the trips of a removed agent are found, too.
    let is_called = |id, name: &str| {
        let agent = map.agent(id);
        agent.is_some_and(|agent| agent.name().as_str() == name)
    };
    let first = page::first(query.after);
    let listed = first
        .into_iter()
        .flat_map(|first| map.trips_from(TripId(first)));
    let wanted = listed.filter(|(_, trip)| {
        let agent = query.agent.as_deref();
        agent.is_none_or(|name| is_called(trip.agent(), name))
            && query
                .since_ns
                .is_none_or(|since| trip.end_stamp_ns() >= since)
    });
    let (trips, next) = page::cut(wanted, limit, |(id, _)| u64::from(id.0));
    let trips = trips
        .into_iter()
        .map(|(id, trip)| encode::trip(map, id, trip))
        .collect();
    reply::json(&TripPage { trips, next })
}

/// A trip with its legs.
#[utoipa::path(get, path = "/v1/spaces/{space}/trips/{id}",
    tag = "memory", operation_id = "get_trip",
    params(IdParams),
    responses(
        (status = 200, description = "The trip", body = TripDetail),
        (status = 404, description = "There is no such space or trip"),
        (status = 410, description = "The trip has been forgotten")))]
pub(crate) async fn get(
    MemoryOfPath(space, id): MemoryOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    let number = id;
    let id = u32::try_from(number).map(TripId);
    let id = id.map_err(|_| unknown("trip", &number))?;
    match map.trip(id) {
        Some(trip) => Ok(reply::json(&encode::trip_detail(&map, id, trip))),
        None if map.is_forgotten_trip(id) => Err(forgotten("trip", number)),
        None => Err(unknown("trip", &number)),
    }
}
