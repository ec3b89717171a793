//! Routes: what is asked for, and what the map answers.

use std::sync::Arc;

use cogmap_proto::{RouteAnswer, RouteQuery};
use cognitive_map::{CognitiveMap, NoRoute, RouteBounds};

use crate::decode::{self, InvalidRoute};
use crate::encode;
use crate::engine::Space;
use crate::problem::Problem;

/// How one gets from here to there in a space as it is now.
///
/// # Errors
/// Says which rule the query breaks, what in it is unknown, or that no way leads there; or the
/// space cannot be asked, or not now.
pub async fn route_in(space: &Arc<Space>, query: RouteQuery) -> Result<RouteAnswer, Problem> {
    let name = space.name().to_owned();
    let found =
        space.routes(move |map, bounds, gives_up| route(&name, map, &query, bounds, gives_up));
    Ok(found.await??)
}

/// How one gets from here to there. `bounds` make the search shorter and change nothing; `gives_up`
/// is asked about once a millisecond.
///
/// # Errors
/// Says which rule the query breaks, what in it is unknown, or that no way leads there.
pub fn route(
    space: &str,
    map: &CognitiveMap,
    query: &RouteQuery,
    bounds: Option<&RouteBounds>,
    gives_up: &mut dyn FnMut() -> bool,
) -> Result<RouteAnswer, InvalidRoute> {
    let question = decode::route(map, query)?;
    let (from, to, options) = (&question.from, &question.to, &question.options);
    let found = map.routes(from, to, options, bounds, gives_up);
    let found = found.map_err(|error| match error {
        NoRoute::NoWay {
            nearest: (place, distance_m),
        } => InvalidRoute::NoWay(place.0, distance_m),
        NoRoute::GivenUp => InvalidRoute::GivenUp,
    })?;
    if let Some(spacing_m) = question.spacing_m {
        let mut lengths = found.iter().map(|route| route.length_m);
        if !lengths.all(|length_m| encode::fits_in_path(length_m, spacing_m)) {
            return Err(InvalidRoute::LongPath(spacing_m));
        }
    }
    Ok(encode::routes(space, map, &found, question.spacing_m))
}
