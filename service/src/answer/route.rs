//! Routes: what is asked for, and what the map answers.

use std::sync::Arc;

use cogmap_proto::{FollowRequest, RouteAnswer, RouteEnd, RouteFormat, RouteQuery};
use cognitive_map::{AgentId, CognitiveMap, Errand, NoRoute, RouteBounds};

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
    let found = match &question.retrace {
        Some(retrace) => map
            .retraced(from, retrace, options, bounds, gives_up)
            .map(|route| vec![route]),
        None => map.routes(from, to, options, bounds, gives_up),
    };
    let found = found.map_err(no_route)?;
    if let Some(spacing_m) = question.spacing_m {
        let mut lengths = found.iter().map(|route| route.length_m);
        if !lengths.all(|length_m| encode::fits_in_path(length_m, spacing_m)) {
            return Err(InvalidRoute::LongPath(spacing_m));
        }
    }
    Ok(encode::routes(space, map, &found, question.spacing_m))
}

/// Why there is no route, as it is answered.
fn no_route(error: NoRoute) -> InvalidRoute {
    match error {
        NoRoute::NoWay {
            nearest: (place, distance_m),
            blockages,
        } => {
            let blockages = blockages.into_iter().map(|blockage| blockage.0);
            InvalidRoute::NoWay(place.0, distance_m, blockages.collect())
        }
        NoRoute::GivenUp => InvalidRoute::GivenUp,
    }
}

/// Where an agent is to go and how, where a way leads there now.
///
/// # Errors
/// Says which rule the request breaks, what in it is unknown, or that no way leads there; or the
/// space cannot be asked, or not now.
pub async fn errand_in(
    space: &Arc<Space>,
    agent: AgentId,
    request: FollowRequest,
) -> Result<Errand, Problem> {
    let found = space.routes(move |map, bounds, gives_up| {
        let name = map
            .agent(agent)
            .map(|agent| agent.name().as_str().to_owned());
        let query = RouteQuery {
            from: RouteEnd::Agent(name.unwrap_or_default()),
            to: request.to.clone(),
            cost: request.cost,
            reverse: request.reverse,
            avoid: request.avoid.clone(),
            shortcuts: false,
            body_radius_m: None,
            alternatives: 0,
            format: RouteFormat::Steps,
            spacing_m: None,
        };
        route("", map, &query, bounds, gives_up)?;
        decode::errand(map, &request)
    });
    Ok(found.await??)
}
