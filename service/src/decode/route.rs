//! Routes that are asked for.

use cogmap_proto as wire;
use cogmap_proto::limits::{METRES_MAX, PAGE_ITEMS_MAX};
use cognitive_map::{
    AgentId, Back, CognitiveMap, NoRouteEnd, PlaceId, RecallCue, Region, Retrace, Reverse,
    RouteCost, RouteEnd, RouteOptions, Status, TripId,
};
use nalgebra::Point3;

use super::cue::{InvalidQuery, cue, unknown_agent};

/// Most alternatives.
const ALTERNATIVES_MAX: u32 = 4;
/// Most boxes: each is compared with every way that is looked at.
const BOXES_MAX: usize = 64;
/// Distance of the poses of a path when the query names none \[m\].
const SPACING_M: f64 = 0.25;
/// Least and largest distance of the poses of a path \[m\].
const SPACINGS_M: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

/// Half the width of the corridor of ways when the query names none \[m\]. Source: in simulated
/// offices with walls of 0.1 m no line within it crossed one.
const BODY_RADIUS_M: f64 = 0.15;
/// Least and largest of it \[m\].
const BODY_RADII_M: std::ops::RangeInclusive<f64> = 0.01..=1.0;

/// Most seconds or metres that one may go back.
const BACK_MAX: f64 = 1e9;

