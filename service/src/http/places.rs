//! Places.

use axum::body::Body;
use axum::extract::{FromRequestParts, State};
use axum::http::Response;
use axum::http::request::Parts;
use cogmap_proto::{self as wire, PlacePage, PlacePercepts};
use cognitive_map::{CognitiveMap, Place, PlaceId};
use serde::{Deserialize, Deserializer};

use super::extract::{IdParams, NoQuery, Query, SpaceOfPath, SpaceParam, path, space};
use super::page;
use super::problem::{Kind, Problem};
use super::reply;
use super::state::Service;
use crate::encode;

/// Which places.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct PlacesQuery {
    /// Only places with a larger number.
    after: Option<u64>,
    /// Most places in the answer; 100 when absent.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
    /// Only places with no coordinate below these, `x,y,z` \[m\].
    #[serde(default, deserialize_with = "corner")]
    #[param(value_type = Option<[f64; 3]>, style = Form, explode = false)]
    min_m: Option<[f64; 3]>,
    /// Only places with no coordinate above these, `x,y,z` \[m\].
    #[serde(default, deserialize_with = "corner")]
    #[param(value_type = Option<[f64; 3]>, style = Form, explode = false)]
    max_m: Option<[f64; 3]>,
    /// Only places visited at or after this stamp \[ns\].
    since_ns: Option<i64>,
}

/// The places of a space.
#[utoipa::path(get, path = "/v1/spaces/{space}/places",
    tag = "memory", operation_id = "list_places",
    params(SpaceParam, PlacesQuery),
    responses(
        (status = 200, description = "The places, by number", body = PlacePage),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "A parameter breaks a rule")))]
pub(crate) async fn list(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<PlacesQuery>,
) -> Result<Response<Body>, Problem> {
    let limit = page::limit(query.limit)?;
    let map = space.snapshot().await?;
    // A filter may look at every place.
    let listed = service.long.make(move || places(&map, &query, limit));
    listed.await
}

fn places(map: &CognitiveMap, query: &PlacesQuery, limit: usize) -> Response<Body> {
    let first = page::first(query.after);
    let listed = first
        .into_iter()
        .flat_map(|first| map.places_from(PlaceId(first)));
    let wanted = listed.filter(|(_, place)| {
        let inside = |axis: usize| {
            let metre = place.position()[axis];
            query.min_m.is_none_or(|min| metre >= min[axis])
                && query.max_m.is_none_or(|max| metre <= max[axis])
        };
        (0..3).all(inside)
            && query
                .since_ns
                .is_none_or(|since| place.last_stamp_ns() >= since)
    });
    let (places, next) = page::cut(wanted, limit, |(id, _)| u64::from(id.0));
    reply::json(&PlacePage {
        frame: encode::FRAME.to_owned(),
        map_revision: map.revision(),
        places: places
            .into_iter()
            .map(|(id, place)| encode::place(map, id, place))
            .collect(),
        next,
    })
}

/// A place.
#[utoipa::path(get, path = "/v1/spaces/{space}/places/{id}",
    tag = "memory", operation_id = "get_place",
    params(IdParams),
    responses(
        (status = 200, description = "The place", body = wire::Place),
        (status = 404, description = "There is no such space or place"),
        (status = 410, description = "The place has been forgotten")))]
pub(crate) async fn get(
    MemoryOfPath(space, id): MemoryOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    let (id, place) = known(&map, id)?;
    Ok(reply::json(&encode::place(&map, id, place)))
}

/// What a place remembers of what was felt and seen there.
#[utoipa::path(get, path = "/v1/spaces/{space}/places/{id}/percepts",
    tag = "memory", operation_id = "get_place_percepts",
    params(IdParams),
    responses(
        (status = 200, description = "What it remembers, by channel", body = PlacePercepts),
        (status = 404, description = "There is no such space or place"),
        (status = 410, description = "The place has been forgotten")))]
pub(crate) async fn percepts(
    MemoryOfPath(space, id): MemoryOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    let (id, _) = known(&map, id)?;
    Ok(reply::json(&encode::place_percepts(space.name(), &map, id)))
}

fn known(map: &CognitiveMap, id: u64) -> Result<(PlaceId, &Place), Problem> {
    let number = id;
    let id = u32::try_from(number).map(PlaceId);
    let id = id.map_err(|_| unknown("place", &number))?;
    match map.place(id) {
        Some(place) => Ok((id, place)),
        None if map.is_forgotten_place(id) => Err(forgotten("place", number)),
        None => Err(unknown("place", &number)),
    }
}

/// The space that the path names, and the number of a memory that may be there or not.
pub(crate) struct MemoryOfPath(
    pub(crate) std::sync::Arc<crate::engine::Space>,
    pub(crate) u64,
);

impl FromRequestParts<Service> for MemoryOfPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Service) -> Result<Self, Problem> {
        let params: IdParams = path(parts, service).await?;
        Ok(Self(space(parts, service, &params.space)?, params.id))
    }
}

/// There is no such memory. Its name is whatever somebody wrote into a path.
pub(crate) fn unknown(what: &str, name: &impl std::fmt::Debug) -> Problem {
    let name = format!("{name:?}");
    let detail = format!("the space has no {what} {name:.80}");
    Problem::new(Kind::UnknownMemory, detail)
}

/// There was such a memory.
pub(crate) fn forgotten(what: &str, number: u64) -> Problem {
    let detail = format!("the space has forgotten {what} {number} to make room for others");
    Problem::new(Kind::ForgottenMemory, detail)
}

fn corner<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[f64; 3]>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.parse().ok()).collect();
    let corner: Option<[f64; 3]> = numbers.and_then(|numbers| numbers.try_into().ok());
    match corner {
        Some(corner) if corner.iter().all(|metre| metre.is_finite()) => Ok(Some(corner)),
        _ => Err(serde::de::Error::custom(
            "a corner is three finite numbers x,y,z",
        )),
    }
}
