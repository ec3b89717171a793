//! Cues that places are recalled by.

use cogmap_proto::limits::{METRES_MAX, PAGE_ITEMS_MAX};
use cogmap_proto::{Name, NameError, PerceptCue, RecallQuery};
use cognitive_map::{AgentId, CognitiveMap, InvalidSample, RecallCue};
use grid::{InvalidCode, PartialCode, Phase};
use nalgebra::{Point3, Vector3};

use super::channel::{InvalidChannel, check_cue};
use super::{fault, percept};

/// Places of an answer when the query names no limit.
const LIMIT_DEFAULT: u32 = 10;

/// Why a query cannot be answered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidQuery {
    /// A coordinate of `position_m` is not a number or is too large.
    #[error("position_m must hold finite numbers of at most {METRES_MAX} m, not {0:?}")]
    Position([f64; 3]),
    /// `radius_m` is negative, not a number or too large.
    #[error("radius_m must be 0 to {METRES_MAX} m, not {0}")]
    Radius(f64),
    /// There is a radius but no centre.
    #[error("radius_m needs position_m, its centre")]
    RadiusWithoutPosition,
    /// The span of time ends before it begins \[ns\].
    #[error("since_ns {0} must not be after until_ns {1}")]
    Span(i64, i64),
    /// A phase is outside \[0, 1).
    #[error("phases in code must be at least 0 and less than 1; code[{0}] is {1:?}")]
    Phase(usize, [f64; 3]),
    /// The code is not one of this space.
    #[error("code: {0}")]
    Code(#[from] InvalidCode),
    /// The agent's name is none.
    #[error("agent: {0}")]
    Agent(#[from] NameError),
    /// There is no such agent.
    #[error("the space has no agent {0:?}")]
    UnknownAgent(String),
    /// The percept makes no sense.
    #[error("{0}: {1}")]
    Percept(String, InvalidSample),
    /// The percept's channel cannot be asked for.
    #[error("percept: {0}")]
    Channel(#[from] InvalidChannel),
    /// A channel of a list cannot be asked for.
    #[error("channels[{0}]: {1}")]
    ChannelOfList(usize, InvalidChannel),
    /// No channels are named, or too many.
    #[error("channels must be a list of 1 to {0} names")]
    Channels(usize),
    /// The limit is out of range.
    #[error("limit must be 1 to {PAGE_ITEMS_MAX}, not {0}")]
    Limit(usize),
}

/// The cue of a query.
///
/// # Errors
/// Says which rule the query breaks, or that an agent or channel in it is unknown.
pub fn cue(map: &CognitiveMap, query: &RecallQuery) -> Result<RecallCue, InvalidQuery> {
    let position = query.position_m.map(position).transpose()?;
    if let Some(radius_m) = query.radius_m {
        // A comparison with NaN is false.
        if !(0.0..=METRES_MAX).contains(&radius_m) {
            return Err(InvalidQuery::Radius(radius_m));
        }
        if position.is_none() {
            return Err(InvalidQuery::RadiusWithoutPosition);
        }
    }
    if let Some((since_ns, until_ns)) = query.since_ns.zip(query.until_ns)
        && since_ns > until_ns
    {
        return Err(InvalidQuery::Span(since_ns, until_ns));
    }
    let code = query
        .code
        .as_deref()
        .map(|phases| code(map, phases))
        .transpose()?;
    let percept = { query.percept.as_ref() }.map(|percept| checked_percept(map, percept));
    let percept = percept.transpose()?;
    let limit = query.limit.unwrap_or(LIMIT_DEFAULT) as usize;
    if !(1..=PAGE_ITEMS_MAX).contains(&limit) {
        return Err(InvalidQuery::Limit(limit));
    }
    let founder = query.agent.as_deref().map(|name| agent(map, name));
    let founder = founder.transpose()?;
    Ok(RecallCue {
        position,
        code,
        percept,
        radius_m: query.radius_m,
        founder,
        since_ns: query.since_ns,
        until_ns: query.until_ns,
        limit,
    })
}

/// A percept to recall by, of a channel that the space knows.
pub(super) fn checked_percept(
    map: &CognitiveMap,
    cue: &PerceptCue,
) -> Result<cognitive_map::PerceptCue, InvalidQuery> {
    let read = percept::percept(cue);
    let percept = read.map_err(|error| InvalidQuery::Percept(fault::in_percept(cue), error))?;
    check_cue(map, &percept)?;
    Ok(percept)
}

pub(super) fn position(metres: [f64; 3]) -> Result<Point3<f64>, InvalidQuery> {
    let legal = metres.iter().all(|metre| metre.abs() <= METRES_MAX);
    legal
        .then(|| Point3::from(metres))
        .ok_or(InvalidQuery::Position(metres))
}

fn code(map: &CognitiveMap, phases: &[Option<[f64; 3]>]) -> Result<PartialCode, InvalidQuery> {
    let legal = |turns: &[f64; 3]| turns.iter().all(|turn| (0.0..1.0).contains(turn));
    for (module, turns) in phases.iter().enumerate() {
        if let Some(turns) = turns.filter(|turns| !legal(turns)) {
            return Err(InvalidQuery::Phase(module, turns));
        }
    }
    let phase = |turns: &[f64; 3]| Phase::wrap(Vector3::from(*turns));
    let phases = phases.iter().map(|turns| turns.as_ref().map(phase));
    Ok(PartialCode::new(map.modules(), phases.collect())?)
}

/// An agent by its name; where there is none now, the latest one that was removed. Spaces have at
/// most some thousand agents, so a scan will do.
fn agent(map: &CognitiveMap, name: &str) -> Result<AgentId, InvalidQuery> {
    map.agents_ever()
        .filter(|(_, agent)| agent.name().as_str() == name)
        .max_by_key(|(id, agent)| (agent.is_enrolled(), *id))
        .map(|(id, _)| id)
        .ok_or_else(|| unknown_agent(name))
}

/// Why there is no agent of this name: there is none, or nobody can be called so.
pub fn unknown_agent(name: &str) -> InvalidQuery {
    match Name::check(name) {
        Ok(()) => InvalidQuery::UnknownAgent(name.to_owned()),
        Err(error) => InvalidQuery::Agent(error),
    }
}
