//! Trips that are never to be forgotten.

use axum::http::StatusCode;
use cognitive_map::{CognitiveMap, TripId};

use super::extract::{IdParams, NoQuery};
use super::places::{MemoryOfPath, forgotten, unknown};
use super::problem::{Kind, Problem};

/// Pin a trip: it is never forgotten. Pinned trips take at most half the budget of legs.
#[utoipa::path(put, path = "/v1/spaces/{space}/trips/{id}/pin", tag = "memory",
    operation_id = "pin_trip", params(IdParams),
    responses(
        (status = 204, description = "The trip is pinned, and that is on disk"),
        (status = 404, description = "There is no such space or trip"),
        (status = 409, description = "Pinned trips would take more than half the budget of legs"),
        (status = 410, description = "The trip has been forgotten"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn put(
    MemoryOfPath(space, id): MemoryOfPath,
    _: NoQuery,
) -> Result<StatusCode, Problem> {
    let map = space.snapshot().await?;
    let trip = trip(&map, id)?;
    if !map.can_pin(trip) {
        let detail = format!(
            "with this trip, pinned ones would take more than half of legs_max, {}",
            map.settings().legs_max
        );
        return Err(Problem::new(Kind::TooManyPins, detail));
    }
    space.pin(trip, true).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Let a trip be forgotten like others.
#[utoipa::path(delete, path = "/v1/spaces/{space}/trips/{id}/pin", tag = "memory",
    operation_id = "unpin_trip", params(IdParams),
    responses(
        (status = 204, description = "The trip is not pinned, and that is on disk"),
        (status = 404, description = "There is no such space or trip"),
        (status = 410, description = "The trip has been forgotten"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn delete(
    MemoryOfPath(space, id): MemoryOfPath,
    _: NoQuery,
) -> Result<StatusCode, Problem> {
    let map = space.snapshot().await?;
    let trip = trip(&map, id)?;
    if map.is_pinned(trip) {
        space.pin(trip, false).await?;
    }
    Ok(StatusCode::NO_CONTENT)
}

fn trip(map: &CognitiveMap, id: u64) -> Result<TripId, Problem> {
    let trip = u32::try_from(id).map(TripId);
    let trip = trip.map_err(|_| unknown("trip", &id))?;
    match map.trip(trip) {
        Some(_) => Ok(trip),
        None if map.is_forgotten_trip(trip) => Err(forgotten("trip", id)),
        None => Err(unknown("trip", &id)),
    }
}