/// Why there is no route.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidRoute {
    /// A percept, an agent or a channel in it breaks a rule or is unknown.
    #[error(transparent)]
    Query(#[from] InvalidQuery),
    /// A number breaks a rule.
    #[error("{0} must be {1}")]
    Number(&'static str, String),
    /// A box is none.
    #[error("avoid.boxes[{0}]: min_m must be finite, and nowhere above max_m")]
    Box(usize),
    /// A list is too long.
    #[error("{0} must hold at most {1}")]
    TooMany(&'static str, usize),
    /// There is no such place, trip or landmark, or none that answers.
    #[error("{0}")]
    UnknownMemory(String),
    /// The place or trip has been forgotten.
    #[error("{0}")]
    Forgotten(String),
    /// An agent is lost.
    #[error("the agent {0:?} is lost: it is not known where it is")]
    AgentLost(String),
    /// No place is near an end: which end, the nearest place and its distance.
    #[error("{0}: no place is near; the nearest is {1}, {2:.3} m away")]
    NothingNear(&'static str, u32, f64),
    /// There are no places at all.
    #[error("the space has no places yet")]
    NoPlaces,
    /// No way leads there: the nearest place to the goal that can be reached, its distance, and the
    /// blockages on the way that there would be.
    #[error(
        "no way leads there; the nearest place that can be reached is {0}, {1:.3} m from \
         it{across}",
        across = across(.2)
    )]
    NoWay(u32, f64, Vec<u64>),
    /// Neither a time nor a length is given, or both.
    #[error("{0}.back: give either s or m")]
    WhichBack(&'static str),
    /// A trip is to be retraced to somewhere.
    #[error("from: a route may end with a retraced trip, not begin with one")]
    RetraceFrom,
    /// What is blocked is not said, or in more than one way.
    #[error("give exactly one of: place; from and to; at_m and radius_m")]
    WhichBlockage,
    /// There are as many blockages as there may be.
    #[error("the space has {0} blockages, the most that there may be")]
    TooManyBlockages(usize),
    /// The agent follows no route.
    #[error("the agent {0:?} follows no route")]
    FollowsNone(String),
    /// The search took too long.
    #[error("no route was found in time")]
    GivenUp,
    /// The path would have too many poses.
    #[error("spacing_m is {0}, which gives more poses than an answer may hold")]
    LongPath(f64),
}

/// What is said of blockages on a way.
fn across(blockages: &[u64]) -> String {
    match blockages {
        [] => String::new(),
        [one] => format!("; blockage {one} is on the way"),
        some => {
            let numbers: Vec<_> = some.iter().map(u64::to_string).collect();
            format!("; blockages {} are on the way", numbers.join(", "))
        }
    }
}

/// A route that is asked for, as the map takes it.
#[derive(Clone, Debug)]
pub struct RouteQuestion {
    /// Where it begins.
    pub from: RouteEnd,
    /// Where it ends.
    pub to: RouteEnd,
    /// The trip that leads there, if one is to be travelled again.
    pub retrace: Option<Retrace>,
    /// What it is to be like.
    pub options: RouteOptions,
    /// Distance of the poses of its path \[m\], if one is asked for.
    pub spacing_m: Option<f64>,
}

/// The ends and options of a query.
///
/// # Errors
/// Says which rule the query breaks, or what in it is unknown.
pub fn route(map: &CognitiveMap, query: &wire::RouteQuery) -> Result<RouteQuestion, InvalidRoute> {
    if query.alternatives > ALTERNATIVES_MAX {
        let rule = format!("0 to {ALTERNATIVES_MAX}, not {}", query.alternatives);
        return Err(InvalidRoute::Number("alternatives", rule));
    }
    let spacing_m = metres("spacing_m", query.spacing_m, SPACING_M, &SPACINGS_M)?;
    let options = options(map, query)?;
    if matches!(query.from, wire::RouteEnd::Retrace(_)) {
        return Err(InvalidRoute::RetraceFrom);
    }
    let retraced = match &query.to {
        wire::RouteEnd::Retrace(of) => Some(retrace(of)?),
        _ => None,
    };
    Ok(RouteQuestion {
        from: end(map, "from", &query.from)?,
        to: end(map, "to", &query.to)?,
        retrace: retraced,
        options,
        spacing_m: (query.format == wire::RouteFormat::Path).then_some(spacing_m),
    })
}

/// A length, or its default where there is none.
fn metres(
    field: &'static str,
    metres: Option<f64>,
    default_m: f64,
    legal: &std::ops::RangeInclusive<f64>,
) -> Result<f64, InvalidRoute> {
    let metres = metres.unwrap_or(default_m);
    // A comparison with NaN is false.
    if legal.contains(&metres) {
        return Ok(metres);
    }
    let (min, max) = (legal.start(), legal.end());
    let rule = format!("{min} to {max} m, not {metres}");
    Err(InvalidRoute::Number(field, rule))
}

fn options(map: &CognitiveMap, query: &wire::RouteQuery) -> Result<RouteOptions, InvalidRoute> {
    let radius_m = query.body_radius_m;
    let radius_m = metres("body_radius_m", radius_m, BODY_RADIUS_M, &BODY_RADII_M)?;
    Ok(RouteOptions {
        shortcuts_within_m: query.shortcuts.then_some(radius_m),
        alternatives: query.alternatives as usize,
        ..options_of(map, query.cost, query.reverse, &query.avoid)?
    })
}

/// What a route is to be like, without shortcuts and alternatives.
pub(super) fn options_of(
    map: &CognitiveMap,
    least: wire::RouteCost,
    backwards: wire::RouteReverse,
    avoid: &wire::RouteAvoid,
) -> Result<RouteOptions, InvalidRoute> {
    if avoid.places.len() > PAGE_ITEMS_MAX {
        return Err(InvalidRoute::TooMany("avoid.places", PAGE_ITEMS_MAX));
    }
    if avoid.boxes.len() > BOXES_MAX {
        return Err(InvalidRoute::TooMany("avoid.boxes", BOXES_MAX));
    }
    // One that has been forgotten may still be led through.
    let places = avoid.places.iter().map(|number| {
        let place = u32::try_from(*number).ok().map(PlaceId);
        let place = place.filter(|place| (place.0 as usize) < map.places_recruited());
        place.ok_or_else(|| unknown("place", number))
    });
    let boxes = avoid.boxes.iter().enumerate().map(|(at, corners)| {
        Region::new(corners.min_m, corners.max_m).ok_or(InvalidRoute::Box(at))
    });
    Ok(RouteOptions {
        cost: cost(least),
        reverse: reverse(backwards),
        avoid_places: places.collect::<Result<_, _>>()?,
        avoid_regions: boxes.collect::<Result<_, _>>()?,
        ..RouteOptions::default()
    })
}

/// What is to be least.
pub(super) fn cost(cost: wire::RouteCost) -> RouteCost {
    match cost {
        wire::RouteCost::Length => RouteCost::Length,
        wire::RouteCost::Time => RouteCost::Time,
        wire::RouteCost::Uncertainty => RouteCost::Uncertainty,
        wire::RouteCost::Recency => RouteCost::Recency,
    }
}

/// Whether ways may be taken backwards.
pub(super) fn reverse(reverse: wire::RouteReverse) -> Reverse {
    match reverse {
        wire::RouteReverse::Allowed => Reverse::Allowed,
        wire::RouteReverse::Never => Reverse::Never,
    }
}

/// A trip that is to be travelled again.
pub(super) fn retrace(of: &wire::RouteRetrace) -> Result<Retrace, InvalidRoute> {
    let trip = u32::try_from(of.trip).map_err(|_| unknown("trip", &of.trip))?;
    Ok(Retrace {
        trip: TripId(trip),
        backward: of.direction == wire::RetraceDirection::Backward,
    })
}

/// How far back.
fn back(field: &'static str, back: &wire::RouteBack) -> Result<Back, InvalidRoute> {
    let (quantity, back) = match (back.s, back.m) {
        (Some(seconds), None) => (seconds, Back::Seconds(seconds)),
        (None, Some(metres)) => (metres, Back::Metres(metres)),
        _ => return Err(InvalidRoute::WhichBack(field)),
    };
    if (0.0..=BACK_MAX).contains(&quantity) {
        return Ok(back);
    }
    let rule = format!("0 to {BACK_MAX:e}, not {quantity}");
    Err(InvalidRoute::Number("back", rule))
}

/// An end of a route; `field` is its name.
pub(super) fn end(
    map: &CognitiveMap,
    field: &'static str,
    end: &wire::RouteEnd,
) -> Result<RouteEnd, InvalidRoute> {
    let (found, what, name) = match end {
        wire::RouteEnd::Place(number) => {
            let place = u32::try_from(*number).map_err(|_| unknown("place", number))?;
            (
                map.route_end_at(PlaceId(place)),
                "place",
                number.to_string(),
            )
        }
        wire::RouteEnd::PositionM(metres) => {
            let legal = metres.iter().all(|metre| metre.abs() <= METRES_MAX);
            if !legal {
                return Err(InvalidQuery::Position(*metres).into());
            }
            let near = map.route_end_near(&Point3::from(*metres));
            (near, "position", format!("{metres:?}"))
        }
        wire::RouteEnd::Agent(name) => {
            let agent = agent(map, name)?;
            if map.status(agent) == Some(Status::Lost) {
                return Err(InvalidRoute::AgentLost(name.clone()));
            }
            (map.route_end_of_agent(agent), "agent", format!("{name:?}"))
        }
        wire::RouteEnd::Landmark(label) => {
            let landmark = map.landmark_by_label(label);
            let (_, landmark) = landmark.ok_or_else(|| unknown("landmark", label))?;
            let before = map.route_end_before(landmark.position());
            (before, "landmark", format!("{label:?}"))
        }
        wire::RouteEnd::Trip(number) => {
            let trip = u32::try_from(*number).map_err(|_| unknown("trip", number))?;
            let start = map.route_end_of_trip(TripId(trip));
            (start, "trip", number.to_string())
        }
        wire::RouteEnd::Home(name) => {
            let home = map.route_end_home(agent(map, name)?);
            (home, "home of the agent", format!("{name:?}"))
        }
        wire::RouteEnd::Back(of) => {
            let agent = agent(map, &of.agent)?;
            let end = map.route_end_back(agent, back(field, of)?);
            (end, "way of the agent", format!("{:?}", of.agent))
        }
        wire::RouteEnd::Retrace(of) => {
            let end = map.route_end_of_retrace(&retrace(of)?);
            (end, "trip", of.trip.to_string())
        }
        wire::RouteEnd::Percept(percept) => {
            let place = recalled(map, percept)?;
            (map.route_end_at(place), "place", place.0.to_string())
        }
    };
    found.map_err(|error| no_end(field, error, what, &name))
}

/// Why a route cannot begin or end somewhere.
fn no_end(field: &'static str, error: NoRouteEnd, what: &str, name: &str) -> InvalidRoute {
    match error {
        NoRouteEnd::Unknown => unknown(what, &name),
        NoRouteEnd::Forgotten => {
            InvalidRoute::Forgotten(format!("{field}: the {what} {name} has been forgotten"))
        }
        NoRouteEnd::NothingNear {
            nearest: Some((place, distance_m)),
        } => InvalidRoute::NothingNear(field, place.0, distance_m),
        NoRouteEnd::NothingNear { nearest: None } => InvalidRoute::NoPlaces,
    }
}

pub(super) fn unknown(what: &str, name: &impl std::fmt::Display) -> InvalidRoute {
    InvalidRoute::UnknownMemory(format!("the space has no {what} {name}"))
}

/// An agent by its name.
fn agent(map: &CognitiveMap, name: &str) -> Result<AgentId, InvalidRoute> {
    let mut agents = map.agents();
    let found = agents.find(|(_, agent)| agent.name().as_str() == name);
    let (agent, _) = found.ok_or_else(|| unknown_agent(name))?;
    Ok(agent)
}

/// The place that a percept recalls best.
fn recalled(map: &CognitiveMap, percept: &wire::PerceptCue) -> Result<PlaceId, InvalidRoute> {
    let query = wire::RecallQuery {
        percept: Some(percept.clone()),
        limit: Some(1),
        ..wire::RecallQuery::default()
    };
    let cue: RecallCue = cue(map, &query)?;
    let best = map.recall(&cue).into_iter().next();
    let best = best.map(|recalled| recalled.place);
    best.ok_or_else(|| InvalidRoute::UnknownMemory("no place remembers such a percept".to_owned()))
}
